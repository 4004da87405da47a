//! Natural frequencies against the amplitude of a one-harmonic motion: describing functions (figures 3 and 4).

mod motion;

use super::columns::refused;
use super::cost::Cost;
use super::{Analysis, Fault, Setting};
use crate::error::Error;
use crate::measure::ColumnHeading;
use crate::postprocess::describing_function::{describing_function, mean_for_force};
use crate::postprocess::effective_stiffness::natural_frequencies;
use crate::quantity::Quantity;
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Report, Table};
use crate::solve::attractor::RecordStop;
use indexmap::IndexMap;
use motion::{HeldQuantity, Moving};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Settings of `effective_frequencies`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct EffectiveFrequencies {
    /// First and last amplitude of every deformation.
    pub amplitude: [Quantity; 2],
    /// Number of values, both ends included.
    #[serde(default = "default_points")]
    pub points: usize,
    /// Mean deformation of the motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_displacement: Option<Mean>,
    /// Mean force; the mean deformation follows from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_force: Option<Mean>,
    /// Connections that move; the others keep the effective stiffness 1. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vary: Option<Vec<String>>,
}

fn default_points() -> usize {
    101
}

/// One value for all connections, or one per connection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "a number, a number with a unit, or one of these per connection"
)]
pub enum Mean {
    /// The same for all.
    All(Quantity),
    /// By connection.
    Each(IndexMap<String, Quantity>),
}

/// Response of a connection at one amplitude, nondimensional; `None`: it does not move, or no mean carries the force.
#[derive(Debug, Clone, Copy, Default)]
struct AmplitudeState {
    mean: Option<f64>,
    mean_force: Option<f64>,
    stiffness: Option<f64>,
    /// What the natural frequencies are computed with.
    slope: f64,
}

#[typetag::serde(name = "effective_frequencies")]
impl Analysis for EffectiveFrequencies {
    /// Loads have no part in it, or just their mean.
    fn takes_functions_of_time(&self) -> bool {
        true
    }

    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        self.moving(setting).err().unwrap_or_default()
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let system = &setting.assembly.system;
        let (n, e) = (system.dof() as f64, system.element_count() as f64);
        let points = self.points as f64;
        let seconds = points * (1e-6 + 1e-4 * e + 2e-8 * n.powi(3));
        Cost::table(points, 3.0 * e + n + 1.0, "points").lasting(seconds, "points")
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let moving = self.moving(setting).map_err(|faults| {
            let first = faults.into_iter().next();
            refused(setting, first.unwrap_or(Fault::new("", "")))
        })?;
        let shares = (0..self.points).map(|k| k as f64 / (self.points - 1) as f64);
        let goes_on = |_: &f64| !setting.control.is_interrupted();
        let rows: Vec<AmplitudeRow> = shares
            .take_while(goes_on)
            .map(|share| AmplitudeRow::at(setting, &moving, share))
            .collect();
        let mut report = Report {
            tables: vec![table(setting, &moving, &rows)],
            figure: Some(figure(setting, &amplitude_of(setting, &moving))),
            warnings: warnings(setting, &moving, &rows),
            ended_early: (rows.len() < self.points).then(|| RecordStop::Interrupted.to_string()),
            ..Report::default()
        };
        for m in moving.iter().filter(|m| lost(m, &rows) == rows.len()) {
            let connection = &setting.assembly.connections[m.connection];
            for quantity in ["mean", "force_mean"] {
                let column = format!("{quantity}.{connection}");
                report.explain_empty("", &column, "no mean displacement carries the mean force");
            }
        }
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let moving = self.moving(setting);
        moving.map_or(Vec::new(), |m| vec![table(setting, &m, &[])])
    }
}

/// One point.
struct AmplitudeRow {
    /// Share of the way from the first to the last amplitude.
    share: f64,
    /// By connection.
    states: Vec<AmplitudeState>,
    /// Natural frequencies over omega_c with these stiffnesses, ascending.
    frequencies: Vec<f64>,
}

impl AmplitudeRow {
    fn at(setting: &Setting<'_>, moving: &[Moving], share: f64) -> AmplitudeRow {
        let states = states(setting, moving, share);
        let slopes: Vec<f64> = states.iter().map(|s| s.slope).collect();
        AmplitudeRow {
            share,
            frequencies: natural_frequencies(&setting.assembly.system, &slopes),
            states,
        }
    }
}

/// `amplitude`, the columns of the connections, `effective_frequency.1..n`: one row per point.
fn table(setting: &Setting<'_>, moving: &[Moving], rows: &[AmplitudeRow]) -> Table {
    let [from, to] = moving.first().map_or([0.0; 2], |m| m.amplitude);
    let amplitude = rows.iter().map(|row| from + (to - from) * row.share);
    let mut columns = vec![amplitude_of(setting, moving).column(amplitude)];
    columns.extend(connection_columns(setting, rows));
    for i in 0..setting.assembly.system.dof() {
        let heading = setting
            .units()
            .frequency(format!("effective_frequency.{}", i + 1));
        columns.push(heading.column(rows.iter().map(|row| row.frequencies[i])));
    }
    Table {
        name: String::new(),
        columns,
    }
}

/// States of all connections at a share of the way from the first to the last amplitude.
fn states(setting: &Setting<'_>, moving: &[Moving], share: f64) -> Vec<AmplitudeState> {
    let system = &setting.assembly.system;
    let still = |slope| AmplitudeState {
        slope,
        ..AmplitudeState::default()
    };
    let mut list: Vec<AmplitudeState> = system.contact_slopes().into_iter().map(still).collect();
    for m in moving {
        let element = system.mounts()[m.connection].element.as_ref();
        let amplitude = m.amplitude[0] + (m.amplitude[1] - m.amplitude[0]) * share;
        let mean = match m.held {
            HeldQuantity::Displacement(mean) => Some(mean),
            HeldQuantity::Force(force) => mean_for_force(element, amplitude, force),
        };
        let given = mean.map(|mean| describing_function(element, mean, amplitude));
        list[m.connection] = AmplitudeState {
            mean,
            mean_force: given.map(|d| d.mean_force),
            stiffness: given.and_then(|d| d.stiffness),
            slope: given.map_or(f64::NAN, |d| d.stiffness.unwrap_or(d.mean_slope)),
        };
    }
    list
}

/// `mean.c.., force_mean.c.., effective_stiffness.c..`.
fn connection_columns(setting: &Setting<'_>, rows: &[AmplitudeRow]) -> Vec<Column> {
    type FrequencyPart<'p> = (
        &'p dyn Fn(usize, &str) -> ColumnHeading,
        fn(&AmplitudeState) -> Option<f64>,
    );
    let units = setting.units();
    let parts: [FrequencyPart<'_>; 3] = [
        (&|e, c| units.displacement(format!("mean.{c}"), e), |s| {
            s.mean
        }),
        (&|e, c| units.force(format!("force_mean.{c}"), e), |s| {
            s.mean_force
        }),
        (
            &|_, c| ColumnHeading::number(format!("effective_stiffness.{c}")),
            |s| s.stiffness,
        ),
    ];
    let mut columns = Vec::new();
    for (heading, value) in parts {
        for (e, connection) in setting.assembly.connections.iter().enumerate() {
            let values = rows
                .iter()
                .map(|row| value(&row.states[e]).unwrap_or(f64::NAN));
            columns.push(heading(e, connection).column(values));
        }
    }
    columns
}

fn amplitude_of(setting: &Setting<'_>, moving: &[Moving]) -> ColumnHeading {
    let connection = moving.first().map_or(0, |m| m.connection);
    setting.units().displacement("amplitude", connection)
}

/// Amplitudes at which no mean displacement carries the mean force of a connection.
fn lost(moving: &Moving, rows: &[AmplitudeRow]) -> usize {
    let is_lost = |row: &&AmplitudeRow| row.states[moving.connection].mean.is_none();
    rows.iter().filter(is_lost).count()
}

fn warnings(setting: &Setting<'_>, moving: &[Moving], rows: &[AmplitudeRow]) -> Vec<String> {
    let mut list = Vec::new();
    for m in moving {
        let name = &setting.assembly.connections[m.connection];
        let mount = &setting.assembly.system.mounts()[m.connection];
        let lost = lost(m, rows);
        if lost > 0 {
            list.push(format!(
                "{name}: no mean displacement carries the mean force at {lost} of {} amplitudes; the cells are empty",
                rows.len()
            ));
        }
        if mount.stiffness_variation.is_some() || mount.transmission_error.is_some() {
            list.push(format!(
                "{name}: the result describes the law alone, without its stiffness variation and transmission error"
            ));
        }
    }
    list
}

fn figure(setting: &Setting<'_>, amplitude: &ColumnHeading) -> Figure {
    let curve = |i: usize| Curve {
        table: String::new(),
        x: "amplitude".into(),
        y: format!("effective_frequency.{}", i + 1),
        label: format!("mode {}", i + 1),
        style: CurveStyle::Line,
        only: None,
    };
    let x_label = match amplitude.unit.as_str() {
        "" => "amplitude of the deformations over l".into(),
        unit => format!("amplitude of the deformations [{unit}]"),
    };
    let y_label = match setting.is_si() {
        true => "effective natural frequency [Hz]".into(),
        false => "effective natural frequency \u{3c9}*/\u{3c9}c".into(),
    };
    let panel = Panel {
        x_label,
        y_label,
        curves: (0..setting.assembly.system.dof()).map(curve).collect(),
        ..Panel::default()
    };
    Figure {
        title: String::new(),
        panels: vec![panel],
    }
}
