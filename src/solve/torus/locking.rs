//! Tori that end because their rotation locks.
//!
//! Where the rotation rho tends to a ratio p/q, two periodic orbits of q maps are born on the torus by a fold. Before it the motion lingers
//! where they will be, and the distance from the ratio is a square root:
//!
//! ```text
//! (rho - p/q)^2 ~ c (lambda_0 - lambda)
//! ```
//!
//! Such a law alone proves nothing. The fold itself is located, on orbits that lie on the torus; only then is the end a locking.

use super::{TorusPoint, TorusProblem};
use crate::error::SolveError;
use crate::solve::curve::{CurveKind, Shots, Spot, corrected};

/// Largest number of maps of a ratio.
const LONGEST: usize = 24;
/// Ratios whose fold is looked for.
const RATIOS: usize = 4;
/// Tori from the end by which the root is extrapolated.
const BEHIND: usize = 4;
/// Distance of the fold from the last torus, in distances of the extrapolation, and of the extrapolation in lengths of the last tori.
const AHEAD: (f64, f64) = (3.0, 8.0);
/// Places on the curve from which the orbit is looked for: those to which the map comes back most closely.
const PLACES: usize = 3;
/// Distance of the orbit from the curve, in extents of the curve.
const ON_CURVE: f64 = 0.1;

/// A ratio at which the rotation locks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Locked {
    /// Turns.
    pub turns: usize,
    /// Maps.
    pub maps: usize,
    /// Share of the parameter at which the orbits fold.
    pub lambda: f64,
}

/// Ratios to which the rotation tends beyond the last torus, the fewest maps first, each with the extrapolated share.
fn ratios(points: &[TorusPoint]) -> Vec<Locked> {
    let Some(k) = points.len().checked_sub(BEHIND) else {
        return Vec::new();
    };
    let of = |p: &TorusPoint| (p.torus.lambda, p.torus.rotation.rem_euclid(1.0));
    let ((from, before), (to, last)) = (of(&points[k]), of(&points[points.len() - 1]));
    let mut list: Vec<Locked> = Vec::new();
    for maps in 1..=LONGEST {
        let turns = last * maps as f64;
        for turns in [turns.floor(), turns.ceil()] {
            let ratio = turns / maps as f64;
            let known = |known: &Locked| known.turns as f64 / known.maps as f64 == ratio;
            let (a, b) = ((before - ratio).powi(2), (last - ratio).powi(2));
            let ahead = (to - from) * b / (a - b);
            let is_near = a > b && ahead.abs() < AHEAD.1 * (to - from).abs();
            if is_near && !list.iter().any(known) {
                list.push(Locked {
                    turns: turns as usize,
                    maps,
                    lambda: to + ahead,
                });
            }
        }
    }
    list.truncate(RATIOS);
    list
}

/// The ratio at which tori lock behind the last one of a path; `repeated` gives the flow over a number of maps. `None` where no fold of
/// orbits that lie on the torus is found.
///
/// # Errors
/// An interruption, or errors of the flow.
pub(crate) fn locking<'a>(
    problem: &mut TorusProblem<'_>,
    points: &[TorusPoint],
    repeated: &mut dyn FnMut(usize, f64) -> Result<Shots<'a>, SolveError>,
) -> Result<Option<Locked>, SolveError> {
    let Some(last) = points.last() else {
        return Ok(None);
    };
    for ratio in ratios(points) {
        let mut shots = repeated(ratio.maps, last.torus.lambda)?;
        problem.refer_to(&last.torus);
        let curve = problem.transported(&last.torus, 0.0)?.points;
        for start in lingering(&mut shots, (&curve, last.torus.lambda))? {
            let spot = Spot {
                u: start,
                p: [ratio.lambda, 0.0],
                extra: 0.0,
            };
            let (back, found) = match corrected(shots, CurveKind::Fold, &spot) {
                Err(SolveError::NoSystem { .. }) => return Ok(None),
                found => found?,
            };
            shots = back;
            let reach = (ratio.lambda - last.torus.lambda) * AHEAD.0;
            let is_ahead = |found: &Spot| {
                let ahead = (found.p[0] - last.torus.lambda) / reach;
                (0.0..=1.0).contains(&ahead) && is_on(&curve, &found.u)
            };
            if let Some(found) = found.filter(is_ahead) {
                let lambda = found.p[0];
                return Ok(Some(Locked { lambda, ..ratio }));
            }
        }
    }
    Ok(None)
}

/// The states of a curve that come back most closely.
fn lingering(
    shots: &mut Shots<'_>,
    (curve, lambda): (&[f64], f64),
) -> Result<Vec<Vec<f64>>, SolveError> {
    let mut list: Vec<(f64, Vec<f64>)> = Vec::new();
    for state in curve.chunks_exact(shots.size()) {
        let mut image = state.to_vec();
        let span = (0.0, std::f64::consts::TAU);
        if shots.map([lambda, 0.0], span, (&mut image, None))? {
            list.push((distance(state, &image), state.to_vec()));
        }
    }
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(list
        .into_iter()
        .take(PLACES)
        .map(|(_, state)| state)
        .collect())
}

/// Whether a state lies on a curve.
fn is_on(curve: &[f64], state: &[f64]) -> bool {
    let points = || curve.chunks_exact(state.len());
    let nearest = points().map(|p| distance(p, state));
    let Some(first) = points().next() else {
        return false;
    };
    let extent = points().map(|p| distance(p, first)).fold(0.0, f64::max);
    nearest.fold(f64::INFINITY, f64::min) < ON_CURVE * extent
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let gaps = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    gaps.sum::<f64>().sqrt()
}
