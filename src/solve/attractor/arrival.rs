//! Whether a record has arrived at an attracting orbit.

use super::LEAST_POINTS;
use super::cycle::{Cycle, OrbitSearch};
use super::geometry::{Cloud, distance};
use super::map::Map;
use crate::solve::floquet;
use nalgebra::DVector;

/// Share of the contraction of a lap that its nonlinear part may undo.
const LINEAR: f64 = 0.1;
/// Laps that have to be linear.
const LAPS: usize = 3;
/// Distance from an orbit, relative to the scale, at which a record has arrived; in errors of the map where that is more.
const ARRIVED: (f64, f64) = (1e-9, 1e3);
/// Attempts from the end of one record.
const ATTEMPTS: usize = 4;
/// Best recurrence that makes a lag worth an attempt, relative to the extent of the record and to its scale.
const RECURRENT: (f64, f64) = (0.2, 1e-6);
/// Largest modulus of the eigenvalues of the last lap's derivative for an attempt: near an attracting orbit it is that of its
/// leading multiplier.
const LAST_LAP: f64 = 1.01;

/// The attracting orbit on which a record ends: its last laps follow the linear part of the return map, so closely that what is
/// left of the distance must vanish, or have arrived.
///
/// ```text
/// e_k = x_k - u,    |e_(k+n) - Phi e_k| <= 0.1 (1 - |mu|) |e_k|
/// ```
pub fn settled(map: &mut dyn Map, cloud: &Cloud<'_>, longest: usize) -> Option<Cycle> {
    let lags = recurrent_lags(cloud, longest);
    let budget = 2 * cloud.count() + 4 * lags.first().copied().unwrap_or(0) + 64;
    let error = map.error();
    let mut search = OrbitSearch::new(map, cloud, budget);
    let start = cloud.count() - 1;
    lags.into_iter().find_map(|lag| {
        let mut lap = cloud.derivative(start - lag, lag);
        if lap.is_none() && cloud.count() < LEAST_POINTS {
            lap = Some(search.lap(cloud.point(start - lag), lag)?);
        }
        let expands = |phi| {
            let leading = floquet::multipliers_and_neutral(&phi, 0).0;
            leading.first().is_none_or(|mu| mu.norm() > LAST_LAP)
        };
        if lap.is_some_and(expands) {
            return None;
        }
        let cycle = search.attracting(cloud.last(), lag)?;
        has_arrived(&cycle, cloud, error).then_some(cycle)
    })
}

/// The orbit from its point nearest the end of a record, if the record has arrived there.
pub fn captured(cycle: &Cycle, cloud: &Cloud<'_>, error: f64) -> Option<Cycle> {
    let size = cloud.size;
    let gap = |k: &usize| {
        distance(
            &cycle.points[k * size..(k + 1) * size],
            cloud.last(),
            &cloud.scale,
        )
    };
    let nearest = (0..cycle.period).min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
    // The transition matrix belongs to the first point: the record is looked at where it passed there.
    let is_long = cloud.count() > nearest;
    (is_long && has_arrived(cycle, &cloud.without(nearest), error)).then(|| cycle.clone())
}

/// Whether the last laps of a record approach the first point of an orbit.
pub fn has_arrived(cycle: &Cycle, cloud: &Cloud<'_>, error: f64) -> bool {
    let (count, n) = (cloud.count(), cycle.period);
    if count <= n {
        return false;
    }
    let u = &cycle.points[..cloud.size];
    let deviation = |k: usize| {
        let difference = cloud.point(k).iter().zip(u).map(|(x, u)| x - u);
        DVector::from_iterator(cloud.size, difference)
    };
    let length = |e: &DVector<f64>| {
        let parts = e.iter().zip(&cloud.scale).map(|(e, s)| (e / s).abs());
        parts.fold(0.0, f64::max)
    };
    let gap = 1.0 - cycle.multipliers[0].norm();
    let arrived = ARRIVED.0.max(ARRIVED.1 * error);
    let last = deviation(count - 1);
    if length(&last) <= arrived {
        return true;
    }
    let laps = LAPS.min((count - 1) / n);
    laps > 0
        && (1..=laps).all(|lap| {
            let (before, after) = (
                deviation(count - 1 - lap * n),
                deviation(count - 1 - (lap - 1) * n),
            );
            let nonlinear = after - &cycle.phi * &before;
            length(&nonlinear) <= LINEAR * gap * length(&before)
        })
}

/// Lags at which the end of a record repeats, the most promising first: the shortest of about the best recurrence, then those
/// that repeat better than all shorter ones.
fn recurrent_lags(cloud: &Cloud<'_>, longest: usize) -> Vec<usize> {
    let largest = longest.min(cloud.count().saturating_sub(1));
    let gaps: Vec<f64> = (1..=largest).map(|n| cloud.end_recurrence(n)).collect();
    let limit = (RECURRENT.0 * cloud.extent()).max(RECURRENT.1);
    let best = gaps.iter().fold(f64::INFINITY, |m, g| m.min(*g));
    if best > limit {
        return Vec::new();
    }
    let near = gaps.iter().position(|g| *g <= 10.0 * best + 1e-10);
    let mut lags: Vec<usize> = near.map(|k| k + 1).into_iter().collect();
    let mut least = limit;
    for (k, gap) in gaps.iter().enumerate() {
        if *gap < least {
            least = *gap;
            if !lags.contains(&(k + 1)) {
                lags.push(k + 1);
            }
        }
    }
    lags.truncate(ATTEMPTS);
    lags
}

/// Period of a record alone, where the derivative of the map is not known: every point repeats to `repeat` at least three
/// times, and what is left falls at least by half from the first half of the record to the second, or has vanished.
pub fn repeats(cloud: &Cloud<'_>, longest: usize) -> Option<usize> {
    (1..=longest)
        .take_while(|n| (REPEATS + 1) * n <= cloud.count())
        .find(|n| {
            let (first, second) = cloud.recurrence_halves(*n);
            first.max(second) <= REPEAT && (second <= VANISHED || second <= 0.5 * first)
        })
}

/// Tolerance of a repeat, relative to the largest modulus of the coordinate.
const REPEAT: f64 = 1e-6;
/// Repeats wanted.
const REPEATS: usize = 3;
/// A repeat that is exact but for rounding.
const VANISHED: f64 = 1e-11;
