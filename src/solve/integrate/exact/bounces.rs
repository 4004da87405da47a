//! Joints that bounce on a jump of their force, ever again and ever faster.
//!
//! A jump whose sides press against it is a valley with straight walls. A motion in it that nothing damps keeps its energy, and its
//! excursions last 2 v / a. While the loads change slowly, v^3 (1/a_below + 1/a_above) is kept, so that v is 0 where a wall comes to an end;
//! averaged over the excursions the force is that which holds the joint on its jump, and the deformation differs from the jump by less
//! than v^2 / 2a. Excursions too short to follow are replaced by that average; how short depends on how many there are.

use crate::solve::integrate::Bounces;

/// Excursions shorter than this, in units of time of the series, end on the jump in any case.
const SHORTEST_STAY: f64 = 1e-4;
/// The same after any number of excursions: longer ones are switches like others.
const LONGEST_STAY: f64 = 0.1;
/// Passages in one response period over which the first limit is doubled.
const PATIENCE: f64 = 200.0;

/// A passage of a jump both of whose sides press against it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Excursion {
    /// The longest excursion that follows, in units of time of the series.
    pub stay: f64,
    /// Its height.
    pub height: f64,
}

/// Counts passages, and keeps what was averaged.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BounceCounter {
    passages: usize,
    /// Response periods in the call.
    turns: f64,
    /// The longest excursion that was averaged in the call: connection, length in units of time of the series, height.
    longest: Option<(usize, Excursion)>,
    hardest: Option<Bounces>,
}

impl BounceCounter {
    pub(super) fn open(&mut self, turns: usize) {
        (self.passages, self.turns) = (0, turns as f64);
        self.longest = None;
    }

    /// Whether an excursion is too short to follow.
    pub(super) fn ends(&self, excursion: Excursion) -> bool {
        excursion.stay <= self.limit()
    }

    fn limit(&self) -> f64 {
        let grown = 1.0 + self.passages as f64 / (PATIENCE * self.turns.max(1.0));
        (SHORTEST_STAY * grown).min(LONGEST_STAY)
    }

    /// Counts an excursion that is followed; whether it is one of many.
    pub(super) fn follow(&mut self, excursion: Excursion) -> bool {
        let counts = excursion.stay <= LONGEST_STAY && self.limit() < LONGEST_STAY;
        self.passages += usize::from(counts);
        counts
    }

    /// Notes that a connection is taken to rest on its jump.
    pub(super) fn average(&mut self, connection: usize, excursion: Excursion) {
        let is_longer = self.longest.is_none_or(|(_, e)| e.stay < excursion.stay);
        if excursion.stay > SHORTEST_STAY && is_longer {
            self.longest = Some((connection, excursion));
        }
    }

    /// Ends a call; `unit`: of time of the series as a share of an excitation period.
    pub(super) fn close(&mut self, unit: f64) {
        let Some((connection, excursion)) = self.longest.take() else {
            return;
        };
        let share = excursion.stay * unit;
        if self.hardest.is_none_or(|h| h.longest < share) {
            self.hardest = Some(Bounces {
                connection,
                passages: (self.passages as f64 / self.turns.max(1.0)) as usize,
                longest: share,
                height: excursion.height,
            });
        }
    }

    /// The longest excursions that were averaged in any call.
    pub(super) fn hardest(&self) -> Option<Bounces> {
        self.hardest
    }

    /// Passages followed in a response period at most, besides the switches of other kinds.
    pub(super) fn most() -> usize {
        (PATIENCE * LONGEST_STAY / SHORTEST_STAY) as usize
    }
}
