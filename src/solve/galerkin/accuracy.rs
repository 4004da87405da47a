//! How far a Galerkin solution is from the orbit that it approximates, judged in twice the harmonics with finer sampling.
//!
//! The solution, padded with zeros, leaves a residual there: what truncation, sampling and the corrector have left. One Newton
//! correction of the larger problem is right to the second order of it,
//!
//! ```text
//! J Du = -R(u, lambda),    error of a measure = measure(u + Du) - measure(u)
//! ```
//!
//! One with many times the harmonics goes on from there where asked for ([`Accuracy::with_refinement`]).
//!
//! At a fold J is singular: there the nearest place of the branch counts, the smallest (Du, Dlambda) with J Du + dR/dlambda
//! Dlambda = -R.

use super::refinement::{Refinement, in_coefficients, widening};
use super::{Galerkin, GalerkinOptions};
use crate::error::SolveError;
use crate::numeric::factors::Factors;
use crate::numeric::trigonometric;
use crate::solve::family::Family;
use crate::solve::newton::{Newton, NewtonOptions, NewtonOutcome};
use crate::solve::orbit::FourierOrbit;
use crate::solve::residual::{Linearisation, PeriodicResidual, Residual};
use crate::system::System;
use nalgebra::DVector;

/// Samples of the larger problem over those of the judged one: what sampling leaves falls by 16.
const FINER: usize = 4;
/// Samples at most.
pub(super) const MOST_SAMPLES: usize = 1 << 22;
/// R.m.s. values below this share of the largest one count as large as that: a connection that hardly moves has no digits to
/// lose.
const HARDLY_MOVES: f64 = 1e-3;

/// R.m.s. of deformation and of its rate, one connection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rms {
    /// Deformation, without its mean (15).
    pub displacement: f64,
    /// Rate of the deformation, d/d(omega_c t).
    pub velocity: f64,
}

/// Share of the error at the same parameter below which the error against the nearest place of the branch shows a fold nearby.
const BESIDE_FOLD: f64 = 0.5;

/// Error estimate of a solution from the larger problem.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// R.m.s. values of the solution, by connection.
    pub(crate) rms: Vec<Rms>,
    /// Their errors at the same parameter, signed; not finite where the larger problem is singular.
    pub(crate) errors: Vec<Rms>,
    /// The corrected orbit.
    pub corrected: FourierOrbit,
    /// Largest relative error of an r.m.s. value against the nearest place of the branch; for the frequency the relative
    /// distance of that place counts as well, for another parameter its share of the range.
    pub along: f64,
    /// The part of it that sampling and the corrector leave: it falls with more samples, not with more harmonics.
    pub sampling: f64,
    /// Largest residual among the harmonics that the solution has not, relative to the terms that cancel in the residual.
    pub truncation: f64,
}

impl Estimate {
    /// Largest relative error of an r.m.s. value at the same parameter.
    pub fn largest(&self) -> f64 {
        relative(&self.rms, &self.errors)
    }
}

/// Solutions compared with those of twice the harmonics.
#[derive(Debug, Clone)]
pub struct Check {
    /// Outcome of the larger problem.
    pub outcome: NewtonOutcome,
    /// R.m.s. values of its solution, all harmonics.
    pub(crate) rms: Vec<Rms>,
    /// The same from the harmonics of the smaller problem alone.
    pub(crate) first: Vec<Rms>,
}

/// Judges the solutions of one number of harmonics.
pub struct Accuracy<F: Family> {
    fine: Galerkin<F>,
    coefficients: usize,
    work: Linearisation,
    factors: Factors,
    newton: Newton,
    options: NewtonOptions,
    /// Corrects further, in many times the harmonics.
    refinement: Option<Refinement<F>>,
}

impl<F: Family> Accuracy<F> {
    /// The size of the problem that judges solutions of a size, for a subharmonic index.
    pub fn size(judged: GalerkinOptions, subharmonic: usize) -> GalerkinOptions {
        let harmonics = 2 * judged.harmonics;
        let least = GalerkinOptions::default_samples(harmonics, subharmonic);
        GalerkinOptions {
            harmonics,
            samples: (FINER * judged.samples).max(least).min(MOST_SAMPLES),
        }
    }

    /// Buffers; `fine` is the problem of twice the harmonics.
    pub fn new(fine: Galerkin<F>, newton: NewtonOptions) -> Accuracy<F> {
        let structure = fine.structure();
        Accuracy {
            coefficients: fine.coefficients() / 2 + 1,
            work: Linearisation::new(&structure),
            factors: Factors::new(&structure),
            newton: Newton::new(&structure, newton),
            options: newton,
            refinement: None,
            fine,
        }
    }

    /// Size of the problem in which corrections go on, for solutions of a size; `None` where it would be too large.
    pub fn wide_size(
        &self,
        judged: GalerkinOptions,
        subharmonic: usize,
    ) -> Option<GalerkinOptions> {
        let harmonics = widening(&self.fine.structure())? * 2 * judged.harmonics;
        let least = GalerkinOptions::default_samples(harmonics, subharmonic);
        let samples = (FINER * judged.samples).max(least);
        (samples <= MOST_SAMPLES).then_some(GalerkinOptions { harmonics, samples })
    }

    /// Solves in a larger problem after the correction: the estimate then covers the modes above twice the harmonics and
    /// what is not linear in the correction.
    pub fn with_refinement(mut self, wide: Galerkin<F>) -> Accuracy<F> {
        let of = (&self.fine.structure(), self.fine.coefficients());
        self.refinement = Some(Refinement::new(wide, of, self.options));
        self
    }

    /// Judges orbits that repeat themselves in a number of equal parts of the period.
    pub(crate) fn restrict(&mut self, parts: usize) {
        self.fine.restrict(parts);
        if let Some(refinement) = &mut self.refinement {
            refinement.restrict(parts);
        }
    }

    /// Errors of a solution.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    pub fn estimate(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Estimate, SolveError> {
        let padded = in_coefficients(u, self.coefficients, self.fine.coefficients());
        self.fine.linearise(&padded, lambda, &mut self.work)?;
        let truncation = self.beyond() / self.work.magnitude.max(f64::MIN_POSITIVE);
        // Padded, for a transmission error moves the connections in the harmonics beyond as well.
        let rms = self.rms(&padded, lambda)?;
        let (mut fixed, mut slope) = (self.work.r.clone(), self.work.dr_dlambda.clone());
        // The harmonics that the solution has leave no residual but what finer samples see.
        let mut sampled = in_coefficients(&fixed, self.fine.coefficients(), self.coefficients);
        sampled = in_coefficients(&sampled, self.coefficients, self.fine.coefficients());
        let jacobian = &self.work.dr_du;
        let is_regular = self.factors.factorise(jacobian)
            && [&mut fixed, &mut slope, &mut sampled]
                .into_iter()
                .all(|rhs| self.factors.solve(jacobian, rhs));
        if !is_regular {
            fixed.fill(f64::NAN);
            sampled.fill(f64::NAN);
        }
        let along = self.along((&padded, lambda), &rms, (&fixed, &slope))?;
        let sampling = self.along((&padded, lambda), &rms, (&sampled, &slope))?;
        let corrected = self.fine.fourier_orbit(&(&padded - &fixed), lambda)?;
        let system = self.fine.family.at(lambda)?;
        let errors = differences(&self::rms(system, &corrected), &rms);
        let mut estimate = Estimate {
            rms,
            errors,
            corrected,
            along,
            sampling,
            truncation,
        };
        self.refine((&padded, lambda), (&fixed, &slope), &mut estimate)?;
        Ok(estimate)
    }

    /// Replaces an estimate by that from the larger problem of the refinement. Its errors become unknown where that problem has no solution
    /// nearby, except beside a fold: there it may have none, and the linear correction is what is known.
    fn refine(
        &mut self,
        (padded, lambda): (&DVector<f64>, f64),
        (fixed, slope): (&DVector<f64>, &DVector<f64>),
        estimate: &mut Estimate,
    ) -> Result<(), SolveError> {
        let Some(refinement) = &mut self.refinement else {
            return Ok(());
        };
        let (few, many) = (self.fine.coefficients(), refinement.coefficients());
        let judged = in_coefficients(padded, few, many);
        let guess = match fixed.iter().all(|x| x.is_finite()) {
            true => &judged - in_coefficients(fixed, few, many),
            false => judged.clone(),
        };
        match refinement.solve(&judged, guess, lambda)? {
            Some(u) => {
                // Of as many harmonics: a transmission error moves the connections in those beyond as well.
                estimate.rms = self.rms(&judged, lambda)?;
                estimate.corrected = self.fine.fourier_orbit(&u, lambda)?;
                let system = self.fine.family.at(lambda)?;
                estimate.errors = differences(&rms(system, &estimate.corrected), &estimate.rms);
                let (fixed, slope) = (&judged - u, in_coefficients(slope, few, many));
                estimate.along = self.along((&judged, lambda), &estimate.rms, (&fixed, &slope))?;
            }
            None if estimate.along < BESIDE_FOLD * estimate.largest() => {}
            None => estimate.errors.iter_mut().for_each(|e| {
                (e.displacement, e.velocity) = (f64::NAN, f64::NAN);
            }),
        }
        Ok(())
    }

    /// The system at a parameter and the orbit of a solution.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    pub fn orbit(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<(&System, FourierOrbit), SolveError> {
        let orbit = self.fine.fourier_orbit(u, lambda)?;
        Ok((self.fine.family.at(lambda)?, orbit))
    }

    /// Error of the measures against the nearest place of the branch, from the step to the solution at the same parameter and the
    /// slope of solutions.
    fn along(
        &mut self,
        (padded, lambda): (&DVector<f64>, f64),
        rms: &[Rms],
        (fixed, slope): (&DVector<f64>, &DVector<f64>),
    ) -> Result<f64, SolveError> {
        // The smallest correction, unknowns measured in their own size.
        let weight = 1.0 / padded.norm_squared().max(f64::MIN_POSITIVE);
        let shift = -weight * fixed.dot(slope) / (1.0 + weight * slope.norm_squared());
        let nearest = padded - fixed - slope * shift;
        let distance = match self.fine.family.is_frequency() {
            true => shift.abs() / lambda.abs(),
            false => shift.abs(),
        };
        let gaps = differences(&self.rms(&nearest, lambda)?, rms);
        Ok(worst(relative(rms, &gaps), distance))
    }

    /// The convergence check of Rook & Singh (1995): the same orbit solved with twice the harmonics, reported from the first
    /// half of them.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    pub fn check(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Check, SolveError> {
        let (few, many) = (self.coefficients, self.fine.coefficients());
        let mut solution = in_coefficients(u, few, many);
        let outcome = self.newton.solve(&mut self.fine, &mut solution, lambda)?;
        let first = in_coefficients(&in_coefficients(&solution, many, few), few, many);
        Ok(Check {
            outcome,
            rms: self.rms(&solution, lambda)?,
            first: self.rms(&first, lambda)?,
        })
    }

    /// Largest residual among the harmonics of the second half.
    fn beyond(&self) -> f64 {
        let rows = self.work.r.as_slice();
        let blocks = rows.chunks_exact(self.fine.coefficients());
        let beyond = blocks.flat_map(|block| &block[self.coefficients..]);
        beyond.fold(0.0, |largest, r| worst(largest, r.abs()))
    }

    fn rms(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Vec<Rms>, SolveError> {
        let orbit = self.fine.fourier_orbit(u, lambda)?;
        Ok(rms(self.fine.family.at(lambda)?, &orbit))
    }
}

/// R.m.s. values of every connection.
fn rms(system: &System, orbit: &FourierOrbit) -> Vec<Rms> {
    let one = |connection: usize| {
        let a = orbit.deformation(system, connection).series();
        Rms {
            displacement: trigonometric::mean_square(&a).sqrt(),
            velocity: orbit.omega * trigonometric::mean_square_of_derivative(&a).sqrt(),
        }
    };
    (0..system.element_count()).map(one).collect()
}

fn differences(a: &[Rms], b: &[Rms]) -> Vec<Rms> {
    let pairs = a.iter().zip(b);
    let one = |(a, b): (&Rms, &Rms)| Rms {
        displacement: a.displacement - b.displacement,
        velocity: a.velocity - b.velocity,
    };
    pairs.map(one).collect()
}

/// Largest of the errors, each relative to its value.
pub(crate) fn relative(values: &[Rms], errors: &[Rms]) -> f64 {
    [|r: &Rms| r.displacement, |r: &Rms| r.velocity]
        .iter()
        .map(|part| {
            let floor = HARDLY_MOVES * values.iter().map(part).fold(0.0, f64::max);
            let one = |(value, error): (&Rms, &Rms)| match part(error).abs() {
                0.0 => 0.0,
                error => error / part(value).max(floor),
            };
            values.iter().zip(errors).map(one).fold(0.0, worst)
        })
        .fold(0.0, worst)
}

/// The larger one; not a number where one of them is not.
fn worst(a: f64, b: f64) -> f64 {
    if b.is_nan() || b > a { b } else { a }
}
