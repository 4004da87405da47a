//! How much work the step control had, and with what.

use crate::solve::integrate::ShortSteps;

/// Counts short steps over calls.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Labour {
    /// Shortest step of the call at hand, in phases of the response, and what limited it.
    shortest: Option<(f64, Option<usize>)>,
    hardest: Option<ShortSteps>,
}

/// Steps per period of the excitation that deserve a word.
const MANY: usize = 1000;

impl Labour {
    /// A step that ends before anything happens, of a width in phases; `culprit` names the connection that limits it.
    #[inline]
    pub fn add(&mut self, width: f64, culprit: impl FnOnce() -> Option<usize>) {
        if self.shortest.is_none_or(|(least, _)| width < least) {
            self.shortest = Some((width, culprit()));
        }
    }

    /// Ends a call: its steps, and its length and a period of the excitation in phases of the response.
    pub fn close(
        &mut self,
        steps: usize,
        length: f64,
        period: f64,
        stiffest: impl FnOnce() -> usize,
    ) {
        let shortest = self.shortest.take();
        let steps = (steps as f64 / (length / period).max(1.0)) as usize;
        if steps <= MANY.max(self.hardest.map_or(0, |h| h.steps)) {
            return;
        }
        if let Some((width, culprit)) = shortest {
            self.hardest = Some(ShortSteps {
                steps,
                shortest: width / period,
                connection: culprit.unwrap_or_else(stiffest),
            });
        }
    }

    /// The most laborious call so far.
    pub fn hardest(&self) -> Option<ShortSteps> {
        self.hardest
    }
}
