//! Invariant curves of the stroboscopic map, followed in one number of the model.

mod report;
mod road;
mod start;
mod trace;

use super::bifurcation_curve::CurveAxis;
use super::cost::{Cost, Period};
use super::parameter::VariedParameter;
use super::{Analysis, Fault, Link, Setting, columns, limits};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::solve::integrate::IntegratorChoice;
use crate::solve::jumps;
use road::TorusRoad;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::time::Instant;

/// Settings of `torus`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Torus {
    /// Source of the first torus.
    pub start: TorusStart,
    /// `frequency`, or the path of a number of the model.
    #[serde(default = "defaults::parameter")]
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
    /// Values to solve exactly at every passage.
    #[serde(default)]
    pub marks: Vec<Quantity>,
    /// Excitation periods per map; default: the number of curves that are visited in turn.
    #[serde(default)]
    pub subharmonic: Option<usize>,
    /// Initial number of points on a curve; odd.
    #[serde(default = "defaults::points")]
    pub points: usize,
    /// Limit of points on a curve.
    #[serde(default = "defaults::most_points")]
    pub most_points: usize,
    /// Invariance error, in sizes of the states, above which points are added.
    #[serde(default = "defaults::tolerance")]
    pub tolerance: f64,
    /// Maps before the record of the attractor.
    #[serde(default = "defaults::transient")]
    pub transient: usize,
    /// Write the curves, point by point at phase 0.
    #[serde(default)]
    pub curve: bool,
    /// First step, in ranges of the parameter and sizes of the states.
    #[serde(default = "defaults::step")]
    pub step: f64,
    /// Smallest step.
    #[serde(default = "defaults::min_step")]
    pub min_step: f64,
    /// Largest step.
    #[serde(default = "defaults::max_step")]
    pub max_step: f64,
    /// Limit of tori in each direction from the start.
    #[serde(default = "defaults::max_tori")]
    pub max_tori: usize,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
}

mod defaults {
    pub fn parameter() -> String {
        "frequency".into()
    }
    pub fn points() -> usize {
        41
    }
    pub fn most_points() -> usize {
        161
    }
    pub fn tolerance() -> f64 {
        1e-10
    }
    pub fn transient() -> usize {
        2000
    }
    pub fn step() -> f64 {
        0.02
    }
    pub fn min_step() -> f64 {
        1e-5
    }
    pub fn max_step() -> f64 {
        0.1
    }
    pub fn max_tori() -> usize {
        500
    }
}

/// Source of the first torus: a Neimark-Sacker event of an analysis of this file, or an attractor.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TorusStart {
    /// Name of a `frequency_response` or `parameter_response` of this file.
    #[serde(default)]
    pub analysis: Option<String>,
    /// Kind of the event: `neimark_sacker`.
    #[serde(default)]
    pub kind: Option<TorusEvent>,
    /// Value of the parameter near the event; default: the first event.
    #[serde(default)]
    pub near: Option<Quantity>,
    /// The attractor that is reached from rest.
    #[serde(default)]
    pub attractor: Option<AttractorStart>,
}

/// Kind of an event at which tori are born.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TorusEvent {
    /// A complex pair passes the unit circle.
    NeimarkSacker,
}

/// An attractor found by integration.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AttractorStart {
    /// Value of the parameter.
    pub value: Quantity,
    /// State at phase 0; default: the static equilibrium at rest.
    #[serde(default)]
    pub initial: Option<super::Initial>,
}

#[typetag::serde(name = "torus")]
impl Analysis for Torus {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = self.check_numbers();
        match self.axis(setting) {
            Ok((axis, at)) => {
                faults.extend(TorusRoad::new(setting, axis.clone(), at, 1).check());
                faults.extend(self.shares(setting, &axis).err());
                faults.extend(start::check(setting, &axis, &self.start));
            }
            Err(fault) => faults.push(fault),
        }
        let system = &setting.assembly.system;
        faults.extend(super::flow::integrator(setting, system, self.integrator).err());
        if let Err(error) = jumps::refuse_hidden(system) {
            faults.push(Fault::new("start", setting.name_connection(&error)));
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let Ok((axis, at)) = self.axis(setting) else {
            return Cost::default();
        };
        let slowest = match axis.parameter {
            VariedParameter::Frequency(_) => axis.ends.0.min(axis.ends.1),
            VariedParameter::Number(_) => at,
        };
        let period = Period::of(setting, slowest);
        let unknowns = (self.most_points * 2 * setting.assembly.system.dof()) as f64;
        let tori = 40.0;
        let elimination = 8.0 * unknowns.powi(3) / 3e9;
        let maps = 12.0 * self.most_points as f64 * period.varied;
        let cost =
            Cost::table(tori, 20.0, "max_tori").lasting(tori * (elimination + maps), "most_points");
        cost.and(Cost {
            bytes: 8.0 * 4.0 * unknowns * unknowns,
            memory_key: "most_points",
            ..Cost::default()
        })
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let refused = |fault| columns::refused(setting, fault);
        let began = Instant::now();
        let (axis, at) = self.axis(setting).map_err(refused)?;
        let marks = self.shares(setting, &axis).map_err(refused)?;
        let traced = trace::run(self, setting, (&axis, at), &marks)?;
        let mut report = report::assemble(self, setting, &axis, &traced);
        let seconds = began.elapsed().as_secs_f64();
        (report.summary).insert("timings".into(), json!({ "seconds": seconds }));
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        match self.axis(setting) {
            Ok((axis, _)) => vec![report::main_table(setting, &axis, &[])],
            Err(_) => Vec::new(),
        }
    }
}

impl Torus {
    /// The parameter with its range, and the excitation frequency where that is fixed.
    fn axis(&self, setting: &Setting<'_>) -> Result<(CurveAxis, f64), Fault> {
        let names = [self.parameter.as_str()];
        let linked = (&self.link, names.as_slice());
        let axis = CurveAxis::read(setting, &self.parameter, (&self.from, &self.to), linked);
        let axis = axis.map_err(|(end, message)| match end {
            None => Fault::new("parameter", message),
            Some(0) => Fault::new("from", message),
            Some(_) => Fault::new("to", message),
        })?;
        if axis.ends.0 == axis.ends.1 {
            let message = format!("{} is the start of the range", self.to.text);
            return Err(Fault::new("to", message));
        }
        let at = match (&axis.parameter, &self.at) {
            (VariedParameter::Frequency(_), None) => 1.0,
            (VariedParameter::Frequency(_), Some(_)) => {
                let message = "the excitation frequency is the parameter; leave `at` out";
                return Err(Fault::new("at", message));
            }
            (VariedParameter::Number(_), Some(at)) => {
                let value = setting.frequency(at);
                value.map_err(|message| Fault::new("at", message))?
            }
            (VariedParameter::Number(knob), None) => {
                let path = knob.name();
                let message =
                    format!("missing: the excitation frequency at which {path} is varied");
                return Err(Fault::new("at", message));
            }
        };
        Ok((axis, at))
    }

    /// Shares of the marks.
    fn shares(&self, setting: &Setting<'_>, axis: &CurveAxis) -> Result<Vec<f64>, Fault> {
        let share = |(k, written): (usize, &Quantity)| {
            let fault = |message: String| Fault::new(format!("marks.{k}"), message);
            let share = start::share(setting, axis, written).map_err(fault)?;
            match (0.0..=1.0).contains(&share) {
                true => Ok(share),
                false => Err(fault(format!("{} lies outside the range", written.text))),
            }
        };
        self.marks.iter().enumerate().map(share).collect()
    }

    fn check_numbers(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let sizes = [
            ("points", self.points, 9, 10_001),
            ("most_points", self.most_points, self.points, 10_001),
            ("transient", self.transient, 0, limits::PERIODS),
            ("max_tori", self.max_tori, 2, limits::POINTS),
            ("subharmonic", self.subharmonic.unwrap_or(1), 1, 1000),
        ];
        let beyond = sizes
            .into_iter()
            .filter_map(|(key, x, a, b)| limits::check(key, x, a, b));
        faults.extend(beyond);
        if self.points.is_multiple_of(2) {
            let message = format!("{} must be odd", self.points);
            faults.push(Fault::new("points", message));
        }
        for (key, value) in [
            ("tolerance", self.tolerance),
            ("step", self.step),
            ("min_step", self.min_step),
            ("max_step", self.max_step),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                faults.push(Fault::new(key, format!("{value} must be > 0")));
            }
        }
        if !(self.min_step <= self.step && self.step <= self.max_step) {
            let message = "must lie between `min_step` and `max_step`";
            faults.push(Fault::new("step", message));
        }
        faults
    }
}
