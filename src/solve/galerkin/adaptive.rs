//! The Galerkin residual with as many harmonics as a tolerance asks for.

use super::accuracy::{Accuracy, in_coefficients};
use super::{Galerkin, GalerkinOptions};
use crate::error::SolveError;
use crate::numeric::jacobian::Structure;
use crate::solve::family::Family;
use crate::solve::newton::NewtonOptions;
use crate::solve::orbit::Orbit;
use crate::solve::residual::{Extent, Fit, Linearisation, PeriodicResidual, Residual, Survey};
use crate::system::System;
use nalgebra::DVector;

/// How many harmonics a solution may have, and what it has to be good for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Largest relative error of an r.m.s. value, as estimated.
    pub tolerance: f64,
    /// Fewest harmonics of the excitation frequency.
    pub least: usize,
    /// Most harmonics of the excitation frequency.
    pub most: usize,
}

/// Share of the tolerance above which harmonics are added, before it is exceeded.
const RAISE: f64 = 0.3;
/// Share below which harmonics are taken away: errors fall like H^-3 and faster, so that a step down stays below [`RAISE`].
const LOWER: f64 = 0.03;
/// Quarters of the number of harmonics after one step up.
const UP: usize = 6;
/// The same after one step down.
const DOWN: usize = 3;
/// Error over the tolerance beyond which the number is doubled.
const FAR: f64 = 10.0;

/// How to make problems of any number of harmonics.
pub struct Sizes<'a, F: Family> {
    /// Harmonics and samples for a number of harmonics of the excitation frequency.
    pub options: &'a dyn Fn(usize) -> GalerkinOptions,
    /// The problem of that size.
    pub problem: &'a dyn Fn(GalerkinOptions) -> Result<Galerkin<F>, SolveError>,
}

impl<F: Family> Clone for Sizes<'_, F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<F: Family> Copy for Sizes<'_, F> {}

impl<F: Family> Sizes<'_, F> {
    /// What judges solutions of so many harmonics.
    ///
    /// # Errors
    /// The problem cannot be made.
    pub fn judge(
        &self,
        harmonics: usize,
        subharmonic: usize,
        newton: NewtonOptions,
    ) -> Result<Accuracy<F>, SolveError> {
        let size = Accuracy::<F>::size((self.options)(harmonics), subharmonic);
        Ok(Accuracy::new((self.problem)(size)?, newton))
    }
}

/// The Galerkin residual of the present number of harmonics, and how to make another.
pub struct Adaptive<'a, F: Family> {
    sizes: Sizes<'a, F>,
    resolution: Resolution,
    newton: NewtonOptions,
    subharmonic: usize,
    harmonics: usize,
    problem: Galerkin<F>,
    judge: Accuracy<F>,
    judged: Option<Judged>,
}

/// The solution judged last.
struct Judged {
    u: DVector<f64>,
    lambda: f64,
    error: f64,
}

impl<'a, F: Family> Adaptive<'a, F> {
    /// The problem of a first number of harmonics; `subharmonic` is that of the family.
    ///
    /// # Errors
    /// The problem cannot be made.
    pub fn new(
        sizes: Sizes<'a, F>,
        resolution: Resolution,
        newton: NewtonOptions,
        (harmonics, subharmonic): (usize, usize),
    ) -> Result<Adaptive<'a, F>, SolveError> {
        Ok(Adaptive {
            problem: (sizes.problem)((sizes.options)(harmonics))?,
            judge: sizes.judge(harmonics, subharmonic, newton)?,
            sizes,
            resolution,
            newton,
            subharmonic,
            harmonics,
            judged: None,
        })
    }

    /// Estimated error of a solution against the nearest place of the branch.
    fn error(&mut self, u: &DVector<f64>, lambda: f64) -> Result<f64, SolveError> {
        if let Some(judged) = &self.judged
            && judged.lambda == lambda
            && judged.u == *u
        {
            return Ok(judged.error);
        }
        let error = self.judge.estimate(u, lambda)?.along;
        let u = u.clone();
        self.judged = Some(Judged { u, lambda, error });
        Ok(error)
    }
}

impl<F: Family> Residual for Adaptive<'_, F> {
    fn dim(&self) -> usize {
        self.problem.dim()
    }

    fn structure(&self) -> Structure {
        self.problem.structure()
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        self.problem.linearise(u, lambda, out)
    }

    fn in_present_size(&self, u: &DVector<f64>) -> DVector<f64> {
        let to = self.problem.coefficients();
        let coordinates = self.dim() / to;
        in_coefficients(u, u.len() / coordinates, to)
    }
}

impl<F: Family> PeriodicResidual for Adaptive<'_, F> {
    fn system_at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.problem.system_at(lambda)
    }

    fn orbit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Orbit, SolveError> {
        self.problem.orbit(u, lambda)
    }

    fn in_doubled_period(&self, half: &DVector<f64>) -> DVector<f64> {
        self.problem.in_doubled_period(half)
    }

    fn survey(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        extent: Extent,
    ) -> Result<Survey, SolveError> {
        self.problem.survey(u, lambda, extent)
    }

    fn size(&self) -> usize {
        self.harmonics
    }

    fn resize(&mut self, size: usize) -> Result<(), SolveError> {
        let newton = self.newton;
        self.problem = (self.sizes.problem)((self.sizes.options)(size))?;
        self.judge = self.sizes.judge(size, self.subharmonic, newton)?;
        (self.harmonics, self.judged) = (size, None);
        Ok(())
    }

    fn fit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Fit, SolveError> {
        let Resolution {
            tolerance,
            least,
            most,
        } = self.resolution;
        let (error, now) = (self.error(u, lambda)? / tolerance, self.harmonics);
        let more = match error > FAR {
            true => 2 * now,
            false => (now * UP).div_ceil(4),
        };
        let (more, fewer) = (more.min(most), (now * DOWN / 4).max(least));
        Ok(match () {
            // Not a number: the larger problem is singular, and says nothing.
            _ if error.is_nan() => Fit::Suits,
            _ if error > RAISE && more > now => match error > 1.0 {
                true => Fit::Fails { size: more },
                false => Fit::Strains { size: more },
            },
            _ if error < LOWER && fewer < now => Fit::Wastes { size: fewer },
            _ => Fit::Suits,
        })
    }
}
