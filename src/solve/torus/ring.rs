//! Functions on the circle through an odd number of equidistant points.

use nalgebra::DVector;
use num_complex::Complex;
use std::f64::consts::{PI, TAU};

/// Weights of the values at `count` points for the value, and for its derivative per turn, at a distance (in turns) from the first one.
pub(super) fn weights(count: usize, turns: f64) -> (Vec<f64>, Vec<f64>) {
    let highest = (count - 1) / 2;
    let (mut value, mut slope) = (vec![0.0; count], vec![0.0; count]);
    for k in 0..count {
        let x = TAU * (turns - k as f64 / count as f64);
        let step = Complex::from_polar(1.0, x);
        let mut wave = Complex::new(1.0, 0.0);
        let (mut sum, mut rise) = (0.5, 0.0);
        for h in 1..=highest {
            wave *= step;
            sum += wave.re;
            rise -= h as f64 * wave.im;
        }
        value[k] = 2.0 * sum / count as f64;
        slope[k] = TAU * 2.0 * rise / count as f64;
    }
    (value, slope)
}

/// The weights for the value alone, from their closed form:
///
/// ```text
/// w_k = (-1)^k / sin(pi x_k) over their sum,    x_k = turns - k / count
/// ```
///
/// P. Henrici, "Barycentric formulas for interpolating trigonometric polynomials and their conjugates", Numer. Math. 33 (1979).
pub(super) fn value_weights(count: usize, turns: f64, weights: &mut Vec<f64>) {
    let (mut s, mut c) = (PI * turns.rem_euclid(1.0)).sin_cos();
    let (step_s, step_c) = (PI / count as f64).sin_cos();
    let (mut sign, mut sum) = (1.0, 0.0);
    weights.clear();
    for k in 0..count {
        if s == 0.0 {
            weights.clear();
            weights.resize(count, 0.0);
            weights[k] = 1.0;
            return;
        }
        weights.push(sign / s);
        sum += sign / s;
        (s, c) = (s * step_c - c * step_s, c * step_c + s * step_s);
        sign = -sign;
    }
    weights.iter_mut().for_each(|w| *w /= sum);
}

/// Value at a place, of functions with `size` components, point by point.
pub(super) fn value(points: &[f64], size: usize, weights: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; size];
    value_into(points, weights, &mut out);
    out
}

/// The same into a buffer, which has as many components.
pub(super) fn value_into(points: &[f64], weights: &[f64], out: &mut [f64]) {
    let size = out.len();
    out.fill(0.0);
    for (point, weight) in points.chunks_exact(size).zip(weights) {
        for (o, x) in out.iter_mut().zip(point) {
            *o += weight * x;
        }
    }
}

/// Derivative per turn at all points.
pub(super) fn derivative(points: &[f64], size: usize) -> Vec<f64> {
    let count = points.len() / size;
    let (_, slope) = weights(count, 0.0);
    let mut out = Vec::with_capacity(points.len());
    for j in 0..count {
        // The weights of a point are those of the first one, turned.
        let own: Vec<f64> = (0..count).map(|k| slope[(k + count - j) % count]).collect();
        out.extend(value(points, size, &own));
    }
    out
}

/// The same function at another number of points.
pub(super) fn resampled(points: &[f64], size: usize, count: usize) -> Vec<f64> {
    let old = points.len() / size;
    let mut weights = Vec::with_capacity(old);
    (0..count)
        .flat_map(|j| {
            value_weights(old, j as f64 / count as f64, &mut weights);
            value(points, size, &weights)
        })
        .collect()
}

/// Values at equidistant points of a function with these coefficients (harmonics 0, 1, .., each a vector).
pub(super) fn synthesised(coefficients: &[DVector<Complex<f64>>], count: usize) -> Vec<f64> {
    let size = coefficients[0].len();
    let mut points = Vec::with_capacity(count * size);
    for j in 0..count {
        let angle = TAU * j as f64 / count as f64;
        for i in 0..size {
            let mut sum = coefficients[0][i].re;
            for (h, c) in coefficients.iter().enumerate().skip(1) {
                sum += 2.0 * (c[i] * Complex::from_polar(1.0, h as f64 * angle)).re;
            }
            points.push(sum);
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_is_exact_for_its_harmonics() {
        let f = |t: f64| (TAU * t).cos() + 0.3 * (3.0 * TAU * t).sin() + 0.1;
        let rise = |t: f64| -TAU * (TAU * t).sin() + 0.9 * TAU * (3.0 * TAU * t).cos();
        let points: Vec<f64> = (0..9).map(|k| f(k as f64 / 9.0)).collect();
        let (at, slope) = weights(9, 0.137);
        assert!((value(&points, 1, &at)[0] - f(0.137)).abs() < 1e-14);
        assert!((value(&points, 1, &slope)[0] - rise(0.137)).abs() < 1e-12);
        let mut again = Vec::new();
        for turns in [0.137, -3.7, 2.0 / 9.0, 2.0 / 9.0 + 1e-13, 0.0] {
            value_weights(9, turns, &mut again);
            let gap = value(&points, 1, &again)[0] - f(turns);
            assert!(gap.abs() < 2e-14, "{turns}: {gap}");
        }
        let slopes = derivative(&points, 1);
        let gaps = slopes
            .iter()
            .enumerate()
            .map(|(k, d)| (d - rise(k as f64 / 9.0)).abs());
        assert!(gaps.fold(0.0, f64::max) < 1e-12);
        let more = resampled(&points, 1, 15);
        assert!((more[4] - f(4.0 / 15.0)).abs() < 1e-14);
    }
}
