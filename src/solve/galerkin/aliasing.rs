//! What sampling the forces leaves in the residual.

use super::Galerkin;
use super::aft::Sampling;
use crate::error::SolveError;
use crate::solve::family::Family;
use crate::solve::residual::Linearisation;
use nalgebra::DVector;

/// How often the samples are doubled to see what is wrong with them.
const FINER: usize = 4;

impl<F: Family> Galerkin<F> {
    /// The residual less that of finer samples; `None` where forces are integrated exactly.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    pub(super) fn aliasing(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        if self.exact.is_some() {
            return Ok(None);
        }
        let mut work = Linearisation::of(self);
        self.evaluate(u, lambda, &mut work)?;
        let coarse = work.r.clone();
        let system = self.family.at(lambda)?;
        let (harmonics, samples) = (self.coefficients / 2, FINER * self.sampling.samples());
        let mut fine = Sampling::new(system, harmonics, samples);
        fine.prepare(system);
        std::mem::swap(&mut self.sampling, &mut fine);
        let outcome = self.evaluate(u, lambda, &mut work);
        std::mem::swap(&mut self.sampling, &mut fine);
        outcome?;
        Ok(Some(coarse - &work.r))
    }
}
