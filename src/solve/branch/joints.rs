//! Where a branch meets a known one.

use super::Tracer;
use crate::error::SolveError;
use crate::solve::continuation::PathEnd;
use crate::solve::events::{BifurcationEvent, EventKind, Examined, Probe};
use crate::solve::place::Place;

/// Halves of an orbit at a branch point that differ by less than this, relative to its size, are one: the point is located to a
/// small share of a step, in which the amplitude of the half orders passes zero.
const SAME_HALVES: f64 = 1e-4;

/// The same on the interpolant of a step.
const NEAR_HALVES: f64 = 1e-2;

/// Where a branch meets a known one.
pub(super) struct Joint {
    /// Number of the known one's crossing.
    known: Option<usize>,
    /// The place, where it was located.
    at: Option<Probe>,
}

impl Tracer<'_> {
    /// Ends the branch in the last step, where it meets a known one.
    pub(super) fn end_at(
        &mut self,
        Joint { known, at }: Joint,
        last: &Probe,
        mut examined: Examined,
    ) -> Result<PathEnd, SolveError> {
        let end = at.as_ref().unwrap_or(last);
        let place = end.look.fraction;
        examined.events.retain(|e| e.fraction <= place);
        examined.owed.retain(|e| e.fraction <= place);
        examined.marks.retain(|m| m.look.fraction < place);
        self.keep(last, end, examined)?;
        if let Some(joint) = &at {
            self.push(joint)?;
        }
        Ok(PathEnd::Joined { known })
    }

    /// Where the step meets a known branch.
    pub(super) fn joint(
        &mut self,
        a: &Probe,
        b: &Probe,
        events: &[BifurcationEvent],
    ) -> Result<Option<Joint>, SolveError> {
        let Some(known) = &self.options.known else {
            return Ok(None);
        };
        for event in events.iter().filter(|e| e.kind == EventKind::BranchPoint) {
            let Some(point) = &event.point else {
                continue;
            };
            let here = Place::of(self.problem, &point.u, point.lambda)?;
            let number = here.nearest(known);
            if number.is_some() || !self.has_equal_halves() && here.gap_of_halves() < SAME_HALVES {
                let probe = self.probe(point.clone(), event.fraction)?;
                return Ok(Some(Joint {
                    known: number,
                    at: Some(probe),
                }));
            }
        }
        if a.point.orientation == 0 || self.has_equal_halves() {
            // The branch has just left such an orbit, or has no others.
            return Ok(None);
        }
        // The halves change places where the branch passes an orbit of half the period, even if the corrector fails there.
        let from = Place::of(self.problem, &a.point.u, a.point.lambda)?;
        let to = Place::of(self.problem, &b.point.u, b.point.lambda)?;
        let Some(fraction) = from.exchange_of_halves(&to) else {
            return Ok(None);
        };
        let (u, lambda) = self.path.interpolate(fraction);
        let here = Place::of(self.problem, &u, lambda)?;
        let is_half = here.gap_of_halves() < NEAR_HALVES;
        Ok(is_half.then(|| Joint {
            known: here.nearest(known),
            at: None,
        }))
    }
}
