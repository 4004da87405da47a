//! Two runs side by side: what changed in the model, what in the results, and their curves on top of each other.

use super::Outcome;
use crate::error::{Diagnostic, Error};
use crate::output::results::{self, HeldRows, Results};
use crate::output::{self, FigureFormat, RunOptions};
use crate::report::{
    Comparison, Curve, CurveStyle, Description, Difference, Figure, Report, ReportChange, Table,
    Values,
};
use std::path::{Path, PathBuf};

/// Quantities whose largest values are compared, by the front of their columns.
const COMPARED: [&str; 5] = [
    "rms.",
    "force_max.",
    "impacts.",
    "impact_energy.",
    "rattle_index.",
];
/// Front of the names of the second run's tables.
const SECOND: &str = "second_";

/// Compares two folders that `gearlash run` has written; figures and page go to `out`.
///
/// # Errors
/// A folder without results, two without a common analysis, a file that cannot be written.
pub fn compare(
    folders: [&Path; 2],
    out: &Path,
    formats: &[FigureFormat],
) -> Result<(Comparison, Outcome), Error> {
    let [a, b] = [
        results::read(folders[0], HeldRows::Drawn)?,
        results::read(folders[1], HeldRows::Drawn)?,
    ];
    let names = names(folders);
    let comparison = Comparison {
        changes: changes(&a.description, &b.description),
        differences: differences(&a, &b),
        missing: missing([&a, &b], &names),
        names: names.clone(),
    };
    let reports: Vec<Report> = (a.reports.iter())
        .filter_map(|one| Some(overlaid(one, find(&b, &one.name)?, &names)))
        .collect();
    if reports.is_empty() {
        return Err(Error::Input(vec![Diagnostic {
            location: None,
            path: folders[1].display().to_string(),
            message: format!(
                "has no analysis of the same name and type as {}",
                folders[0].display()
            ),
            help: None,
        }]));
    }
    let options = RunOptions {
        model: format!("{} and {}", names[0], names[1]),
        figures: formats.to_vec(),
        inputs: a.inputs.into_iter().chain(b.inputs).collect(),
        settings: serde_json::Map::new(),
        description: Description::default(),
        comparison: Some(comparison.clone()),
    };
    let files = output::write_run(out, &reports, &options)?;
    let outcome = Outcome {
        reports,
        files,
        interrupted: false,
        left_out: Vec::new(),
        warnings: Vec::new(),
    };
    Ok((comparison, outcome))
}

/// The last parts of the paths, or the whole paths where these are equal.
fn names(folders: [&Path; 2]) -> [String; 2] {
    let last = |path: &Path| {
        path.file_name()
            .map(|name| name.to_string_lossy().into_owned())
    };
    match folders.map(last) {
        [Some(a), Some(b)] if a != b => [a, b],
        _ => folders.map(|path| path.display().to_string()),
    }
}

fn find<'r>(results: &'r Results, name: &str) -> Option<&'r Report> {
    results.reports.iter().find(|report| report.name == name)
}

fn missing(results: [&Results; 2], names: &[String; 2]) -> Vec<String> {
    let mut list = Vec::new();
    for (own, other, name) in [
        (results[0], results[1], &names[0]),
        (results[1], results[0], &names[1]),
    ] {
        let lone = own.reports.iter().filter(|report| {
            find(other, &report.name).is_none_or(|found| found.kind != report.kind)
        });
        list.extend(lone.map(|report| format!("{} is in {name} only", report.name)));
    }
    list
}

/// Values of the models that differ, in the order of the first one.
fn changes(a: &Description, b: &Description) -> Vec<ReportChange> {
    let text = |value: Option<&serde_json::Value>| match value {
        None => String::new(),
        Some(serde_json::Value::String(text)) => text.clone(),
        Some(value) => value.to_string(),
    };
    let further = b.values.keys().filter(|path| !a.values.contains_key(*path));
    let paths = a.values.keys().chain(further);
    paths
        .filter(|path| a.values.get(*path) != b.values.get(*path))
        .map(|path| ReportChange {
            path: path.clone(),
            values: [text(a.values.get(path)), text(b.values.get(path))],
        })
        .collect()
}

/// Largest values of the quantities that both runs have, and the numbers of their events.
fn differences(a: &Results, b: &Results) -> Vec<Difference> {
    let mut list = Vec::new();
    for one in &a.reports {
        let Some(other) = find(b, &one.name).filter(|other| other.kind == one.kind) else {
            continue;
        };
        for table in one
            .tables
            .iter()
            .filter(|t| t.name.is_empty() || t.name == "rattle")
        {
            let wanted = |name: &str| COMPARED.iter().any(|front| name.starts_with(front));
            for column in table.columns.iter().filter(|c| wanted(&c.name)) {
                let values = [Some(table), other.table(&table.name)]
                    .map(|t| t.and_then(|t| t.largest(&column.name)).unwrap_or(f64::NAN));
                let unit = if column.unit.is_empty() {
                    String::new()
                } else {
                    format!(" [{}]", column.unit)
                };
                let quantity = format!("largest {}{unit}", column.name);
                let is_told = list
                    .iter()
                    .any(|d: &Difference| d.analysis == one.name && d.quantity == quantity);
                if !is_told && values.iter().any(|x| x.is_finite()) {
                    list.push(Difference {
                        analysis: one.name.clone(),
                        quantity,
                        values,
                    });
                }
            }
        }
        list.extend(event_counts(one, other));
    }
    list
}

fn event_counts(one: &Report, other: &Report) -> Vec<Difference> {
    let kinds = |report: &Report| match report
        .table("events")
        .and_then(|t| t.column("kind"))
        .map(|c| &c.values)
    {
        Some(Values::Text(kinds)) => kinds.clone(),
        _ => Vec::new(),
    };
    let [a, b] = [kinds(one), kinds(other)];
    let mut known: Vec<&String> = a.iter().chain(&b).collect();
    known.sort();
    known.dedup();
    let count = |list: &[String], kind: &String| list.iter().filter(|k| *k == kind).count() as f64;
    let difference = |kind: &String| Difference {
        analysis: one.name.clone(),
        quantity: format!("events: {}", kind.replace('_', " ")),
        values: [count(&a, kind), count(&b, kind)],
    };
    known.into_iter().map(difference).collect()
}

/// The first run's report with the curves of the second one behind its own.
fn overlaid(one: &Report, other: &Report, names: &[String; 2]) -> Report {
    let mut report = Report {
        caption: String::new(),
        further_figures: Vec::new(),
        summary: serde_json::Map::new(),
        warnings: Vec::new(),
        ended_early: None,
        streamed: None,
        ..one.clone()
    };
    report.tables = one
        .tables
        .iter()
        .filter(|t| t.name.is_empty() || t.name == "events")
        .cloned()
        .collect();
    if let Some(table) = other.table("") {
        report.tables.push(Table {
            name: format!("{SECOND}main"),
            columns: table.columns.clone(),
        });
    }
    report.figure = one
        .figure
        .as_ref()
        .map(|figure| overlaid_figure(figure, other, names));
    report
}

fn overlaid_figure(figure: &Figure, other: &Report, names: &[String; 2]) -> Figure {
    let main = other.table("");
    let has = |curve: &Curve| {
        main.is_some_and(|t| t.column(&curve.x).is_some() && t.column(&curve.y).is_some())
    };
    let mut figure = figure.clone();
    for panel in &mut figure.panels {
        panel.curves.retain(|c| {
            c.table.is_empty()
                && !matches!(c.style, CurveStyle::Crosses | CurveStyle::Events { .. })
        });
        let second: Vec<Curve> = (panel.curves.iter().filter(|c| has(c)))
            .map(|c| Curve {
                table: format!("{SECOND}main"),
                label: labelled(&c.label, &panel.heading, &names[1]),
                ..c.clone()
            })
            .collect();
        for curve in &mut panel.curves {
            curve.label = labelled(&curve.label, &panel.heading, &names[0]);
        }
        panel.curves.extend(second);
        panel.x_range = None;
    }
    figure
}

/// The run's name, with the label where it says more than the panel.
fn labelled(label: &str, heading: &str, run: &str) -> String {
    match label.is_empty() || crate::report::readable(label) == heading {
        true => run.to_string(),
        false => format!("{run}: {label}"),
    }
}

/// Folder of a comparison where none is given.
pub fn default_folder(folders: [&Path; 2]) -> PathBuf {
    let [a, b] = names(folders).map(|name| name.replace(['/', '\\'], "-"));
    PathBuf::from("results").join(format!("{a}-and-{b}"))
}
