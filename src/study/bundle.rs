//! Runs of a parameter study by their numbers, in memory: for whoever hands them out to other machines.

use super::load::diagnostics;
use super::{Run, Study};
use crate::analysis::parameter_study::{COMPLETE, Plan, Tally};
use crate::analysis::{Control, ParameterStudy};
use crate::error::{Diagnostic, Error, did_you_mean};
use crate::output::manifest::sha256;
use crate::report::{Column, Report, Table};
use std::ops::Range;

/// Plan of a parameter study, known before it runs.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyExtent {
    /// Number of runs, numbered 0 to `runs - 1`.
    pub runs: u64,
    /// Columns of the table, without values.
    pub columns: Vec<Column>,
    /// SHA-256 of everything that the rows depend on except the program: the model, the analysis, the space and the quantities.
    pub identity: String,
    /// Estimated duration of the most expensive run, in seconds.
    pub seconds: f64,
}

impl Study {
    /// The extent of a parameter study, by its name.
    ///
    /// # Errors
    /// [`Error::Input`]: an unknown name; an analysis that is not a parameter study.
    pub fn extent(&self, name: &str, control: &dyn Control) -> Result<StudyExtent, Error> {
        self.planned(name, control, |plan| StudyExtent {
            runs: plan.runs(),
            columns: plan.columns().to_vec(),
            identity: sha256(plan.identity().to_string().as_bytes()),
            seconds: plan.cost_of_a_run().seconds,
        })
    }

    /// The rows of some runs of a parameter study, one after another on this thread. Every row is a function of the run's number:
    /// bundles computed anywhere, in any order, join to the table that one machine writes.
    ///
    /// Returns fewer rows when an interruption comes: those that were finished before.
    ///
    /// # Errors
    /// As [`Study::extent`]; numbers beyond the last run.
    pub fn rows(
        &self,
        name: &str,
        runs: Range<u64>,
        control: &dyn Control,
    ) -> Result<Table, Error> {
        let (last, wanted) = (runs.end, runs.clone());
        let rows = |plan: &Plan<'_>| {
            if runs.start > runs.end || runs.end > plan.runs() {
                return Err(plan.runs());
            }
            let mut table = Table {
                name: String::new(),
                columns: plan.columns().to_vec(),
            };
            let mut worker = plan.worker();
            for (done, run) in runs.enumerate() {
                let Some(row) = worker.run(run) else { break };
                for (column, cell) in table.columns.iter_mut().zip(row.cells) {
                    column.values.push(cell);
                }
                let share = (done + 1) as f64 / (last - wanted.start) as f64;
                control.progress(name, share, "");
            }
            Ok(table)
        };
        let rows = control
            .interrupt()
            .scope(|| self.planned(name, control, rows))?;
        rows.map_err(|runs| {
            let message = format!(
                "no runs {} to {}: the study has {runs}, numbered from 0",
                wanted.start, wanted.end
            );
            refused(name, message, None)
        })
    }

    /// The report of a parameter study of which these rows are finished: the one that one machine delivers.
    ///
    /// # Errors
    /// As [`Study::extent`]; a table of another study.
    pub fn report_of(
        &self,
        name: &str,
        rows: Table,
        control: &dyn Control,
    ) -> Result<Report, Error> {
        let (run, study) = self.parameter_study(name)?;
        let (runs, columns) =
            self.planned(name, control, |plan| (plan.runs(), plan.columns().to_vec()))?;
        let is_own = columns.len() == rows.columns.len()
            && (columns.iter().zip(&rows.columns)).all(|(a, b)| a.name == b.name);
        if !is_own {
            return Err(refused(
                name,
                "these rows belong to another study".into(),
                None,
            ));
        }
        let filled = |column: &str, is_counted: fn(&str) -> bool| {
            let words = rows.column(column).and_then(|c| c.values.as_texts());
            let words = words.into_iter().flatten();
            words.filter(|word| is_counted(word)).count() as u64
        };
        let tally = Tally {
            runs,
            finished: rows.rows() as u64,
            failed: filled("status", |word| word != COMPLETE),
            warned: filled("warnings", |word| !word.is_empty()),
            stride: 1,
        };
        Ok(self.finish(run, study.report(rows, &tally), control))
    }

    fn parameter_study(&self, name: &str) -> Result<(&Run, &ParameterStudy), Error> {
        let Some(run) = self.runs.iter().find(|run| run.name == name) else {
            let names = self.runs.iter().map(|run| run.name.as_str());
            let help = did_you_mean(name, names);
            return Err(refused(name, "no such analysis".into(), Some(help)));
        };
        match run.analysis.study() {
            Some(study) => Ok((run, study)),
            None => {
                let message = format!("is a {}, wanted a parameter_study", run.kind);
                Err(refused(name, message, None))
            }
        }
    }

    fn planned<T>(
        &self,
        name: &str,
        control: &dyn Control,
        use_it: impl FnOnce(&Plan<'_>) -> T,
    ) -> Result<T, Error> {
        let (run, study) = self.parameter_study(name)?;
        let setting = self.setting(run, control);
        match Plan::new(study, &setting) {
            Ok(plan) => Ok(use_it(&plan)),
            Err(faults) => {
                let list = diagnostics(self.model.document(), name, faults);
                Err(Error::Input(list))
            }
        }
    }
}

fn refused(name: &str, message: String, help: Option<String>) -> Error {
    Error::Input(vec![Diagnostic {
        location: None,
        path: format!("analyses.{name}"),
        message,
        help,
    }])
}
