//! Sliders that begin to slip between two places of a step: the span of what they follow grows to what they can hold.

use super::locate::{RootTarget, SearchResult};
use super::{EventKind, Look, Step};
use crate::error::SolveError;
use crate::solve::residual::Survey;

impl Step<'_> {
    /// Locates the onsets of slip of a step and returns what is known there.
    pub(super) fn slips(&mut self, a: &Look, b: &Look) -> Result<Vec<Look>, SolveError> {
        let mut knots = Vec::new();
        for (number, (connection, at_a)) in a.survey.slips.iter().enumerate() {
            let Some((_, at_b)) = b.survey.slips.get(number) else {
                continue;
            };
            let changes = at_a * at_b < 0.0;
            if !changes {
                continue;
            }
            let width = b.fraction - a.fraction;
            let guess = a.fraction + width * at_a / (at_a - at_b);
            let is_whole = a.fraction == 0.0 && b.fraction == 1.0;
            let target = RootTarget {
                limits: (0.0, 1.0),
                guess,
                slope: (at_b - at_a) / width,
                extent: Some(self.extent),
                values: is_whole.then_some(((0.0, *at_a), (1.0, *at_b))),
            };
            let excess = |survey: Option<&Survey>| {
                let own = survey.and_then(|s| s.slips.get(number));
                own.map_or(f64::NAN, |(_, excess)| *excess)
            };
            let found = self.locate(&target, |_, _, survey| excess(survey))?;
            if let SearchResult::Root(root) = &found
                && let Some(survey) = root.survey.clone()
            {
                knots.push(Look {
                    fraction: root.fraction,
                    lambda: root.point.lambda,
                    survey,
                });
            }
            let kind = EventKind::SlipOnset {
                connection: *connection,
            };
            self.report(kind, (a.lambda, b.lambda), guess, found);
        }
        Ok(knots)
    }
}
