//! The arclength equation as a border of the problem: the same Newton iteration corrects it.

use super::PathPoint;
use crate::error::SolveError;
use crate::solve::residual::{Linearisation, Residual};
use nalgebra::DVector;

/// The problem with its arclength equation as last row: unknowns (u, lambda), parameter s.
pub(super) struct Bordered<'a> {
    pub problem: &'a mut dyn Residual,
    pub base: &'a PathPoint,
    pub weight: f64,
    pub inner: &'a mut Linearisation,
    pub u: &'a mut DVector<f64>,
}

impl Residual for Bordered<'_> {
    fn dim(&self) -> usize {
        self.problem.dim() + 1
    }

    fn linearise(
        &mut self,
        x: &DVector<f64>,
        s: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let dim = self.problem.dim();
        let lambda = x[dim];
        self.u.copy_from(&x.rows(0, dim));
        self.problem.linearise(self.u, lambda, self.inner)?;
        let inner = &*self.inner;
        out.magnitude = inner.magnitude;
        out.r.rows_mut(0, dim).copy_from(&inner.r);
        out.dr_du
            .view_mut((0, 0), (dim, dim))
            .copy_from(&inner.dr_du);
        out.dr_du
            .view_mut((0, dim), (dim, 1))
            .copy_from(&inner.dr_dlambda);
        // The row is measured in units of the residual, so that one tolerance serves both.
        let scale = inner.magnitude;
        let mut along = -s + self.base.tangent_lambda * (lambda - self.base.lambda);
        for k in 0..dim {
            let row = self.weight * self.base.tangent_u[k];
            along += row * (x[k] - self.base.u[k]);
            out.dr_du[(dim, k)] = scale * row;
        }
        out.r[dim] = scale * along;
        out.dr_du[(dim, dim)] = scale * self.base.tangent_lambda;
        out.dr_dlambda.fill(0.0);
        out.dr_dlambda[dim] = -scale;
        Ok(())
    }
}
