//! How far an error of the residual moves a point of the path.

use super::bordered::Bordered;
use super::{Continuation, PathPoint};
use crate::error::SolveError;
use crate::solve::residual::Residual;
use nalgebra::DVector;

impl Continuation {
    /// Change of the parameter at a point, across the path, when the residual changes by `error`; `None` where the path is
    /// singular.
    ///
    /// # Errors
    /// Errors of the problem.
    pub(crate) fn shift_of_parameter(
        &mut self,
        problem: &mut dyn Residual,
        at: &PathPoint,
        error: DVector<f64>,
    ) -> Result<Option<f64>, SolveError> {
        let mut bordered = Bordered {
            problem,
            base: at,
            weight: self.options.weight,
            inner: &mut self.inner,
            u: &mut self.inner_u,
        };
        let x = at.u.clone().push(at.lambda);
        self.newton.visit(&mut bordered, &x, 0.0)?;
        let mut change = error.push(0.0);
        let sign = self.newton.solve_linear(&mut change);
        Ok((sign != 0).then(|| change[change.len() - 1]))
    }
}
