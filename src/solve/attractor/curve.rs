//! Evidence that a record lies on an invariant curve.
//!
//! On an invariant curve, or on several that are visited in turn, the map is a rotation seen through a continuous function:
//!
//! ```text
//! x_k = X(k rho),    X(theta + 1) = X(theta)
//! ```
//!
//! rho is read off the spectrum and refined together with the Fourier coefficients of X. The coefficients come from the first two thirds
//! of the record; the last third is predicted. No fit predicts chaos, a slow transient or a long period: the first has no rho, the
//! second no X that stays, the third too few angles.
//!
//! A spiral towards a periodic orbit, slower than the record is long, nearly fits too. So X has no more harmonics than the widest gap
//! between the angles allows, and the best returns are looked at besides ([`BestReturns`]): their lags are denominators of rho, and an orbit
//! to which the points are drawn has such a period.

use super::geometry::Cloud;
use super::returns::BestReturns;
use crate::numeric::fourier::Fourier;
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};

/// An invariant curve as a record shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InvariantCurve {
    /// Curves that are visited in turn.
    pub loops: usize,
    /// Rotation per `loops` iterates, in (0, 1).
    pub rotation: f64,
    /// R.m.s. error of the prediction relative to the size of the curve.
    pub error: f64,
    /// The same from the first half of the record.
    pub error_of_half: f64,
    /// The best recurrences of the record.
    pub(super) returns: BestReturns,
}

/// Points looked at.
pub(super) const LARGEST: usize = 4096;
/// Points on one curve below which nothing is said.
const LEAST: usize = 60;
/// Harmonics of the curve at most.
const HARMONICS: usize = 40;
/// Points per harmonic at least.
const PER_HARMONIC: usize = 8;
/// Lines of the spectrum that are tried, and the parts of the rotation number that they may be multiples of.
const LINES: usize = 3;
const MULTIPLES: usize = 3;
/// Refinements of the rotation number.
const REFINEMENTS: usize = 4;

/// The curve on which the points lie; `None` where they show no rotation.
pub(super) fn invariant_curve(cloud: &Cloud<'_>) -> Option<InvariantCurve> {
    let first = cloud.count().saturating_sub(LARGEST);
    let returns = BestReturns::of(cloud, LARGEST)?;
    let loops = returns.loops;
    let points: Vec<&[f64]> = (first..cloud.count())
        .step_by(loops)
        .map(|k| cloud.point(k))
        .collect();
    if points.len() < LEAST {
        return None;
    }
    let motion = CurvePoints::new(&points, &cloud.scale);
    let half = CurvePoints::new(&points[..points.len() / 2], &cloud.scale);
    let rough = |rho: &f64| motion.prediction(*rho, 6);
    let candidates = candidates(&motion.widest());
    let found = candidates.iter().filter_map(rough);
    let (_, rho) = found.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (error, rotation) = motion.prediction(rho, HARMONICS)?;
    let error_of_half = half
        .prediction(rotation, HARMONICS)
        .map_or(f64::INFINITY, |p| p.0);
    Some(InvariantCurve {
        loops,
        rotation: rotation.rem_euclid(1.0),
        error,
        error_of_half,
        returns,
    })
}

/// Successive points of one curve, scaled, without their mean.
struct CurvePoints {
    /// One row per point.
    points: DMatrix<f64>,
}

impl CurvePoints {
    fn new(points: &[&[f64]], scale: &[f64]) -> CurvePoints {
        let mut matrix =
            DMatrix::from_fn(points.len(), scale.len(), |k, i| points[k][i] / scale[i]);
        for mut column in matrix.column_iter_mut() {
            let mean = column.mean();
            column.add_scalar_mut(-mean);
        }
        CurvePoints { points: matrix }
    }

    /// The coordinate that varies most.
    fn widest(&self) -> Vec<f64> {
        let columns = self.points.column_iter();
        let widest = columns.max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        widest.map_or(Vec::new(), |c| c.iter().copied().collect())
    }

    /// Error with which the first two thirds predict the last, and the refined rotation number.
    fn prediction(&self, mut rho: f64, harmonics: usize) -> Option<(f64, f64)> {
        let (count, size) = self.points.shape();
        let known = 2 * count / 3;
        for refinement in 0..=REFINEMENTS {
            let harmonics = harmonics.min(resolved(rho, known));
            if harmonics < 4 {
                return None;
            }
            let basis = basis(rho, count, harmonics);
            let gram = gram(rho, known, harmonics).cholesky()?;
            let right = basis.rows(0, known).tr_mul(&self.points.rows(0, known));
            let coefficients = gram.solve(&right);
            let error = &self.points - &basis * &coefficients;
            if refinement == REFINEMENTS {
                let missed = error.rows(known, count - known).norm_squared();
                let all = self.points.norm_squared();
                let share = missed / (count - known) as f64 / (all / count as f64);
                return Some((share.sqrt(), rho));
            }
            rho += shift(&error, &slopes(&coefficients, &basis), known, size);
        }
        None
    }
}

/// Rows (1, cos 2 pi theta, sin 2 pi theta, cos 4 pi theta, ..), theta = k rho.
fn basis(rho: f64, count: usize, harmonics: usize) -> DMatrix<f64> {
    let mut basis = DMatrix::from_element(count, 2 * harmonics + 1, 1.0);
    let first: Vec<(f64, f64)> = (0..count)
        .map(|k| (TAU * (k as f64 * rho).fract()).sin_cos())
        .collect();
    let mut angles = vec![(0.0, 1.0); count];
    for h in 0..harmonics {
        for (k, ((s, c), (s1, c1))) in angles.iter_mut().zip(&first).enumerate() {
            (*s, *c) = (*s * c1 + *c * s1, *c * c1 - *s * s1);
            (basis[(k, 2 * h + 1)], basis[(k, 2 * h + 2)]) = (*c, *s);
        }
    }
    basis
}

/// Products of the basis functions summed over the first `known` points, from the sums of their sums and differences:
///
/// ```text
/// sum of e^(2 pi i j k rho), k = 0 .. K - 1  =  sin(pi K x) / sin(pi x) e^(pi i (K - 1) x),    x = j rho
/// ```
fn gram(rho: f64, known: usize, harmonics: usize) -> DMatrix<f64> {
    let sums: Vec<(f64, f64)> = (0..=2 * harmonics)
        .map(|j| {
            let x = (j as f64 * rho).fract();
            let count = known as f64;
            let size = match (PI * x).sin() {
                0.0 => count,
                below => (PI * count * x).sin() / below,
            };
            let (s, c) = (PI * (count - 1.0) * x).sin_cos();
            (size * s, size * c)
        })
        .collect();
    let mut gram = DMatrix::zeros(2 * harmonics + 1, 2 * harmonics + 1);
    for h in 0..=harmonics {
        for m in 0..=h {
            let ((s1, c1), (s2, c2)) = (sums[h - m], sums[h + m]);
            let mut set = |row: usize, column: usize, value: f64| {
                (gram[(row, column)], gram[(column, row)]) = (value, value);
            };
            let (cos_h, cos_m) = ((2 * h).saturating_sub(1), (2 * m).saturating_sub(1));
            set(cos_h, cos_m, 0.5 * (c1 + c2));
            if h > 0 {
                set(2 * h, cos_m, 0.5 * (s2 + s1));
            }
            if m > 0 {
                set(2 * h, 2 * m, 0.5 * (c1 - c2));
                set(cos_h, 2 * m, 0.5 * (s2 - s1));
            }
        }
    }
    gram
}

/// dX/dtheta at every point.
fn slopes(coefficients: &DMatrix<f64>, basis: &DMatrix<f64>) -> DMatrix<f64> {
    let mut turned = DMatrix::zeros(coefficients.nrows(), coefficients.ncols());
    for h in 0..coefficients.nrows() / 2 {
        let w = TAU * (h + 1) as f64;
        for i in 0..coefficients.ncols() {
            turned[(2 * h + 1, i)] = w * coefficients[(2 * h + 2, i)];
            turned[(2 * h + 2, i)] = -w * coefficients[(2 * h + 1, i)];
        }
    }
    basis * turned
}

/// Change of the rotation number that takes out most of a residual.
fn shift(error: &DMatrix<f64>, slopes: &DMatrix<f64>, known: usize, size: usize) -> f64 {
    let (mut mixed, mut own) = (0.0, 0.0);
    for k in 0..known {
        let time = k as f64 - 0.5 * (known - 1) as f64;
        for i in 0..size {
            let change = time * slopes[(k, i)];
            mixed += change * error[(k, i)];
            own += change * change;
        }
    }
    if own > 0.0 { mixed / own } else { 0.0 }
}

/// Harmonics that the angles of a rotation resolve: some points to each, and two at least in its length everywhere.
fn resolved(rho: f64, count: usize) -> usize {
    let gaps = gaps(rho, count);
    let widest = gaps.iter().fold(0.0_f64, |m, gap| m.max(*gap));
    (distinct(&gaps) / PER_HARMONIC).min((0.5 / widest) as usize)
}

/// Distances between neighbouring angles of a rotation, in turns.
fn gaps(rho: f64, count: usize) -> Vec<f64> {
    let mut angles: Vec<f64> = (0..count)
        .map(|k| (k as f64 * rho).rem_euclid(1.0))
        .collect();
    angles.sort_by(f64::total_cmp);
    let closing = angles[0] + 1.0 - angles[count - 1];
    let between = angles.windows(2).map(|w| w[1] - w[0]);
    between.chain([closing]).collect()
}

/// Angles that are apart from each other by a quarter of their mean distance.
fn distinct(gaps: &[f64]) -> usize {
    let apart = 0.25 / gaps.len() as f64;
    gaps.iter().filter(|gap| **gap > apart).count()
}

/// Rotation numbers that the strongest lines of a series may represent.
fn candidates(series: &[f64]) -> Vec<f64> {
    let lines = lines(series);
    let mut list = Vec::new();
    for multiple in 1..=MULTIPLES {
        for line in &lines {
            let shifts = 0..multiple;
            list.extend(shifts.map(|j| (line + j as f64) / multiple as f64));
        }
    }
    list
}

/// Frequencies of the strongest lines, in (0, 1/2).
fn lines(series: &[f64]) -> Vec<f64> {
    let count = series.len();
    let window = |k: usize| 1.0 - (TAU * (k as f64 + 0.5) / count as f64).cos();
    let windowed: Vec<f64> = (0..count).map(|k| series[k] * window(k)).collect();
    let samples = (4 * count).next_power_of_two();
    let mut padded = windowed;
    padded.resize(samples, 0.0);
    let mut coefficients = vec![0.0; samples - 1];
    Fourier::new(samples).to_coefficients(&padded, &mut coefficients);
    let power: Vec<f64> = coefficients[1..]
        .chunks_exact(2)
        .map(|c| c[0] * c[0] + c[1] * c[1])
        .collect();
    // Bin k of the transform is power[k - 1]. The window's own width is two bins of the record.
    let width = 2 * samples / count;
    let mut peaks: Vec<usize> = (width..power.len().saturating_sub(1))
        .filter(|k| power[*k] > power[k - 1] && power[*k] >= power[k + 1])
        .collect();
    peaks.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    peaks.truncate(LINES);
    let frequency = |k: usize| {
        // Vertex of the parabola through the logarithms.
        let [a, b, c] =
            [power[k - 1], power[k], power[k + 1]].map(|x| x.max(f64::MIN_POSITIVE).ln());
        let bend = a - 2.0 * b + c;
        let offset = if bend < 0.0 {
            0.5 * (a - c) / bend
        } else {
            0.0
        };
        (k as f64 + 1.0 + offset) / samples as f64
    };
    peaks.into_iter().map(frequency).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    #[test]
    fn a_rational_rotation_has_few_angles() {
        assert_eq!(distinct(&gaps(3.0 / 16.0, 200)), 16);
        assert_eq!(distinct(&gaps(0.618_033_988_749_895, 200)), 200);
    }

    #[test]
    fn arcs_that_leave_gaps_resolve_few_harmonics() {
        // 80 angles on two arcs of 0.16 turns.
        assert_eq!(resolved(0.502, 80), 1);
        assert_eq!(resolved(0.618_033_988_749_895, 80), 10);
    }

    #[test]
    fn lines_stand_at_the_frequencies() {
        let series: Vec<f64> = (0..300)
            .map(|k| {
                (TAU * 0.1234 * f64::from(k)).cos() + 0.3 * (TAU * 0.3456 * f64::from(k)).sin()
            })
            .collect();
        let found = lines(&series);
        assert!((found[0] - 0.1234).abs() < 1e-4, "{found:?}");
        assert!((found[1] - 0.3456).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn products_are_summed_in_closed_form() {
        for rho in [0.1234567, 0.5, 1e-9, 0.99] {
            let basis = basis(rho, 90, 5);
            let gap = gram(rho, 60, 5) - basis.rows(0, 60).tr_mul(&basis.rows(0, 60));
            assert!(gap.amax() < 1e-11, "{rho}: {gap}");
        }
    }

    #[test]
    fn coefficients_have_slopes() {
        let basis = basis(0.1, 7, 3);
        let mut coefficients = DMatrix::zeros(7, 1);
        coefficients[(3, 0)] = 2.0;
        let slope = slopes(&coefficients, &basis);
        let wanted = DVector::from_fn(7, |k, _| -4.0 * TAU * (2.0 * TAU * 0.1 * k as f64).sin());
        assert!((slope.column(0) - wanted).amax() < 1e-12);
    }
}
