//! Bounds on the frequencies of a train.

use super::laws::LawPart;
use crate::system::System;
use nalgebra::{DMatrix, DVector};

/// A bound on the frequencies with the steepest, or with the flattest, part of every law; of laws that are not affine, near their
/// breakpoints.
pub(crate) fn frequency_bound(
    system: &System,
    laws: &[LawPart],
    chosen: fn(f64, f64) -> f64,
) -> f64 {
    let mut slopes = vec![(0.0, 0.0); system.element_count()];
    for part in laws {
        let variation = system.mounts()[part.connection]
            .stiffness_variation
            .as_ref();
        let largest = variation.map_or(1.0, |s| s.largest());
        let (q, v) = part.law.slopes(chosen);
        let sum = &mut slopes[part.connection];
        *sum = (sum.0 + q * largest, sum.1 + v * largest);
    }
    let coupled = |slopes: &mut dyn Iterator<Item = f64>| {
        let mut stiffness = system.stiffness().abs();
        for (mut column, slope) in stiffness.column_iter_mut().zip(slopes) {
            column *= slope;
        }
        radius(&(stiffness * system.element_map().abs()))
    };
    // Without any spring the characteristic frequency is the measure: only loads move such a train.
    let is_free = laws.iter().all(|p| p.law.slopes(f64::max).0 == 0.0);
    let least = if is_free { 1.0 } else { LEAST_SLOPE };
    let springs = coupled(&mut slopes.iter().map(|s| s.0.max(least)));
    let dampers = match slopes.iter().any(|s| s.1 > 0.0) {
        true => coupled(&mut slopes.iter().map(|s| s.1)),
        false => 0.0,
    };
    radius(&system.damping().abs()) + dampers + springs.sqrt()
}

/// A bound on the spectral radius of a matrix without negative numbers, close whatever the scales of its coordinates are.
///
/// ```text
/// rho(A) <= max_i (A x)_i / x_i  for every x > 0 (Collatz and Wielandt),  x from the power iteration
/// ```
pub fn radius(matrix: &DMatrix<f64>) -> f64 {
    let mut x = DVector::from_element(matrix.ncols(), 1.0);
    let mut bound = f64::INFINITY;
    for _ in 0..POWERS {
        let y = matrix * &x;
        let ratio = y.iter().zip(&x).map(|(y, x)| y / x).fold(0.0, f64::max);
        bound = bound.min(ratio);
        let largest = y.amax().max(f64::MIN_POSITIVE);
        x = y.map(|y| (y / largest).max(LEAST_SHARE));
    }
    bound
}

/// Keeps a system without stiffness in motion.
const LEAST_SLOPE: f64 = 1e-6;
/// Steps of the power iteration.
const POWERS: usize = 30;
/// Keeps the numbers of coordinates that nothing drives from zero.
const LEAST_SHARE: f64 = 1e-30;
