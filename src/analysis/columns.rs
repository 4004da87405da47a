//! Names, units and factors of what the analyses in the time domain report.

use super::{Fault, Setting};
use crate::error::{Diagnostic, Error};
use crate::measure::ColumnHeading;
use crate::model::Structure;
use crate::report::{Column, FrequencyAxis, FrequencyUnit, Report, Values};
use crate::solve::attractor::lyapunov::Exponents;
use std::f64::consts::TAU;

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

/// `T`, or `t` in seconds.
pub(super) fn time(setting: &Setting<'_>) -> ColumnHeading {
    let name = if setting.is_si() { "t" } else { "T" };
    setting.units().time(name)
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
        shown: match reference(setting) {
            Some(_) => FrequencyUnit::RevolutionsPerMinute,
            None => written,
        },
        omega_c: setting.assembly.scales.frequency,
    })
}

/// Name of the reference shaft, where speeds in rpm accompany frequencies: in SI reports of trains that name one.
pub(super) fn reference<'a>(setting: &Setting<'a>) -> Option<&'a str> {
    let Structure::Train(train) = &setting.model.structure else {
        return None;
    };
    let motion = train.mean_motion.as_ref().filter(|_| setting.is_si())?;
    train
        .bodies
        .get_index(motion.reference)
        .map(|(name, _)| name.as_str())
}

/// `speed_rpm` from frequencies over omega_c, where there is a reference shaft.
pub(super) fn speed_rpm(
    setting: &Setting<'_>,
    frequencies: impl IntoIterator<Item = f64>,
) -> Option<Column> {
    reference(setting)?;
    let factor = setting.assembly.scales.frequency * 60.0 / TAU;
    let heading = ColumnHeading::new("speed_rpm", "rpm", factor);
    Some(heading.column(frequencies))
}

/// Text of an abscissa of excitation frequencies, in rpm where there is a reference shaft.
pub(super) fn frequency_label(setting: &Setting<'_>, otherwise: &str) -> String {
    match reference(setting) {
        Some(body) => format!("speed of {body} [rpm]"),
        None => otherwise.to_owned(),
    }
}

/// Rate of one connection.
pub(super) fn rate(setting: &Setting<'_>, connection: usize) -> ColumnHeading {
    let name = &setting.assembly.connections[connection];
    setting.units().rate(format!("v.{name}"), connection)
}

/// Displacement of one connection.
fn displacement(setting: &Setting<'_>, connection: usize) -> ColumnHeading {
    let name = &setting.assembly.connections[connection];
    setting
        .units()
        .displacement(format!("q.{name}"), connection)
}

/// `q.c.., v.c.., f.c..` of the connections: deformations, their rates, forces.
pub(super) fn connections(setting: &Setting<'_>) -> Vec<ColumnHeading> {
    let names = setting.assembly.connections.iter().enumerate();
    let force = |(k, name): (usize, &String)| setting.units().force(format!("f.{name}"), k);
    let count = names.len();
    let mut list: Vec<ColumnHeading> = (0..count).map(|k| displacement(setting, k)).collect();
    list.extend((0..count).map(|k| rate(setting, k)));
    list.extend(names.map(force));
    list
}

/// `z.c` of the connections that remember something; `z.c.1`, `z.c.2`, .. where they remember more than one number.
pub(super) fn memories(setting: &Setting<'_>) -> Vec<ColumnHeading> {
    let names = setting.assembly.connections.iter().enumerate();
    let mounts = setting.assembly.system.mounts();
    names
        .flat_map(|(k, name)| {
            let count = mounts[k].element.memory_count();
            (1..=count).map(move |number| {
                let name = match count {
                    1 => format!("z.{name}"),
                    _ => format!("z.{name}.{number}"),
                };
                setting.units().displacement(name, k)
            })
        })
        .collect()
}

/// The relative coordinates, their rates, and what connections remember.
pub(super) fn states(setting: &Setting<'_>) -> Vec<ColumnHeading> {
    let mut list = coordinates(setting);
    list.extend(memories(setting));
    list
}

/// Connection that a relative coordinate measures; `None` for the coordinates of reduced systems, whose scale is 1.
pub(super) fn connection_of(setting: &Setting<'_>, coordinate: usize) -> Option<usize> {
    let coupling = setting.assembly.coupling.as_ref()?;
    coupling.coordinates.get(coordinate).copied()
}

/// The relative coordinates, geometric, without transmission error: `q.c.., v.c..` where they are the deformation of connection c
/// and its rate, else `r.c.., dr.c..`.
pub(super) fn coordinates(setting: &Setting<'_>) -> Vec<ColumnHeading> {
    let names = &setting.assembly.coordinates;
    let described = |i: usize, is_rate: bool| {
        let own = match connection_of(setting, i) {
            Some(k) if is_rate => rate(setting, k),
            Some(k) => displacement(setting, k),
            None => ColumnHeading::number(""),
        };
        let kind = match (is_deformation(setting, i), is_rate) {
            (true, false) => "q",
            (true, true) => "v",
            (false, false) => "r",
            (false, true) => "dr",
        };
        ColumnHeading {
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

/// `acceleration.<body>..` from SI values. None for reduced systems.
pub(super) fn accelerations(setting: &Setting<'_>) -> Vec<ColumnHeading> {
    setting.units().accelerations("acceleration")
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

/// `lyapunov_1, lyapunov_2, ..`, exponents in units of omega_c, one list per row; empty where one is not known or minus infinity.
pub(super) fn exponents(count: usize, rows: &[Option<&Exponents>]) -> Vec<Column> {
    let column = |i: usize| {
        let value = |row: &Option<&Exponents>| row.map_or(f64::NAN, |e| e.values[i]);
        let shown = |x: f64| if x.is_finite() { x } else { f64::NAN };
        let values = rows.iter().map(value).map(shown).collect();
        float(format!("lyapunov_{}", i + 1), "", values)
    };
    (0..count).map(column).collect()
}

/// Says of exponents that are minus infinity in every row why their columns are empty, and lists all that are in some.
pub(super) fn explain_exponents(report: &mut Report, rows: &[Option<&Exponents>]) {
    let count = rows.iter().flatten().map(|e| e.values.len()).max();
    let is_forgotten = |row: &Option<&Exponents>, i: usize| {
        row.is_some_and(|e| e.values.get(i) == Some(&f64::NEG_INFINITY))
    };
    let mut list = Vec::new();
    for i in 0..count.unwrap_or(0) {
        let name = format!("lyapunov_{}", i + 1);
        let forgotten = rows.iter().filter(|row| is_forgotten(row, i)).count();
        if forgotten == rows.len() {
            report.explain_empty("summary", &name, FORGOTTEN);
        }
        if forgotten > 0 {
            list.push(name);
        }
    }
    if !list.is_empty() {
        let entry = serde_json::json!({"columns": list, "reason": FORGOTTEN});
        report.summary.insert("minus_infinity".into(), entry);
    }
}

/// Heading that says how many of the largest exponents have no place in a figure; empty where all have one.
pub(super) fn exponents_not_drawn(rows: &[Option<&Exponents>]) -> String {
    let is_infinite = |e: &&&Exponents| e.values.first() == Some(&f64::NEG_INFINITY);
    match rows.iter().flatten().filter(is_infinite).count() {
        0 => String::new(),
        count => format!(
            "minus infinity at {count} of {} points, not drawn",
            rows.len()
        ),
    }
}

/// Why an exponent has no number.
const FORGOTTEN: &str = "minus infinity: a deviation is forgotten within a period (its multiplier is 0), as in held contact or by a slider that slips";
