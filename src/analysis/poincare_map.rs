//! States at phase 0 of the excitation, period after period, from one or several initial states (figures 5 and 6).

use super::cost::{Cost, Period};
use super::flow::{self, LabelKeys, PreparedMotion};
use super::map_table::{MapRows, dots};
use super::{Analysis, Fault, Initial, Setting, columns};
use crate::error::Error;
use crate::interrupt;
use crate::quantity::Quantity;
use crate::report::{Figure, Panel, Report, Table};
use crate::solve::attractor::lyapunov::Exponents;
use crate::solve::attractor::{
    Attractor, HeadStart, LabelOptions, Lengths, MapSize, Stroboscopic, attractor_from, head_starts,
};
use crate::solve::ensemble::Ensemble;
use crate::solve::integrate::{IntegratorChoice, IntegratorOptions};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Settings of `poincare_map`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct PoincareMap {
    /// Excitation frequency.
    pub at: Quantity,
    /// Periods of the excitation recorded.
    #[serde(default = "defaults::periods")]
    pub periods: usize,
    /// Periods before the record.
    #[serde(default = "defaults::periods")]
    pub transient: usize,
    /// State at phase 0.
    #[serde(default)]
    pub initial: Option<Initial>,
    /// Several initial states, one run each.
    #[serde(default)]
    pub initials: Option<Vec<Initial>>,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// Local error of the series flow, relative to the motion; default 1e-12.
    #[serde(default)]
    pub flow_tolerance: Option<f64>,
    /// Compute Lyapunov exponents for the labels.
    #[serde(default = "defaults::lyapunov")]
    pub lyapunov: bool,
    /// Longest period of a label; default 256.
    #[serde(default)]
    pub longest_period: Option<usize>,
    /// Limit to which an undecided record is extended, in lengths of the record; default 8.
    #[serde(default)]
    pub extend: Option<usize>,
}

pub(super) mod defaults {
    pub fn periods() -> usize {
        200
    }
    pub fn lyapunov() -> bool {
        true
    }
}

/// Iterates spent, per decision, on the search for attracting orbits among the points: runs are few.
const EFFORT: usize = 2000;
/// Initial states whose transients are gone through together.
const TOGETHER: usize = 8;
/// Periods between two reports of the progress.
pub(super) const REPORTED: usize = 64;

#[typetag::serde(name = "poincare_map")]
impl Analysis for PoincareMap {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let states = self.states();
        let mut faults = flow::check_motions(setting, &self.at, &states, self.flow());
        if self.initial.is_some() && self.initials.is_some() {
            let message = "give `initial` for one run or `initials` for several, not both";
            faults.push(Fault::new("initials", message));
        }
        if self.initials.as_ref().is_some_and(Vec::is_empty) {
            faults.push(Fault::new("initials", "an empty list: nothing to run"));
        }
        faults.extend(flow::check_size(self.size(), states.len()));
        faults.extend(self.label_keys().check());
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let Ok(frequency) = setting.frequency(&self.at) else {
            return Cost::default();
        };
        let period = Period::of(setting, frequency);
        flow::cost(self.size(), setting, period, self.states().len())
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let began = Instant::now();
        let states = self.states();
        let total = states.len() * (self.transient + self.periods);
        let done = AtomicUsize::new(0);
        let flag = interrupt::current();
        let count = || {
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            if count.is_multiple_of(REPORTED) {
                let words = format!("period {count} of {total}");
                // Extended records take longer than the stated one.
                let share = (count as f64 / total as f64).min(1.0);
                setting.control.progress(setting.name, share, &words);
            }
            !setting.control.is_interrupted()
        };
        let begun: Result<Vec<Vec<Begun>>, Fault> = (states.par_chunks(TOGETHER))
            .map(|states| flag.scope(|| self.begin(setting, states, &count)))
            .collect();
        let runs: Result<Vec<MapRun>, Fault> = begun.map(|begun| {
            let begun: Vec<Begun> = begun.into_iter().flatten().collect();
            let one = |begun| flag.scope(|| self.one(setting, begun, &count));
            begun.into_par_iter().map(one).collect()
        });
        let runs = runs.map_err(|fault| columns::refused(setting, fault))?;
        let mut report = self.report(setting, &runs);
        let seconds = began.elapsed().as_secs_f64();
        (report.summary).insert("timings".into(), json!({ "seconds": seconds }));
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        self.report(setting, &[]).tables
    }
}

/// A motion, and what it has behind it.
type Begun = (PreparedMotion, HeadStart);

/// What became of one initial state.
struct MapRun {
    attractor: Attractor,
    integrator: &'static str,
    warnings: Vec<String>,
}

impl PoincareMap {
    fn size(&self) -> MapSize {
        MapSize {
            transient: self.transient,
            periods: self.periods,
            exponents: Lengths::wanted(self.lyapunov),
        }
    }

    fn flow(&self) -> IntegratorOptions {
        flow::options(self.integrator, self.flow_tolerance)
    }

    fn label_keys(&self) -> LabelKeys {
        LabelKeys {
            longest_period: self.longest_period,
            extend: self.extend,
        }
    }

    /// Initial states with their keys.
    fn states(&self) -> Vec<(String, Initial)> {
        match &self.initials {
            Some(list) => (list.iter().enumerate())
                .map(|(k, state)| (format!("initials.{k}"), state.clone()))
                .collect(),
            None => vec![("initial".into(), self.initial.clone().unwrap_or_default())],
        }
    }

    /// Motions from some of the states; several go through their transients together.
    fn begin(
        &self,
        setting: &Setting<'_>,
        states: &[(String, Initial)],
        count: &(dyn Fn() -> bool + Sync),
    ) -> Result<Vec<Begun>, Fault> {
        let motions: Result<Vec<PreparedMotion>, Fault> = (states.iter())
            .map(|(key, initial)| {
                PreparedMotion::new(setting, &self.at, (key, initial), self.flow())
            })
            .collect();
        let mut motions = motions?;
        let ensemble = motions.first().filter(|_| motions.len() > 1);
        let ensemble = ensemble.map(|motion| Ensemble::new(&motion.system, self.flow()));
        let Some(Ok(mut ensemble)) = ensemble else {
            let alone = |motion| (motion, HeadStart::default());
            return Ok(motions.into_iter().map(alone).collect());
        };
        let mut starts: Vec<Vec<f64>> = motions.iter().map(|m| m.state.clone()).collect();
        let system = &motions[0].system;
        let heads = head_starts(
            &mut ensemble,
            system,
            &mut starts,
            self.transient,
            &mut || count(),
        );
        for (motion, state) in motions.iter_mut().zip(starts) {
            motion.state = state;
        }
        let heads = heads.into_iter().map(Option::unwrap_or_default);
        Ok(motions.into_iter().zip(heads).collect())
    }

    fn one(
        &self,
        setting: &Setting<'_>,
        (mut motion, head): Begun,
        count: &(dyn Fn() -> bool + Sync),
    ) -> MapRun {
        let mut keep_going = |_: usize| count();
        let mut map = Stroboscopic {
            system: &motion.system,
            integrator: motion.integrator.as_mut(),
        };
        let options = LabelOptions {
            effort: EFFORT,
            ..self.label_keys().options()
        };
        let begin = (motion.state.as_mut_slice(), head);
        let attractor = attractor_from(&mut map, begin, self.size(), options, &mut keep_going);
        let integrator = motion.integrator.as_ref();
        let (name, strain) = (integrator.name(), integrator.strain());
        MapRun {
            attractor,
            integrator: name,
            warnings: (motion.warning.into_iter())
                .chain(flow::labour(name, strain, setting))
                .collect(),
        }
    }

    fn report(&self, setting: &Setting<'_>, runs: &[MapRun]) -> Report {
        let mut rows = MapRows::new(setting);
        let mut list = Vec::new();
        for (number, run) in runs.iter().enumerate() {
            let count = rows.append(number, self.transient, &run.attractor.record);
            let values = run.attractor.record.exponents.as_ref().map(|e| &e.values);
            list.push(json!({
                "run": number,
                "label": run.attractor.label.to_string(),
                "integrator": run.integrator,
                "periods": count,
                "extension": run.attractor.extension,
                "lyapunov": values,
                "stop": run.attractor.record.stop.map(|s| flow::tell(s, setting)),
            }));
        }
        let stops: Vec<String> = (runs.iter().enumerate())
            .filter_map(|(k, run)| {
                Some(format!(
                    "run {k}: {}",
                    flow::tell(run.attractor.record.stop?, setting)
                ))
            })
            .collect();
        let mut warnings: Vec<String> = runs.iter().flat_map(|r| r.warnings.clone()).collect();
        warnings.dedup();
        let labels: Vec<String> = runs.iter().map(|r| r.attractor.label.to_string()).collect();
        let mut report = Report {
            tables: vec![rows.table(), self.summary(setting, runs)],
            figure: Some(figure(setting, &labels)),
            warnings,
            ended_early: (!stops.is_empty()).then(|| stops.join("; ")),
            ..Report::default()
        };
        columns::explain_exponents(&mut report, &of_runs(runs));
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        for (key, value) in [
            ("options", options),
            ("integrator", json!(runs.first().map(|r| r.integrator))),
            ("runs", Value::Array(list)),
        ] {
            report.summary.insert(key.into(), value);
        }
        report
    }

    /// `run, label, lyapunov_1..`, exponents in units of omega_c.
    fn summary(&self, setting: &Setting<'_>, runs: &[MapRun]) -> Table {
        let label = |run: &MapRun| run.attractor.label.to_string();
        let mut list = vec![
            columns::integer("run", (0..runs.len() as i64).collect()),
            columns::text("label", runs.iter().map(label).collect()),
        ];
        let exponents = if self.lyapunov {
            setting.assembly.system.state_size()
        } else {
            0
        };
        list.extend(columns::exponents(exponents, &of_runs(runs)));
        Table {
            name: "summary".into(),
            columns: list,
        }
    }
}

/// Velocity against displacement of the first two coordinates.
fn figure(setting: &Setting<'_>, labels: &[String]) -> Figure {
    let list = columns::coordinates(setting);
    let n = list.len() / 2;
    let named: Vec<String> = (labels.iter().enumerate())
        .map(|(k, label)| format!("run {k}: {label}"))
        .collect();
    let panel = |i: usize| Panel {
        x_label: list[i].axis(),
        y_label: list[n + i].axis(),
        curves: dots(&list[i].name, &list[n + i].name, &named),
        ..Panel::default()
    };
    Figure {
        title: String::new(),
        panels: (0..n.min(2)).map(panel).collect(),
    }
}

/// Lyapunov exponents of every run.
fn of_runs(runs: &[MapRun]) -> Vec<Option<&Exponents>> {
    let list = runs.iter();
    list.map(|r| r.attractor.record.exponents.as_ref())
        .collect()
}
