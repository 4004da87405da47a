//! Motion against time: deformations, rates, forces, switches and absolute accelerations.

use super::cost::{Cost, Period};
use super::flow::{self, Motion};
use super::poincare_map::REPORTED;
use super::{Analysis, Fault, Initial, Setting, columns, limits};
use crate::error::Error;
use crate::measure::Heading;
use crate::quantity::Quantity;
use crate::report::{Curve, CurveStyle, Figure, Panel, Report, Table};
use crate::solve::attractor::Stop;
use crate::solve::integrate::{IntegrationEnd, IntegratorChoice, Observer, Segment, Switch};
use crate::system::{Scratch, System};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use std::time::Instant;

/// Settings of `time_history`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TimeHistory {
    /// Excitation frequency.
    pub at: Quantity,
    /// Periods of the excitation written.
    #[serde(default = "defaults::periods")]
    pub periods: usize,
    /// Periods integrated before, not written; the time goes on counting.
    #[serde(default)]
    pub transient: usize,
    /// Rows a period.
    #[serde(default = "defaults::samples")]
    pub samples_per_period: usize,
    /// State at phase 0.
    #[serde(default)]
    pub initial: Initial,
    /// Which integrator runs.
    #[serde(default)]
    pub integrator: IntegratorChoice,
}

mod defaults {
    pub fn periods() -> usize {
        10
    }
    pub fn samples() -> usize {
        200
    }
}

/// Rows written at most.
const MAX_ROWS: usize = 50_000_000;
/// Connections drawn at most.
const MAX_CURVES: usize = 4;

#[typetag::serde(name = "time_history")]
impl Analysis for TimeHistory {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let states = [("initial".to_string(), self.initial.clone())];
        let mut faults = flow::check_motions(setting, &self.at, &states, self.integrator);
        for (key, found, least, most) in [
            ("periods", self.periods, 1, limits::PERIODS),
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
        if self.periods.saturating_mul(self.samples_per_period) > MAX_ROWS {
            let message = format!(
                "{} periods of {} samples are more than {MAX_ROWS} rows",
                self.periods, self.samples_per_period
            );
            faults.push(Fault::new("samples_per_period", message));
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let Ok(frequency) = setting.frequency(&self.at) else {
            return Cost::default();
        };
        let periods = self.periods as f64;
        let rows = periods * self.samples_per_period as f64;
        let columns =
            3 * setting.assembly.connections.len() + columns::accelerations(setting).len();
        let seconds = (periods + self.transient as f64) * Period::of(setting, frequency).plain;
        let key = if self.transient > self.periods {
            "transient"
        } else {
            "periods"
        };
        Cost::table(rows, 1.0 + columns as f64, "samples_per_period")
            .lasting(seconds + 1e-6 * rows, key)
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let began = Instant::now();
        let start = ("initial", &self.initial);
        let motion = Motion::new(setting, &self.at, start, self.integrator);
        let Motion {
            system,
            mut integrator,
            mut state,
            warning,
        } = motion.map_err(|fault| columns::refused(setting, fault))?;
        let mut record = Record::new(setting, &system, self.samples_per_period);
        let mut stop = None;
        let total = self.transient + self.periods;
        for period in 0..total {
            if setting.control.is_interrupted() {
                stop = Some(Stop::Interrupted);
                break;
            }
            if period == self.transient {
                record.row(period, 0, &state);
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
                stop = Some(Stop::of(end, period + 1));
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
        let rows = record.times.len();
        let mut report = Report {
            tables: record.tables(setting),
            figure: Some(figure(setting)),
            warnings: warning.into_iter().collect(),
            ended_early: stop.map(|s| flow::tell(s, setting)),
            ..Report::default()
        };
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        let seconds = began.elapsed().as_secs_f64();
        for (key, value) in [
            ("options", options),
            ("integrator", json!(integrator.name())),
            ("rows", json!(rows)),
            ("timings", json!({ "seconds": seconds })),
        ] {
            report.summary.insert(key.into(), value);
        }
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let record = Record::new(setting, &setting.assembly.system, self.samples_per_period);
        record.tables(setting)
    }
}

/// Collects rows and switches while the integrator runs.
struct Record<'a> {
    setting: &'a Setting<'a>,
    system: &'a System,
    samples: usize,
    /// Period that runs, counted from 0, and the next sample inside it.
    period: usize,
    next: usize,
    state: Vec<f64>,
    scratch: Scratch,
    /// Nondimensional times T.
    times: Vec<f64>,
    /// Deformations, rates, forces of the connections, then accelerations of the bodies: one list a column.
    series: Vec<Vec<f64>>,
    switches: Vec<(f64, Switch)>,
}

impl<'a> Record<'a> {
    fn new(setting: &'a Setting<'a>, system: &'a System, samples: usize) -> Record<'a> {
        let bodies = columns::accelerations(setting).len();
        Record {
            setting,
            system,
            samples,
            period: 0,
            next: 1,
            state: vec![0.0; 2 * system.dof()],
            scratch: system.scratch(),
            times: Vec::new(),
            series: vec![Vec::new(); 3 * system.element_count() + bodies],
            switches: Vec::new(),
        }
    }

    fn begin(&mut self, period: usize) {
        (self.period, self.next) = (period, 1);
    }

    fn tau(&self, sample: usize) -> f64 {
        TAU * sample as f64 / self.samples as f64
    }

    /// T after so many periods and samples.
    fn time(&self, period: usize, share: f64) -> f64 {
        (period as f64 + share) * TAU / self.system.excitation_frequency()
    }

    /// A row; phase 0 stands for the end of the period before, too.
    fn row(&mut self, period: usize, sample: usize, state: &[f64]) {
        let tau = self.tau(sample);
        let time = self.time(period, sample as f64 / self.samples as f64);
        self.times.push(time);
        let (setting, system) = (self.setting, self.system);
        let bodies = (setting.assembly).body_accelerations(system, tau, state, &mut self.scratch);
        if bodies.is_none() {
            system.respond(tau, state, &mut self.scratch);
        }
        let Scratch {
            deformation,
            rate,
            response,
        } = &self.scratch;
        let forces = response.iter().map(|r| r.f);
        let values = (deformation.iter().copied())
            .chain(rate.iter().copied())
            .chain(forces)
            .chain(bodies.into_iter().flatten());
        for (column, value) in self.series.iter_mut().zip(values) {
            column.push(value);
        }
    }

    /// The main table and the switches.
    fn tables(self, setting: &Setting<'_>) -> Vec<Table> {
        let described = columns::connections(setting)
            .into_iter()
            .chain(columns::accelerations(setting));
        let mut main = vec![columns::time(setting).column(self.times)];
        main.extend(described.zip(self.series).map(|(d, list)| d.column(list)));
        vec![
            Table {
                name: String::new(),
                columns: main,
            },
            switch_table(setting, &self.switches),
        ]
    }
}

impl Observer for Record<'_> {
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
    }

    fn switch(&mut self, switch: &Switch) {
        let time = self.time(self.period, switch.tau / TAU);
        self.switches.push((time, *switch));
    }
}

/// Passages of breakpoints: when, where, from which flank to which, in which direction, how fast, and the breakpoint.
fn switch_table(setting: &Setting<'_>, switches: &[(f64, Switch)]) -> Table {
    let names = &setting.assembly.connections;
    let all = columns::connections(setting);
    let rates: Vec<_> = (0..names.len())
        .map(|k| columns::rate(setting, k))
        .collect();
    let mut units: Vec<&str> = rates.iter().map(|q| q.unit.as_str()).collect();
    units.dedup();
    let mut lengths: Vec<&str> = all[..names.len()].iter().map(|q| q.unit.as_str()).collect();
    lengths.dedup();
    let float = |f: &dyn Fn(&Switch) -> f64| switches.iter().map(|(_, s)| f(s)).collect();
    let whole = |f: &dyn Fn(&Switch) -> i8| switches.iter().map(|(_, s)| i64::from(f(s))).collect();
    let mut time = columns::time(setting);
    time.name = "time".into();
    let connection = |s: &Switch| names[s.connection].clone();
    let direction = |s: &Switch| if s.velocity < 0.0 { -1 } else { 1 };
    Table {
        name: "switches".into(),
        columns: vec![
            time.column(switches.iter().map(|(t, _)| *t)),
            columns::text(
                "connection",
                switches.iter().map(|(_, s)| connection(s)).collect(),
            ),
            columns::integer("from", whole(&|s| s.from)),
            columns::integer("to", whole(&|s| s.to)),
            columns::integer("direction", whole(&direction)),
            columns::float(
                "rate",
                units.join(" or "),
                float(&|s| s.velocity * rates[s.connection].factor),
            ),
            columns::float(
                "level",
                lengths.join(" or "),
                float(&|s| s.level * all[s.connection].factor),
            ),
        ],
    }
}

/// Deformations against time.
fn figure(setting: &Setting<'_>) -> Figure {
    let time = columns::time(setting);
    let names = &setting.assembly.connections;
    let panel = |(quantity, name): (Heading, &String)| Panel {
        x_label: time.axis(),
        y_label: quantity.axis(),
        x_range: None,
        x_frequency: None,
        curves: vec![Curve {
            table: String::new(),
            x: time.name.clone(),
            y: quantity.name,
            label: name.clone(),
            style: CurveStyle::Line,
            only: None,
        }],
    };
    let quantities = columns::connections(setting);
    Figure {
        title: String::new(),
        panels: (quantities.into_iter().zip(names))
            .take(MAX_CURVES)
            .map(panel)
            .collect(),
    }
}
