//! Running the analyses of a study and writing their results.

use super::ensemble::{DeliveredRuns, StudyEnsemble};
use super::load::diagnostics;
use super::shelf::Shelf;
use super::{Outcome, Run, RunSettings, Shard, Study, WrittenReport};
use crate::analysis::cost::Cost;
use crate::analysis::parameter_study::Plan;
use crate::analysis::{Control, panicked};
use crate::error::Error;
use crate::output::RunOptions;
use crate::output::folder::{self, Earlier};
use crate::output::journal::Journal;
use crate::report::Report;
use rayon::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

impl Study {
    /// What every analysis takes, with its name.
    ///
    /// # Errors
    /// An analysis that takes more memory than there is.
    pub fn costs(&self, control: &dyn Control) -> Result<Vec<(String, Cost)>, Error> {
        let (mut list, mut faults) = (Vec::new(), Vec::new());
        for run in &self.runs {
            let cost = run.analysis.cost(&self.setting(run, control));
            // Runs of a study that cannot be paid are rows of its table.
            let refusal = cost.refusal(control.memory());
            if let Some(fault) = refusal.filter(|_| run.analysis.study().is_none()) {
                faults.extend(diagnostics(self.model.document(), &run.name, vec![fault]));
            }
            list.push((run.name.clone(), cost));
        }
        match faults.is_empty() {
            true => Ok(list),
            false => Err(Error::Input(faults)),
        }
    }

    /// What the user should know before the analyses run: what takes long or much, and names that make trouble elsewhere.
    ///
    /// # Errors
    /// As [`Study::costs`].
    pub fn forewarnings(&self, control: &dyn Control) -> Result<Vec<String>, Error> {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let mut list = folder::name_warnings(&names);
        for (name, cost) in self.costs(control)? {
            list.extend(
                cost.warnings()
                    .into_iter()
                    .map(|text| format!("{name}: {text}")),
            );
        }
        Ok(list)
    }

    pub(super) fn run_part(
        &self,
        settings: &RunSettings,
        shard: Option<Shard>,
        control: &dyn Control,
    ) -> Result<Outcome, Error> {
        let costs = self.costs(control)?;
        folder::prepare(&settings.out)?;
        let earlier = Earlier::of(&settings.out);
        let options = RunOptions {
            model: self.model.name.clone(),
            figures: settings.figures.clone(),
            inputs: self.inputs(),
            settings: self.settings(),
            description: self.describe(),
            comparison: None,
        };
        let names = self.runs.iter().map(|run| run.name.clone()).collect();
        let shelf = Shelf::new(settings, options, names);
        let rescue = shelf.clone();
        control.in_emergency(Box::new(move || {
            let outcome = rescue.conclude_without_the_rest()?;
            Some(outcome.map(|outcome| outcome.left_out))
        }));
        if shard.is_none() {
            self.run_plain(settings, &shelf, &costs, control)?;
        }
        let journals = self.run_studies(settings, shard, &shelf, control)?;
        let mut outcome = shelf.conclude(control.is_interrupted())?;
        if shard.is_some() {
            let others = self
                .runs
                .iter()
                .filter(|run| run.analysis.study().is_none());
            outcome.left_out = others.map(|run| run.name.clone()).collect();
        }
        let known: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let written: Vec<&str> = outcome.reports.iter().map(|r| r.name.as_str()).collect();
        outcome.warnings = earlier.stale(&known, &written, &outcome.files);
        // Only now nothing that a kill could take away hangs on them.
        journals.into_iter().try_for_each(Journal::remove)?;
        Ok(outcome)
    }

    /// The analyses that are not parameter studies: side by side, unless their memory is too small for that.
    fn run_plain(
        &self,
        settings: &RunSettings,
        shelf: &Shelf,
        costs: &[(String, Cost)],
        control: &dyn Control,
    ) -> Result<(), Error> {
        let plain = |(place, run): (usize, &Run)| {
            if run.analysis.study().is_some() || control.is_interrupted() {
                return Ok(());
            }
            self.one(run, settings, (place, shelf), control)
        };
        let bytes: f64 = costs.iter().map(|(_, cost)| cost.bytes).sum();
        let fits = control.memory().is_none_or(|most| bytes <= most as f64);
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(settings.jobs)
            .build()
            .map_err(|error| Error::File {
                action: "start threads for",
                path: settings.out.clone(),
                source: std::io::Error::other(error),
            })?;
        pool.install(|| match fits {
            true => self.runs.par_iter().enumerate().try_for_each(plain),
            false => self.runs.iter().enumerate().try_for_each(plain),
        })
    }

    /// One analysis and its files. A panic in it is a fault of the program, and no reason to lose the others.
    fn one(
        &self,
        run: &Run,
        settings: &RunSettings,
        (place, shelf): (usize, &Shelf),
        control: &dyn Control,
    ) -> Result<(), Error> {
        let failed = |message: String| {
            let report = Report {
                ended_early: Some(message),
                ..Report::default()
            };
            self.finish(run, report, control)
        };
        let report = catch_unwind(AssertUnwindSafe(|| self.report(run, control)));
        let report = report.unwrap_or_else(|panic| Ok(failed(panicked(panic.as_ref()))))?;
        let write = || {
            let write = AssertUnwindSafe(|| WrittenReport::new(report, settings));
            catch_unwind(write).unwrap_or_else(|panic| {
                WrittenReport::new(failed(panicked(panic.as_ref())), settings)
            })
        };
        shelf.put(place, write)
    }

    /// The parameter studies, one after another. Returns the journals that are no longer needed once everything is on disk.
    fn run_studies(
        &self,
        settings: &RunSettings,
        shard: Option<Shard>,
        shelf: &Shelf,
        control: &dyn Control,
    ) -> Result<Vec<Journal>, Error> {
        let mut journals = Vec::new();
        for (place, run) in self.runs.iter().enumerate() {
            let Some(study) = run.analysis.study().filter(|_| !control.is_interrupted()) else {
                continue;
            };
            let setting = self.setting(run, control);
            let plan = Plan::new(study, &setting).map_err(|faults| {
                Error::Input(diagnostics(self.model.document(), &run.name, faults))
            })?;
            let ensemble = StudyEnsemble {
                name: &run.name,
                model: &self.model.name,
                caption: run.texts.caption.as_deref().unwrap_or_default(),
                warnings: &setting.assembly.warnings,
                study,
                plan: &plan,
                shard,
                settings,
                shelf,
                control,
            };
            let DeliveredRuns { report, journal } = ensemble.run()?;
            journals.extend(journal);
            shelf.put(place, || {
                WrittenReport::new(self.finish(run, report, control), settings)
            })?;
        }
        Ok(journals)
    }
}
