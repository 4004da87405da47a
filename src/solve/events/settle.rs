//! Folds and branch points told apart, and what passes +1 without either.
//!
//! The path tells where it turns and where the sign of its determinant changes; the multipliers tell how many pass +1. At a fold
//! of m equal parts the determinant changes its sign m - 1 times; where an even number passes +1 without a turn it keeps it.

use super::turnings::StepTurning;
use super::{BifurcationEvent, EventKind, Probe, Step};
use crate::error::SolveError;
use crate::solve::continuation::PathPoint;

/// A fold this near to a branch point, as a share of the step, is the same place: the arms of a pitchfork turn there, and equal
/// parts turn together.
const SAME_TURN: f64 = 1e-3;
/// The same for a passage of equal multipliers, which truncated series place a little beside it.
const NEAR_TURN: f64 = 0.1;

impl Step<'_> {
    /// Folds that are the turning of two arms at a branch point are left out.
    pub(super) fn merge_turns(&mut self) {
        self.merge(&[]);
    }

    /// Where a fold and a branch point coincide, one of them goes: the branch point where equal multipliers pass +1, else the
    /// fold.
    fn merge(&mut self, ones: &[BifurcationEvent]) {
        let is_kind = |kind: EventKind| move |e: &&BifurcationEvent| e.kind == kind;
        let folds: Vec<f64> = self
            .found
            .iter()
            .filter(is_kind(EventKind::Fold))
            .map(|e| e.fraction)
            .collect();
        for fold in folds {
            let is_here = |e: &BifurcationEvent| {
                e.kind == EventKind::BranchPoint && (e.fraction - fold).abs() < SAME_TURN
            };
            if !self.found.iter().any(is_here) {
                continue;
            }
            let passes_together =
                |e: &BifurcationEvent| e.multiplicity > 1 && (e.fraction - fold).abs() < NEAR_TURN;
            match ones.iter().any(passes_together) {
                true => self.found.retain(|e| !is_here(e)),
                false => self
                    .found
                    .retain(|e| e.kind != EventKind::Fold || e.fraction != fold),
            }
        }
    }

    /// Gives folds and branch points the multipliers that pass +1 there, the nearest ones first, and reports what is left as
    /// branch points; returns what the path knows nothing of.
    pub(super) fn settle(
        &mut self,
        mut ones: Vec<BifurcationEvent>,
        (a, b): (&Probe, &Probe),
    ) -> Result<Vec<BifurcationEvent>, SolveError> {
        ones.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        if ones.iter().any(is_even) {
            self.locate_turns_of_parts((&a.point, &b.point))?;
        }
        self.merge(&ones);
        while let Some((k, turn)) = self.nearest_turn(&ones) {
            let one = ones.remove(k);
            let event = &mut self.found[turn];
            (event.unstable, event.multiplicity) = (one.unstable, one.multiplicity);
        }
        let (even, odd): (Vec<_>, Vec<_>) = ones.into_iter().partition(is_even);
        for event in even {
            self.add(self.with_tangent(event));
        }
        self.settle_odd(odd, (a, b))
    }

    /// Locates folds of the step again at which an even number of equal parts turns.
    fn locate_turns_of_parts(
        &mut self,
        (a, b): (&PathPoint, &PathPoint),
    ) -> Result<(), SolveError> {
        if a.orientation * b.orientation >= 0 || a.tangent_lambda * b.tangent_lambda >= 0.0 {
            return Ok(());
        }
        for k in 0..self.found.len() {
            if self.found[k].kind == EventKind::Fold {
                let guess = (self.found[k].fraction, StepTurning::Together);
                self.found[k] = self.fold((0.0, a), (1.0, b), guess)?;
            }
        }
        Ok(())
    }

    fn with_tangent(&self, mut event: BifurcationEvent) -> BifurcationEvent {
        let fraction = event.fraction;
        let smooth = |point: PathPoint| self.path.with_smooth_tangent(point, fraction);
        event.point = event.point.map(smooth);
        event
    }

    /// The passage and the fold or branch point without one that are nearest to each other.
    fn nearest_turn(&self, ones: &[BifurcationEvent]) -> Option<(usize, usize)> {
        let is_open = |e: &BifurcationEvent| {
            matches!(e.kind, EventKind::Fold | EventKind::BranchPoint) && e.unstable.is_none()
        };
        let turns = self.found.iter().enumerate().filter(|(_, e)| is_open(e));
        let pairs = turns.flat_map(|(j, turn)| {
            let gaps = ones.iter().enumerate();
            gaps.map(move |(k, one)| ((one.fraction - turn.fraction).abs(), k, j, is_even(one)))
        });
        let pairs = pairs.filter(|(gap, _, _, is_even)| !is_even || *gap < NEAR_TURN);
        let nearest = pairs.min_by(|p, q| p.0.total_cmp(&q.0))?;
        Some((nearest.1, nearest.2))
    }

    /// Single passages of +1 that no sign of the path's has told of: several in one step do not show in the signs at its ends.
    fn settle_odd(
        &mut self,
        ones: Vec<BifurcationEvent>,
        (a, b): (&Probe, &Probe),
    ) -> Result<Vec<BifurcationEvent>, SolveError> {
        let mut owed = Vec::new();
        if ones.len() < 2 {
            return Ok(ones);
        }
        let mut left = (0.0, Some(a.point.clone()));
        for (k, one) in ones.iter().enumerate() {
            let right = match ones.get(k + 1) {
                None => (1.0, Some(b.point.clone())),
                Some(next) => {
                    let middle = 0.5 * (one.fraction + next.fraction);
                    (middle, self.path.at_fraction(self.problem, middle)?)
                }
            };
            let is_found = match (&left.1, &right.1) {
                (Some(p), Some(q)) => self.crossing((left.0, p), (right.0, q))?,
                _ => false,
            };
            let crossing = self
                .found
                .iter_mut()
                .rev()
                .find(|e| is_found && e.kind == EventKind::BranchPoint && e.unstable.is_none());
            match crossing {
                Some(event) => {
                    (event.unstable, event.multiplicity) = (one.unstable, one.multiplicity);
                }
                None => owed.push(one.clone()),
            }
            left = right;
        }
        if is_even_number(owed.len()) {
            // The determinant of a truncated series keeps its sign where the flow passes twice.
            for event in std::mem::take(&mut owed) {
                self.add(self.with_tangent(event));
            }
        }
        Ok(owed)
    }
}

fn is_even(event: &BifurcationEvent) -> bool {
    is_even_number(event.multiplicity)
}

fn is_even_number(number: usize) -> bool {
    number.is_multiple_of(2)
}
