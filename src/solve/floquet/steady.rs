//! Characteristic exponents of motions whose variational equation has constant coefficients.
//!
//! While no connection passes a breakpoint, A is constant all along the period and the multipliers are those of a linear train:
//!
//! ```text
//! mu_i = exp(lambda_i T),    lambda_i eigenvalues of A
//! ```
//!
//! Along a branch A stays the same where only the frequency or a load varies: its eigenvalues are computed once.

use super::by_falling_modulus;
use super::variation::{OrbitVariation, is_piecewise_constant};
use crate::numeric::eigenvalues::eigenvalues;
use crate::numeric::periodic::Periodic;
use crate::solve::jumps;
use crate::solve::orbit::FourierOrbit;
use crate::system::{Mount, System};
use nalgebra::DMatrix;
use num_complex::Complex;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The exponents of one A, shared by all orbits that have it.
pub type SteadyExponents = Arc<[Complex<f64>]>;

/// The last constant A with its eigenvalues.
#[derive(Debug, Default)]
pub(super) struct Steady {
    known: Option<(DMatrix<f64>, SteadyExponents)>,
}

impl Steady {
    /// Eigenvalues of A of an orbit along which it is constant; `None` elsewhere.
    pub fn exponents(
        &mut self,
        system: &System,
        orbit: &FourierOrbit,
        extrema: &[Vec<(f64, f64)>],
    ) -> Option<SteadyExponents> {
        let mut pairs = system.mounts().iter().zip(extrema);
        let is_constant = pairs.all(|(mount, extrema)| is_steady(mount, extrema));
        if !is_constant || jumps::refuse_hidden(system).is_err() {
            return None;
        }
        let mut variation = OrbitVariation::new(system, orbit);
        let a = variation.coefficients(0.5 * TAU);
        match &self.known {
            Some((known, exponents)) if known == a => Some(exponents.clone()),
            _ => {
                let exponents: SteadyExponents = of(a)?.into();
                self.known = Some((a.clone(), exponents.clone()));
                Some(exponents)
            }
        }
    }
}

/// Whether the partials of a connection keep their values while its deformation moves between its extrema.
fn is_steady(mount: &Mount, extrema: &[(f64, f64)]) -> bool {
    let varies = |series: &Periodic| !series.is_constant();
    if !is_piecewise_constant(mount) || mount.stiffness_variation.as_ref().is_some_and(varies) {
        return false;
    }
    let low = extrema.iter().fold(f64::INFINITY, |m, (_, x)| m.min(*x));
    let high = extrema
        .iter()
        .fold(f64::NEG_INFINITY, |m, (_, x)| m.max(*x));
    let breakpoints = mount.element.breakpoints();
    breakpoints.into_iter().all(|b| b <= low || b >= high)
}

/// Eigenvalues of A = [[0, I], [-K, -C]]. Its lower left block has the size of squares of frequencies: velocities in units of
/// their root make all blocks alike.
fn of(a: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let n = a.nrows() / 2;
    let stiffness = a.view((n, 0), (n, n)).amax();
    let scale = if stiffness > 0.0 {
        stiffness.sqrt()
    } else {
        1.0
    };
    let mut balanced = a.clone();
    balanced.view_mut((0, n), (n, n)).scale_mut(scale);
    balanced.view_mut((n, 0), (n, n)).unscale_mut(scale);
    if balanced.iter().any(|x| !x.is_finite()) {
        return None;
    }
    eigenvalues(&balanced)
}

/// Multipliers over a time, by falling modulus; none when they overflow.
pub(super) fn multipliers(exponents: &SteadyExponents, time: f64) -> Vec<Complex<f64>> {
    let list: Vec<Complex<f64>> = exponents.iter().map(|x| (x * time).exp()).collect();
    if list.iter().all(|mu| mu.is_finite()) {
        by_falling_modulus(list)
    } else {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solve::floquet;

    #[test]
    fn exponents_give_the_multipliers_of_the_exponential() {
        // Two coupled oscillators, one of them a thousand times stiffer.
        let stiffness = [[2.0, -1.0], [-1.0, 2e6]];
        let damping = [[0.1, 0.02], [0.02, 40.0]];
        let a = DMatrix::from_fn(4, 4, |i, j| match (i < 2, j < 2) {
            (true, _) => f64::from(u8::from(j == i + 2)),
            (false, true) => -stiffness[i - 2][j],
            (false, false) => -damping[i - 2][j - 2],
        });
        let exponents: SteadyExponents = of(&a).expect("finite").into();
        let time = 0.37;
        let phi = (a * time).exp();
        let expected = floquet::multipliers(&phi);
        let found = multipliers(&exponents, time);
        for (x, y) in found.iter().zip(&expected) {
            assert!((x - y).norm() < 1e-10, "{found:?} {expected:?}");
        }
        let trace: f64 = found.iter().map(|mu| mu.norm().ln()).sum();
        assert!((trace + 40.1 * time).abs() < 1e-9 * 40.1 * time, "{trace}");
    }
}
