//! Upper limits of the counts of an analysis. They keep every product of sizes far from overflow; what a run
//! costs within them is estimated by [`super::cost`].

use super::Fault;

/// Values of a parameter, points of a branch, rows of a curve.
pub const POINTS: usize = 1_000_000;
/// Periods of the excitation, recorded or not.
pub const PERIODS: usize = 1_000_000_000;
/// Samples per period.
pub const SAMPLES: usize = 1_000_000;
/// Random initial states.
pub const STATES: usize = 1_000_000;
/// Branches followed from the events of others, and how deep.
pub const BRANCHES: usize = 10_000;

/// A fault of a key whose number is below `least` or above `most`.
pub fn check(key: &str, found: usize, least: usize, most: usize) -> Option<Fault> {
    if found < least {
        return Some(Fault::new(
            key,
            format!("{found} must be at least {least}, and at most {most}"),
        ));
    }
    (found > most).then(|| Fault::new(key, format!("{found} must be at most {most}")))
}
