//! A study: a model file, its analyses checked before anything runs, and their results on disk.

use crate::analysis::{Analysis, Control, Setting};
use crate::assembly::Assembly;
use crate::error::{Diagnostic, Error, Source};
use crate::model::Model;
use crate::output::{self, FigureFormat, Input, RunOptions};
use crate::report::{Plot, Report};
use crate::yaml::{self, Node};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

mod bundle;
mod compare;
mod describe;
mod ensemble;
mod load;
mod measured;
mod memory;
mod merge;
mod plotting;
mod record;
mod redraw;
mod results;
mod run;
mod scrutiny;
mod shard;
mod shelf;

pub use bundle::StudyExtent;
pub use compare::{compare, default_folder};
pub use merge::merge;
pub use redraw::redraw;
pub use results::{History, Iterates, ResponseCurves, ResponseEvent, ResponsePoint};
pub use shard::Shard;

use load::{analyses, assembled, build, load_run, names, without_repetition};
use measured::Points;

/// A model file ready to run.
#[derive(Debug)]
pub struct Study {
    /// Texts that it was made from, in order: what a hash of the input is taken of.
    sources: Vec<Arc<Source>>,
    /// The model as written, without any analysis's own settings.
    pub model: Model,
    /// Its assembly.
    pub assembly: Assembly,
    /// Analyses in the order of the file, those that were chosen.
    pub runs: Vec<Run>,
    /// Names of all analyses of the file.
    pub names: Vec<String>,
}

/// One analysis with the model under which it runs.
#[derive(Debug)]
pub struct Run {
    /// Name in the file.
    pub name: String,
    kind: String,
    texts: Texts,
    /// What is drawn over its figures.
    measured: Vec<Points>,
    analysis: Box<dyn Analysis>,
    /// The model with the analysis's own `set:`; `None` when it has none.
    own: Option<Built>,
}

/// A model and its assembly.
type Built = (Model, Assembly);

/// Keys that every analysis takes besides its own.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Texts {
    title: Option<String>,
    caption: Option<String>,
    assumed: Vec<String>,
    plot: Option<Plot>,
}

/// Output settings of a run.
#[derive(Debug, Clone)]
pub struct RunSettings {
    /// Results folder.
    pub out: PathBuf,
    /// Figure formats.
    pub figures: Vec<FigureFormat>,
    /// Threads.
    pub jobs: usize,
}

/// Outcome of a run.
#[derive(Debug)]
pub struct Outcome {
    /// Reports in the order of the file; analyses that an interruption kept from starting are missing.
    pub reports: Vec<Report>,
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Whether the user interrupted the run.
    pub interrupted: bool,
    /// Analyses that are not parameter studies, when a part of the studies was to run; or those that did not end in time when the
    /// process had to.
    pub left_out: Vec<String>,
    /// Warnings about the folder.
    pub warnings: Vec<String>,
}

/// A report whose files are on disk.
struct WrittenReport {
    report: Report,
    files: Vec<PathBuf>,
}

impl WrittenReport {
    fn new(report: Report, settings: &RunSettings) -> Result<WrittenReport, Error> {
        let files = output::write_report(&settings.out, &report, &settings.figures)?;
        Ok(WrittenReport { report, files })
    }
}

impl Outcome {
    /// Writes the page and the manifest.
    fn summarised(
        written: Vec<WrittenReport>,
        settings: &RunSettings,
        options: &RunOptions,
        interrupted: bool,
    ) -> Result<Outcome, Error> {
        let files: Vec<PathBuf> = written.iter().flat_map(|w| w.files.clone()).collect();
        let reports: Vec<Report> = written.into_iter().map(|w| w.report).collect();
        let summary = output::write_summary(&settings.out, &reports, options, &files)?;
        Ok(Outcome {
            reports,
            files: files.into_iter().chain(summary).collect(),
            interrupted,
            left_out: Vec::new(),
            warnings: Vec::new(),
        })
    }
}

impl Study {
    /// Loads, validates and assembles a model file and checks its analyses, all of them or those named in `only`.
    ///
    /// # Errors
    /// All errors found; nothing is run and nothing is written.
    pub fn load(path: &Path, overrides: &[String], only: &[String]) -> Result<Study, Error> {
        let document = yaml::load(path, overrides)?;
        let base =
            build(&document.root).map(|(model, assembly)| (model.called_after(path), assembly));
        Study::new(&document.root, base, only, document.sources)
    }

    /// The analyses of a model in memory, all of them or those named in `only`, checked.
    ///
    /// # Errors
    /// All errors found.
    pub fn of(model: &Model, only: &[String]) -> Result<Study, Error> {
        Study::new(model.document(), assembled(model.clone()), only, Vec::new())
    }

    fn new(
        root: &Node,
        base: Result<Built, Vec<Diagnostic>>,
        only: &[String],
        sources: Vec<Arc<Source>>,
    ) -> Result<Study, Error> {
        let mut faults = Vec::new();
        let base = base.map_err(|list| faults.extend(list)).ok();
        let mut runs = Vec::new();
        for (name, entry) in analyses(root, only).unwrap_or_else(|list| {
            faults.extend(list);
            Vec::new()
        }) {
            match load_run(root, name, entry, base.as_ref()) {
                Ok(run) => runs.push(run),
                Err(list) => faults.extend(list),
            }
        }
        match base {
            Some((model, assembly)) if faults.is_empty() => Ok(Study {
                names: names(root),
                sources,
                model,
                assembly,
                runs,
            }),
            _ => Err(Error::Input(without_repetition(faults))),
        }
    }

    /// Runs the analyses side by side, then the parameter studies one after another, each on all threads. Writes each one's
    /// files as soon as it ends, then the page and the manifest.
    ///
    /// # Errors
    /// A file that cannot be written; finished results stay.
    pub fn run(&self, settings: &RunSettings, control: &dyn Control) -> Result<Outcome, Error> {
        self.run_part(settings, None, control)
    }

    /// The same for one part of the runs of every parameter study; other analyses are left out.
    ///
    /// # Errors
    /// As [`Study::run`]; when there is no parameter study; when the folder holds another part.
    pub fn run_shard(
        &self,
        settings: &RunSettings,
        shard: Shard,
        control: &dyn Control,
    ) -> Result<Outcome, Error> {
        if self.runs.iter().all(|run| run.analysis.study().is_none()) {
            return Err(Error::Input(vec![Diagnostic {
                location: None,
                path: "--shard".into(),
                message: "no parameter_study to run: nothing to divide".into(),
                help: None,
            }]));
        }
        self.run_part(settings, Some(shard), control)
    }

    /// The reports of all analyses, one after another, without writing anything.
    ///
    /// # Errors
    /// Misuse that the checks could not see.
    pub fn reports(&self, control: &dyn Control) -> Result<Vec<Report>, Error> {
        self.runs
            .iter()
            .map(|run| self.report(run, control))
            .collect()
    }

    fn report(&self, run: &Run, control: &dyn Control) -> Result<Report, Error> {
        let setting = self.setting(run, control);
        let report = control.interrupt().scope(|| run.analysis.run(&setting))?;
        Ok(self.finish(run, report, control))
    }

    /// The model under which an analysis runs.
    fn setting<'a>(&'a self, run: &'a Run, control: &'a dyn Control) -> Setting<'a> {
        let (model, assembly) = match &run.own {
            Some((model, assembly)) => (model, assembly),
            None => (&self.model, &self.assembly),
        };
        Setting {
            name: &run.name,
            model,
            assembly,
            control,
        }
    }

    /// A report with its name, its texts, and what the model says.
    fn finish(&self, run: &Run, mut report: Report, control: &dyn Control) -> Report {
        let assembly = run.own.as_ref().map_or(&self.assembly, |own| &own.1);
        report.name = run.name.clone();
        report.kind = run.kind.clone();
        report.title = run.texts.title.clone().unwrap_or_else(|| run.name.clone());
        let own = run.texts.caption.clone().unwrap_or_default();
        let parts = [own, std::mem::take(&mut report.caption)];
        report.caption = parts
            .into_iter()
            .filter(|text| !text.is_empty())
            .collect::<Vec<_>>()
            .join(" ");
        report.assumed = run.texts.assumed.clone();
        finish(&mut report, assembly);
        plotting::dress(
            &mut report,
            run.texts.plot.clone().unwrap_or_default(),
            (run.own.as_ref().map_or(&self.model, |own| &own.0), assembly),
        );
        measured::add(&mut report, &run.measured);
        // An interruption that the user did not request has a reason.
        if let (Some(end), Some(reason)) = (&mut report.ended_early, control.reason()) {
            *end = end.replacen("interrupted", &reason, 1);
        }
        report
    }

    fn inputs(&self) -> Vec<Input> {
        let texts = (self.sources.iter()).map(|s| Input::of(s.name.clone(), s.text.as_bytes()));
        let own = self.runs.iter().filter_map(|run| run.own.as_ref());
        let models = std::iter::once(&self.model).chain(own.map(|own| &own.0));
        let mut tables: Vec<&PathBuf> = models.flat_map(|model| &model.files).collect();
        let measured = self.runs.iter().flat_map(|run| &run.measured);
        tables.extend(measured.map(|measured| &measured.path));
        let control = load::Unattended;
        let of = |run: &Run| run.analysis.files(&self.setting(run, &control));
        let read: Vec<PathBuf> = self.runs.iter().flat_map(of).collect();
        tables.extend(&read);
        tables.sort();
        tables.dedup();
        // They were read a moment ago; one that has gone since leaves no hash.
        let tables = tables.into_iter().filter_map(|path| {
            let bytes = std::fs::read(path).ok()?;
            Some(Input::of(path.display().to_string(), &bytes))
        });
        texts.chain(tables).collect()
    }

    fn settings(&self) -> Map<String, Value> {
        let analysis = |run: &Run| {
            (
                run.name.clone(),
                serde_json::to_value(&run.analysis).unwrap_or(Value::Null),
            )
        };
        self.runs.iter().map(analysis).collect()
    }
}

/// Adds what the model says to a report.
fn finish(report: &mut Report, assembly: &Assembly) {
    // The assembly hands on the warnings of the model.
    let mut warnings = assembly.warnings.clone();
    warnings.append(&mut report.warnings);
    report.warnings = warnings;
    report.summary.insert("scales".into(), scales(assembly));
    scrutiny::examine(report);
}

fn scales(assembly: &Assembly) -> Value {
    let scales = &assembly.scales;
    let displacement: Map<String, Value> = assembly
        .connections
        .iter()
        .zip(&scales.displacement)
        .map(|(name, l)| (name.clone(), json!(l)))
        .collect();
    json!({ "omega_c": scales.frequency, "displacement": displacement })
}
