//! What the methods delivered, as tables, a figure and a summary.

use super::accuracy::Accuracies;
use super::delivered::Delivered;
use super::orbits::OrbitTable;
use super::verify::Verification;
use super::{BranchSettings, ResponseTable, Swept};
use crate::analysis::branch_figure;
use crate::analysis::branch_table::{self, TracedMethod};
use crate::analysis::columns::{float, integer, text};
use crate::analysis::event_table;
use crate::analysis::multiplier_table;
use crate::analysis::rattle_figure;
use crate::report::{Report, Table, Values};
use crate::solve::branch::BranchPoint;
use serde_json::{Value, json};

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
