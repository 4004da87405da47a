//! The report of a study, once its rows are on disk or in memory.

use super::ParameterStudy;
use super::figures::Drawing;
use crate::report::{Report, Table};
use serde_json::{Value, json};

/// Outcomes of the runs of a study.
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
    /// The report holds every k-th row.
    pub stride: u64,
}

impl ParameterStudy {
    /// The report from the rows that are drawn, all of them or every `stride`-th.
    pub fn report(&self, table: Table, tally: &Tally) -> Report {
        let drawing = Drawing::of(self, &table);
        let mut report = Report {
            figure: drawing.main,
            further_figures: drawing.further,
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
        report.tables.extend(drawing.tables);
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
    pub(super) fn parameters(&self) -> usize {
        let grid = self.grid.as_ref().map(|grid| grid.len());
        let list = self
            .list
            .as_ref()
            .and_then(|list| Some(list.first()?.len()));
        let sample = self.sample.as_ref().map(|sample| sample.parameters.len());
        grid.or(list).or(sample).unwrap_or(0)
    }
}

/// Why the study ended early: runs that are missing or failed.
fn early_end(tally: &Tally) -> Option<String> {
    let mut parts = Vec::new();
    if tally.finished < tally.runs {
        let all = counted(tally.runs, "run");
        parts.push(format!(
            "interrupted after {} of {all}; repeat the command to resume",
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
