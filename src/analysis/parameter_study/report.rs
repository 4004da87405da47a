//! The report of a study, once its rows are on disk or in memory.

use super::{Axis, ParameterStudy, Plot};
use crate::analysis::Fault;
use crate::error::did_you_mean;
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Report, Table, Values};
use serde_json::{Value, json};

/// What became of the runs of a study.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Runs that were to be done here.
    pub runs: u64,
    /// Runs that are done.
    pub finished: u64,
    /// Of these, runs that ended early or were refused.
    pub failed: u64,
    /// Of these, runs with warnings.
    pub warned: u64,
    /// The report holds every so many rows.
    pub stride: u64,
}

/// Panels of the figure when nothing else is asked for.
const MOST_PANELS: usize = 4;
/// Columns after the collected quantities.
const ENDING: usize = 3;

impl ParameterStudy {
    /// The report from the rows that are drawn, all of them or every `stride`-th.
    pub fn report(&self, table: Table, tally: &Tally) -> Report {
        let mut report = Report {
            figure: self.figure(&table.columns),
            ended_early: early_end(tally),
            ..Report::default()
        };
        if tally.stride > 1 {
            report.caption = format!(
                "Shown is one run in {}; the table has all of them.",
                tally.stride
            );
        }
        if tally.warned > 0 {
            let runs = counted(tally.warned, "run");
            let message = format!("{runs} with warnings: see the column `warnings`");
            report.warnings.push(message);
        }
        report.tables.push(table);
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        let counts = json!({
            "runs": tally.runs,
            "finished": tally.finished,
            "failed": tally.failed,
            "with_warnings": tally.warned,
        });
        report.summary.insert("options".into(), options);
        report.summary.insert("runs".into(), counts);
        report
    }

    /// How many columns after `run` are parameters.
    fn parameters(&self) -> usize {
        let grid = self.grid.as_ref().map(|grid| grid.len());
        let list = self
            .list
            .as_ref()
            .and_then(|list| Some(list.first()?.len()));
        let sample = self.sample.as_ref().map(|sample| sample.parameters.len());
        grid.or(list).or(sample).unwrap_or(0)
    }

    /// What is wrong with `plot:`.
    pub(super) fn check_plot(&self, columns: &[Column]) -> Vec<Fault> {
        let Some(Plot { x, y }) = &self.plot else {
            return Vec::new();
        };
        let mut faults = Vec::new();
        let y_keys = y
            .iter()
            .enumerate()
            .map(|(k, name)| (format!("plot.y.{k}"), name));
        for (key, name) in std::iter::once(("plot.x".to_string(), x)).chain(y_keys) {
            match columns.iter().find(|c| c.name == *name) {
                None => {
                    let names: Vec<&String> = columns.iter().map(|c| &c.name).collect();
                    let hint = did_you_mean(name, names);
                    faults.push(Fault::new(
                        key,
                        format!("no column is called `{name}`; {hint}"),
                    ));
                }
                Some(column) if matches!(column.values, Values::Text(_)) => {
                    faults.push(Fault::new(
                        key,
                        format!("`{name}` holds words, wanted numbers"),
                    ));
                }
                Some(_) => {}
            }
        }
        if y.is_empty() {
            faults.push(Fault::new("plot.y", "an empty list: nothing to draw"));
        }
        faults
    }

    /// Dots, one a run; a line where a single parameter runs through a range.
    fn figure(&self, columns: &[Column]) -> Option<Figure> {
        let first = 1 + self.parameters();
        let is_number = |c: &&Column| !matches!(c.values, Values::Text(_));
        let (x, y): (&Column, Vec<&Column>) = match &self.plot {
            Some(plot) => {
                let find = |name: &String| columns.iter().find(|c| c.name == *name);
                (find(&plot.x)?, plot.y.iter().filter_map(find).collect())
            }
            None => {
                let collected = &columns[first..columns.len() - ENDING];
                let y = collected
                    .iter()
                    .filter(is_number)
                    .take(MOST_PANELS)
                    .collect();
                (columns[1..first].iter().find(is_number)?, y)
            }
        };
        if y.is_empty() {
            return None;
        }
        let is_line = self.grid.as_ref().is_some_and(|grid| {
            let is_even = matches!(grid.values().next(), Some(Axis::Range(_)));
            grid.len() == 1 && is_even && x.name == columns[1].name
        });
        let style = if is_line {
            CurveStyle::Line
        } else {
            CurveStyle::Dots
        };
        let panel = |y: &Column| Panel {
            x_label: labelled(x),
            y_label: labelled(y),
            x_range: None,
            x_frequency: None,
            curves: vec![Curve {
                table: String::new(),
                x: x.name.clone(),
                y: y.name.clone(),
                label: y.name.clone(),
                style: style.clone(),
                only: None,
            }],
        };
        Some(Figure {
            title: String::new(),
            panels: y.into_iter().map(panel).collect(),
        })
    }
}

fn labelled(column: &Column) -> String {
    match column.unit.as_str() {
        "" => column.name.clone(),
        unit => format!("{} [{unit}]", column.name),
    }
}

/// Why the study ended early: runs that are missing or failed.
fn early_end(tally: &Tally) -> Option<String> {
    let mut parts = Vec::new();
    if tally.finished < tally.runs {
        let all = counted(tally.runs, "run");
        parts.push(format!(
            "interrupted after {} of {all}; the same command goes on from there",
            tally.finished
        ));
    }
    if tally.failed > 0 {
        let all = counted(tally.finished, "run");
        parts.push(format!(
            "{} of {all} failed: see the column `reason`",
            tally.failed
        ));
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// `1 run`, `2 runs`.
fn counted(number: u64, thing: &str) -> String {
    let ending = if number == 1 { "" } else { "s" };
    format!("{number} {thing}{ending}")
}
