//! What one method delivers: a branch or attractors, where they begin and why they end.

use super::Method;
use crate::solve::attractor::Label;
use crate::solve::branch::BranchPoint;
use crate::solve::events::{BifurcationEvent, EventKind};
use serde_json::{Value, json};

/// The event at which a branch begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    /// Branch on which it lies.
    pub parent: usize,
    /// Its number among the events of that branch.
    pub event: usize,
    /// What it is.
    pub kind: EventKind,
    /// Crossings between the primary branch and this one.
    pub depth: usize,
}

/// What one method delivered: a branch, or attractors along the range.
pub(super) struct Delivered {
    pub method: Method,
    /// nu, excitation periods in a response period; 1 for attractors, whose labels say it.
    pub subharmonic: usize,
    /// Event at which it begins; `None` for the primary branch.
    pub origin: Option<Origin>,
    /// The random start that led to it, in words.
    pub start: Option<String>,
    /// Whether it goes on behind a break of another one.
    pub is_restart: bool,
    /// Whether it begins at a point that another run saved.
    pub is_saved: bool,
    /// Whether it left its crossing as another one did, and was stopped there.
    pub is_twin: bool,
    /// Names of the integrators that ran.
    integrators: Vec<&'static str>,
    pub points: Vec<BranchPoint>,
    pub events: Vec<BifurcationEvent>,
    /// Events that the flow refuted.
    pub refuted: Vec<BifurcationEvent>,
    /// Kinds of the attractors, one per point; none for branches, whose solutions are periodic by construction.
    pub labels: Vec<Label>,
    pub end: Ending,
}

/// Why the points end.
pub(super) struct Ending {
    /// One word for files.
    pub reason: &'static str,
    /// A sentence for people.
    pub message: String,
    /// Whether something is missing.
    pub is_early: bool,
}

impl Ending {
    /// Something is missing.
    pub fn early(reason: &'static str, message: String) -> Ending {
        Ending {
            reason,
            message,
            is_early: true,
        }
    }

    /// The end of the range.
    pub fn complete() -> Ending {
        Ending {
            reason: "range_reached",
            message: "the end of the range was reached".into(),
            is_early: false,
        }
    }
}

impl Delivered {
    /// Nothing yet.
    pub fn new(method: Method, subharmonic: usize) -> Delivered {
        Delivered {
            method,
            subharmonic,
            origin: None,
            start: None,
            is_restart: false,
            is_saved: false,
            is_twin: false,
            integrators: Vec::new(),
            points: Vec::new(),
            events: Vec::new(),
            refuted: Vec::new(),
            labels: Vec::new(),
            end: Ending::complete(),
        }
    }

    /// Notes which integrator runs.
    pub fn note_integrator(&mut self, name: &'static str) {
        if !self.integrators.contains(&name) {
            self.integrators.push(name);
        }
    }

    /// Names of the integrators that ran.
    pub fn integrators(&self) -> String {
        self.integrators.join(", ")
    }

    /// Why it ended early, with the method and the number of the branch in front where there are several.
    pub fn complaint(&self, number: usize, branches: usize) -> Option<String> {
        let (message, word) = (&self.end.message, self.method.word());
        self.end.is_early.then(|| match () {
            _ if self.is_side() => format!("{word}, branch {number}: {message}"),
            _ if branches > 1 => format!("{word}: {message}"),
            _ => message.clone(),
        })
    }

    /// Whether it is another branch than the primary one.
    pub fn is_side(&self) -> bool {
        self.origin.is_some() || self.start.is_some()
    }

    /// Row of the events at which the branch begins.
    pub fn event_row(&self, delivered: &[Delivered]) -> Option<usize> {
        self.origin.map(|origin| {
            let before = &delivered[..origin.parent];
            origin.event + before.iter().map(|d| d.events.len()).sum::<usize>()
        })
    }

    pub fn as_value(&self, number: usize, delivered: &[Delivered]) -> Value {
        let integrator = (!self.integrators.is_empty()).then(|| self.integrators());
        json!({
            "branch": number,
            "method": self.method.word(),
            "subharmonic": self.subharmonic,
            "origin": self.start,
            "parent": self.origin.map(|o| o.parent),
            "event": self.event_row(delivered),
            "integrator": integrator,
            "points": self.points.len(),
            "end": { "reason": self.end.reason, "message": self.end.message },
        })
    }
}
