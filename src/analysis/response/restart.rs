//! Breaks: where a force jumps, a branch ends at the orbit that grazes the jump, and others exist behind it.

use super::delivered::{Delivered, Ending};
use super::hunt::Hunt;
use super::source::BranchSource;
use super::trace::Work;
use super::{BranchSettings, Method};
use crate::error::Error;
use crate::solve::branch::BranchPoint;
use crate::solve::continuation::CrossingSide;

/// Distances behind a break at which the branch is taken up again, as shares of the range.
const BEHIND: [f64; 5] = [1e-3, 3e-3, 1e-2, 3e-2, 0.1];
/// Breaks along one range.
const MOST: usize = 40;
/// What ends a branch at a break: it stops there, or jumps to another curve and comes back.
const BROKEN: [&str; 3] = ["step_too_small", "creeping", "looped"];

impl Work<'_> {
    /// Goes on behind the breaks of the branch delivered last, to the end of the range.
    pub(super) fn follow_behind_breaks(&mut self, method: Method) -> Result<(), Error> {
        let system = &self.swept.setting.assembly.system;
        let mut laws = system.mounts().iter().map(|mount| &mount.element);
        if !laws.any(|law| law.is_discontinuous()) {
            return Ok(());
        }
        for _ in 0..MOST {
            let number = self.delivered.len() - 1;
            if !BROKEN.contains(&self.delivered[number].end.reason) {
                break;
            }
            let Some(piece) = self.behind_break(method, number)? else {
                break;
            };
            let (last, first) = (number + 1, piece.points.first().map(|p| p.lambda));
            let message = format!(
                "the branch breaks where an orbit grazes a jump of the force; branch {last} continues at {}",
                self.swept.place(first.unwrap_or_default()),
            );
            self.warnings.push(format!("branch {number}: {message}"));
            self.delivered[number].end = Ending {
                reason: "broken",
                message,
                is_early: false,
            };
            self.delivered.push(piece);
        }
        Ok(())
    }

    /// The branch through what the motion comes to behind a break: nearest by, and farther on where nothing is found.
    fn behind_break(&mut self, method: Method, number: usize) -> Result<Option<Delivered>, Error> {
        let (settings, swept): (&BranchSettings, _) = (self.settings, self.swept);
        let (from, to) = swept.range;
        let ahead = |p: &BranchPoint| (p.lambda - from) / (to - from);
        let points = &self.delivered[number].points;
        let farthest = points.iter().max_by(|a, b| ahead(a).total_cmp(&ahead(b)));
        let Some(farthest) = farthest else {
            return Ok(None);
        };
        let (reached, unknowns) = (farthest.lambda, farthest.unknowns.clone());
        let place = swept.place(reached);
        for lambda in BEHIND.map(|share| reached + share * (to - from)) {
            if (to - lambda) / (to - from) <= 0.0 || swept.setting.control.is_interrupted() {
                break;
            }
            let mut hunt = Hunt::new((settings, swept), lambda, 0)?;
            for found in hunt.behind(method, &unknowns)? {
                let Some(u) = hunt.unknowns(method, &found)? else {
                    continue;
                };
                let mut piece = Delivered::new(method, settings.subharmonic);
                piece.start = Some(format!("behind the break at {place}"));
                piece.is_restart = true;
                self.follow(
                    BranchSource::Inside(u, lambda, CrossingSide::Forward),
                    &mut piece,
                )?;
                let is_onward = |p: &BranchPoint| (p.lambda - lambda) / (to - from) > 0.0;
                if piece.points.iter().any(is_onward) {
                    return Ok(Some(piece));
                }
            }
        }
        Ok(None)
    }
}
