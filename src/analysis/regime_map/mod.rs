//! Kinds of attractors, and measures of them, over a grid of two numbers of the model.

mod cells;
mod measures;
mod neighbours;
mod overlay;
mod report;

use super::bifurcation_curve::{Axes, CurveAxis};
use super::cost::{Cost, Period};
use super::flow::{self, LabelKeys};
use super::{Analysis, Fault, Link, Setting, columns, limits};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::solve::attractor::{Lengths, MapSize};
use crate::solve::integrate::IntegratorChoice;
use cells::Field;
use indexmap::IndexMap;
use measures::WantedColumns;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::time::Instant;

/// Settings of `regime_map`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RegimeMap {
    /// The two numbers (`frequency` or paths of numbers of the model), each with its values.
    pub parameters: IndexMap<String, AxisValues>,
    /// Further numbers that follow one of them, such as `{gear_1.drag: {gear_2.drag: "0.4*x"}}`.
    #[serde(default, skip_serializing_if = "Link::is_empty")]
    pub link: Link,
    /// Excitation frequency, if it is not one of the parameters.
    #[serde(default)]
    pub at: Option<Quantity>,
    /// Columns to report, of a frequency response or of its rattle metrics: by name, or for all connections and
    /// bodies, such as `impacts`.
    #[serde(default = "defaults::measures")]
    pub measures: Vec<String>,
    /// Measure to draw; default: labels.
    #[serde(default)]
    pub draw: Option<String>,
    /// Number of times the grid is halved where neighbours differ.
    #[serde(default = "defaults::refine")]
    pub refine: usize,
    /// Initial states of the motions.
    #[serde(default = "defaults::seeds")]
    pub seeds: Vec<Seed>,
    /// Curves of this file to draw over the map.
    #[serde(default)]
    pub curves: Vec<String>,
    /// Excitation periods before the record.
    #[serde(default = "defaults::transient")]
    pub transient: usize,
    /// Periods recorded.
    #[serde(default = "defaults::periods")]
    pub periods: usize,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
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

/// Values of one number.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisValues {
    /// First value.
    pub from: Quantity,
    /// Last value.
    pub to: Quantity,
    /// Number of values, evenly spaced, both ends included.
    pub points: usize,
}

/// Initial state of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Seed {
    /// Static equilibrium at rest.
    Rest,
    /// End of the motion in the previous cell, along the first number upwards.
    Neighbour,
    /// End of the motion in the previous cell, along the first number downwards.
    NeighbourDown,
}

mod defaults {
    use super::Seed;

    pub fn measures() -> Vec<String> {
        vec!["impacts".into()]
    }
    pub fn refine() -> usize {
        2
    }
    pub fn seeds() -> Vec<Seed> {
        vec![Seed::Rest, Seed::Neighbour]
    }
    pub fn transient() -> usize {
        200
    }
    pub fn periods() -> usize {
        100
    }
    pub fn lyapunov() -> bool {
        true
    }
}

/// Cells at most, refined everywhere.
const CELLS: usize = 20_000_000;

#[typetag::serde(name = "regime_map")]
impl Analysis for RegimeMap {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults: Vec<Fault> = flow::check_size(self.size(), 1).into_iter().collect();
        faults.extend(self.label_keys().check());
        faults.extend(limits::check("refine", self.refine, 0, 8));
        for (name, values) in &self.parameters {
            let key = format!("parameters.{name}.points");
            faults.extend(limits::check(&key, values.points, 2, limits::POINTS));
        }
        if self.seeds.is_empty() {
            faults.push(Fault::new("seeds", "an empty list: nothing to run"));
        }
        faults.extend(flow::integrator(setting, &setting.assembly.system, self.integrator).err());
        match self.axes(setting) {
            Ok(axes) => {
                faults.extend(axes.check(setting));
                let overlay = self.curves.iter().enumerate();
                faults.extend(overlay.filter_map(|(k, name)| {
                    let message = overlay::check(setting, &axes, name).err()?;
                    Some(Fault::new(format!("curves.{k}"), message))
                }));
            }
            Err(list) => faults.extend(list),
        }
        let wanted = WantedColumns::new(setting, &self.measures, self.draw.as_deref());
        faults.extend(wanted.err().into_iter().flatten());
        let cells = self.parameters.values().fold(1_usize, |n, values| {
            n.saturating_mul(values.points.saturating_mul(1 << self.refine.min(8)))
        });
        if cells > CELLS {
            let message = format!("{cells} cells if all are refined; at most {CELLS}");
            faults.push(Fault::new("refine", message));
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let Ok(axes) = self.axes(setting) else {
            return Cost::default();
        };
        let period = Period::of(setting, axes.slowest());
        let base: usize = self.parameters.values().map(|v| v.points).product();
        // Refinement follows lines.
        let cells = base as f64 * (1.0 + 0.5 * self.refine as f64);
        let runs = cells * self.seeds.len() as f64;
        let plain = flow::cost(self.size(), setting, period, 1).seconds;
        Cost::table(runs, 4.0 + self.measures.len() as f64, "parameters")
            .lasting(runs * plain, "parameters")
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let refused = |fault| columns::refused(setting, fault);
        let began = Instant::now();
        let axes = self
            .axes(setting)
            .map_err(|mut list| refused(list.remove(0)))?;
        let wanted = WantedColumns::new(setting, &self.measures, self.draw.as_deref());
        let wanted = wanted.map_err(|mut list| refused(list.remove(0)))?;
        let curves = overlay::tables(setting, &axes, &self.curves)?;
        let mut field = Field::new(self, setting, &axes, &wanted);
        field.run();
        let mut report = report::assemble(self, setting, (&axes, &wanted), (&field, curves));
        let seconds = began.elapsed().as_secs_f64();
        (report.summary).insert("timings".into(), json!({ "seconds": seconds }));
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let wanted = WantedColumns::new(setting, &self.measures, self.draw.as_deref());
        match (self.axes(setting), wanted) {
            (Ok(axes), Ok(wanted)) => {
                let field = Field::new(self, setting, &axes, &wanted);
                vec![
                    report::main_table((&axes, &wanted), &field),
                    report::orbits(setting, &field),
                ]
            }
            _ => Vec::new(),
        }
    }
}

impl RegimeMap {
    fn size(&self) -> MapSize {
        MapSize {
            transient: self.transient,
            periods: self.periods,
            exponents: Lengths::for_labels(self.lyapunov),
        }
    }

    fn label_keys(&self) -> LabelKeys {
        LabelKeys {
            longest_period: self.longest_period,
            extend: self.extend,
        }
    }

    fn axes(&self, setting: &Setting<'_>) -> Result<Axes, Vec<Fault>> {
        let mut faults = Vec::new();
        if self.parameters.len() != 2 {
            let message = format!("{} numbers; a map has two", self.parameters.len());
            return Err(vec![Fault::new("parameters", message)]);
        }
        let mut list = Vec::new();
        let names: Vec<&str> = self.parameters.keys().map(String::as_str).collect();
        for (name, values) in &self.parameters {
            match CurveAxis::read(
                setting,
                name,
                (&values.from, &values.to),
                (&self.link, &names),
            ) {
                Ok(axis) if axis.ends.0 == axis.ends.1 => {
                    let message = format!("{} is the start of the range", values.to.text);
                    faults.push(Fault::new(format!("parameters.{name}.to"), message));
                }
                Ok(axis) => list.push(axis),
                Err((end, message)) => {
                    let key = match end {
                        None => format!("parameters.{name}"),
                        Some(0) => format!("parameters.{name}.from"),
                        Some(_) => format!("parameters.{name}.to"),
                    };
                    faults.push(Fault::new(key, message));
                }
            }
        }
        Axes::of(setting, list, self.at.as_ref(), faults)
    }
}
