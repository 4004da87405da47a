//! Attracting periodic orbits among the points of a record that has not settled on one: the sign of a long transient.
//!
//! A chaotic transient wanders around an attracting orbit before it is caught, and passes it closely time and again. Where a record nearly
//! repeats for a while, Newton's iteration finds the orbit that it passes.

use super::cycle::{Cycle, OrbitSearch};
use super::geometry::{Cloud, distance};
use super::map::Map;
use crate::solve::floquet;
use nalgebra::{DMatrix, DVector};

/// Longest period looked for.
const LONGEST: usize = 24;
/// Near repeats, relative to the extent of the record.
const NEAR: f64 = 0.2;
/// Near repeats tried for every lag.
const REPEATS: usize = 24;
/// Guesses per lag.
const PER_LAG: usize = 6;
/// Largest modulus of the eigenvalues of a near repeat's derivative that makes it worth an attempt.
const EXPANSION: f64 = 16.0;

/// A near repeat.
struct OrbitGuess {
    lag: usize,
    /// Where Newton's first step leads, by the derivatives along the record.
    state: Vec<f64>,
    /// Largest modulus of the eigenvalues of the derivative of the iterates between.
    expansion: f64,
    /// Place among the guesses of the same lag, by expansion.
    rank: usize,
}

/// An attracting orbit among the points, found with at most `effort` iterates of the map.
///
/// The derivatives along the record tell without integrating where Newton's iteration would go and whether an orbit there is likely
/// to attract: the likeliest are tried.
pub(super) fn orbit(
    map: &mut dyn Map,
    cloud: &Cloud<'_>,
    (effort, reach): (usize, f64),
) -> Option<Cycle> {
    let near = NEAR * cloud.extent();
    let mut guesses: Vec<OrbitGuess> = (1..=LONGEST.min(cloud.count() / 4))
        .flat_map(|lag| guesses_after(cloud, lag, near))
        .collect();
    // Short ones first, since they cost least, and the best of every lag before the others.
    guesses.sort_by_key(|g| (g.lag * (g.rank + 1), g.lag));
    let mut search = OrbitSearch::new(map, cloud, effort);
    guesses.iter().find_map(|guess| {
        let cycle = search.attracting_beyond_saddle(&guess.state, guess.lag)?;
        is_within_reach(&cycle.points, cloud, reach).then_some(cycle)
    })
}

/// The best guesses among the nearest repeats after a number of iterates.
fn guesses_after(cloud: &Cloud<'_>, lag: usize, near: f64) -> Vec<OrbitGuess> {
    let mut list: Vec<(f64, usize)> = (0..cloud.count() - lag)
        .map(|k| (cloud.lag(k, lag), k))
        .filter(|(gap, _)| *gap <= near)
        .collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    list.truncate(REPEATS);
    let mut guesses: Vec<OrbitGuess> = (list.iter())
        .filter_map(|(_, k)| guess(cloud, lag, *k, near))
        .collect();
    guesses.sort_by(|a, b| a.expansion.total_cmp(&b.expansion));
    guesses.truncate(PER_LAG);
    for (rank, guess) in guesses.iter_mut().enumerate() {
        guess.rank = rank;
    }
    guesses
}

/// A near repeat from which Newton's first step stays near, and around which little expands.
fn guess(cloud: &Cloud<'_>, lag: usize, start: usize, near: f64) -> Option<OrbitGuess> {
    let phi = cloud.derivative(start, lag)?;
    let (from, to) = (cloud.point(start), cloud.point(start + lag));
    let mut step = DVector::from_fn(cloud.size, |i, _| to[i] - from[i]);
    let matrix = DMatrix::identity(cloud.size, cloud.size) - &phi;
    if !matrix.lu().solve_mut(&mut step) {
        return None;
    }
    let parts = step.iter().zip(&cloud.scale).map(|(x, s)| (x / s).abs());
    let is_near = parts.fold(0.0, f64::max) <= 2.0 * near;
    let expansion = is_near.then(|| floquet::multipliers(&phi).first().map(|mu| mu.norm()))??;
    (expansion <= EXPANSION).then_some(OrbitGuess {
        lag,
        state: from.iter().zip(&step).map(|(x, step)| x + step).collect(),
        expansion,
        rank: 0,
    })
}

/// Whether every point of the orbit has a point of the record within a share of the extent.
pub(super) fn is_within_reach(orbit: &[f64], cloud: &Cloud<'_>, reach: f64) -> bool {
    let reach = reach * cloud.extent();
    orbit
        .chunks_exact(cloud.size)
        .all(|p| (0..cloud.count()).any(|k| distance(cloud.point(k), p, &cloud.scale) <= reach))
}
