//! Names, units and factors of what the analyses in the time domain report.

use super::{Fault, Setting};
use crate::error::{Diagnostic, Error};
use crate::model::{Motion, Structure};
use crate::report::{Column, FrequencyAxis, FrequencyUnit, Values};

/// A column without its numbers: its name, its unit, and the factor from nondimensional to reported values.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Quantity {
    pub name: String,
    pub unit: String,
    pub factor: f64,
}

impl Quantity {
    fn new(name: String, unit: String, factor: f64) -> Quantity {
        Quantity { name, unit, factor }
    }

    /// The column of nondimensional values.
    pub fn column(self, values: Vec<f64>) -> Column {
        let Quantity { name, unit, factor } = self;
        float(name, unit, values.into_iter().map(|x| x * factor).collect())
    }

    /// Text of an axis: the name with its unit.
    pub fn axis(&self) -> String {
        if self.unit.is_empty() {
            self.name.clone()
        } else {
            format!("{} [{}]", self.name, self.unit)
        }
    }
}

pub(super) fn float(name: impl Into<String>, unit: impl Into<String>, values: Vec<f64>) -> Column {
    Column {
        name: name.into(),
        unit: unit.into(),
        values: Values::Float(values),
    }
}

pub(super) fn integer(name: &str, values: Vec<i64>) -> Column {
    Column {
        name: name.into(),
        unit: String::new(),
        values: Values::Integer(values),
    }
}

pub(super) fn text(name: &str, values: Vec<String>) -> Column {
    Column {
        name: name.into(),
        unit: String::new(),
        values: Values::Text(values),
    }
}

/// Nondimensional, or with a unit and a factor in SI reports.
fn scaled(setting: &Setting<'_>, name: String, unit: String, factor: f64) -> Quantity {
    if setting.is_si() {
        Quantity::new(name, unit, factor)
    } else {
        Quantity::new(name, String::new(), 1.0)
    }
}

/// `T`, or `t` in seconds.
pub(super) fn time(setting: &Setting<'_>) -> Quantity {
    let name = if setting.is_si() { "t" } else { "T" };
    let factor = 1.0 / setting.assembly.scales.frequency;
    scaled(setting, name.into(), "s".into(), factor)
}

/// Scales of an abscissa of frequencies, which SI reports write in `si`. None for reduced systems, which have no time scale.
pub(super) fn frequency_axis(setting: &Setting<'_>, si: FrequencyUnit) -> Option<FrequencyAxis> {
    let Structure::Train(_) = setting.model.structure else {
        return None;
    };
    let written = if setting.is_si() {
        si
    } else {
        FrequencyUnit::Nondimensional
    };
    Some(FrequencyAxis {
        written,
        omega_c: setting.assembly.scales.frequency,
    })
}

/// Rate of one connection.
pub(super) fn rate(setting: &Setting<'_>, connection: usize) -> Quantity {
    let scales = &setting.assembly.scales;
    let name = format!("v.{}", setting.assembly.connections[connection]);
    let unit = format!("{}/s", setting.model.units_of(connection).0);
    let factor = scales.displacement[connection] * scales.frequency;
    scaled(setting, name, unit, factor)
}

/// Displacement of one connection.
fn displacement(setting: &Setting<'_>, connection: usize) -> Quantity {
    let name = format!("q.{}", setting.assembly.connections[connection]);
    let unit = setting.model.units_of(connection).0.to_string();
    let l = setting.assembly.scales.displacement[connection];
    scaled(setting, name, unit, l)
}

/// `q.c.., v.c.., f.c..` of the connections: deformations, their rates, forces.
pub(super) fn connections(setting: &Setting<'_>) -> Vec<Quantity> {
    let scales = &setting.assembly.scales;
    let force = |k: usize| {
        let name = format!("f.{}", setting.assembly.connections[k]);
        let factor = scales.stiffness[k] * scales.displacement[k];
        let unit = setting.model.units_of(k).1.to_string();
        scaled(setting, name, unit, factor)
    };
    let count = setting.assembly.connections.len();
    let mut list: Vec<Quantity> = (0..count).map(|k| displacement(setting, k)).collect();
    list.extend((0..count).map(|k| rate(setting, k)));
    list.extend((0..count).map(force));
    list
}

/// Connection that a relative coordinate measures; `None` for the coordinates of reduced systems, whose scale is 1.
pub(super) fn connection_of(setting: &Setting<'_>, coordinate: usize) -> Option<usize> {
    let coupling = setting.assembly.coupling.as_ref()?;
    coupling.coordinates.get(coordinate).copied()
}

/// The relative coordinates, geometric, without transmission error: `q.c.., v.c..` where they are the deformation of connection c
/// and its rate, else `r.c.., dr.c..`.
pub(super) fn coordinates(setting: &Setting<'_>) -> Vec<Quantity> {
    let names = &setting.assembly.coordinates;
    let described = |i: usize, is_rate: bool| {
        let own = match connection_of(setting, i) {
            Some(k) if is_rate => rate(setting, k),
            Some(k) => displacement(setting, k),
            None => Quantity::new(String::new(), String::new(), 1.0),
        };
        let kind = match (is_deformation(setting, i), is_rate) {
            (true, false) => "q",
            (true, true) => "v",
            (false, false) => "r",
            (false, true) => "dr",
        };
        Quantity {
            name: format!("{kind}.{}", names[i]),
            ..own
        }
    };
    let n = names.len();
    let positions = (0..n).map(|i| described(i, false));
    positions
        .chain((0..n).map(|i| described(i, true)))
        .collect()
}

/// Whether a relative coordinate is the deformation of the connection that has its name.
fn is_deformation(setting: &Setting<'_>, coordinate: usize) -> bool {
    let assembly = setting.assembly;
    let name = &assembly.coordinates[coordinate];
    let Some(k) = assembly.connections.iter().position(|c| c == name) else {
        return false;
    };
    let error = &assembly.system.mounts()[k].transmission_error;
    let is_shifted = (error.as_ref()).is_some_and(|e| !e.is_constant() || e.mean() != 0.0);
    !is_shifted && assembly.system.element_map_row(k) == [(coordinate, 1.0)]
}

/// `acceleration.<body>..` from SI values: rad/s^2 (m/s^2 for translating masses), or rad/T^2 (m/T^2), divided by omega_c^2, in
/// nondimensional reports. None for reduced systems.
pub(super) fn accelerations(setting: &Setting<'_>) -> Vec<Quantity> {
    let Structure::Train(train) = &setting.model.structure else {
        return Vec::new();
    };
    let (per, factor) = if setting.is_si() {
        ("s^2", 1.0)
    } else {
        ("T^2", setting.assembly.scales.frequency.powi(-2))
    };
    let one = |(name, body): (&String, &crate::model::Body)| {
        let angle = match body.motion {
            Motion::Rotation => "rad",
            Motion::Translation => "m",
        };
        Quantity::new(
            format!("acceleration.{name}"),
            format!("{angle}/{per}"),
            factor,
        )
    };
    train.bodies.iter().map(one).collect()
}

/// A fault that only showed while the analysis ran.
pub(super) fn refused(setting: &Setting<'_>, fault: Fault) -> Error {
    let path = format!("analyses.{}", setting.name);
    let path = if fault.key.is_empty() {
        path
    } else {
        format!("{path}.{}", fault.key)
    };
    Error::Input(vec![Diagnostic {
        location: None,
        path,
        message: fault.message,
        help: None,
    }])
}
