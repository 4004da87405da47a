//! Run-ups and run-downs: order tracks, spectra, ranges and rattle against the speed, and the speeds of resonance.

mod heat;
mod orders;
mod plan;
mod record;
mod signals;
mod tables;

use super::cost::{Cost, Period};
use super::transient::{Drive, RampKeys, SpeedProfile, SpeedRamp, Transient, tell};
use super::{Analysis, Fault, Initial, Setting, columns, flow};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::solve::integrate::{IntegratorChoice, IntegratorOptions};
use plan::RunUpPlan;
use record::RunUpRecord;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

/// Settings of `run_up`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct RunUp {
    /// Speed of the reference at the start.
    #[serde(default)]
    pub from: Option<Quantity>,
    /// Speed at the end; below `from` for a run-down.
    #[serde(default)]
    pub to: Option<Quantity>,
    /// Speed over time, such as a measured one, instead of `from`, `to`, `duration`, `rate` and `hold`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<SpeedProfile>,
    /// Duration of the ramp from `from` to `to`.
    #[serde(default)]
    pub duration: Option<Quantity>,
    /// Rate of change of speed, such as `170 rpm/s`, instead of `duration`.
    #[serde(default)]
    pub rate: Option<Quantity>,
    /// Time at the first speed before the ramp, and at the last speed after it.
    #[serde(default)]
    pub hold: Option<Quantity>,
    /// Phase of the reference at t = 0; default 0.
    #[serde(default)]
    pub phase: Option<Quantity>,
    /// Orders of the reference to track: numbers, fractions such as 35/47, or names of meshes with teeth; default:
    /// the orders of the loads.
    #[serde(default)]
    pub orders: Option<Vec<ReportedOrder>>,
    /// Length of a window, in whole revolutions.
    #[serde(default = "defaults::window")]
    pub window: usize,
    /// Revolutions between the starts of windows; default: half a window.
    #[serde(default)]
    pub hop: Option<usize>,
    /// Samples per revolution; default: 64, more for orders above 8.
    #[serde(default)]
    pub samples_per_revolution: Option<usize>,
    /// Signals: `q.c`, `v.c`, `f.c`, `dte.c` of a connection c, `acceleration.BODY`; default: the deformations of
    /// connections with gaps.
    #[serde(default)]
    pub signals: Option<Vec<String>>,
    /// Highest order of the spectra; default: the highest tracked order.
    #[serde(default)]
    pub spectrum_to: Option<usize>,
    /// Frequency bands of the levels: pairs of frequencies.
    #[serde(default)]
    pub bands: Option<Vec<(Quantity, Quantity)>>,
    /// Whether the train follows the speed, every body with a torque for its mean acceleration.
    #[serde(default)]
    pub follow: bool,
    /// State at t = 0; default: the static equilibrium under the mean loads at rest.
    #[serde(default)]
    pub initial: Initial,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// Local error of the series flow, relative to the motion; default 1e-12.
    #[serde(default)]
    pub flow_tolerance: Option<f64>,
    /// Further tables; default: `spectra`.
    #[serde(default)]
    pub tables: Option<Vec<RunUpTable>>,
}

/// An order of the reference: a number, a fraction, or the name of a mesh.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ReportedOrder {
    /// A number.
    Number(f64),
    /// A fraction, or the name of a mesh with teeth.
    Text(String),
}

impl ReportedOrder {
    /// Its number.
    ///
    /// # Errors
    /// What is no number above 0, no fraction, and no mesh with teeth.
    pub(in crate::analysis) fn value(&self, setting: &Setting<'_>) -> Result<f64, String> {
        let value = match self {
            ReportedOrder::Number(value) => Some(*value),
            ReportedOrder::Text(text) => plan::named(setting, text),
        };
        value.filter(|value| *value > 0.0 && value.is_finite()).ok_or_else(|| {
            let shown = match self {
                ReportedOrder::Number(value) => value.to_string(),
                ReportedOrder::Text(text) => format!("`{text}`"),
            };
            format!(
                "{shown}: wanted a number above 0, a fraction such as 35/47, or the name of a mesh with teeth"
            )
        })
    }
}

/// Optional tables of a run-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunUpTable {
    /// Amplitudes against speed and order.
    Spectra,
    /// Every passage through a breakpoint.
    Switches,
    /// The samples of the signals.
    Series,
}

mod defaults {
    pub fn window() -> usize {
        8
    }
}

#[typetag::serde(name = "run_up")]
impl Analysis for RunUp {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = self.initial.check(setting, "initial");
        faults.extend(flow::check_tolerance(self.flow()));
        match RunUpPlan::new(self, setting) {
            Err(list) => faults.extend(list),
            Ok(plan) => {
                let start = self.drive(&plan);
                let motion = Transient::new(setting, start, &Initial::default(), self.flow());
                faults.extend(motion.err());
            }
        }
        faults
    }

    fn takes_functions_of_time(&self) -> bool {
        true
    }

    fn files(&self, setting: &Setting<'_>) -> Vec<PathBuf> {
        let speed = self.speed.as_ref();
        speed
            .and_then(|speed| speed.path(setting, "speed"))
            .into_iter()
            .collect()
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let Ok(plan) = RunUpPlan::new(self, setting) else {
            return Cost::default();
        };
        let SpeedRamp { end, turns, .. } = plan.ramp;
        let windows = turns / plan.hop as f64;
        let columns = (plan.signals.len() * (3 + 2 * plan.orders.len())) as f64;
        let lines = windows * (plan.spectrum * self.window) as f64;
        let samples = turns * plan.samples as f64;
        let series = if plan.keeps_series { samples } else { 0.0 };
        let cells = windows * columns + (lines + series) * (2 + plan.signals.len()) as f64;
        let motion = end / std::f64::consts::TAU * Period::of(setting, 1.0).plain;
        Cost::table(cells, 1.0, "samples_per_revolution")
            .lasting(motion + 1e-6 * samples, "duration")
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let began = Instant::now();
        let plan = RunUpPlan::new(self, setting);
        let plan = plan.map_err(|mut list| columns::refused(setting, list.remove(0)))?;
        let start = self.drive(&plan);
        let motion = Transient::new(setting, start, &self.initial, self.flow());
        let mut motion = motion.map_err(|fault| columns::refused(setting, fault))?;
        let system = motion.system.clone();
        let Some(course) = system.course() else {
            return Ok(Report::default());
        };
        let (orders, layout) = plan.layout(self.window);
        let state = motion.state.clone();
        let mut record = RunUpRecord::new(
            setting,
            (&system, course),
            &plan.signals,
            (orders, layout),
            &state,
        );
        motion.integrator.start(&system, 0.0, &state, &mut record);
        let stop = motion.advance(setting, (0.0, plan.ramp.end), &mut record);
        record.finish();
        let reached = record.reached;
        let mut report = tables::report(setting, &plan, record);
        report.warnings.extend(motion.warnings(setting));
        report.ended_early = stop.map(|stop| tell(setting, stop, reached));
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        for (key, value) in [
            ("options", options),
            ("integrator", json!(motion.integrator.name())),
            ("samples_per_revolution", json!(plan.samples)),
            ("orders", json!(plan.orders)),
            (
                "timings",
                json!({ "seconds": began.elapsed().as_secs_f64() }),
            ),
        ] {
            report.summary.insert(key.into(), value);
        }
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        RunUpPlan::new(self, setting).map_or(Vec::new(), |plan| tables::empty(setting, &plan))
    }
}

impl RunUp {
    fn drive<'p>(&self, plan: &'p RunUpPlan) -> Drive<'p> {
        Drive {
            speed: &plan.ramp.line,
            phase: plan.ramp.phase,
            follow: self.follow,
        }
    }

    fn flow(&self) -> IntegratorOptions {
        flow::options(self.integrator, self.flow_tolerance)
    }

    fn ramp_keys(&self) -> RampKeys<'_> {
        RampKeys {
            from: self.from.as_ref(),
            to: self.to.as_ref(),
            speed: self.speed.as_ref(),
            duration: self.duration.as_ref(),
            rate: self.rate.as_ref(),
            hold: self.hold.as_ref(),
            phase: self.phase.as_ref(),
        }
    }
}
