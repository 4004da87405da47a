//! Several starts: random states that lead to solutions which no branch has reached yet, and the branches through them.

use super::{BranchSettings, Method, Swept};
use crate::analysis::{Fault, Setting};
use crate::quantity::Quantity;
use crate::report::Report;
use crate::solve::jumps::refuse_hidden;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Random initial states to search for solutions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Starts {
    /// States per value.
    pub count: usize,
    /// Seed of the generator: the same seed gives the same states.
    pub seed: u64,
    /// Value or values of the parameter; default: the first value of the range.
    #[serde(default)]
    pub at: At,
    /// Half width of the box around the static equilibrium at rest, in every coordinate and rate, nondimensional.
    #[serde(rename = "box", default = "reach")]
    pub reach: f64,
}

/// Values at which random starts are drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a value of the parameter or a list of them")]
pub enum At {
    /// One.
    One(Quantity),
    /// Several.
    Several(Vec<Quantity>),
}

impl Default for At {
    fn default() -> Self {
        At::Several(Vec::new())
    }
}

fn reach() -> f64 {
    2.0
}

/// States at most, all values together.
const MOST_STATES: usize = 100_000;
impl BranchSettings {
    /// Values of the random starts as written, with their keys.
    pub(super) fn starts_at(&self) -> Vec<(String, &Quantity)> {
        let Some(starts) = &self.starts else {
            return Vec::new();
        };
        let listed = |list| {
            let list = <[Quantity]>::iter(list).enumerate();
            list.map(|(k, at)| (format!("starts.at.{k}"), at)).collect()
        };
        match &starts.at {
            At::One(at) => vec![("starts.at".into(), at)],
            At::Several(list) if list.is_empty() => {
                self.from.iter().map(|from| ("from".into(), from)).collect()
            }
            At::Several(list) => listed(list),
        }
    }

    /// Whether there may be other branches than the primary one.
    pub(super) fn has_side_branches(&self) -> bool {
        let is_saved = self.start.saved().is_some();
        self.branches.limits().is_some() || self.starts.is_some() || is_saved
    }

    /// What is wrong with the random starts.
    pub(super) fn check_starts(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = Vec::new();
        let Some(starts) = &self.starts else {
            return faults;
        };
        let states = starts.count.saturating_mul(self.starts_at().len());
        if starts.count == 0 || states > MOST_STATES {
            let message = format!(
                "{} must be at least 1, and at most {MOST_STATES} with the number of values",
                starts.count
            );
            faults.push(Fault::new("starts.count", message));
        }
        if !(starts.reach > 0.0 && starts.reach.is_finite()) {
            let message = format!("{} must be > 0: a half width", starts.reach);
            faults.push(Fault::new("starts.box", message));
        }
        if self.methods() == [Method::Integration] {
            let message = "the method `integration` follows attractors, not branches";
            faults.push(Fault::new("starts", message));
        }
        if let Err(error) = refuse_hidden(&setting.assembly.system) {
            faults.push(Fault::new("starts", setting.name_connection(&error)));
        }
        faults
    }
}

/// What the starts at one value led to.
pub(super) struct StartSearch {
    pub method: Method,
    pub lambda: f64,
    pub guesses: usize,
    /// Guesses that led to an orbit.
    pub converged: usize,
    /// Different orbits, those of a shorter period left out.
    pub solutions: usize,
    /// Different orbits that repeat themselves before the response period is over.
    pub shorter: usize,
    /// On branches followed before.
    pub known: usize,
    /// Number of starts of branches.
    pub followed: usize,
}

impl StartSearch {
    /// Nothing yet.
    pub fn new(method: Method, lambda: f64) -> StartSearch {
        StartSearch {
            method,
            lambda,
            guesses: 0,
            converged: 0,
            solutions: 0,
            shorter: 0,
            known: 0,
            followed: 0,
        }
    }

    fn as_value(&self, swept: &Swept<'_>) -> Value {
        json!({
            "method": self.method.word(),
            "at": swept.value(self.lambda),
            "guesses": self.guesses,
            "converged": self.converged,
            "solutions": self.solutions,
            "shorter_period": self.shorter,
            "known": self.known,
            "followed": self.followed,
            "message": self.message(swept),
        })
    }

    fn message(&self, swept: &Swept<'_>) -> String {
        let StartSearch {
            guesses,
            converged,
            solutions,
            known,
            followed,
            ..
        } = self;
        let (word, place) = (self.method.word(), swept.place(self.lambda));
        let lost = match solutions - known - followed {
            0 => String::new(),
            lost => {
                format!(", {lost} not reached by the method with its first number of harmonics")
            }
        };
        let shorter = match self.shorter {
            0 => String::new(),
            shorter => format!("; {shorter} of a shorter period left out"),
        };
        format!(
            "Random starts ({word}) at {place}: {converged} of {guesses} guesses led to {solutions} different solutions, \
             {known} on branches followed before, {followed} followed{lost}{shorter}."
        )
    }
}

/// Says what the starts led to.
pub(super) fn report(searches: &[StartSearch], swept: &Swept<'_>, report: &mut Report) {
    let values = searches.iter().map(|s| s.as_value(swept));
    report.summary.insert("starts".into(), values.collect());
    for search in searches {
        report.caption = format!("{} {}", report.caption, search.message(swept));
    }
    report.caption = report.caption.trim().to_owned();
}
