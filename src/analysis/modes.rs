//! Natural frequencies of the linearised train against the effective stiffness of its connections (figure 2).

use super::cost::Cost;
use super::{Analysis, Fault, Setting, columns, limits};
use crate::error::Error;
use crate::postprocess::effective_stiffness::natural_frequencies;
use crate::report::{Curve, CurveStyle, Figure, Panel, Report, Table};
use crate::solve::attractor::RecordStop;
use crate::solve::equilibrium::equilibrium;
use crate::system::System;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of `modes`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[non_exhaustive]
pub struct Modes {
    /// First and last effective stiffness.
    pub effective_stiffness: [f64; 2],
    /// Number of values, both ends included.
    pub points: usize,
    /// Connections whose stiffness varies together; the others keep that of the state. Default: all.
    pub vary: Option<Vec<String>>,
    /// State with effective stiffness 1.
    pub state: State,
}

/// State about which the train is linearised.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Full contact: slope 1 in every connection with a spring.
    #[default]
    Contact,
    /// Static equilibrium: the slope of every law there, 0 for open connections.
    Rest,
    /// Full contact with every slider slipping.
    Slipping,
}

impl Default for Modes {
    fn default() -> Self {
        Modes {
            effective_stiffness: [0.0, 1.0],
            points: 101,
            vary: None,
            state: State::Contact,
        }
    }
}

#[typetag::serde(name = "modes")]
impl Analysis for Modes {
    /// Loads have no part in it, or just their mean.
    fn takes_functions_of_time(&self) -> bool {
        true
    }

    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = Vec::new();
        faults.extend(limits::check("points", self.points, 2, limits::POINTS));
        for (k, value) in self.effective_stiffness.iter().enumerate() {
            if !(value.is_finite() && *value >= 0.0) {
                faults.push(Fault::new(
                    format!("effective_stiffness.{k}"),
                    format!("{value} must be >= 0"),
                ));
            }
        }
        for (k, name) in self.vary.iter().flatten().enumerate() {
            if !setting.assembly.connections.contains(name) {
                let hint = crate::error::did_you_mean(name, &setting.assembly.connections);
                faults.push(Fault::new(
                    format!("vary.{k}"),
                    format!("no connection is called `{name}`; {hint}"),
                ));
            }
        }
        if let Err(message) = self.slopes(setting) {
            faults.push(Fault::new("state", message));
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let (n, points) = (setting.assembly.system.dof() as f64, self.points as f64);
        let seconds = points * (1e-6 + 2e-8 * n.powi(3));
        Cost::table(points, n + 1.0, "points").lasting(seconds, "points")
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let assembly = setting.assembly;
        let [from, to] = self.effective_stiffness;
        let n = assembly.system.dof();
        let varies = |name: &String| self.vary.as_ref().is_none_or(|list| list.contains(name));
        let state = (self.slopes(setting))
            .map_err(|message| columns::refused(setting, Fault::new("state", message)))?;
        let mut stiffness = Vec::with_capacity(self.points);
        let mut frequencies = vec![Vec::with_capacity(self.points); n];
        for k in 0..self.points {
            if setting.control.is_interrupted() {
                break;
            }
            let value = from + (to - from) * k as f64 / (self.points - 1) as f64;
            let slopes: Vec<f64> = assembly
                .connections
                .iter()
                .zip(&state)
                .map(|(name, slope)| if varies(name) { value * slope } else { *slope })
                .collect();
            stiffness.push(value);
            let list = natural_frequencies(&assembly.system, &slopes);
            frequencies
                .iter_mut()
                .zip(list)
                .for_each(|(column, w)| column.push(w));
        }
        let ended_early =
            (stiffness.len() < self.points).then(|| RecordStop::Interrupted.to_string());
        let (_, scale) = unit(setting);
        let scaled = |list: Vec<f64>| list.into_iter().map(|w| w * scale).collect();
        let frequencies = frequencies.into_iter().map(scaled).collect();
        Ok(Report {
            tables: vec![table(setting, stiffness, frequencies)],
            figure: Some(figure(n, unit(setting).0)),
            ended_early,
            ..Report::default()
        })
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let none = vec![Vec::new(); setting.assembly.system.dof()];
        vec![table(setting, Vec::new(), none)]
    }
}

impl Modes {
    /// Slopes of the laws in the requested state, e values; or the reason why there are none.
    fn slopes(&self, setting: &Setting<'_>) -> Result<Vec<f64>, String> {
        let system = &setting.assembly.system;
        match self.state {
            State::Contact => Ok(system.contact_slopes()),
            State::Slipping => Ok(slipping_slopes(system)),
            State::Rest => {
                let names = &setting.assembly.connections;
                let rest = equilibrium(system).map_err(|none| none.describe(names))?;
                rest.slopes(names)
            }
        }
    }
}

/// Slopes in full contact with every slider slipping, e values.
fn slipping_slopes(system: &System) -> Vec<f64> {
    let rest = equilibrium(system).ok();
    let mut slopes = system.contact_slopes();
    for (e, (mount, slope)) in system.mounts().iter().zip(&mut slopes).enumerate() {
        if mount.element.memory_count() == 0 {
            continue;
        }
        let x = rest.as_ref().map_or(0.0, |r| r.deformation[e]);
        let automata = mount.element.automata().unwrap_or_default();
        let springs = automata.iter().filter(|a| !a.has_memory);
        *slope = springs.map(|a| a.slope_at(x)).sum();
    }
    slopes
}

/// Unit of the natural frequencies, and the factor to it from frequencies over omega_c.
fn unit(setting: &Setting<'_>) -> (&'static str, f64) {
    match setting.is_si() {
        true => (
            "Hz",
            setting.assembly.scales.frequency / std::f64::consts::TAU,
        ),
        false => ("", 1.0),
    }
}

/// `effective_stiffness, natural_frequency.1..n`, one row a stiffness.
fn table(setting: &Setting<'_>, stiffness: Vec<f64>, frequencies: Vec<Vec<f64>>) -> Table {
    let (unit, _) = unit(setting);
    let mut list = vec![columns::float("effective_stiffness", "", stiffness)];
    list.extend((frequencies.into_iter().enumerate()).map(|(i, values)| {
        let name = format!("natural_frequency.{}", i + 1);
        columns::float(name, unit, values)
    }));
    Table {
        name: String::new(),
        columns: list,
    }
}

fn figure(n: usize, unit: &str) -> Figure {
    let curve = |i: usize| Curve {
        table: String::new(),
        x: "effective_stiffness".into(),
        y: format!("natural_frequency.{}", i + 1),
        label: format!("mode {}", i + 1),
        style: CurveStyle::Line,
        only: None,
    };
    let y_label = if unit.is_empty() {
        "natural frequency \u{3c9}/\u{3c9}c".into()
    } else {
        format!("natural frequency [{unit}]")
    };
    let panel = Panel {
        x_label: "effective stiffness \u{3ba}".into(),
        y_label,
        curves: (0..n).map(curve).collect(),
        ..Panel::default()
    };
    Figure {
        title: String::new(),
        panels: vec![panel],
    }
}
