//! Orbits that repeat themselves in m equal parts of the period: they have the harmonics whose order is a multiple of m, and no others.

use crate::numeric::fraction::divisors;
use crate::solve::residual::Linearisation;
use nalgebra::DVector;

/// Amplitude of other harmonics, relative to the largest coefficient, up to which an orbit consists of equal parts.
const EQUAL_PARTS: f64 = 1e-8;

/// The largest divisor of `most` that is a number of equal parts in which an orbit repeats itself.
pub(super) fn of(u: &DVector<f64>, dof: usize, most: usize) -> usize {
    let coefficients = u.len() / dof;
    let largest = u.amax();
    let is_equal = |parts: &usize| {
        let others = u.iter().enumerate();
        let mut others = others.filter(|(row, _)| !is_multiple(row % coefficients, *parts));
        others.all(|(_, x)| x.abs() <= EQUAL_PARTS * largest)
    };
    divisors(most).find(is_equal).unwrap_or(1)
}

/// Holds the other harmonics at 0: u_k = 0 in the place of their equations.
pub(super) fn hold(parts: usize, coefficients: usize, u: &DVector<f64>, out: &mut Linearisation) {
    if parts == 1 {
        return;
    }
    for row in (0..u.len()).filter(|row| !is_multiple(row % coefficients, parts)) {
        out.dr_du.pin(row);
        (out.r[row], out.dr_dlambda[row]) = (u[row], 0.0);
    }
}

/// Whether a coefficient, by its place in its coordinate's list, belongs to the mean or to a harmonic of an order divisible by `parts`.
fn is_multiple(place: usize, parts: usize) -> bool {
    place.div_ceil(2).is_multiple_of(parts)
}
