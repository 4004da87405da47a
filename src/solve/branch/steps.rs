//! Steps along a branch, and what makes them shorter.

use super::Tracer;
use crate::error::SolveError;
use crate::solve::continuation::{Advance, PathEnd};
use crate::solve::events::{BifurcationEvent, Examined, Probe};

/// How often a step is retried whose events cannot be located or do not explain its change of stability.
const REPAIRS: usize = 3;

impl Tracer<'_> {
    /// The end of the next step and everything that happens on the way. An event that cannot be located may tell of folds that
    /// the step has jumped over, and so may multipliers that pass the circle without an event: the step is retried at a quarter
    /// of its length, and kept as it was where that does not help.
    pub(super) fn take_step(
        &mut self,
        last: &Probe,
    ) -> Result<Result<(Probe, Examined), PathEnd>, SolveError> {
        let (mut refused, mut repairs) = (None, 0);
        loop {
            let end = match self.path.advance(self.problem)? {
                Advance::End(end) => Some(end),
                Advance::Point(_) => None,
            };
            self.branch.exchanges = self.exchanges + self.path.exchanges();
            if let Some(end) = end {
                return Ok(match refused {
                    None => Err(end),
                    Some((taken, found)) => {
                        self.path.restore(taken);
                        Ok(found)
                    }
                });
            }
            let next = self.reached()?;
            let mut examined = self.examine(last, &next)?;
            let is_located = examined.events.iter().all(BifurcationEvent::is_located);
            let is_clear = is_located && self.unexplained((last, &next), &mut examined)?.is_empty();
            if is_clear || self.may_break(&next)? {
                return Ok(Ok((next, examined)));
            }
            let Some(taken) = self.path.retreat() else {
                return Ok(Ok((next, examined)));
            };
            // The first of them is the step as it was.
            let (taken, found) = refused.unwrap_or((taken, (next, examined)));
            if repairs == REPAIRS {
                self.path.restore(taken);
                return Ok(Ok(found));
            }
            refused = Some((taken, found));
            repairs += 1;
        }
    }

    /// Whether a force jumps: orbits do so too where they graze, and shorter steps do not cross the break of the branch.
    pub(super) fn may_break(&mut self, at: &Probe) -> Result<bool, SolveError> {
        let system = self.problem.system_at(at.point.lambda)?;
        let mut laws = system.mounts().iter().map(|mount| &mount.element);
        Ok(laws.any(|law| law.is_discontinuous()))
    }
}
