//! What analyses are asked to draw: checked before they run, handed to their reports.

use crate::analysis::EVENTS;
use crate::analysis::Fault;
use crate::assembly::Assembly;
use crate::error::did_you_mean;
use crate::model::{Model, Structure};
use crate::report::{Column, Panel, Plot, Report, Table, Values};
use serde_json::Value;

/// Methods that figures know.
const METHODS: [&str; 3] = ["galerkin", "shooting", "integration"];

/// What is wrong with `plot:`: columns that the tables do not have, unknown connections, ranges that are none.
pub(super) fn check(plot: &Plot, tables: &[Table], connections: &[String]) -> Vec<Fault> {
    let mut faults = Vec::new();
    let columns: Vec<&Column> = tables.iter().flat_map(|t| &t.columns).collect();
    let mut column = |key: String, name: &str, is_quantity: bool| {
        let front = format!("{name}.");
        let is_wanted =
            |c: &&&Column| c.name == name || (is_quantity && c.name.starts_with(&front));
        match columns.iter().find(is_wanted) {
            // An analysis that does not tell its columns is looked at when it is drawn.
            _ if columns.is_empty() => {}
            None => {
                let hint = did_you_mean(name, columns.iter().map(|c| c.name.as_str()));
                faults.push(Fault::new(
                    key,
                    format!("no column is called `{name}`; {hint}"),
                ));
            }
            Some(c) if matches!(c.values, Values::Text(_)) => {
                faults.push(Fault::new(
                    key,
                    format!("`{name}` holds words, wanted numbers"),
                ));
            }
            Some(_) => {}
        }
    };
    if let Some(x) = &plot.x {
        column("plot.x".into(), x, false);
    }
    for (k, y) in plot.y.iter().enumerate() {
        column(format!("plot.y.{k}"), y, true);
    }
    for (key, list, known) in [
        ("connections", &plot.connections, connections.to_vec()),
        ("events", &plot.events, EVENTS.map(String::from).to_vec()),
        ("methods", &plot.methods, METHODS.map(String::from).to_vec()),
    ] {
        for (k, word) in list.iter().flatten().enumerate() {
            if !known.contains(word) {
                let hint = did_you_mean(word, &known);
                let message = format!("`{word}` is unknown; {hint}");
                faults.push(Fault::new(format!("plot.{key}.{k}"), message));
            }
        }
    }
    for (key, range) in [("x_range", plot.x_range), ("y_range", plot.y_range)] {
        if range.is_some_and(|[a, b]| !(a.is_finite() && b.is_finite()) || a == b) {
            let message = "wanted two different finite numbers";
            faults.push(Fault::new(format!("plot.{key}"), message));
        }
    }
    faults
}

/// Gives a report its title, its colours and what is asked of its figures. What cannot be drawn as asked is a warning: the
/// results are worth more than the figure.
pub(super) fn dress(report: &mut Report, plot: Plot, (model, assembly): (&Model, &Assembly)) {
    report.connections.clone_from(&assembly.connections);
    name_shafts(report, model);
    entitle(report);
    report.plot = plot;
    settle(report);
}

/// The same from what another report of the same study says in its JSON file.
pub(super) fn inherit(report: &mut Report, json: &Value) {
    let drawing = &json["drawing"];
    let read = |key: &str| drawing.get(key).cloned().unwrap_or_default();
    report.connections = serde_json::from_value(read("connections")).unwrap_or_default();
    entitle(report);
    report.plot = serde_json::from_value(read("plot")).unwrap_or_default();
    settle(report);
}

/// Tells axes of frequencies and speeds what all shafts do.
fn name_shafts(report: &mut Report, model: &Model) {
    let Structure::Train(train) = &model.structure else {
        return;
    };
    let Some(motion) = &train.mean_motion else {
        return;
    };
    let bodies = train.bodies.keys().cloned().enumerate();
    let ratio = |(body, name)| (name, motion.speed_of(body) / motion.speed);
    let shafts: Vec<(String, f64)> = bodies.map(ratio).collect();
    let further = report
        .further_figures
        .iter_mut()
        .map(|named| &mut named.figure);
    let panels = report
        .figure
        .iter_mut()
        .chain(further)
        .flat_map(|figure| &mut figure.panels);
    let is_speed = |panel: &Panel| panel.x_frequency.is_some() || panel.x_label.ends_with("[rpm]");
    for panel in panels.filter(|panel| is_speed(panel)) {
        panel.shafts.clone_from(&shafts);
    }
}

fn entitle(report: &mut Report) {
    if let Some(figure) = &mut report.figure {
        figure.title.clone_from(&report.title);
    }
    for further in &mut report.further_figures {
        further.figure.title = format!("{}: {}", report.title, further.name);
    }
}

#[cfg(feature = "figures")]
fn settle(report: &mut Report) {
    use crate::output::arrange::arranged;
    let fault = report
        .figures()
        .find_map(|(_, figure)| arranged(figure, report).err());
    if let Some(error) = fault {
        report.warnings.push(format!("`plot` is ignored: {error}"));
        report.plot = Plot::default();
    }
}

#[cfg(not(feature = "figures"))]
fn settle(_: &mut Report) {}
