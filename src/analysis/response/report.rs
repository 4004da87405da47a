//! What the methods delivered, as tables, a figure and a summary.

use super::accuracy::Accuracies;
use super::crossings::Origin;
use super::orbits::OrbitTable;
use super::verify::Verification;
use super::{BranchSettings, Method, ResponseTable, Swept};
use crate::analysis::branch_figure;
use crate::analysis::branch_table::{self, TracedMethod};
use crate::analysis::columns::{float, integer, text};
use crate::analysis::event_table;
use crate::analysis::multiplier_table;
use crate::analysis::rattle_figure;
use crate::report::{Report, Table, Values};
use crate::solve::attractor::Label;
use crate::solve::branch::BranchPoint;
use crate::solve::events::BifurcationEvent;
use serde_json::{Value, json};

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

/// What happened, where, and after how many points; how far the points reach where they end elsewhere.
pub(super) fn early_message(swept: &Swept<'_>, message: &str, points: &[BranchPoint]) -> String {
    let Some(last) = points.last() else {
        return format!("{message} before the first point");
    };
    let (from, to) = swept.range;
    let (word, ahead): (_, fn(f64, f64) -> f64) = match to < from {
        true => ("lowest", f64::min),
        false => ("highest", f64::max),
    };
    let farthest = points.iter().map(|p| p.lambda).fold(from, ahead);
    let (at, reached) = (swept.place(last.lambda), swept.place(farthest));
    let reached = match reached == at {
        true => String::new(),
        false => format!("; {word} {reached}"),
    };
    format!("{message} at {at} after {} points{reached}", points.len())
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
    fn complaint(&self, number: usize, branches: usize) -> Option<String> {
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
    fn event_row(&self, delivered: &[Delivered]) -> Option<usize> {
        self.origin.map(|origin| {
            let before = &delivered[..origin.parent];
            origin.event + before.iter().map(|d| d.events.len()).sum::<usize>()
        })
    }

    fn as_value(&self, number: usize, delivered: &[Delivered]) -> Value {
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

/// The report but for its warnings and options.
pub(super) fn assemble(
    swept: &Swept<'_>,
    delivered: &[Delivered],
    orbits: Option<OrbitTable>,
    verification: Option<&Verification>,
    accuracies: Option<(&BranchSettings, &Accuracies)>,
) -> Report {
    let setting = swept.setting;
    let traced: Vec<TracedMethod<'_>> = delivered
        .iter()
        .map(|d| TracedMethod {
            points: &d.points,
            events: &d.events,
            refuted: &d.refuted,
            labels: &d.labels,
            method: d.method,
        })
        .collect();
    let (events, refuted) = (
        event_table::events(swept, &traced),
        event_table::refuted(swept, &traced),
    );
    let mut report = Report {
        figure: Some(branch_figure::figure(swept, &traced)),
        ..Report::default()
    };
    let branches = delivered.iter().enumerate();
    let branches = branches.map(|(k, d)| d.as_value(k, delivered));
    for (key, value) in [
        ("branches", branches.collect()),
        ("events", rows_as_json(&events)),
        ("refuted", rows_as_json(&refuted)),
    ] {
        report.summary.insert(key.into(), value);
    }
    report.tables.push(branch_table::points(swept, &traced));
    report
        .tables
        .extend(multiplier_table::multipliers(swept, &traced));
    if swept.computes(ResponseTable::Events) {
        report.tables.push(events);
        report.tables.extend(Some(refuted).filter(|t| t.rows() > 0));
    }
    if let Some(rattle) = branch_table::rattle(swept, &traced) {
        let figure = rattle_figure::figure(&rattle, report.figure.as_ref());
        report.further_figures.extend(figure);
        report.tables.push(rattle);
    }
    report.tables.extend(orbits.map(|o| o.finish(setting)));
    if let Some(verification) = verification {
        let value = verification.as_value();
        report.summary.insert("verify".into(), value);
    }
    if let Some((settings, accuracies)) = accuracies {
        report.tables.push(accuracies.table(settings, swept));
        let value = accuracies.as_value(settings, swept);
        report.summary.insert("accuracy".into(), value);
    }
    let drawn = branch_figure::drawn(swept);
    let names = setting.assembly.connections.iter().enumerate();
    let left_out = names.filter(|(e, _)| !drawn.contains(e));
    let left_out: Vec<&str> = left_out.map(|(_, name)| name.as_str()).collect();
    if !left_out.is_empty() {
        report.caption = format!(
            "Not drawn: {}; the table has all connections.",
            left_out.join(", ")
        );
    }
    let verified = verification.map(Verification::message);
    let judged = accuracies.map(|(_, a)| a.message(swept));
    for message in verified.into_iter().chain(judged) {
        report.caption = format!("{} {message}", report.caption).trim().to_owned();
    }
    let complaints: Vec<String> = delivered
        .iter()
        .enumerate()
        .filter_map(|(k, d)| d.complaint(k, delivered.len()))
        .collect();
    report.ended_early = (!complaints.is_empty()).then(|| complaints.join("; "));
    report
}

/// One row per branch: its start and end. `parent` and `event` (a row of the events) are empty for a primary branch.
pub(super) fn branches(delivered: &[Delivered]) -> Table {
    let numbers = |f: &dyn Fn(&Delivered) -> usize| -> Vec<i64> {
        delivered.iter().map(|d| f(d) as i64).collect()
    };
    let maybe = |f: &dyn Fn(&Delivered) -> Option<usize>| -> Vec<f64> {
        let value = |d| f(d).map_or(f64::NAN, |x| x as f64);
        delivered.iter().map(value).collect()
    };
    let words = |f: &dyn Fn(&Delivered) -> &'static str| -> Vec<String> {
        delivered.iter().map(|d| f(d).to_owned()).collect()
    };
    let kind = |d: &Delivered| match d.origin {
        Some(origin) => origin.kind.word(),
        None if d.is_restart => "restart",
        None if d.is_saved => "saved_point",
        None if d.start.is_some() => "random_start",
        None => "start",
    };
    Table {
        name: "branches".into(),
        columns: vec![
            integer("branch", (0..delivered.len() as i64).collect()),
            text("method", words(&|d| d.method.word())),
            integer("subharmonic", numbers(&|d| d.subharmonic)),
            float("parent", "", maybe(&|d| d.origin.map(|o| o.parent))),
            float("event", "", maybe(&|d| d.event_row(delivered))),
            text("kind", words(&kind)),
            integer("points", numbers(&|d| d.points.len())),
            text("end", words(&|d| d.end.reason)),
        ],
    }
}

fn rows_as_json(table: &Table) -> Value {
    let cell = |values: &Values, row: usize| match values {
        Values::Float(v) => json!(v[row].is_finite().then_some(v[row])),
        Values::Integer(v) => json!(v[row]),
        Values::Text(v) => json!(v[row]),
    };
    let row = |r: usize| -> Value {
        let cells = table.columns.iter();
        Value::Object(
            cells
                .map(|c| (c.name.clone(), cell(&c.values, r)))
                .collect(),
        )
    };
    Value::Array((0..table.rows()).map(row).collect())
}
