//! Periodic orbits of systems that do not exist everywhere.

use crate::error::SolveError;
use crate::numeric::jacobian::JacobianStructure;
use crate::solve::orbit::Orbit;
use crate::solve::residual::{
    Extent, Fit, Linearisation, PeriodicResidual, Residual, Size, Survey,
};
use crate::system::System;
use nalgebra::DVector;

/// A problem whose residual is not a number where there is no system: the path following halves its step there and ends,
/// instead of failing.
pub(super) struct Guarded<'a>(pub &'a mut dyn PeriodicResidual);

impl Residual for Guarded<'_> {
    fn dim(&self) -> usize {
        self.0.dim()
    }

    fn structure(&self) -> JacobianStructure {
        self.0.structure()
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        match self.0.linearise(u, lambda, out) {
            Err(SolveError::NoSystem { .. }) => {
                out.r.fill(f64::NAN);
                out.magnitude = 1.0;
                Ok(())
            }
            outcome => outcome,
        }
    }

    fn in_present_size(&self, u: &DVector<f64>) -> DVector<f64> {
        self.0.in_present_size(u)
    }
}

impl PeriodicResidual for Guarded<'_> {
    fn system_at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.0.system_at(lambda)
    }

    fn orbit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Orbit, SolveError> {
        self.0.orbit(u, lambda)
    }

    fn aliasing(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        self.0.aliasing(u, lambda)
    }

    fn in_doubled_period(&self, half: &DVector<f64>) -> DVector<f64> {
        self.0.in_doubled_period(half)
    }

    fn equal_parts(&mut self, u: &DVector<f64>, lambda: f64) -> Result<usize, SolveError> {
        self.0.equal_parts(u, lambda)
    }

    fn restrict(&mut self, parts: usize) -> usize {
        self.0.restrict(parts)
    }

    fn size(&self) -> Size {
        self.0.size()
    }

    fn resize(&mut self, size: Size) -> Result<(), SolveError> {
        self.0.resize(size)
    }

    fn fit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Fit, SolveError> {
        self.0.fit(u, lambda)
    }

    fn survey(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        extent: Extent,
    ) -> Result<Survey, SolveError> {
        self.0.survey(u, lambda, extent)
    }
}
