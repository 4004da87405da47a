//! First invariant curves: at a Neimark-Sacker event, and from the record of an attractor.

use super::exponents::weighted;
use super::{CurveOfTorus, TorusProblem, ring};
use crate::error::SolveError;
use crate::solve::continuation::{ContinuationOptions, Section};
use crate::solve::curve::Shots;
use crate::solve::floquet;
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use std::f64::consts::TAU;

/// Amplitudes of a first curve around an orbit, relative to its size.
const AMPLITUDES: [f64; 4] = [0.02, 0.01, 0.005, 0.04];

/// The first curve around a periodic orbit at which a pair of multipliers passes the circle: its amplitude is fixed, the parameter
/// free. `None` where there is no pair, or the corrector fails.
///
/// ```text
/// K = u + epsilon Re(w e^(i theta)),    rho = arg mu / 2 pi
/// ```
///
/// # Errors
/// Errors of the problem.
pub(crate) fn from_event<'a>(
    mut shots: Shots<'a>,
    (u, lambda): (&[f64], f64),
    count: usize,
    options: ContinuationOptions,
) -> Result<Option<(TorusProblem<'a>, CurveOfTorus)>, SolveError> {
    let n = u.len();
    let (mut state, mut phi) = (u.to_vec(), DMatrix::identity(n, n));
    let into = (state.as_mut_slice(), Some(&mut phi));
    if !shots.map([lambda, 0.0], (0.0, TAU), into)? {
        return Ok(None);
    }
    let pairs = floquet::multipliers(&phi)
        .into_iter()
        .filter(|mu| mu.im > 0.0);
    let gap = |mu: &Complex<f64>| (mu.norm() - 1.0).abs();
    let Some(mu) = pairs.min_by(|a, b| gap(a).total_cmp(&gap(b))) else {
        return Ok(None);
    };
    let shifted = phi.map(|x| Complex::new(x, 0.0)) - DMatrix::identity(n, n) * mu;
    let svd = shifted.svd(false, true);
    let values = svd.singular_values.iter().enumerate();
    let Some((k, _)) = values.min_by(|a, b| a.1.total_cmp(b.1)) else {
        return Ok(None);
    };
    let Some(v) = svd.v_t else { return Ok(None) };
    let w = v.row(k).adjoint();
    let largest = u.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let zero = DVector::from_element(n, Complex::new(0.0, 0.0));
    // 2 Re c e^(i theta): half the vector.
    let circle = ring::synthesised(&[zero, w.map(|z| z * 0.5)], count);
    let flat = CurveOfTorus {
        points: (0..count).flat_map(|_| u.iter().copied()).collect(),
        rotation: mu.arg() / TAU,
        lambda,
        section: 0.0,
    };
    let mut problem = TorusProblem::new(shots, &flat);
    problem.refer_to_circle(
        u,
        &circle
            .iter()
            .map(|x| x * largest * 1e-2)
            .collect::<Vec<f64>>(),
    );
    for amplitude in AMPLITUDES.map(|a| a * largest) {
        let direction = circle.iter().map(|x| x * amplitude / problem.size);
        let direction = DVector::from_vec(direction.chain([0.0]).collect());
        let x = problem.unknowns(&flat);
        let mut section = Section::new(&problem, (x, lambda), (direction.clone(), 0.0), options)?;
        let s = (options.weight * direction.norm_squared()).sqrt();
        if let Some(point) = section.at(&mut problem, s)? {
            let torus = problem.torus(&point.u, point.lambda);
            problem.refer_to(&torus);
            return Ok(Some((problem, torus)));
        }
    }
    Ok(None)
}

/// A first curve from successive points of an attractor, taken every response period, with their rotation per period.
pub(crate) fn from_record(
    points: &[f64],
    size: usize,
    (rotation, lambda): (f64, f64),
    count: usize,
) -> CurveOfTorus {
    let rough = coefficients(points, size, rotation, 2);
    let rotation = refined(points, size, rotation, &rough);
    let all = coefficients(points, size, rotation, (count - 1) / 2 + 1);
    CurveOfTorus {
        points: ring::synthesised(&all, count),
        rotation,
        lambda,
        section: 0.0,
    }
}

/// Coefficients of harmonics 0, 1, .. by weighted averages.
fn coefficients(
    points: &[f64],
    size: usize,
    rotation: f64,
    harmonics: usize,
) -> Vec<DVector<Complex<f64>>> {
    let one = |h: usize| {
        let part = |i: usize, wave: fn(f64) -> f64| {
            let values: Vec<f64> = (points.chunks_exact(size).enumerate())
                .map(|(k, x)| x[i] * wave(TAU * (h as f64 * k as f64 * rotation).fract()))
                .collect();
            weighted(&values)
        };
        DVector::from_fn(size, |i, _| {
            Complex::new(part(i, f64::cos), -part(i, f64::sin))
        })
    };
    (0..harmonics).map(one).collect()
}

/// The rotation from the steps of the first harmonic's angle, where that turns once per rotation.
fn refined(points: &[f64], size: usize, rotation: f64, rough: &[DVector<Complex<f64>>]) -> f64 {
    let angle = |x: &[f64]| {
        let parts = x.iter().zip(rough[0].iter().zip(rough[1].iter()));
        let sum: Complex<f64> = parts.map(|(x, (mean, c))| c.conj() * (x - mean.re)).sum();
        sum.arg() / TAU
    };
    let angles: Vec<f64> = points.chunks_exact(size).map(angle).collect();
    let steps = angles.windows(2).map(|w| {
        let step = w[1] - w[0] - rotation;
        step - step.round()
    });
    let mean = weighted(&steps.collect::<Vec<f64>>());
    if mean.abs() < 1e-3 {
        rotation + mean
    } else {
        rotation
    }
}
