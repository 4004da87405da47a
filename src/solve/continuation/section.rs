//! Points of a path found from outside it: in planes across a direction, up to where the path turns back.

use super::{Continuation, ContinuationOptions, PathPoint};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::newton::NewtonOutcome;
use crate::solve::residual::Residual;
use nalgebra::DVector;

/// Distances of the outermost plane tried, in units of the reach.
const REACHES: [f64; 3] = [1.0, 2.0, 4.0];
/// Width to which the plane of a turning point is located, relative to the reach.
const LOCATED: f64 = 1e-9;

/// Planes <direction, x - x_0> = s across a direction in the space of (u, lambda).
#[derive(Debug)]
pub struct Section {
    base: PathPoint,
    path: Continuation,
    /// Length of the direction given.
    reach: f64,
}

impl Section {
    /// Planes across `direction` = (du, dlambda), the first one (s = 0) through `place` = (u, lambda).
    ///
    /// # Errors
    /// Contradictory options.
    pub fn new(
        problem: &dyn Residual,
        (u, lambda): (DVector<f64>, f64),
        (mut du, mut dlambda): (DVector<f64>, f64),
        options: ContinuationOptions,
    ) -> Result<Section, SolveError> {
        options.validate()?;
        let reach = (options.weight * du.norm_squared() + dlambda * dlambda).sqrt();
        du /= reach;
        dlambda /= reach;
        let base = PathPoint {
            u,
            lambda,
            tangent_u: du,
            tangent_lambda: dlambda,
            orientation: 0,
            newton: NewtonOutcome::unsolved(),
        };
        let path = Continuation::standing(problem, base.clone(), options);
        Ok(Section { base, path, reach })
    }

    /// The point of the path in a plane; `None` when the corrector fails.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn at(
        &mut self,
        problem: &mut dyn Residual,
        s: f64,
    ) -> Result<Option<PathPoint>, SolveError> {
        let base = &self.base;
        let guess = &base.u + &base.tangent_u * s;
        let lambda = base.lambda + base.tangent_lambda * s;
        let point = self.path.correct(problem, base, s, guess, lambda)?;
        Ok(point.newton.is_converged().then_some(point))
    }

    /// The point nearest by at which the path turns back in the parameter, and on which side of it the path lies: -1 below,
    /// 1 above. `None` when there is none within a few lengths of the direction.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn turn(
        &mut self,
        problem: &mut dyn Residual,
    ) -> Result<Option<(PathPoint, f64)>, SolveError> {
        for reach in REACHES.map(|x| x * self.reach) {
            let ends = [self.at(problem, -reach)?, self.at(problem, reach)?];
            let [Some(low), Some(high)] = ends else {
                return Ok(None);
            };
            let (a, b) = (low.tangent_lambda, high.tangent_lambda);
            if (a > 0.0) == (b > 0.0) {
                continue;
            }
            let (mut is_whole, width) = (true, LOCATED * self.reach);
            let slope = |s: f64| {
                let point = self.at(problem, s)?;
                is_whole &= point.is_some();
                Ok::<f64, SolveError>(point.map_or(f64::NAN, |p| p.tangent_lambda))
            };
            let s = roots::bracketed(slope, (-reach, a), (reach, b), width)?.root;
            let side = if a > 0.0 { -1.0 } else { 1.0 };
            let top = if is_whole { self.at(problem, s)? } else { None };
            return Ok(top.map(|point| (point, side)));
        }
        Ok(None)
    }
}
