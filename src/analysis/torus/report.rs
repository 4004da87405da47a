//! Tori as tables and as a figure.

use super::Torus;
use super::trace::{TorusRow, TracedTorus};
use crate::analysis::Setting;
use crate::analysis::bifurcation_curve::CurveAxis;
use crate::analysis::columns::{coordinates, float, frequency_axis, integer};
use crate::analysis::parameter::VariedParameter;
use crate::measure::ColumnHeading;
use crate::report::{Curve, CurveStyle, Figure, FrequencyUnit, Panel, Report, Table};
use crate::solve::torus::{TorusEnd, TorusPoint};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Uncertainties of an exponent within which its sign is not known.
const UNSURE: f64 = 3.0;

/// Everything that is delivered.
pub(super) fn assemble(
    keys: &Torus,
    setting: &Setting<'_>,
    axis: &CurveAxis,
    traced: &TracedTorus,
) -> Report {
    let mut tables = vec![main_table(setting, axis, &traced.rows)];
    if keys.curve {
        tables.push(curves(setting, &traced.rows));
    }
    let early = traced.ends.iter().filter(|end| !end.is_complete());
    let mut reasons: Vec<String> = traced.failure.iter().cloned().collect();
    reasons.extend(early.map(|end| told(axis, end)));
    let mut report = Report {
        tables,
        figure: Some(figure(keys, setting, axis, &traced.rows)),
        ended_early: (!reasons.is_empty()).then(|| reasons.join("; ")),
        ..Report::default()
    };
    let end = |end: &TorusEnd| json!({"reason": end.reason(), "message": told(axis, end)});
    let options = serde_json::to_value(keys).unwrap_or(Value::Null);
    for (key, value) in [
        ("options", options),
        ("integrator", json!(traced.integrator)),
        ("ends", traced.ends.iter().map(end).collect()),
        ("failure", json!(traced.failure)),
        ("stability_changes", changes(axis, &traced.rows)),
    ] {
        report.summary.insert(key.into(), value);
    }
    report
}

/// The end in words.
fn told(axis: &CurveAxis, end: &TorusEnd) -> String {
    match end {
        TorusEnd::Folded(locked) => {
            format!(
                "{}, at {}",
                end.message(),
                axis.told(axis.value(locked.lambda))
            )
        }
        end => end.message(),
    }
}

/// Largest transverse exponent per excitation period.
fn exponent(row: &TorusRow) -> f64 {
    row.point.exponent.0 / row.nu as f64
}

/// 1 where nearby motions come nearer, 0 where they leave, empty where the exponent is within its uncertainty of 0.
fn stable(row: &TorusRow) -> f64 {
    let (exponent, uncertainty) = row.point.exponent;
    match exponent.abs() > UNSURE * uncertainty {
        true if exponent < 0.0 => 1.0,
        true => 0.0,
        false => f64::NAN,
    }
}

/// Places between which the torus gains or loses stability.
fn changes(axis: &CurveAxis, rows: &[TorusRow]) -> Value {
    let pairs = rows
        .windows(2)
        .filter(|w| exponent(&w[0]) * exponent(&w[1]) < 0.0);
    let place = |w: &[TorusRow]| {
        let [a, b] = [&w[0], &w[1]].map(|row| (row.point.torus.lambda, exponent(row)));
        let share = a.0 + (b.0 - a.0) * a.1 / (a.1 - b.1);
        let [low, high, near] = [a.0, b.0, share].map(|x| axis.value(x) * axis.factor);
        json!({"between": [low, high], "about": near})
    };
    pairs.map(place).collect()
}

/// `point, parameter, mark, rotation, nu, rms.c.., exponent, invariance_error, points, switches_least, switches_most, stable`.
pub(super) fn main_table(setting: &Setting<'_>, axis: &CurveAxis, rows: &[TorusRow]) -> Table {
    let of =
        |f: &dyn Fn(&TorusPoint) -> f64| rows.iter().map(|r| f(&r.point)).collect::<Vec<f64>>();
    let count =
        |f: &dyn Fn(&TorusRow) -> usize| rows.iter().map(|r| f(r) as i64).collect::<Vec<i64>>();
    let size = 2 * setting.assembly.system.dof();
    let mut columns = vec![
        integer("point", (0..rows.len() as i64).collect()),
        float(
            "parameter",
            &axis.unit,
            of(&|p| axis.value(p.torus.lambda) * axis.factor),
        ),
        integer("mark", count(&|r| usize::from(r.point.is_mark))),
        float("rotation", "", of(&|p| p.torus.rotation.rem_euclid(1.0))),
        integer("nu", count(&|r| r.nu)),
    ];
    for (k, name) in setting.assembly.connections.iter().enumerate() {
        let heading = setting.units().displacement(format!("rms.{name}"), k);
        columns.push(heading.column(rows.iter().map(|r| r.rms[k])));
    }
    columns.extend([
        float("exponent", "", rows.iter().map(exponent).collect()),
        float("invariance_error", "", of(&|p| p.error)),
        integer("points", count(&|r| r.point.torus.points.len() / size)),
        integer("switches_least", count(&|r| r.point.switches.0)),
        integer("switches_most", count(&|r| r.point.switches.1)),
        float("stable", "", rows.iter().map(stable).collect()),
        integer("branch", count(&|_| 0)),
    ]);
    if axis.parameter.is_frequency() && setting.is_si() {
        let hertz = |p: &TorusPoint| axis.value(p.torus.lambda) * axis.factor / TAU;
        columns.push(float("frequency_hz", "Hz", of(&hertz)));
    }
    Table {
        name: String::new(),
        columns,
    }
}

/// `point, angle, q.., v..`: the curves at phase 0.
fn curves(setting: &Setting<'_>, rows: &[TorusRow]) -> Table {
    let size = 2 * setting.assembly.system.dof();
    let (mut numbers, mut angles) = (Vec::new(), Vec::new());
    let mut states: Vec<&[f64]> = Vec::new();
    for (number, row) in rows.iter().enumerate() {
        let count = row.curve.len() / size;
        for (k, state) in row.curve.chunks_exact(size).enumerate() {
            numbers.push(number as i64);
            angles.push(k as f64 / count as f64);
            states.push(state);
        }
    }
    let mut columns = vec![
        integer("point", numbers),
        ColumnHeading::new("angle", "turns", 1.0).column(angles),
    ];
    let headings = coordinates(setting).into_iter().enumerate();
    columns.extend(headings.map(|(i, heading)| heading.column(states.iter().map(|s| s[i]))));
    Table {
        name: "curve".into(),
        columns,
    }
}

/// Rotation, r.m.s. deformations and exponent against the parameter; the curves where they are kept.
fn figure(keys: &Torus, setting: &Setting<'_>, axis: &CurveAxis, rows: &[TorusRow]) -> Figure {
    let x_frequency = match axis.parameter {
        VariedParameter::Frequency(_) => frequency_axis(setting, FrequencyUnit::RadianPerSecond),
        VariedParameter::Number(_) => None,
    };
    let line = |y: String, label: String| Curve {
        table: String::new(),
        x: "parameter".into(),
        y,
        label,
        style: CurveStyle::Branch {
            branch: "branch".into(),
            stable: "stable".into(),
        },
        only: None,
    };
    let panel = |y_label: String, curves: Vec<Curve>| Panel {
        x_label: axis.reported_label(),
        y_label,
        x_frequency,
        curves,
        ..Panel::default()
    };
    let names = &setting.assembly.connections;
    let rms = names
        .iter()
        .map(|name| line(format!("rms.{name}"), name.clone()));
    let unit = setting.units().displacement("rms", 0).axis();
    let mut panels = vec![
        panel(unit, rms.collect()),
        panel(
            "rotation number".into(),
            vec![line("rotation".into(), "rotation".into())],
        ),
        panel(
            "largest transverse exponent".into(),
            vec![line("exponent".into(), "exponent".into())],
        ),
    ];
    if keys.curve && !rows.is_empty() {
        let list = coordinates(setting);
        let n = list.len() / 2;
        for i in 0..n.min(2) {
            let dots = Curve {
                table: "curve".into(),
                x: list[i].name.clone(),
                y: list[n + i].name.clone(),
                label: "tori at phase 0".into(),
                style: CurveStyle::Dots,
                only: None,
            };
            panels.push(Panel {
                x_label: list[i].axis(),
                y_label: list[n + i].axis(),
                curves: vec![dots],
                ..Panel::default()
            });
        }
    }
    Figure {
        title: String::new(),
        panels,
    }
}
