//! Steps along a branch, and what makes them shorter.

use super::Tracer;
use crate::error::SolveError;
use crate::solve::continuation::{Advance, PathEnd};
use crate::solve::events::{BifurcationEvent, Probe};

/// How often a step whose events cannot be located is taken anew, shorter.
const REPAIRS: usize = 3;

impl Tracer<'_> {
    /// The end of the next step and everything that happens on the way. An event that cannot be located may tell of folds that
    /// the step has jumped over: it is taken anew, shorter, and as it was where that does not help.
    pub(super) fn take_step(
        &mut self,
        last: &Probe,
    ) -> Result<Result<(Probe, Vec<BifurcationEvent>), PathEnd>, SolveError> {
        let mut refused = None;
        for repairs in 0.. {
            let end = match self.path.advance(self.problem)? {
                Advance::End(end) => Some(end),
                Advance::Point(_) => None,
            };
            self.branch.exchanges = self.exchanges + self.path.exchanges();
            match (end, refused.take()) {
                (Some(end), None) => return Ok(Err(end)),
                (Some(_), Some((taken, found))) => {
                    self.path.restore(taken);
                    return Ok(Ok(found));
                }
                (None, before) => refused = before,
            }
            let next = self.reached()?;
            let events = self.events(last, &next)?;
            let found = (next, events);
            let is_clear = found.1.iter().all(BifurcationEvent::is_located);
            if is_clear || self.may_break(&found.0)? {
                return Ok(Ok(found));
            }
            let Some(taken) = self.path.retreat() else {
                return Ok(Ok(found));
            };
            let (taken, found) = refused.take().unwrap_or((taken, found));
            if repairs == REPAIRS {
                self.path.restore(taken);
                return Ok(Ok(found));
            }
            refused = Some((taken, found));
        }
        unreachable!("the last repair returns")
    }

    /// Whether a force jumps: orbits do so too where they graze, and shorter steps do not cross the break of the branch.
    fn may_break(&mut self, at: &Probe) -> Result<bool, SolveError> {
        let system = self.problem.system_at(at.point.lambda)?;
        let mut laws = system.mounts().iter().map(|mount| &mount.element);
        Ok(laws.any(|law| law.is_discontinuous()))
    }
}
