//! Turns of a branch that are made by the sampling of its forces.
//!
//! Every sample that passes a breakpoint bends the branch by as much as the samples err there. Where a branch is nearly vertical
//! such bends turn it back and forth. A pair of turns is real only where the parameter differs between them by more than that.

use super::Tracer;
use crate::error::SolveError;
use crate::solve::continuation::PathPoint;
use crate::solve::events::{BifurcationEvent, EventKind};

/// Distance of two turns, in sampling errors, up to which they are one ripple: the error of one place is a sample of what it
/// may be nearby.
const RIPPLE: f64 = 8.0;

impl Tracer<'_> {
    /// How far the sampling of the forces may have moved the parameter of a fold; 0 where nothing is sampled.
    pub(super) fn doubt(&mut self, fold: &PathPoint) -> Result<f64, SolveError> {
        let Some(error) = self.problem.aliasing(&fold.u, fold.lambda)? else {
            return Ok(0.0);
        };
        let shift = self.path.shift_of_parameter(self.problem, fold, error)?;
        Ok(shift.map_or(0.0, f64::abs))
    }
}

/// Removes pairs of turns that are nearer to each other than the sampling errs, the nearest ones first: what is left of a fold
/// that ripples is its farthest turn.
pub(super) fn remove(events: &mut Vec<BifurcationEvent>) {
    loop {
        let turns: Vec<usize> = (0..events.len())
            .filter(|k| events[*k].kind == EventKind::Fold)
            .collect();
        let pairs = turns.windows(2).map(|pair| {
            let [a, b] = [&events[pair[0]], &events[pair[1]]];
            let distance = (a.lambda - b.lambda).abs();
            (pair[0], pair[1], distance, a.doubt.max(b.doubt))
        });
        let ripples = pairs.filter(|(.., distance, doubt)| *distance <= RIPPLE * doubt);
        let nearest = ripples.min_by(|a, b| a.2.total_cmp(&b.2));
        let Some((first, second, ..)) = nearest.filter(|pair| pair.3 > 0.0) else {
            return;
        };
        events.remove(second);
        events.remove(first);
    }
}
