//! The arclength equation as a border of the problem: the same Newton iteration corrects it.

use super::PathPoint;
use crate::error::SolveError;
use crate::numeric::jacobian::JacobianStructure;
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

    fn structure(&self) -> JacobianStructure {
        self.problem.structure().bordered()
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
        let (base, inner) = (self.base, &mut *self.inner);
        // At rest without load every term vanishes: any unit will do.
        let scale = match inner.magnitude {
            0.0 => 1.0,
            magnitude => magnitude,
        };
        out.magnitude = scale;
        out.r.rows_mut(0, dim).copy_from(&inner.r);
        // The row is measured in units of the residual, so that one tolerance serves both.
        let row = |k: usize| scale * self.weight * base.tangent_u[k];
        let corner = scale * base.tangent_lambda;
        let along: f64 = (0..dim).map(|k| row(k) * (x[k] - base.u[k])).sum();
        out.r[dim] = along + corner * (lambda - base.lambda) - scale * s;
        out.dr_du
            .take_bordered(&mut inner.dr_du, &inner.dr_dlambda, row, corner);
        out.dr_dlambda.fill(0.0);
        out.dr_dlambda[dim] = -scale;
        Ok(())
    }
}
