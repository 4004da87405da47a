//! What kind of attractor a record of Poincaré points shows.
//!
//! The criterion, in this order. A label is given only when the record supports it; everything else is `undecided`.
//!
//! - **period n**: every point of the record repeats after n periods to [`REPEAT`] of the largest modulus that its
//!   coordinate takes in the record (a point of an attractor of period 1 has no other size; a coordinate that nearly
//!   vanishes is measured by a thousandth of the largest one); the smallest such n up to
//!   [`LONGEST`], with at least [`REPEATS`] repeats inside the record. A largest exponent that is significantly positive
//!   contradicts it: undecided.
//! - **chaotic**: the largest Lyapunov exponent is more than [`SIGMAS`] standard errors above 0 and has stretched small
//!   deviations by at least e^[`STRETCH`] over the record. Never without exponents.
//! - **quasi-periodic**: the largest exponent is within [`SIGMAS`] standard errors of 0 (or has changed deviations by less
//!   than a factor e over the record) and has stretched them by no more than e^[`STRETCH`] in all, the 0-1 test of Gottwald and Melbourne on the points gives regular motion
//!   (K < [`REGULAR`]), and the record does not close in on a periodic orbit: its best recurrence neither halves from the
//!   first half of the record to the second nor falls below [`CLOSE`] (a slow transient cannot be told from a torus then).
//!   Without exponents the 0-1 test decides alone,
//!   more strictly (K < [`STRICTLY_REGULAR`]). At least [`LEAST_POINTS`] points. Never where [`excludes_tori`] holds.

use super::lyapunov::Exponents;
use crate::system::{Mount, System};

/// Tolerance of a repeat, relative to the largest modulus of the coordinate.
pub const REPEAT: f64 = 1e-6;
/// Longest period looked for.
pub const LONGEST: usize = 64;
/// Repeats wanted.
pub const REPEATS: usize = 3;
/// Standard errors that make an exponent significant.
pub const SIGMAS: f64 = 3.0;
/// Logarithm of the stretching over the record: at least that of a chaotic attractor, at most that of a torus.
pub const STRETCH: f64 = 3.0;
/// K of the 0-1 test below which motion counts as regular, when the exponent says so too.
pub const REGULAR: f64 = 0.5;
/// The same when there is no exponent.
pub const STRICTLY_REGULAR: f64 = 0.2;
/// Best recurrence, relative to the largest modulus of the coordinate, below which a torus is not claimed.
pub const CLOSE: f64 = 1e-3;
/// Points below which a record is too short for the 0-1 test.
pub const LEAST_POINTS: usize = 100;

/// Kind of an attractor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Label {
    /// Repeats after so many periods of the excitation.
    Period(usize),
    /// Points on closed curves.
    QuasiPeriodic,
    /// Neighbouring motions separate exponentially.
    Chaotic,
    /// The record does not tell.
    Undecided,
}

impl std::fmt::Display for Label {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Label::Period(n) => write!(f, "period {n}"),
            Label::QuasiPeriodic => f.write_str("quasi-periodic"),
            Label::Chaotic => f.write_str("chaotic"),
            Label::Undecided => f.write_str("undecided"),
        }
    }
}

/// Label of a record of successive Poincaré points, `size` values each, with its Lyapunov exponents if there are any.
pub fn label(points: &[f64], size: usize, exponents: Option<&Exponents>) -> Label {
    let count = points.len() / size.max(1);
    if count == 0 || points.iter().any(|x| !x.is_finite()) {
        return Label::Undecided;
    }
    let largest = exponents.and_then(|e| Some((*e.values.first()?, e.error, e.span)));
    let is_stretching = largest
        .is_some_and(|(value, error, span)| value > SIGMAS * error && value * span > STRETCH);
    match (period(points, size), is_stretching) {
        (Some(_), true) => return Label::Undecided,
        (Some(n), false) => return Label::Period(n),
        (None, true) => return Label::Chaotic,
        (None, false) => {}
    }
    if count < LEAST_POINTS {
        return Label::Undecided;
    }
    let is_neutral = largest.is_none_or(|(value, error, span)| {
        let is_small = value.abs() <= (SIGMAS * error).max(1.0 / span);
        error.is_finite() && is_small && value * span <= STRETCH
    });
    let limit = if largest.is_some() {
        REGULAR
    } else {
        STRICTLY_REGULAR
    };
    if is_neutral && !closes_in(points, size) && growth(&widest(points, size)) < limit {
        Label::QuasiPeriodic
    } else {
        Label::Undecided
    }
}

/// Whether a system has no quasi-periodic motion, whatever a record looks like: one coordinate, damped everywhere.
///
///     d(q', v')/d(q, v):  trace = -(Gam + sum_e kappa_e W_e df_e/dv) < 0
///
/// The Poincaré map of one coordinate is a map of the plane. A closed curve that it maps onto itself bounds a disk that it
/// maps onto itself, which a map that shrinks every area cannot do. (Without damping areas stay, and such curves abound;
/// from two coordinates on the plane is no longer the whole state.)
pub fn excludes_tori(system: &System) -> bool {
    let takes_energy = |(e, mount): (usize, &Mount)| {
        let element = mount.element.as_ref();
        let weight = system.stiffness()[(0, e)] * system.element_map()[(e, 0)];
        let is_steady = weight >= 0.0 && mount.stiffness_variation.is_none();
        !element.depends_on_velocity() || (is_steady && element.is_passive())
    };
    system.dof() == 1
        && system.damping()[(0, 0)] > 0.0
        && system.mounts().iter().enumerate().all(takes_energy)
}

/// Smallest period of the points.
fn period(points: &[f64], size: usize) -> Option<usize> {
    let count = points.len() / size;
    let scale = moduli(points, size);
    (1..=LONGEST)
        .take_while(|n| (REPEATS + 1) * n <= count)
        .find(|n| recurrence(points, &scale, *n) <= REPEAT)
}

/// Largest modulus of every coordinate, at least a thousandth of the largest of all.
fn moduli(points: &[f64], size: usize) -> Vec<f64> {
    let mut scale = vec![0.0_f64; size];
    for point in points.chunks_exact(size) {
        for (s, x) in scale.iter_mut().zip(point) {
            *s = s.max(x.abs());
        }
    }
    // A coordinate that nearly vanishes at this phase holds the errors of the others.
    let largest = scale.iter().fold(f64::MIN_POSITIVE, |m, s| m.max(*s));
    scale.iter().map(|s| s.max(1e-3 * largest)).collect()
}

/// Largest change over n periods relative to the scale.
fn recurrence(points: &[f64], scale: &[f64], n: usize) -> f64 {
    let size = scale.len();
    let mut worst = 0.0_f64;
    for (before, after) in points
        .chunks_exact(size)
        .zip(points.chunks_exact(size).skip(n))
    {
        for ((a, b), s) in before.iter().zip(after).zip(scale) {
            worst = worst.max((a - b).abs() / s);
        }
        if worst > 1.0 {
            break;
        }
    }
    worst
}

/// Whether the best recurrence of the second half of the record is less than half of that of the first, or small: a transient.
fn closes_in(points: &[f64], size: usize) -> bool {
    let scale = moduli(points, size);
    let middle = points.len() / size / 2 * size;
    let longest = LONGEST.min(middle / size / 2);
    let best = |half: &[f64]| {
        (1..=longest)
            .map(|n| recurrence(half, &scale, n))
            .fold(f64::INFINITY, f64::min)
    };
    best(&points[middle..]) < CLOSE.max(0.5 * best(&points[..middle]))
}

/// The coordinate that varies most, without its mean.
fn widest(points: &[f64], size: usize) -> Vec<f64> {
    let centred = |i: usize| {
        let series: Vec<f64> = points.iter().skip(i).step_by(size).copied().collect();
        let mean = series.iter().sum::<f64>() / series.len() as f64;
        series.into_iter().map(|x| x - mean).collect::<Vec<f64>>()
    };
    let energy = |series: &[f64]| series.iter().map(|x| x * x).sum::<f64>();
    let all = (0..size).map(centred);
    all.max_by(|a, b| energy(a).total_cmp(&energy(b)))
        .unwrap_or_default()
}

/// Frequencies over which the 0-1 test takes the median.
const FREQUENCIES: usize = 100;

/// K of the 0-1 test: near 0 for regular motion, near 1 for chaos. `series` without its mean.
///
///     p_c(n) + i s_c(n) = sum_(j <= n) x_j exp(i c j),  M_c(n) = mean |p(j + n) - p(j)|^2,  K = median_c corr(n, M_c(n))
///
/// n runs to a quarter of the record: in records of a few hundred points a slow beat between c and the motion would
/// otherwise look like growth (rotations then keep K below 0.1, chaotic maps above 0.9). G. A. Gottwald and I. Melbourne, On the implementation of the 0-1 test for chaos, SIAM J. Appl. Dyn. Syst. 8 (2009).
fn growth(series: &[f64]) -> f64 {
    let lags = series.len() / 4;
    let mut list: Vec<f64> = (0..FREQUENCIES)
        .map(|k| {
            // Equally spaced in (pi/5, 4 pi/5), away from the resonances at its ends.
            let share = (k as f64 + 0.5) / FREQUENCIES as f64;
            correlation(&displacements(
                series,
                std::f64::consts::PI * (0.2 + 0.6 * share),
                lags,
            ))
        })
        .collect();
    list.sort_by(f64::total_cmp);
    list[FREQUENCIES / 2]
}

/// Mean square displacement over 1..=lags steps.
fn displacements(series: &[f64], c: f64, lags: usize) -> Vec<f64> {
    let mut path = vec![(0.0, 0.0)];
    let (mut p, mut s) = (0.0, 0.0);
    for (j, x) in series.iter().enumerate() {
        let (sin, cos) = (c * (j + 1) as f64).sin_cos();
        p += x * cos;
        s += x * sin;
        path.push((p, s));
    }
    let count = path.len() - lags;
    let mean = |n: usize| {
        let squares = (0..count).map(|j| {
            let (a, b) = (path[j], path[j + n]);
            (b.0 - a.0).powi(2) + (b.1 - a.1).powi(2)
        });
        squares.sum::<f64>() / count as f64
    };
    (1..=lags).map(mean).collect()
}

/// Correlation of a series with its index; 0 for a constant one.
fn correlation(series: &[f64]) -> f64 {
    let count = series.len() as f64;
    let (middle, mean) = ((count - 1.0) / 2.0, series.iter().sum::<f64>() / count);
    let (mut mixed, mut own, mut index) = (0.0, 0.0, 0.0);
    for (n, x) in series.iter().enumerate() {
        let (n, x) = (n as f64 - middle, x - mean);
        mixed += n * x;
        own += x * x;
        index += n * n;
    }
    if own > 0.0 {
        mixed / (own * index).sqrt()
    } else {
        0.0
    }
}
