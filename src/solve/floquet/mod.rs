//! Floquet multipliers from the variational equation along a periodic orbit.

mod leading;
mod memory;
mod steady;
mod variation;

use super::jumps;
use super::orbit::FourierOrbit;
use crate::interrupt;
use crate::numeric::dense;
use crate::numeric::eigenvalues::eigenvalues;
use crate::numeric::exponential::Exponential;
use crate::system::System;
use nalgebra::DMatrix;
use num_complex::Complex;
use std::f64::consts::TAU;
use steady::Steady;
pub use steady::SteadyExponents;
pub(crate) use variation::is_piecewise_constant;
use variation::{OrbitVariation, Stretches};

/// Selection of the computed multipliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spectrum {
    /// All 2n, from the whole transition matrix.
    All,
    /// Those of largest modulus down to the inside of the unit circle, by Arnoldi's method, without the matrix.
    Leading,
}

/// Coordinates up to which the transition matrix is formed. Its cost grows like n^3 a stretch between two switches, that of
/// Arnoldi's products like n.
const LARGEST_WHOLE: usize = 64;

impl Spectrum {
    /// The spectrum computed for a number of coordinates.
    pub fn of(dof: usize) -> Spectrum {
        if dof <= LARGEST_WHOLE {
            Spectrum::All
        } else {
            Spectrum::Leading
        }
    }
}

/// Computes transition matrices and multipliers along Fourier orbits; owns its buffers.
#[derive(Debug, Default)]
pub struct Floquet {
    exponential: Option<Exponential>,
    steady: Steady,
}

impl Floquet {
    /// Multipliers over one response period by falling modulus: all, or the leading ones of a long train ([`Spectrum::of`]).
    /// None when they are not known: a law with hidden jumps, an overflow, an iteration that does not converge.
    /// `extrema`: of the deformations, one list a connection.
    pub fn multipliers(
        &mut self,
        system: &System,
        orbit: &FourierOrbit,
        extrema: &[Vec<(f64, f64)>],
    ) -> Vec<Complex<f64>> {
        self.of_part(system, (orbit, extrema), 1).0
    }

    /// The same over the first of several equal parts of the period, and all characteristic exponents of an orbit along which the variational
    /// equation has constant coefficients.
    pub(crate) fn of_part(
        &mut self,
        system: &System,
        (orbit, extrema): (&FourierOrbit, &[Vec<(f64, f64)>]),
        parts: usize,
    ) -> (Vec<Complex<f64>>, Option<SteadyExponents>) {
        let (spectrum, end) = (Spectrum::of(system.dof()), TAU / parts as f64);
        if let Some(exponents) = self.steady.exponents(system, orbit, extrema) {
            let mut list = steady::multipliers(&exponents, end / orbit.omega);
            if spectrum == Spectrum::Leading {
                list.truncate(leading::wanted(&list));
            }
            return (list, Some(exponents));
        }
        let list = match spectrum {
            Spectrum::All => multipliers(&self.transition(system, (orbit, extrema), end)),
            Spectrum::Leading => Floquet::leading(system, (orbit, extrema), end),
        };
        (list, None)
    }

    /// The same of a system with memory, and how many more are 1 by construction.
    pub(crate) fn with_memory(
        system: &System,
        orbit: &FourierOrbit,
        extrema: &[Vec<(f64, f64)>],
        parts: usize,
    ) -> (Vec<Complex<f64>>, usize) {
        match memory::transition(system, orbit, extrema, TAU / parts as f64) {
            Some(phi) => multipliers_and_neutral(&phi, 2 * system.dof()),
            None => (Vec::new(), 0),
        }
    }

    /// State-transition matrix over one response period, in (q, v), 2n x 2n; the system is at the frequency of the orbit.
    ///
    /// ```text
    /// dPhi/dT = A Phi,    A = [[0, I], [-kappa diag(df/dq) W, -Gam - kappa diag(df/dv) W]]
    /// ```
    ///
    /// The period is cut at every passage of a breakpoint and every kink of the stiffness variation. Between two cuts A is
    /// constant for piecewise-affine laws and one matrix exponential is exact; elsewhere Magnus' fourth-order rule on panels
    /// keeps det Phi = exp(integral of trace A) to rounding. A force that jumps at a breakpoint adds its saltation matrix
    /// ([`jumps`]), a continuous one needs none. NaN where a law has hidden jumps: unknown.
    ///
    /// Rook & Singh (1995), eqs. (17), (18), in d/dT instead of d/dtau.
    pub fn monodromy(&mut self, system: &System, orbit: &FourierOrbit) -> DMatrix<f64> {
        self.transition(system, (orbit, &orbit.extrema(system)), TAU)
    }

    /// The same up to a phase.
    fn transition(
        &mut self,
        system: &System,
        (orbit, extrema): (&FourierOrbit, &[Vec<(f64, f64)>]),
        to: f64,
    ) -> DMatrix<f64> {
        let size = 2 * system.dof();
        if jumps::refuse_hidden(system).is_err() {
            return DMatrix::from_element(size, size, f64::NAN);
        }
        let stretches = Stretches::new(system, orbit, extrema, to);
        let exponential = match &mut self.exponential {
            Some(exponential) if exponential.size() == size => exponential,
            other => other.insert(Exponential::new(size)),
        };
        let mut variation = OrbitVariation::new(system, orbit);
        let mut phi = DMatrix::identity(size, size);
        let mut next = DMatrix::zeros(size, size);
        for stretch in &stretches.list {
            let width = stretch.panel_width();
            for k in 0..stretch.panels {
                if interrupt::is_requested() {
                    return DMatrix::from_element(size, size, f64::NAN);
                }
                let from = stretch.begin + k as f64 * width;
                let exponent = if stretches.is_constant {
                    variation.midpoint(from, width)
                } else {
                    variation.magnus(from, width)
                };
                dense::multiply(exponential.of(exponent), &phi, &mut next);
                std::mem::swap(&mut phi, &mut next);
            }
            for passage in &stretch.passages {
                passage.saltate(system, phi.as_mut_slice());
            }
        }
        phi
    }
}

/// Eigenvalues of a state-transition matrix by falling modulus, the member of a pair with positive imaginary part first; none
/// when the matrix has overflown or its eigenvalues do not converge.
pub fn multipliers(phi: &DMatrix<f64>) -> Vec<Complex<f64>> {
    if phi.iter().any(|x| !x.is_finite()) {
        return Vec::new();
    }
    by_falling_modulus(eigenvalues(phi).unwrap_or_default())
}

/// Multipliers of the whole period from those of one of its equal parts.
pub fn whole(mut list: Vec<Complex<f64>>, parts: usize) -> Vec<Complex<f64>> {
    if parts > 1 {
        list.iter_mut().for_each(|mu| *mu = mu.powu(parts as u32));
    }
    list
}

/// Rows of a transition matrix, behind the first ones, that belong to numbers which stay what they are.
pub fn kept(phi: &DMatrix<f64>, motion: usize) -> impl Iterator<Item = usize> {
    let is_kept = move |row: &usize| {
        let entries = phi.row(*row);
        let mut entries = entries.iter().enumerate();
        entries.all(|(column, x)| *x == if column == *row { 1.0 } else { 0.0 })
    };
    (motion..phi.nrows()).filter(is_kept)
}

/// Multipliers of a system with memory, with a 0 in the place of each one that is 1 by construction, and how many these are; `motion`:
/// coordinates and rates together.
pub(crate) fn multipliers_and_neutral(
    phi: &DMatrix<f64>,
    motion: usize,
) -> (Vec<Complex<f64>>, usize) {
    let neutral: Vec<usize> = kept(phi, motion).collect();
    if neutral.is_empty() {
        return (multipliers(phi), 0);
    }
    let others: Vec<usize> = (0..phi.nrows()).filter(|k| !neutral.contains(k)).collect();
    let mut list = multipliers(&phi.select_rows(&others).select_columns(&others));
    if !list.is_empty() {
        list.extend(neutral.iter().map(|_| Complex::new(0.0, 0.0)));
    }
    (list, neutral.len())
}

/// Multipliers by falling modulus, the member of a pair with positive imaginary part first.
pub(crate) fn by_falling_modulus(mut list: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
    let key = |mu: &Complex<f64>| (mu.norm(), mu.re, mu.im);
    list.sort_by(|a, b| {
        key(b)
            .partial_cmp(&key(a))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    // Rounding may order the members of a pair either way.
    for k in 1..list.len() {
        if list[k].im > 0.0 && (list[k] - list[k - 1].conj()).norm() <= 1e-12 * list[k].norm() {
            list.swap(k - 1, k);
        }
    }
    list
}
