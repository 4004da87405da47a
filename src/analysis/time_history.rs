//! Motion against time: deformations, rates, forces, switches and absolute accelerations.

mod figure;
mod loops;
mod selection;

use super::cost::{Cost, Period};
use super::flow::{self, PreparedMotion};
use super::poincare_map::REPORTED;
use super::transient::{self, HistoryKeys, Impacts, Rows, SpeedProfile, switch_table};
use super::{Analysis, Fault, Initial, Setting, columns, limits};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::solve::attractor::RecordStop;
use crate::solve::integrate::{
    FlowObserver, IntegrationEnd, IntegratorChoice, IntegratorOptions, Segment, Switch,
};
use crate::system::System;
use figure::figure;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::time::Instant;

/// Settings of `time_history`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct TimeHistory {
    /// Excitation frequency; default with `duration`: the speed of the model's reference.
    #[serde(default)]
    pub at: Option<Quantity>,
    /// Excitation periods to write; default 10.
    #[serde(default)]
    pub periods: Option<usize>,
    /// Periods integrated before the first row and not written; time starts before them.
    #[serde(default)]
    pub transient: usize,
    /// Rows per period.
    #[serde(default = "defaults::samples")]
    pub samples_per_period: usize,
    /// State at phase 0.
    #[serde(default)]
    pub initial: Initial,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// Local error of the series flow, relative to the motion; default 1e-12.
    #[serde(default)]
    pub flow_tolerance: Option<f64>,
    /// Duration from t = 0, instead of `periods`; loads may then be functions of time.
    #[serde(default)]
    pub duration: Option<Quantity>,
    /// Speed of the reference against time; requires `duration`.
    #[serde(default)]
    pub speed: Option<SpeedProfile>,
    /// With `duration`: whether the train follows the speed, every body with a torque for its mean acceleration.
    #[serde(default)]
    pub follow: bool,
    /// Instants to write, ascending; requires `duration`.
    #[serde(default)]
    pub samples: Option<Vec<Quantity>>,
    /// Number of rows, evenly over the duration, if no instants are listed; default 2001.
    #[serde(default)]
    pub points: Option<usize>,
    /// Write every k-th row.
    #[serde(default = "defaults::decimate")]
    pub decimate: usize,
    /// Columns to write besides the time, such as `q.mesh_1`; default: all.
    #[serde(default)]
    pub columns: Option<Vec<String>>,
}

mod defaults {
    pub fn decimate() -> usize {
        1
    }
    pub fn samples() -> usize {
        200
    }
}

/// Periods and rows where the settings say nothing.
const PERIODS: usize = 10;
const POINTS: usize = 2001;
/// Rows written at most.
const MAX_ROWS: usize = 50_000_000;

#[typetag::serde(name = "time_history")]
impl Analysis for TimeHistory {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = self.check_keys();
        faults.extend(self.check_columns(setting));
        if let Some(history) = self.history() {
            faults.extend(transient::check_history(&history, setting));
            return faults;
        }
        let Some(at) = &self.at else {
            let message = "is missing: give the excitation frequency, or `duration`";
            faults.push(Fault::new("at", message));
            return faults;
        };
        let states = [("initial".to_string(), self.initial.clone())];
        faults.extend(flow::check_motions(setting, at, &states, self.flow()));
        for (key, found, least, most) in [
            ("periods", self.periods(), 1, limits::PERIODS),
            ("transient", self.transient, 0, limits::PERIODS),
            (
                "samples_per_period",
                self.samples_per_period,
                1,
                limits::SAMPLES,
            ),
        ] {
            faults.extend(limits::check(key, found, least, most));
        }
        if self.periods().saturating_mul(self.samples_per_period) > MAX_ROWS {
            let message = format!(
                "{} periods of {} samples are more than {MAX_ROWS} rows",
                self.periods(),
                self.samples_per_period
            );
            faults.push(Fault::new("samples_per_period", message));
        }
        faults
    }

    fn takes_functions_of_time(&self) -> bool {
        self.duration.is_some()
    }

    fn files(&self, setting: &Setting<'_>) -> Vec<PathBuf> {
        let file = self.speed.as_ref().and_then(|s| s.path(setting, "speed"));
        file.into_iter().collect()
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let columns =
            3 * setting.assembly.connections.len() + columns::accelerations(setting).len();
        if let Some(history) = self.history() {
            let rows = history.samples.map_or(history.points, <[_]>::len) as f64;
            let duration = transient::time(setting, history.duration).unwrap_or(0.0);
            let seconds = duration / TAU * Period::of(setting, 1.0).plain;
            return Cost::table(rows, 1.0 + columns as f64, "points").lasting(seconds, "duration");
        }
        let Some(Ok(frequency)) = self.at.as_ref().map(|at| setting.frequency(at)) else {
            return Cost::default();
        };
        let periods = self.periods() as f64;
        let rows = periods * self.samples_per_period as f64;
        let seconds = (periods + self.transient as f64) * Period::of(setting, frequency).plain;
        let key = if self.transient > self.periods() {
            "transient"
        } else {
            "periods"
        };
        Cost::table(rows, 1.0 + columns as f64, "samples_per_period")
            .lasting(seconds + 1e-6 * rows, key)
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let began = Instant::now();
        let mut report = match self.history() {
            Some(history) => transient::run_history(&history, setting)?,
            None => self.run_periods(setting)?,
        };
        let rows = report.tables.first().map_or(0, Table::rows);
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        let seconds = began.elapsed().as_secs_f64();
        if let Some(main) = report.tables.first_mut() {
            let slow = loops::table(setting, main);
            self.thin(main);
            // Loops are what a reader of a train with memory looks for; force curves are not.
            let has_memory = setting.assembly.system.memory_count() > 0;
            report.figure = Some(figure(setting, main, slow.as_ref().filter(|_| has_memory)));
            let apart = slow.as_ref().filter(|_| !has_memory);
            let apart = apart.map(|slow| figure::of_loops(setting, (main, slow)));
            report.further_figures.extend(apart);
            report.tables.extend(slow);
        }
        for (key, value) in [
            ("options", options),
            ("rows", json!(rows)),
            ("timings", json!({ "seconds": seconds })),
        ] {
            report.summary.insert(key.into(), value);
        }
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let system = &setting.assembly.system;
        let mut tables = vec![
            Rows::new(setting, system).table(),
            switch_table(setting, &[]),
        ];
        let state = vec![0.0; system.state_size()];
        let impacts = Impacts::new(setting, system, (0.0, 0.0), &state).tables((0.0, 1.0));
        tables.extend(impacts.iter().map(Table::without_rows));
        if let Some(main) = tables.first_mut() {
            let slow = loops::table(setting, main);
            self.thin(main);
            tables.extend(slow);
        }
        tables
    }
}

impl TimeHistory {
    fn periods(&self) -> usize {
        self.periods.unwrap_or(PERIODS)
    }

    /// Keys that do not go together.
    fn check_keys(&self) -> Vec<Fault> {
        let refuse = |key: &str, message: &str| Fault::new(key, message);
        let mut faults = Vec::new();
        let timed = [
            ("speed", self.speed.is_some()),
            ("follow", self.follow),
            ("samples", self.samples.is_some()),
            ("points", self.points.is_some()),
        ];
        if self.duration.is_none() {
            let given = timed.into_iter().filter(|(_, is_given)| *is_given);
            faults.extend(given.map(|(key, _)| refuse(key, "requires `duration`")));
            return faults;
        }
        for (key, is_given) in [
            ("periods", self.periods.is_some()),
            ("transient", self.transient > 0),
        ] {
            if is_given {
                faults.push(refuse(key, "excludes `duration`, which sets the length"));
            }
        }
        if self.samples.is_some() && self.points.is_some() {
            let message = "excludes `samples`, which lists the instants";
            faults.push(refuse("points", message));
        }
        faults
    }

    /// The motion with `duration`, if given.
    fn history(&self) -> Option<HistoryKeys<'_>> {
        Some(HistoryKeys {
            at: self.at.as_ref(),
            duration: self.duration.as_ref()?,
            speed: self.speed.as_ref(),
            follow: self.follow,
            samples: self.samples.as_deref(),
            points: self.points.unwrap_or(POINTS),
            initial: &self.initial,
            integrator: self.flow(),
        })
    }

    /// Periods at a constant speed.
    fn run_periods(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let at = self.at.clone().unwrap_or(Quantity {
            value: 1.0,
            dimension: None,
            text: "1".into(),
        });
        let start = ("initial", &self.initial);
        let motion = PreparedMotion::new(setting, &at, start, self.flow());
        let PreparedMotion {
            system,
            mut integrator,
            mut state,
            warning,
        } = motion.map_err(|fault| columns::refused(setting, fault))?;
        let mut record = HistoryRecord::new(setting, &system, self.samples_per_period);
        let mut stop = None;
        let total = self.transient + self.periods();
        for period in 0..total {
            if setting.control.is_interrupted() {
                stop = Some(RecordStop::Interrupted);
                break;
            }
            if period == self.transient {
                record.open(period, &state);
            }
            if period == 0 && self.transient == 0 {
                integrator.start(&system, 0.0, &state, &mut record);
            }
            let end = if period < self.transient {
                integrator.advance(&system, (0.0, TAU), &mut state, &mut ())
            } else {
                record.begin(period);
                integrator.advance(&system, (0.0, TAU), &mut state, &mut record)
            };
            let is_finite =
                end == IntegrationEnd::Interrupted || state.iter().all(|x| x.is_finite());
            if end != IntegrationEnd::Reached || !is_finite {
                let end = if is_finite {
                    end
                } else {
                    IntegrationEnd::Diverged
                };
                stop = Some(RecordStop::of(end, period + 1));
                break;
            }
            if period >= self.transient {
                record.row(period + 1, 0, &state);
            }
            if period.is_multiple_of(REPORTED) {
                let share = (period + 1) as f64 / total as f64;
                let words = format!("period {} of {total}", period + 1);
                setting.control.progress(setting.name, share, &words);
            }
        }
        let mut report = Report {
            tables: record.tables(),
            warnings: (warning.into_iter())
                .chain(flow::labour(
                    integrator.name(),
                    integrator.strain(),
                    setting,
                ))
                .collect(),
            ended_early: stop.map(|s| flow::tell(s, setting)),
            ..Report::default()
        };
        let name = json!(integrator.name());
        report.summary.insert("integrator".into(), name);
        Ok(report)
    }
}

impl TimeHistory {
    fn flow(&self) -> IntegratorOptions {
        flow::options(self.integrator, self.flow_tolerance)
    }
}

/// Collects rows and switches while the integrator runs.
struct HistoryRecord<'a> {
    rows: Rows<'a>,
    system: &'a System,
    samples: usize,
    /// Period that runs, counted from 0, and the next sample inside it.
    period: usize,
    next: usize,
    state: Vec<f64>,
    switches: Vec<(f64, Switch)>,
    setting: &'a Setting<'a>,
    impacts: Option<Impacts<'a>>,
    /// Begin and end of what is written.
    span: (f64, f64),
}

impl<'a> HistoryRecord<'a> {
    fn new(setting: &'a Setting<'a>, system: &'a System, samples: usize) -> HistoryRecord<'a> {
        HistoryRecord {
            rows: Rows::new(setting, system),
            system,
            samples,
            period: 0,
            next: 1,
            state: vec![0.0; system.state_size()],
            switches: Vec::new(),
            setting,
            impacts: None,
            span: (0.0, 0.0),
        }
    }

    /// The written part begins.
    fn open(&mut self, period: usize, state: &[f64]) {
        let time = self.time(period, 0.0);
        self.span = (time, time);
        let impacts = Impacts::new(self.setting, self.system, (time, 0.0), state);
        self.impacts = Some(impacts);
        self.row(period, 0, state);
    }

    fn tables(self) -> Vec<Table> {
        let switches = switch_table(self.setting, &self.switches);
        let mut tables = vec![self.rows.table(), switches];
        let impacts = self.impacts.map(|impacts| impacts.tables(self.span));
        tables.extend(impacts.into_iter().flatten());
        tables
    }

    fn begin(&mut self, period: usize) {
        (self.period, self.next) = (period, 1);
    }

    fn tau(&self, sample: usize) -> f64 {
        TAU * sample as f64 / self.samples as f64
    }

    /// T after a number of periods and samples.
    fn time(&self, period: usize, share: f64) -> f64 {
        (period as f64 + share) * TAU / self.system.excitation_frequency()
    }

    /// A row; phase 0 is also the end of the previous period.
    fn row(&mut self, period: usize, sample: usize, state: &[f64]) {
        let time = self.time(period, sample as f64 / self.samples as f64);
        self.rows.push(time, self.tau(sample), state);
    }
}

impl FlowObserver for HistoryRecord<'_> {
    fn segment(&mut self, segment: &Segment<'_>) {
        let end = segment.tau + segment.width;
        while self.next < self.samples {
            let tau = self.tau(self.next);
            if tau > end {
                break;
            }
            let x = ((tau - segment.tau) / segment.width).clamp(0.0, 1.0);
            let mut state = std::mem::take(&mut self.state);
            segment.state(x, self.system.omega(), &mut state);
            self.row(self.period, self.next, &state);
            self.state = state;
            self.next += 1;
        }
        self.span.1 = self.time(self.period, end / TAU);
        if let Some(impacts) = &mut self.impacts {
            impacts.segment(segment);
        }
    }

    fn switch(&mut self, switch: &Switch) {
        let time = self.time(self.period, switch.tau / TAU);
        let is_news = self.impacts.as_ref().is_none_or(|i| i.is_news(switch));
        if is_news {
            self.switches.push((time, *switch));
        }
        if let Some(impacts) = &mut self.impacts {
            impacts.switch(time, switch);
        }
    }
}
