//! States at phase 0 of the excitation against a parameter: the attractor followed, or many random initial states (figures 7 to 9).

mod sweep;

use super::cost::{Cost, Period};
use super::flow::{self, LabelKeys};
use super::map_table::{MapRows, dots};
use super::parameter::VariedParameter;
use super::poincare_map::defaults;
use super::{Analysis, Fault, Initial, Link, Setting, columns, limits};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Curve, Figure, FrequencyUnit, Panel, Report, Table, Words};
use crate::solve::attractor::{Lengths, MapSize};
use crate::solve::integrate::IntegratorChoice;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::time::Instant;
use sweep::{SweepPlan, SweepPoint, SweepWork, exponents, integrations};

/// Settings of `bifurcation_diagram`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct BifurcationDiagram {
    /// `frequency`, or the path of a number of the model.
    #[serde(default = "frequency")]
    pub parameter: String,
    /// Further numbers that follow it, such as `{gear_2.drag: "0.4*x"}`.
    #[serde(default, skip_serializing_if = "Link::is_empty")]
    pub link: Link,
    /// Excitation frequency, if it is not the parameter.
    #[serde(default)]
    pub at: Option<Quantity>,
    /// First value.
    pub from: Quantity,
    /// Last value.
    pub to: Quantity,
    /// Number of values, evenly spaced, both ends included.
    pub points: usize,
    /// Direction in which the attractor is followed; default: from `from` to `to`.
    #[serde(default)]
    pub direction: Option<SweepDirection>,
    /// Excitation periods before the record, at every value.
    #[serde(default = "defaults::periods")]
    pub transient: usize,
    /// Recorded periods per value.
    #[serde(default = "defaults::periods")]
    pub periods: usize,
    /// State at phase 0 at the first value.
    #[serde(default)]
    pub initial: Option<Initial>,
    /// Random initial states at every value, instead of following the attractor.
    #[serde(default)]
    pub seeds: Option<Seeds>,
    /// Compute Lyapunov exponents.
    #[serde(default = "defaults::lyapunov")]
    pub lyapunov: bool,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// Local error of the series flow, relative to the motion; default 1e-12.
    #[serde(default)]
    pub flow_tolerance: Option<f64>,
    /// Longest period of a label; default 256.
    #[serde(default)]
    pub longest_period: Option<usize>,
    /// Limit to which an undecided record is extended, in lengths of the record; default 8.
    #[serde(default)]
    pub extend: Option<usize>,
}

fn frequency() -> String {
    "frequency".into()
}

/// Direction of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SweepDirection {
    /// Increasing parameter.
    Up,
    /// Decreasing parameter.
    Down,
    /// One run with increasing and one with decreasing parameter.
    Both,
}

/// Random initial states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Seeds {
    /// States per value of the parameter.
    pub count: usize,
    /// Seed of the generator: the same seed gives the same states.
    pub seed: u64,
    /// Box around the static equilibrium at rest.
    #[serde(rename = "box", default)]
    pub reach: StartBox,
}

/// Half widths of the box of initial states.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number, or {q: [..], v: [..]}")]
pub enum StartBox {
    /// The same for every coordinate and rate, nondimensional.
    Uniform(f64),
    /// One per coordinate and rate, in the units of `initial`.
    Each(Initial),
}

impl Default for StartBox {
    fn default() -> Self {
        StartBox::Uniform(1.0)
    }
}

#[typetag::serde(name = "bifurcation_diagram")]
impl Analysis for BifurcationDiagram {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = self.check_sweep(setting);
        faults.extend(flow::check_size(self.size(), self.records()));
        faults.extend(self.label_keys().check());
        if let Some(initial) = &self.initial {
            faults.extend(initial.check(setting, "initial"));
        }
        faults.extend(self.check_seeds(setting));
        let integrator = flow::options(self.integrator, self.flow_tolerance);
        faults.extend(flow::check_tolerance(integrator));
        faults.extend(flow::integrator(setting, &setting.assembly.system, integrator).err());
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let ends = [&self.from, &self.to].map(|end| self.at.as_ref().unwrap_or(end));
        let frequencies = ends.into_iter().flat_map(|end| setting.frequency(end));
        let Some(frequency) = frequencies.reduce(f64::min) else {
            return Cost::default();
        };
        let period = Period::of(setting, frequency);
        flow::cost(self.size(), setting, period, self.records())
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let began = Instant::now();
        let plan = self
            .plan(setting)
            .map_err(|f| columns::refused(setting, f))?;
        let work = SweepWork::new(setting, &plan);
        let points = match &plan.seeds {
            None => work.followed(),
            Some(seeds) => work.scattered(seeds),
        };
        let stops = work.into_stops();
        let mut report = self.report(setting, &plan, &points);
        report.ended_early = (!stops.is_empty()).then(|| sweep::shortened(&stops));
        report.summary.insert("stops".into(), json!(stops));
        let seconds = began.elapsed().as_secs_f64();
        report
            .summary
            .insert("timings".into(), json!({ "seconds": seconds }));
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let plan = self.plan(setting);
        plan.map_or(Vec::new(), |plan| self.report(setting, &plan, &[]).tables)
    }
}

impl SweepDirection {
    /// Values in the orders of the sweeps, as written without a direction.
    pub fn sweeps<T: Clone>(
        direction: Option<SweepDirection>,
        written: Vec<(f64, T)>,
    ) -> Vec<Vec<(f64, T)>> {
        let mut rising = written.clone();
        rising.sort_by(|a, b| a.0.total_cmp(&b.0));
        let falling = rising.iter().rev().cloned().collect();
        match direction {
            None => vec![written],
            Some(SweepDirection::Up) => vec![rising],
            Some(SweepDirection::Down) => vec![falling],
            Some(SweepDirection::Both) => vec![rising, falling],
        }
    }
}

impl BifurcationDiagram {
    fn size(&self) -> MapSize {
        MapSize {
            transient: self.transient,
            periods: self.periods,
            exponents: Lengths::wanted(self.lyapunov),
        }
    }

    fn records(&self) -> usize {
        let runs = match (&self.seeds, self.direction) {
            (Some(seeds), _) => seeds.count,
            (None, Some(SweepDirection::Both)) => 2,
            (None, _) => 1,
        };
        runs.saturating_mul(self.points)
    }

    fn label_keys(&self) -> LabelKeys {
        LabelKeys {
            longest_period: self.longest_period,
            extend: self.extend,
        }
    }

    fn check_sweep(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = Vec::new();
        faults.extend(limits::check("points", self.points, 2, limits::POINTS));
        let parameter = match VariedParameter::alone(setting, &self.parameter, &self.link) {
            Ok(parameter) => parameter,
            Err(message) => {
                faults.push(Fault::new("parameter", message));
                return faults;
            }
        };
        match (&parameter, &self.at) {
            (VariedParameter::Frequency(_), Some(_)) => {
                let message = "the excitation frequency is the parameter; leave `at` out";
                faults.push(Fault::new("at", message));
            }
            (VariedParameter::Number(knob), None) => {
                let message = format!(
                    "missing: the excitation frequency at which {} is varied",
                    knob.name()
                );
                faults.push(Fault::new("at", message));
            }
            (VariedParameter::Number(_), Some(at)) => {
                faults.extend(flow::frequency(setting, "at", at).err());
            }
            (VariedParameter::Frequency(_), None) => {}
        }
        for (key, written) in [("from", &self.from), ("to", &self.to)] {
            let fault = parameter.check(setting, written).err();
            faults.extend(fault.map(|message| Fault::new(key, message)));
        }
        if self.from.value == self.to.value && self.from.dimension == self.to.dimension {
            let message = format!("{} is where the sweep starts", self.to.text);
            faults.push(Fault::new("to", message));
        }
        faults
    }

    fn check_seeds(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let Some(seeds) = &self.seeds else {
            return Vec::new();
        };
        let mut faults = Vec::new();
        faults.extend(limits::check("seeds.count", seeds.count, 1, limits::STATES));
        if self.direction.is_some() {
            let message = "with `seeds` every value is a run of its own; leave `direction` out";
            faults.push(Fault::new("direction", message));
        }
        if self.initial.is_some() {
            let message = "with `seeds` the initial states are random; leave `initial` out";
            faults.push(Fault::new("initial", message));
        }
        match &seeds.reach {
            StartBox::Uniform(width) if !(*width >= 0.0 && width.is_finite()) => {
                let message = format!("{width} must be >= 0: a half width");
                faults.push(Fault::new("seeds.box", message));
            }
            StartBox::Uniform(_) => {}
            StartBox::Each(widths) => {
                faults.extend(widths.check(setting, "seeds.box"));
                let all = [("q", &widths.q), ("v", &widths.v)];
                for (name, list) in all {
                    let negative = list.iter().flatten().position(|w| w.value < 0.0);
                    faults.extend(negative.map(|k| {
                        let message = "must be >= 0: a half width";
                        Fault::new(format!("seeds.box.{name}.{k}"), message)
                    }));
                }
            }
        }
        faults
    }

    fn plan(&self, setting: &Setting<'_>) -> Result<SweepPlan, Fault> {
        let fault = |key: &'static str| move |message: String| Fault::new(key, message);
        let parameter = VariedParameter::alone(setting, &self.parameter, &self.link);
        let parameter = parameter.map_err(fault("parameter"))?;
        let value = |written| parameter.value(setting, written);
        let from = value(&self.from).map_err(fault("from"))?;
        let to = value(&self.to).map_err(fault("to"))?;
        let at = match &self.at {
            Some(at) => flow::frequency(setting, "at", at)?,
            None => 1.0,
        };
        let last = self.points - 1;
        let value = |k: usize| match k {
            _ if k == last => to,
            _ => from + (to - from) * k as f64 / last as f64,
        };
        let written = (0..self.points).map(|k| (value(k), ())).collect();
        let sweeps = SweepDirection::sweeps(self.direction, written);
        let values = |sweep: Vec<(f64, ())>| sweep.into_iter().map(|x| x.0).collect();
        let sweeps = sweeps.into_iter().map(values).collect();
        let seeds = self.seeds.as_ref().map(|seeds| seeds.states(setting));
        let seeds = seeds.transpose()?;
        let (unit, factor) = parameter.reported(setting, &self.from);
        Ok(SweepPlan {
            parameter,
            at,
            sweeps,
            seeds,
            size: self.size(),
            labels: self.label_keys(),
            integrator: flow::options(self.integrator, self.flow_tolerance),
            initial: self.initial.clone().unwrap_or_default(),
            unit,
            factor,
        })
    }

    fn report(&self, setting: &Setting<'_>, plan: &SweepPlan, points: &[SweepPoint]) -> Report {
        let mut rows = MapRows::new(setting);
        let mut values = Vec::new();
        for point in points {
            let count = rows.append(point.run, plan.size.transient, &point.attractor.record);
            values.extend(std::iter::repeat_n(point.value, count));
        }
        let mut main = rows.table();
        main.columns.splice(0..0, plan.columns(setting, &values));
        let labels = self.run_names(plan);
        let mut warnings: Vec<String> = points.iter().filter_map(|p| p.warning.clone()).collect();
        warnings.sort();
        warnings.dedup();
        let (ran, strain) = integrations(points);
        warnings.extend(flow::labour(&ran, strain, setting));
        let mut report = Report {
            tables: vec![main, summary_table(setting, plan, points)],
            figure: Some(self.figure(setting, plan, &labels, points)),
            warnings,
            ..Report::default()
        };
        columns::explain_exponents(&mut report, &exponents(points));
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        for (key, value) in [
            ("options", options),
            ("parameter", json!(plan.parameter.name())),
            ("integrator", json!(ran)),
            ("runs", json!(labels)),
            ("points", json!(points.len())),
        ] {
            report.summary.insert(key.into(), value);
        }
        report
    }

    /// One text a run.
    fn run_names(&self, plan: &SweepPlan) -> Vec<String> {
        match &plan.seeds {
            Some(seeds) => (0..seeds.count).map(|k| format!("seed {k}")).collect(),
            None => (plan.sweeps.iter())
                .map(|list| {
                    if list[0] < list[list.len() - 1] {
                        "up"
                    } else {
                        "down"
                    }
                })
                .map(String::from)
                .collect(),
        }
    }

    /// Points of the first two coordinates and the largest exponent against the parameter.
    fn figure(
        &self,
        setting: &Setting<'_>,
        plan: &SweepPlan,
        labels: &[String],
        points: &[SweepPoint],
    ) -> Figure {
        let list = columns::coordinates(setting);
        let written = Words::of_number(&self.parameter, &plan.unit);
        let (x_label, x_frequency) = match plan.parameter {
            VariedParameter::Frequency(_) => (
                columns::frequency_label(setting, &written),
                columns::frequency_axis(setting, FrequencyUnit::RadianPerSecond),
            ),
            VariedParameter::Number(_) => (written, None),
        };
        let panel = |y_label: String, curves| Panel {
            x_label: x_label.clone(),
            y_label,
            x_frequency,
            curves,
            ..Panel::default()
        };
        let mut panels: Vec<Panel> = (list.iter().take((list.len() / 2).min(2)))
            .map(|q| {
                let curves = dots("parameter", &q.name, labels);
                panel(q.axis(), curves)
            })
            .collect();
        if self.lyapunov {
            let in_summary = |curve: Curve| Curve {
                table: "summary".into(),
                ..curve
            };
            let curves = dots("parameter", "lyapunov_1", labels);
            let curves = curves.into_iter().map(in_summary).collect();
            panels.push(Panel {
                heading: columns::exponents_not_drawn(&exponents(points)),
                ..panel("largest Lyapunov exponent".into(), curves)
            });
        }
        Figure {
            title: String::new(),
            panels,
        }
    }
}

/// `parameter, speed_rpm, run, label, lyapunov_1..`, exponents in units of omega_c.
fn summary_table(setting: &Setting<'_>, plan: &SweepPlan, points: &[SweepPoint]) -> Table {
    let values: Vec<f64> = points.iter().map(|p| p.value).collect();
    let mut list = plan.columns(setting, &values);
    list.extend([
        columns::integer("run", points.iter().map(|p| p.run as i64).collect()),
        columns::text(
            "label",
            points
                .iter()
                .map(|p| p.attractor.label.to_string())
                .collect(),
        ),
    ]);
    let count = setting.assembly.system.state_size();
    list.extend(columns::exponents(count, &exponents(points)));
    Table {
        name: "summary".into(),
        columns: list,
    }
}
