//! Transverse exponents: growth of what is left of small deviations when the direction along the curve is taken out.

use super::{CurveOfTorus, TorusProblem, ring};
use crate::error::SolveError;
use nalgebra::{DMatrix, DVector};

/// Iterates over which growth is averaged, after those in which directions turn into place.
const ITERATES: (usize, usize) = (3000, 200);

impl TorusProblem<'_> {
    /// Derivatives of the map at all points.
    pub(super) fn derivatives(&mut self, torus: &CurveOfTorus) -> Result<Vec<f64>, SolveError> {
        let n = self.shots.size();
        let mut list = Vec::with_capacity(torus.points.len() * n);
        let mut phi = DMatrix::identity(n, n);
        for state in torus.points.chunks_exact(n) {
            let mut state = state.to_vec();
            let into = (state.as_mut_slice(), Some(&mut phi));
            if !self.shots.map([torus.lambda, 0.0], self.span(), into)? {
                phi.fill(f64::NAN);
            }
            list.extend_from_slice(phi.as_slice());
        }
        Ok(list)
    }

    /// The largest transverse exponent per map, and how much it depends on the length of the average.
    ///
    /// Along the curve the derivative is a function of the angle, which turns by rho: averages with weights that vanish smoothly at
    /// both ends converge faster than any power of the length.
    pub(super) fn exponent(&mut self, torus: &CurveOfTorus) -> Result<(f64, f64), SolveError> {
        let n = self.shots.size();
        let derivatives = self.derivatives(torus)?;
        let tangent = ring::derivative(&torus.points, n);
        let logs = growth(&derivatives, &tangent, (n, torus.rotation));
        let whole = weighted(&logs);
        let part = weighted(&logs[..2 * logs.len() / 3]);
        Ok((whole, (whole - part).abs()))
    }
}

/// Logarithms of the growth of the leading transverse direction, iterate by iterate.
fn growth(derivatives: &[f64], tangent: &[f64], (n, rotation): (usize, f64)) -> Vec<f64> {
    let count = tangent.len() / n;
    let along = |theta: f64| {
        let (weights, _) = ring::weights(count, theta);
        let t = DVector::from_vec(ring::value(tangent, n, &weights)).normalize();
        let a = DMatrix::from_vec(n, n, ring::value(derivatives, n * n, &weights));
        (t, a)
    };
    let mut theta = 0.0_f64;
    let (mut t, mut a) = along(theta);
    // An uneven start: it has a part in every direction.
    let mut v = DVector::from_fn(n, |i, _| {
        1.0 + 0.618 * (i as f64 + 1.0).fract() + 0.1 * i as f64
    });
    v -= &t * t.dot(&v);
    v.normalize_mut();
    let mut logs = Vec::with_capacity(ITERATES.0);
    for k in 0..ITERATES.0 + ITERATES.1 {
        v = &a * v;
        theta = (theta + rotation).rem_euclid(1.0);
        (t, a) = along(theta);
        v -= &t * t.dot(&v);
        let norm = v.norm();
        if k >= ITERATES.1 {
            logs.push(norm.ln());
        }
        v /= norm;
    }
    logs
}

/// Average with the weights exp(-1 / (s (1 - s))).
pub(super) fn weighted(values: &[f64]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (k, x) in values.iter().enumerate() {
        let s = (k as f64 + 1.0) / (values.len() as f64 + 1.0);
        let weight = (-1.0 / (s * (1.0 - s))).exp();
        sum += weight * x;
        total += weight;
    }
    sum / total
}
