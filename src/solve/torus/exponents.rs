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
    let mut weights = Vec::with_capacity(count);
    let mut along = |theta: f64, t: &mut DVector<f64>, a: &mut DMatrix<f64>| {
        ring::value_weights(count, theta, &mut weights);
        ring::value_into(tangent, &weights, t.as_mut_slice());
        ring::value_into(derivatives, &weights, a.as_mut_slice());
        t.normalize_mut();
    };
    let mut theta = 0.0_f64;
    let (mut t, mut a) = (DVector::zeros(n), DMatrix::zeros(n, n));
    along(theta, &mut t, &mut a);
    // An uneven start: it has a part in every direction.
    let mut v = DVector::from_fn(n, |i, _| {
        1.0 + 0.618 * (i as f64 + 1.0).fract() + 0.1 * i as f64
    });
    v -= &t * t.dot(&v);
    v.normalize_mut();
    let mut next = v.clone();
    let mut logs = Vec::with_capacity(ITERATES.0);
    for k in 0..ITERATES.0 + ITERATES.1 {
        a.mul_to(&v, &mut next);
        std::mem::swap(&mut v, &mut next);
        theta = (theta + rotation).rem_euclid(1.0);
        along(theta, &mut t, &mut a);
        v.axpy(-t.dot(&v), &t, 1.0);
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
