//! Analyses of a model in memory, without files.

use super::load::{self, diagnostics};
use super::{Study, finish};
use crate::analysis::{Analysis, Control, Setting, panicked};
use crate::assembly::Assembly;
use crate::error::{Diagnostic, Error, did_you_mean};
use crate::interrupt::Interrupt;
use crate::model::Model;
use crate::report::Report;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Name of an analysis that has none.
const UNNAMED: &str = "analysis";

impl Model {
    /// Names of the model's analyses, in the order of the file.
    pub fn analyses(&self) -> Vec<String> {
        load::names(self.document())
    }

    /// Nondimensional system with scales, names and natural frequencies.
    ///
    /// # Errors
    /// [`Error::Input`]: the model cannot be assembled.
    pub fn assemble(&self) -> Result<Assembly, Error> {
        let (_, assembly) = load::assembled(self.clone()).map_err(Error::Input)?;
        Ok(assembly)
    }

    /// Runs an analysis of the model by its name.
    ///
    /// # Errors
    /// [`Error::Input`]: an unknown name, with the nearest valid name; settings that the model does not admit.
    pub fn run(&self, analysis: &str) -> Result<Report, Error> {
        self.run_observed(analysis, &Interrupt::default())
    }

    /// Runs an analysis of the model by its name and reports progress to an observer, which may stop it.
    ///
    /// The report is then partial, and `ended_early` gives the reason.
    ///
    /// # Errors
    /// As [`Model::run`].
    pub fn run_observed(&self, analysis: &str, observer: &dyn Control) -> Result<Report, Error> {
        let known = self.analyses();
        if !known.iter().any(|name| name == analysis) {
            return Err(Error::Input(vec![Diagnostic {
                location: None,
                path: "analyses".into(),
                message: format!("no analysis is called `{analysis}`"),
                help: Some(did_you_mean(analysis, &known)),
            }]));
        }
        let study = Study::of(self, &[analysis.to_owned()])?;
        let [run] = study.runs.as_slice() else {
            return Ok(Report::default());
        };
        study.costs(observer)?;
        whole(|| study.report(run, observer))
    }

    /// Runs an analysis built in code.
    ///
    /// # Errors
    /// [`Error::Input`]: settings that the model does not admit; paths begin with `analysis`.
    pub fn run_analysis(
        &self,
        analysis: &dyn Analysis,
        observer: &dyn Control,
    ) -> Result<Report, Error> {
        let (model, assembly) = load::assembled(self.clone()).map_err(Error::Input)?;
        let setting = Setting {
            name: UNNAMED,
            model: &model,
            assembly: &assembly,
            control: observer,
        };
        let mut faults = analysis.check(&setting);
        if faults.is_empty() {
            faults.extend(analysis.cost(&setting).refusal(observer.memory()));
        }
        if !faults.is_empty() {
            let list = diagnostics(self.document(), UNNAMED, faults);
            return Err(Error::Input(list.into_iter().map(without_root).collect()));
        }
        whole(|| {
            let mut report = observer.interrupt().scope(|| analysis.run(&setting))?;
            report.name = UNNAMED.into();
            report.kind = analysis.typetag_name().into();
            finish(&mut report, &assembly);
            Ok(report)
        })
    }
}

/// The path of a fault without the part of a file's analyses.
fn without_root(fault: Diagnostic) -> Diagnostic {
    let path = fault.path.strip_prefix("analyses.");
    Diagnostic {
        path: path.unwrap_or(&fault.path).to_owned(),
        ..fault
    }
}

/// A report, also where a fault of the program ends the run.
fn whole(run: impl FnOnce() -> Result<Report, Error>) -> Result<Report, Error> {
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        Ok(Report {
            ended_early: Some(panicked(panic.as_ref())),
            ..Report::default()
        })
    })
}
