//! Solutions in many times the harmonics, found without the factors of the matrix that those would need.
//!
//! The harmonics of a smaller problem are corrected with its factors, those beyond one by one, with what is left of the Jacobian J of
//! the larger problem when the harmonics beyond are not coupled to each other:
//!
//! ```text
//! J_kk s_k = R_k,  k beyond;    J_00 s_0 = R_0 - sum_k J_0k s_k;    u <- u - s
//! ```
//!
//! Modes above the harmonics of the smaller problem are in J_kk. The iteration contracts where the stiffness at the harmonics beyond
//! hardly varies against the inertia; elsewhere Newton's method solves the larger problem, if that is not too large.

use super::Galerkin;
use crate::error::SolveError;
use crate::numeric::factors::Factors;
use crate::numeric::jacobian::{Jacobian, JacobianStructure};
use crate::solve::family::Family;
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::residual::{Linearisation, PeriodicResidual, Residual};
use nalgebra::{DMatrix, DVector};

/// Iterations at most.
const ITERATIONS: usize = 10;
/// Step that ends the iteration, relative to the whole correction: an estimate needs no more digits.
const ENOUGH: f64 = 0.02;
/// Share of the step before below which the matrix of the smaller problem is kept.
const QUICK: f64 = 0.3;
/// Share of the step before above which the iteration does not contract.
const SLOW: f64 = 0.7;
/// Step, relative to the whole correction, that is good enough where sampling keeps the iteration from contracting further.
const GOOD: f64 = 0.1;
/// Step relative to the motion that is rounding.
const ROUNDING: f64 = 1e-14;
/// Correction, relative to the motion, beyond which the solution is another one.
const ANOTHER: f64 = 0.5;
/// Entries of the largest Jacobian that is filled: 32 MB.
const MOST_ENTRIES: usize = 4_000_000;
/// Rows of the largest matrix that Newton's method may factorise at every point.
const MOST_ROWS: usize = 1500;

/// How many times the harmonics of a problem of this shape a refinement takes, if it is not too large.
pub(super) fn widening(structure: &JacobianStructure) -> Option<usize> {
    let entries = match structure {
        JacobianStructure::Dense(dim) => dim * dim,
        JacobianStructure::Block(pattern) | JacobianStructure::BorderedBlock(pattern) => {
            pattern.stored() * pattern.size().pow(2)
        }
    };
    [4, 2]
        .into_iter()
        .find(|factor| entries * factor * factor <= MOST_ENTRIES)
}

/// Refines solutions of one size.
pub(super) struct Refinement<F: Family> {
    wide: Galerkin<F>,
    /// Coefficients per coordinate of the smaller problem.
    few: usize,
    work: Linearisation,
    low: Jacobian,
    factors: Factors,
    newton: NewtonOptions,
}

impl<F: Family> Refinement<F> {
    /// Buffers; `structure`: shape of the smaller problem, with `few` coefficients per coordinate.
    pub fn new(
        wide: Galerkin<F>,
        (structure, few): (&JacobianStructure, usize),
        newton: NewtonOptions,
    ) -> Refinement<F> {
        Refinement {
            work: Linearisation {
                has_parameter: false,
                ..Linearisation::of(&wide)
            },
            low: Jacobian::new(structure),
            factors: Factors::new(structure),
            wide,
            few,
            newton,
        }
    }

    /// Refines orbits that repeat themselves in a number of equal parts of the period.
    pub fn restrict(&mut self, parts: usize) {
        self.wide.restrict(parts);
    }

    /// Coefficients per coordinate of the larger problem.
    pub fn coefficients(&self) -> usize {
        self.wide.coefficients()
    }

    /// The solution of the larger problem near a first guess, both in its coefficients; `None` where there is none nearby.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    pub fn solve(
        &mut self,
        judged: &DVector<f64>,
        guess: DVector<f64>,
        lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        let found = match self.iterate(judged, guess.clone(), lambda)? {
            None if guess.len() <= MOST_ROWS => self.by_newton(judged, guess, lambda)?,
            found => found,
        };
        let is_near = |u: &DVector<f64>| (u - judged).norm() <= ANOTHER * judged.norm();
        Ok(found.filter(is_near))
    }

    fn iterate(
        &mut self,
        judged: &DVector<f64>,
        mut u: DVector<f64>,
        lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        let (mut last, mut is_current) = (f64::INFINITY, false);
        for _ in 0..ITERATIONS {
            self.wide.linearise(&u, lambda, &mut self.work)?;
            if !is_current && !self.factorise_low() {
                return Ok(None);
            }
            let Some(step) = self.step() else {
                return Ok(None);
            };
            let size = step.norm();
            // NaN is no progress either.
            let contracts = size < SLOW * last;
            if !contracts {
                let is_good = last <= GOOD * (&u - judged).norm();
                return Ok(is_good.then_some(u));
            }
            is_current = size < QUICK * last && last.is_finite();
            u -= step;
            if size <= ENOUGH * (&u - judged).norm() || size <= ROUNDING * u.norm() {
                return Ok(Some(u));
            }
            last = size;
        }
        Ok(None)
    }

    fn by_newton(
        &mut self,
        judged: &DVector<f64>,
        mut u: DVector<f64>,
        lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        // Steps far below the correction: where forces jump between samples, the residual does not fall any further.
        let correction = (&u - judged).amax() / u.amax().max(f64::MIN_POSITIVE);
        let options = NewtonOptions {
            step_tolerance: (ENOUGH * correction).max(self.newton.step_tolerance),
            ..self.newton
        };
        let mut newton = Newton::new(&self.wide.structure(), options);
        let outcome = newton.solve(&mut self.wide, &mut u, lambda)?;
        Ok(outcome.is_converged().then_some(u))
    }

    /// Takes the harmonics of the smaller problem out of the Jacobian, and factorises them.
    fn factorise_low(&mut self) -> bool {
        let (few, many) = (self.few, self.wide.coefficients());
        for (i, j) in blocks(&self.low.structure(), few) {
            let mut target = self.low.block_mut(few, (i, j));
            let mut source = self.work.dr_du.block_mut(many, (i, j));
            for l in 0..few {
                target.column(l).copy_from_slice(&source.column(l)[..few]);
            }
        }
        self.factors.factorise(&self.low)
    }

    /// The step, of the harmonics beyond first; `None` where a matrix is singular.
    fn step(&mut self) -> Option<DVector<f64>> {
        let (few, many) = (self.few, self.wide.coefficients());
        let mut step = self.beyond()?;
        let mut felt = DVector::zeros(step.len());
        self.work.dr_du.multiply(&step, &mut felt);
        let mut low = in_coefficients(&(&self.work.r - felt), many, few);
        if !self.factors.solve(&self.low, &mut low) {
            return None;
        }
        let places = step.as_mut_slice().chunks_exact_mut(many);
        for (step, low) in places.zip(low.as_slice().chunks_exact(few)) {
            step[..few].copy_from_slice(low);
        }
        Some(step)
    }

    /// The step of every harmonic beyond those of the smaller problem, by itself; the others 0.
    fn beyond(&self) -> Option<DVector<f64>> {
        let (few, many) = (self.few, self.wide.coefficients());
        let n = self.work.r.len() / many;
        let mut step = DVector::zeros(self.work.r.len());
        for first in (few..many).step_by(2) {
            let place = |row: usize| row / 2 * many + first + row % 2;
            let own = DMatrix::from_fn(2 * n, 2 * n, |r, c| self.work.dr_du[(place(r), place(c))]);
            let rhs = DVector::from_fn(2 * n, |row, _| self.work.r[place(row)]);
            let own = own.lu().solve(&rhs)?;
            own.iter()
                .enumerate()
                .for_each(|(row, x)| step[place(row)] = *x);
        }
        Some(step)
    }
}

/// The blocks that are stored.
fn blocks(structure: &JacobianStructure, size: usize) -> Vec<(usize, usize)> {
    match structure {
        JacobianStructure::Dense(dim) => {
            let n = dim / size;
            (0..n * n).map(|k| (k / n, k % n)).collect()
        }
        JacobianStructure::Block(pattern) | JacobianStructure::BorderedBlock(pattern) => {
            let columns = 0..pattern.blocks();
            columns
                .flat_map(|j| pattern.column(j).iter().map(move |i| (*i, j)))
                .collect()
        }
    }
}

/// The same motion, or a change of it, with another number of coefficients per coordinate: padded with zeros, or truncated.
pub(crate) fn in_coefficients(u: &DVector<f64>, from: usize, to: usize) -> DVector<f64> {
    let few = from.min(to);
    let mut out = DVector::zeros(u.len() / from * to);
    let blocks = out.as_mut_slice().chunks_exact_mut(to);
    for (out, u) in blocks.zip(u.as_slice().chunks_exact(from)) {
        out[..few].copy_from_slice(&u[..few]);
    }
    out
}
