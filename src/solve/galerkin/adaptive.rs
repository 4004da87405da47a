//! The Galerkin residual with as many harmonics as a tolerance asks for.

use super::accuracy::{Accuracy, Estimate, MOST_SAMPLES};
use super::refinement::in_coefficients;
use super::{Galerkin, GalerkinOptions};
use crate::error::SolveError;
use crate::numeric::jacobian::JacobianStructure;
use crate::solve::family::Family;
use crate::solve::newton::NewtonOptions;
use crate::solve::orbit::Orbit;
use crate::solve::residual::{
    Extent, Fit, Linearisation, PeriodicResidual, Residual, Size, Survey,
};
use crate::system::System;
use nalgebra::DVector;

/// Limits of the number of harmonics of a solution, and its required accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HarmonicLimits {
    /// Largest relative error of an r.m.s. value, as estimated.
    pub tolerance: f64,
    /// Fewest harmonics of the excitation frequency.
    pub least: usize,
    /// Most harmonics of the excitation frequency.
    pub most: usize,
    /// Number of times the samples may be doubled; 0 if they are given, or forces are not sampled.
    pub doublings: u32,
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

/// Factory of problems with any number of harmonics.
pub(crate) struct Sizes<'a, F: Family> {
    /// Harmonics and fewest samples for a number of harmonics of the excitation frequency.
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
    /// What judges solutions of a size.
    ///
    /// # Errors
    /// The problem cannot be made.
    pub fn judge(
        &self,
        size: Size,
        subharmonic: usize,
        newton: NewtonOptions,
    ) -> Result<Accuracy<F>, SolveError> {
        let size = Accuracy::<F>::size(self.of(size), subharmonic);
        Ok(Accuracy::new((self.problem)(size)?, newton))
    }

    /// The same with corrections that go on in many times the harmonics, where memory allows.
    ///
    /// # Errors
    /// The problem cannot be made.
    pub fn refined_judge(
        &self,
        size: Size,
        subharmonic: usize,
        newton: NewtonOptions,
    ) -> Result<Accuracy<F>, SolveError> {
        let judge = self.judge(size, subharmonic, newton)?;
        Ok(match judge.wide_size(self.of(size), subharmonic) {
            Some(wide) => judge.with_refinement((self.problem)(wide)?),
            None => judge,
        })
    }

    fn of(&self, size: Size) -> GalerkinOptions {
        let options = (self.options)(size.harmonics);
        GalerkinOptions {
            samples: (options.samples << size.doublings).min(MOST_SAMPLES),
            ..options
        }
    }
}

/// The Galerkin residual of the present number of harmonics, and how to make another.
pub(crate) struct Adaptive<'a, F: Family> {
    sizes: Sizes<'a, F>,
    resolution: HarmonicLimits,
    newton: NewtonOptions,
    subharmonic: usize,
    size: Size,
    /// Most doublings of the samples so far.
    finest: u32,
    problem: Galerkin<F>,
    judge: Accuracy<F>,
    judged: Option<JudgedSolution>,
}

/// The solution judged last.
struct JudgedSolution {
    u: DVector<f64>,
    lambda: f64,
    estimate: Estimate,
}

impl<'a, F: Family> Adaptive<'a, F> {
    /// The problem of a first number of harmonics; `subharmonic` is that of the family.
    ///
    /// # Errors
    /// The problem cannot be made.
    pub fn new(
        sizes: Sizes<'a, F>,
        resolution: HarmonicLimits,
        newton: NewtonOptions,
        (harmonics, subharmonic): (usize, usize),
    ) -> Result<Adaptive<'a, F>, SolveError> {
        let size = Size {
            harmonics,
            doublings: 0,
        };
        Ok(Adaptive {
            problem: (sizes.problem)(sizes.of(size))?,
            judge: sizes.judge(size, subharmonic, newton)?,
            sizes,
            resolution,
            newton,
            subharmonic,
            size,
            finest: 0,
            judged: None,
        })
    }

    /// Largest number of times the samples were doubled.
    pub(crate) fn finest(&self) -> u32 {
        self.finest
    }

    /// Estimated errors of a solution against the nearest place of the branch, and the part of sampling, over the tolerance.
    fn errors(&mut self, u: &DVector<f64>, lambda: f64) -> Result<[f64; 2], SolveError> {
        let is_judged = |j: &JudgedSolution| j.lambda == lambda && j.u == *u;
        let judged = match self.judged.take().filter(is_judged) {
            Some(judged) => judged,
            None => JudgedSolution {
                estimate: self.judge.estimate(u, lambda)?,
                u: u.clone(),
                lambda,
            },
        };
        let Estimate {
            along, sampling, ..
        } = self.judged.insert(judged).estimate;
        Ok([along, sampling].map(|e| e / self.resolution.tolerance))
    }

    /// The size for an error that is too large: more samples where sampling is to blame, else more harmonics.
    fn larger(&self, [error, sampling]: [f64; 2]) -> Size {
        let Size {
            harmonics,
            doublings,
        } = self.size;
        if sampling > 0.5 * error {
            let doublings = (doublings + 1).min(self.resolution.doublings);
            return Size {
                harmonics,
                doublings,
            };
        }
        let more = match error > FAR {
            true => 2 * harmonics,
            false => (harmonics * UP).div_ceil(4),
        };
        Size {
            harmonics: more.min(self.resolution.most),
            doublings,
        }
    }

    /// The size for an error that is needlessly small.
    fn smaller(&self, sampling: f64) -> Size {
        let Size {
            harmonics,
            doublings,
        } = self.size;
        // Half the samples leave four times the error.
        let is_fine = doublings > 0 && 4.0 * sampling < LOWER;
        Size {
            harmonics: (harmonics * DOWN / 4).max(self.resolution.least),
            doublings: doublings - u32::from(is_fine),
        }
    }
}

impl<F: Family> Residual for Adaptive<'_, F> {
    fn dim(&self) -> usize {
        self.problem.dim()
    }

    fn structure(&self) -> JacobianStructure {
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

    fn aliasing(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        self.problem.aliasing(u, lambda)
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

    fn equal_parts(&mut self, u: &DVector<f64>, lambda: f64) -> Result<usize, SolveError> {
        self.problem.equal_parts(u, lambda)
    }

    fn restrict(&mut self, parts: usize) -> usize {
        self.judged = None;
        self.judge.restrict(parts);
        self.problem.restrict(parts)
    }

    fn size(&self) -> Size {
        self.size
    }

    fn resize(&mut self, size: Size) -> Result<(), SolveError> {
        let problem = (self.sizes.problem)(self.sizes.of(size))?;
        let parts = std::mem::replace(&mut self.problem, problem).restrict(1);
        self.judge = self.sizes.judge(size, self.subharmonic, self.newton)?;
        self.restrict(parts);
        self.size = size;
        self.finest = self.finest.max(size.doublings);
        Ok(())
    }

    fn fit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Fit, SolveError> {
        let errors = self.errors(u, lambda)?;
        let (larger, smaller) = (self.larger(errors), self.smaller(errors[1]));
        Ok(match errors[0] {
            // The larger problem is singular, and says nothing.
            error if error.is_nan() => Fit::Suits,
            error if error > RAISE && larger != self.size => match error > 1.0 {
                true => Fit::Fails { size: larger },
                false => Fit::Strains { size: larger },
            },
            error if error < LOWER && smaller != self.size => Fit::Wastes { size: smaller },
            _ => Fit::Suits,
        })
    }
}
