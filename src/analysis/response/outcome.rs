//! How a branch ended, and what a reader of its results has to know.

use super::delivered::{Delivered, Ending};
use super::guarded::Guarded;
use super::report;
use super::swept::Swept;
use super::trace::Work;
use super::{Method, bandwidth};
use crate::solve::branch::{self, Branch};
use crate::solve::continuation::PathEnd;
use crate::solve::events::{BifurcationEvent, EventKind, Verdict};
use crate::solve::floquet::Spectrum;
use crate::solve::residual::PeriodicResidual;

/// Distance in which the end of a model explains the end of a branch.
const BORDER: f64 = 1e-4;
/// Changes of stability that are told one by one.
const FEW: usize = 3;

impl Work<'_> {
    /// Why a branch ended.
    pub(super) fn ending(&self, problem: &mut Guarded<'_>, branch: &Branch) -> Ending {
        let (end, points) = (branch.end, branch.points.as_slice());
        let (mut reason, mut message) = (end.reason(), end.message());
        match end {
            PathEnd::RangeReached | PathEnd::Closed | PathEnd::Joined { .. } => {
                return Ending {
                    reason,
                    message,
                    is_early: false,
                };
            }
            PathEnd::StepTooSmall { .. } => {
                // The steps may have ended where there is no model any more; difference quotients reach a little further.
                if let [.., before, last] = points {
                    let onwards = (last.lambda - before.lambda).signum();
                    let beyond = [1.0, 1e3, 1e6].map(|k| k * self.settings.min_step);
                    let lost = |step: &f64| {
                        let there = last.lambda + onwards * step.min(BORDER);
                        problem.system_at(there).err()
                    };
                    if let Some(error) = beyond.iter().find_map(lost) {
                        (reason, message) = ("no_model", error.to_string());
                    }
                }
            }
            _ => {}
        }
        Ending::early(reason, report::early_message(self.swept, &message, points))
    }

    /// Says that something is missing, unless a branch says so already.
    pub(super) fn note_interruption(&mut self) {
        if !self.delivered.iter().any(|d| d.end.reason == "interrupted") {
            let method = self.delivered.last().map(|d| d.method);
            let method = method.unwrap_or_else(|| self.settings.methods()[0]);
            let mut missing = Delivered::new(method, self.settings.subharmonic);
            missing.end = Ending::early("interrupted", "interrupted".into());
            self.delivered.push(missing);
        }
    }

    /// What was computed in another way than for most systems.
    pub(super) fn explain(&mut self, method: Method, exchanges: usize) {
        let dof = self.swept.setting.assembly.system.dof();
        if self.settings.stability && self.swept.spectrum() == Spectrum::Leading {
            let which = match method {
                Method::Galerkin => format!(
                    "of the {} multipliers those of largest modulus are computed, by Arnoldi's method, down to the inside of \
                     the unit circle; ",
                    2 * dof
                ),
                _ => String::new(),
            };
            self.warnings.push(format!(
                "{dof} coordinates: {which}the averaged estimates (multiplier_estimates) are left out"
            ));
        }
        if exchanges > 0 {
            self.warnings.push(format!(
                "{exchanges} linear systems were solved by dense elimination with row exchanges across all coordinates: \
                 elimination by blocks lost too many digits"
            ));
        }
    }

    pub(super) fn warn(&mut self, delivered: &Delivered, end: PathEnd, pulling: &[bool]) {
        let (swept, list) = (self.swept, &mut self.warnings);
        let connections = &swept.setting.assembly.connections;
        for (name, _) in connections.iter().zip(pulling).filter(|(_, pulls)| **pulls) {
            list.push(format!(
                "{name}: the contact pulls somewhere on the branch (1 + beta v < 0): impact damping is beyond its range"
            ));
        }
        list.extend(bandwidth::complaint(swept, delivered));
        list.extend(bandwidth::unknown_stability(swept, delivered));
        let lost = |e: &&BifurcationEvent| e.verdict == Verdict::NotTried && !e.is_located();
        let (unresolved, unlocated): (Vec<_>, Vec<_>) =
            { delivered.events.iter().filter(lost) }.partition(|e| e.kind == EventKind::Unresolved);
        list.extend(not_resolved(swept, &unresolved));
        for event in unlocated {
            let (low, high) = event.bracket;
            list.push(format!(
                "a {} between {} and {} could not be located",
                event.kind.word(),
                swept.place(low),
                swept.place(high),
            ));
        }
        // Side branches live on a part of the range.
        if end != PathEnd::RangeReached || delivered.is_side() {
            return;
        }
        for (mark, written) in swept.marks.iter().zip(&self.settings.marks) {
            let is_solved = |p: &branch::BranchPoint| {
                p.is_mark && (p.lambda - mark).abs() <= 1e-12 * mark.abs()
            };
            if !delivered.points.iter().any(is_solved) {
                list.push(format!("the mark {} could not be solved", written.text));
            }
        }
    }
}

/// What to do where the events found do not explain the number of unstable multipliers.
const ADVICE: &str = "reduce `max_step`, or use more harmonics or the method `shooting`";

/// Changes of stability without an event that explains them: each in a sentence of its own, or all in one where they are many.
fn not_resolved(swept: &Swept<'_>, events: &[&BifurcationEvent]) -> Vec<String> {
    if events.len() > FEW {
        let ends = events.iter().flat_map(|e| [e.bracket.0, e.bracket.1]);
        return vec![format!(
            "unresolved: at {} places {} the number of unstable multipliers changes, and no bifurcation found there \
             explains it (events of kind unresolved); {ADVICE}",
            events.len(),
            swept.between(ends),
        )];
    }
    let one = |event: &&BifurcationEvent| {
        let (low, high) = event.bracket;
        open_change((swept.place(low), swept.place(high)), event.unstable)
    };
    events.iter().map(one).collect()
}

/// What contradicts what between two places, by the unstable multipliers before and behind; without these where they are not known.
fn open_change((low, high): (String, String), unstable: Option<(usize, usize)>) -> String {
    match unstable {
        Some((before, behind)) if before == behind => format!(
            "unresolved: the bifurcations found between {low} and {high} lead to another number of unstable multipliers than \
             the {behind} there; {ADVICE}"
        ),
        Some((before, behind)) => format!(
            "unresolved: the number of unstable multipliers goes from {before} to {behind} between {low} and {high}, and no \
             bifurcation found there explains it; {ADVICE}"
        ),
        None => format!(
            "unresolved: the bifurcations found between {low} and {high} contradict each other in the number of unstable \
             multipliers, which is not known there; {ADVICE}"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_change_names_the_counts_that_are_known_and_no_others() {
        let sentence = |unstable| open_change(("1.25".into(), "1.5".into()), unstable);
        let (changed, kept, unknown) = (
            sentence(Some((7, 9))),
            sentence(Some((9, 9))),
            sentence(None),
        );
        assert!(changed.contains("from 7 to 9 between 1.25 and 1.5"));
        assert!(kept.contains("than the 9 there"));
        for text in [&changed, &kept, &unknown] {
            assert!(text.starts_with("unresolved: ") && text.ends_with(ADVICE));
        }
        let digits = unknown.replace("1.25", "").replace("1.5", "");
        assert!(!digits.contains(|c: char| c.is_ascii_digit()), "{unknown}");
    }
}
