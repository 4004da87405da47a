//! The branches through what random starts lead to.

use super::Method;
use super::delivered::Delivered;
use super::hunt::Hunt;
use super::source::BranchSource;
use super::trace::Work;
use crate::error::Error;
use crate::solve::continuation::CrossingSide;
use nalgebra::DVector;

impl Work<'_> {
    /// Follows what random starts lead to, both ways, unless it lies on a branch delivered since `first`; then what begins on
    /// these branches.
    pub(super) fn follow_starts(&mut self, method: Method, first: usize) -> Result<(), Error> {
        let (settings, swept) = (self.settings, self.swept);
        let Some(starts) = &settings.starts else {
            return Ok(());
        };
        let number = self.delivered.len();
        for (value, lambda) in swept.starts().iter().enumerate() {
            let mut hunt = Hunt::new((settings, swept), *lambda, first)?;
            let (mut search, list) = hunt.search(starts, (method, value))?;
            for found in &list {
                if swept.setting.control.is_interrupted() {
                    return Ok(());
                }
                if hunt.is_known(&self.delivered, found)? {
                    search.known += 1;
                } else if let Some(u) = hunt.unknowns(method, found)? {
                    search.followed += 1;
                    self.follow_both_ways(method, &u, *lambda, &found.origin)?;
                }
            }
            self.searches.push(search);
        }
        self.follow_crossings(method, number)
    }

    /// Follows the branch through a solution; one way where it closes, or where the other one leaves the range.
    pub(super) fn follow_both_ways(
        &mut self,
        method: Method,
        u: &DVector<f64>,
        lambda: f64,
        origin: &str,
    ) -> Result<(), Error> {
        let (from, to) = self.swept.range;
        for side in [CrossingSide::Forward, CrossingSide::Backward] {
            let border = if side == CrossingSide::Forward {
                to
            } else {
                from
            };
            if lambda == border {
                continue;
            }
            let mut delivered = Delivered::new(method, self.settings.subharmonic);
            delivered.start = Some(origin.into());
            let source = BranchSource::Inside(u.clone(), lambda, side);
            self.follow(source, &mut delivered)?;
            let is_closed = delivered.end.reason == "closed";
            self.delivered.push(delivered);
            if is_closed {
                break;
            }
        }
        Ok(())
    }
}
