//! A study ready to run: each run from its number.

use super::ParameterStudy;
use super::collect::Collector;
use super::direction::{Coordinate, StudyParameter};
use super::place::{Destination, Target};
use super::space::Space;
use super::watch::RunWatch;
use crate::analysis::cost::Cost;
use crate::analysis::parameter::{entries, framed, joined, said};
use crate::analysis::{Analysis, Control, Fault, Setting, panicked};
use crate::assembly::Assembly;
use crate::error::Diagnostic;
use crate::model::{Knob, Model, NAMES, is_name};
use crate::report::{Cell, Column, Report, Values};
use crate::yaml::Node;
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A study ready to run.
pub struct Plan<'a> {
    setting: &'a Setting<'a>,
    target: Target,
    analysis: Box<dyn Analysis>,
    space: Space,
    collectors: Vec<Collector>,
    columns: Vec<Column>,
    identity: Value,
    /// Whether the analysis itself says how many points a branch has at most: one that has them is complete.
    limits_points: bool,
}

/// A finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyRow {
    /// Its cells, one per column of the plan.
    pub cells: Vec<Cell>,
    /// Whether the run delivered everything.
    pub is_complete: bool,
    /// Whether it had warnings.
    pub has_warnings: bool,
}

/// Outcome of a run, as a word in the table.
pub const COMPLETE: &str = "complete";
const ENDED_EARLY: &str = "ended_early";
const REFUSED: &str = "refused";
/// Columns after the collected ones.
const ENDING: [&str; 3] = ["status", "reason", "warnings"];
/// The key of the largest number of points of a branch, and why a branch ends that has them.
const MAX_POINTS: &str = "max_points";
/// Values looked at before anything runs.
const PROBES: usize = 256;
/// Values whose cost is looked at.
const COST_PROBES: usize = 64;
/// Characters of a text in the table.
const LONGEST: usize = 500;

impl<'a> Plan<'a> {
    /// Reads the study's target, space and quantities.
    ///
    /// # Errors
    /// Everything wrong with them.
    pub fn new(study: &ParameterStudy, setting: &'a Setting<'a>) -> Result<Plan<'a>, Vec<Fault>> {
        let target = Target::new(study, setting)?;
        let space = Space::new(study, setting, &target);
        let analysis = target.analysis();
        let (space, analysis) = match (space, analysis) {
            (Ok(space), Ok(analysis)) => (space, analysis),
            (space, analysis) => {
                return Err(space
                    .err()
                    .into_iter()
                    .chain(analysis.err())
                    .flatten()
                    .collect());
            }
        };
        let own = target.setting(setting, setting.control);
        let mut faults: Vec<Fault> = (super::super::check(analysis.as_ref(), &own).iter())
            .map(|fault| target.fault(fault))
            .collect();
        let mut collectors = Vec::new();
        // Tables depend on settings that have just been found good.
        if faults.is_empty() {
            let tables = analysis.tables(&own);
            for (name, written) in &study.collect {
                if !is_name(name) {
                    let message = format!("names {NAMES}");
                    faults.push(Fault::new(format!("collect.{name}"), message));
                    continue;
                }
                match Collector::new(name, written, (&target.kind, &tables), &own) {
                    Ok(collector) => collectors.push(collector),
                    Err(list) => faults.extend(list),
                }
            }
        }
        if study.collect.is_empty() {
            faults.push(Fault::new(
                "collect",
                "nothing to collect: give at least one quantity",
            ));
        }
        let columns = columns(&space, &collectors);
        faults.extend(repeated(&columns));
        if !faults.is_empty() {
            return Err(faults);
        }
        let identity = identity(study, &target, &columns);
        let is_varied = |d: &StudyParameter| d.place == Destination::Analysis(MAX_POINTS.into());
        let limits_points =
            target.own.get(MAX_POINTS).is_some() && !space.directions.iter().any(is_varied);
        Ok(Plan {
            setting,
            target,
            analysis,
            space,
            collectors,
            columns,
            identity,
            limits_points,
        })
    }

    /// Number of runs.
    pub fn runs(&self) -> u64 {
        self.space.runs()
    }

    /// Columns of the table, without values.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Everything that the rows depend on but the program: the model, the analysis, the space and the quantities.
    pub fn identity(&self) -> &Value {
        &self.identity
    }

    /// Whoever runs one run after another.
    pub fn worker(&self) -> Worker<'_> {
        Worker {
            plan: self,
            own: self.target.own.clone(),
        }
    }

    /// Cost of the most expensive run that is not refused, at the values known beforehand.
    pub fn cost_of_a_run(&self) -> Cost {
        let mut worker = self.worker();
        let own = self.target.setting(self.setting, self.setting.control);
        let first = self.analysis.cost(&own);
        let memory = self.setting.control.memory();
        let values = self.space.probes(COST_PROBES).into_iter();
        let costs = values.filter_map(|(_, values)| {
            let prepared = worker.prepare(&values).ok()?;
            let setting = worker.setting(&prepared, self.setting.control);
            let cost = worker.analysis(&prepared).cost(&setting);
            cost.refusal(memory).is_none().then_some(cost)
        });
        costs.fold(first, |most, cost| Cost {
            bytes: most.bytes.max(cost.bytes),
            ..if cost.seconds > most.seconds {
                cost
            } else {
                most
            }
        })
    }

    /// What the model and the analysis say about the values that can be seen beforehand.
    pub(super) fn check_values(&self) -> Vec<Fault> {
        let mut worker = self.worker();
        let probe = |(key, values): (String, Vec<Coordinate>)| {
            let message = worker.prepare(&values).err()?;
            Some(Fault::new(key, message))
        };
        let mut faults: Vec<Fault> = self
            .space
            .probes(PROBES)
            .into_iter()
            .filter_map(probe)
            .collect();
        faults.dedup_by(|a, b| a.message == b.message);
        faults
    }
}

impl Target {
    /// The model with other numbers and parts, and its assembly; `None` if nothing changes.
    fn changed(
        &self,
        numbers: &[(&Knob, f64)],
        mut parts: Vec<(String, Node)>,
    ) -> Result<Option<(Model, Assembly)>, Vec<Diagnostic>> {
        let model = match (numbers, parts.is_empty()) {
            ([], true) => return Ok(None),
            (numbers, true) => self.varied.changed(numbers)?,
            (numbers, false) => {
                let all = numbers.iter().map(|(knob, x)| entries(knob, *x));
                parts.extend(all.flatten());
                self.varied.with_parts(parts)?
            }
        };
        framed(model, &self.assembly).map(Some)
    }

    /// The setting of the analysis with the model as written.
    fn setting<'a>(&'a self, outer: &Setting<'a>, control: &'a dyn Control) -> Setting<'a> {
        Setting {
            name: outer.name,
            model: &self.model,
            assembly: &self.assembly,
            control,
        }
    }
}

/// Runs one run after another. Every run sets all parameters, so that none sees what another one left.
pub struct Worker<'a> {
    plan: &'a Plan<'a>,
    /// Keys of the analysis.
    own: Node,
}

/// A run about to start: what differs from the plan.
struct Prepared {
    model: Option<(Model, Assembly)>,
    analysis: Option<Box<dyn Analysis>>,
}

impl Worker<'_> {
    /// A run by its number; `None` when it was interrupted.
    pub fn run(&mut self, run: u64) -> Option<StudyRow> {
        let plan = self.plan;
        let watch = RunWatch::new(plan.setting.control);
        if watch.is_interrupted() {
            return None;
        }
        let values = plan.space.values(run);
        let outcome = self.outcome(&values, &watch);
        // Whatever was being computed when the interruption came may be incomplete: the run is repeated.
        if watch.has_spoken() || watch.is_interrupted() {
            return None;
        }
        let (mut report, refusal) = match outcome {
            Ok(report) => (report, None),
            Err(reason) => (Report::default(), Some(reason)),
        };
        if plan.limits_points && ends_within_limits(&report) {
            report.warnings.extend(report.ended_early.take());
        }
        let (status, reason) = match (&refusal, &report.ended_early) {
            (Some(reason), _) => (REFUSED, reason.as_str()),
            (None, Some(reason)) => (ENDED_EARLY, reason.as_str()),
            (None, None) => (COMPLETE, ""),
        };
        let number = i64::try_from(run).expect("a study has at most i64::MAX runs");
        let mut cells = vec![Cell::Integer(number)];
        cells.extend(values.iter().map(Coordinate::cell));
        cells.extend(plan.collectors.iter().map(|c| c.cell(&report)));
        let warnings = report.warnings.join("; ");
        cells.extend([status, reason, &warnings].map(|text| Cell::Text(cropped(text))));
        Some(StudyRow {
            cells,
            is_complete: status == COMPLETE,
            has_warnings: !warnings.is_empty(),
        })
    }

    /// The report of a run, or why there is none.
    fn outcome(&mut self, values: &[Coordinate], watch: &RunWatch<'_>) -> Result<Report, String> {
        let prepared = self.prepare(values)?;
        let setting = self.setting(&prepared, watch);
        let analysis = self.analysis(&prepared);
        if let Some(fault) = analysis.cost(&setting).refusal(setting.control.memory()) {
            return Err(format!("analysis.{}: {}", fault.key, fault.message));
        }
        let run = AssertUnwindSafe(|| analysis.run(&setting));
        let outcome = catch_unwind(run).map_err(|panic| panicked(panic.as_ref()))?;
        let mut report = outcome.map_err(|e| e.to_string())?;
        // What is true of the model as written is said once, by the study.
        let known = &self.plan.target.assembly.warnings;
        let own = setting.assembly.warnings.iter();
        let mut warnings: Vec<String> = own.filter(|w| !known.contains(w)).cloned().collect();
        warnings.append(&mut report.warnings);
        report.warnings = warnings;
        Ok(report)
    }

    /// Puts the values in their places and reads what is there.
    fn prepare(&mut self, values: &[Coordinate]) -> Result<Prepared, String> {
        let target = &self.plan.target;
        let mut changes_analysis = false;
        let (mut numbers, mut parts) = (Vec::new(), Vec::new());
        for (direction, value) in self.plan.space.directions.iter().zip(values) {
            match (&direction.place, value) {
                (Destination::Number(knob), Coordinate::Number(x)) => {
                    numbers.push((knob.as_ref(), *x));
                }
                (Destination::Number(knob), Coordinate::Word(_)) => {
                    parts.push((knob.name().to_owned(), direction.node(value)));
                }
                (Destination::Part(path), _) => parts.push((path.clone(), direction.node(value))),
                (Destination::Analysis(path), _) => {
                    changes_analysis = true;
                    let set = self.own.set(path, direction.node(value));
                    set.map_err(|mistake| said(&mistake))?;
                }
            }
            if let Coordinate::Number(x) = value {
                let followers = direction.followers.iter();
                numbers.extend(followers.map(|f| (&f.knob, f.relation.value(*x))));
            }
        }
        let prepared = Prepared {
            model: target
                .changed(&numbers, parts)
                .map_err(|list| joined(&list))?,
            analysis: match changes_analysis {
                true => Some(self.own.read("analysis").map_err(|d| said(&d))?),
                false => None,
            },
        };
        let setting = self.setting(&prepared, self.plan.setting.control);
        let faults = super::super::check(self.analysis(&prepared), &setting);
        match faults.first() {
            None => Ok(prepared),
            Some(_) => {
                let text = |f: &Fault| format!("analysis.{}: {}", f.key, f.message);
                Err(faults.iter().map(text).collect::<Vec<_>>().join("; "))
            }
        }
    }

    fn setting<'s>(&'s self, prepared: &'s Prepared, control: &'s dyn Control) -> Setting<'s> {
        let target = &self.plan.target;
        let (model, assembly) = match &prepared.model {
            Some((model, assembly)) => (model, assembly),
            None => (&target.model, &target.assembly),
        };
        Setting {
            name: self.plan.setting.name,
            model,
            assembly,
            control,
        }
    }

    fn analysis<'s>(&'s self, prepared: &'s Prepared) -> &'s dyn Analysis {
        let own = prepared.analysis.as_ref();
        own.unwrap_or(&self.plan.analysis).as_ref()
    }
}

/// Whether every branch of a report went as far as the range or the limit of points.
fn ends_within_limits(report: &Report) -> bool {
    let branches = report.summary.get("branches").and_then(Value::as_array);
    let reason = |branch: &Value| branch["end"]["reason"].as_str().map(String::from);
    let mut reasons = branches.into_iter().flatten().map(reason);
    let usual = ["range_reached", "closed", "joined", MAX_POINTS];
    reasons.all(|reason| reason.is_some_and(|reason| usual.contains(&reason.as_str())))
}

/// `run`, the parameters, the quantities, `status, reason, warnings`.
fn columns(space: &Space, collectors: &[Collector]) -> Vec<Column> {
    let plain = |name: &str, values| Column {
        name: name.into(),
        unit: String::new(),
        values,
    };
    let mut list = vec![plain("run", Values::Integer(Vec::new()))];
    list.extend(space.directions.iter().map(|d| d.column.clone()));
    list.extend(collectors.iter().map(|c| c.column.clone()));
    list.extend(ENDING.map(|name| plain(name, Values::Text(Vec::new()))));
    list
}

/// Quantities whose name another column has.
fn repeated(columns: &[Column]) -> Vec<Fault> {
    let is_repeated = |k: usize| {
        let others = columns.iter().enumerate().filter(|(i, _)| *i != k);
        others.into_iter().any(|(_, c)| c.name == columns[k].name)
    };
    let names = (0..columns.len())
        .filter(|k| is_repeated(*k))
        .map(|k| &columns[k].name);
    let mut names: Vec<&String> = names.collect();
    names.dedup();
    names.sort();
    names.dedup();
    let fault = |name: &&String| {
        let message = "another column of the table has this name; choose another one";
        Fault::new(format!("collect.{name}"), message)
    };
    names.iter().map(fault).collect()
}

fn identity(study: &ParameterStudy, target: &Target, columns: &[Column]) -> Value {
    let column = |c: &Column| json!({"name": c.name, "unit": c.unit, "kind": c.values.kind()});
    let columns: Vec<Value> = columns.iter().map(column).collect();
    json!({
        "model": target.varied.document().to_json(),
        "analysis": target.own.to_json(),
        "grid": study.grid,
        "list": study.list,
        "sample": study.sample,
        "collect": study.collect,
        "columns": columns,
        "link": study.link,
    })
}

fn cropped(text: &str) -> String {
    let mut short: String = text.chars().take(LONGEST).collect();
    if text.chars().nth(LONGEST).is_some() {
        short.push('…');
    }
    short
}
