//! The two arms of a fold: where they lie closer together than the methods apart, the flow's orbit nearest to a point may be on the
//! other one.

use super::{Confirmer, Station};
use crate::solve::branch::Stability;
use crate::solve::events::EventKind;
use crate::solve::family::Family;

/// Points on either side of a fold that may be given to the wrong arm.
pub(super) const REACH: usize = 8;

impl<F: Family> Confirmer<'_, F> {
    /// Takes the flow's orbits beside confirmed folds away from the points that lie on the other arm: those before the fold of the
    /// series belong to the arm before it.
    pub(super) fn part_arms(&mut self) {
        for found in &self.located {
            let event = &self.branch.events[found.event];
            let (EventKind::Fold, Some((before, after))) = (event.kind, event.unstable) else {
                continue;
            };
            let fold = event.after_point;
            let end = (fold + REACH).min(self.states.len() - 1);
            for k in fold.saturating_sub(REACH)..=end {
                let Some(orbit) = self.stations[k].as_ref().and_then(Station::orbit) else {
                    continue;
                };
                let ahead = self.flow.dot(&(&orbit.x - &found.x), &found.tangent);
                let (own, other, is_across) = match k <= fold {
                    true => (before, after, ahead > 0.0),
                    false => (after, before, ahead < 0.0),
                };
                if is_across && orbit.unstable() == other {
                    self.stations[k] = None;
                    self.barred[k] = Some(own);
                }
            }
        }
    }

    /// Stability of a point whose orbit of the flow lies on the other arm, from the counts beside the fold; known where the series
    /// has the same count.
    pub(super) fn on_own_arm(&self, k: usize) -> Option<Stability> {
        let count = self.barred[k]?;
        let multipliers = &self.branch.points[k].multipliers;
        let own = multipliers.iter().filter(|mu| mu.norm() > 1.0).count();
        Some(match (own == count, count) {
            (false, _) => Stability::Unknown,
            (true, 0) => Stability::Stable,
            (true, _) => Stability::Unstable,
        })
    }
}
