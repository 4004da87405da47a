//! Maps as tables and as pictures.

use super::RegimeMap;
use super::cells::{CellIndex, Field, MapCell};
use super::measures::WantedColumns;
use super::overlay::Overlay;
use crate::analysis::Setting;
use crate::analysis::bifurcation_curve::Axes;
use crate::analysis::columns::{float, integer, text};
use crate::analysis::response::OrbitTable;
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Report, Table};
use crate::solve::attractor::Label;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Failures told in full.
const SHOWN: usize = 4;

/// Everything that is delivered.
pub(super) fn assemble(
    keys: &RegimeMap,
    setting: &Setting<'_>,
    (axes, wanted): (&Axes, &WantedColumns),
    (field, (curves, list, reasons)): (&Field<'_>, Overlay),
) -> Report {
    let main = main_table((axes, wanted), field);
    let mut warnings: Vec<String> = reasons;
    let lost: Vec<(&CellIndex, &String)> = (field.cells.iter())
        .filter_map(|((_, place), cell)| Some((place, cell.failure.as_ref()?)))
        .collect();
    for (place, reason) in lost.iter().take(SHOWN) {
        let both = [(0, place.0), (1, place.1)]
            .map(|(k, i)| axes.list[k].told(axes.list[k].value(field.share(k, i))));
        warnings.push(format!("{}: {reason}", both.join(", ")));
    }
    if lost.len() > SHOWN {
        warnings.push(format!("{} cells in all could not be computed", lost.len()));
    }
    let mut tables = vec![main, orbits(setting, field)];
    let has_curves = !list.is_empty();
    if has_curves {
        tables.push(axes.drawn(curves, ["parameter_1", "parameter_2"]));
    }
    let is_interrupted = setting.control.is_interrupted();
    let mut report = Report {
        figure: Some(figure(
            (setting, keys),
            axes,
            (wanted, longest(field)),
            &list,
        )),
        tables,
        warnings,
        ended_early: is_interrupted
            .then(|| format!("interrupted after {} runs", field.cells.len())),
        ..Report::default()
    };
    let options = serde_json::to_value(keys).unwrap_or(Value::Null);
    for (key, value) in [
        ("options", options),
        ("runs", json!(field.cells.len())),
        ("failures", json!(lost.len())),
    ] {
        report.summary.insert(key.into(), value);
    }
    report
}

/// Cells in the order of the main table.
fn rows<'f>(field: &'f Field<'_>) -> Vec<(&'f (usize, CellIndex), &'f MapCell)> {
    let mut rows: Vec<(&(usize, CellIndex), &MapCell)> = field.cells.iter().collect();
    rows.sort_by_key(|((seed, (i, j)), _)| (*j, *i, *seed));
    rows
}

/// Periodic orbits of some cells: `branch` is the seed, `point` the row of the main table, from 0.
pub(super) fn orbits(setting: &Setting<'_>, field: &Field<'_>) -> Table {
    let mut table: OrbitTable = Field::no_orbits(setting);
    for (row, (_, cell)) in rows(field).into_iter().enumerate() {
        if let Some(orbit) = &cell.orbit {
            table.append(orbit, row);
        }
    }
    table.finish(setting)
}

/// `<path>, <path>, seed, label, <measures>`, then the speed and the values in the user's units.
pub(super) fn main_table((axes, wanted): (&Axes, &WantedColumns), field: &Field<'_>) -> Table {
    let rows = rows(field);
    let value = |k: usize, place: &CellIndex| {
        let place = if k == 0 { place.0 } else { place.1 };
        axes.list[k].value(field.share(k, place)) * axes.list[k].factor
    };
    let of = |k: usize| {
        rows.iter()
            .map(|((_, place), _)| value(k, place))
            .collect::<Vec<f64>>()
    };
    let mut columns: Vec<Column> = (0..2)
        .map(|k| float(axes.list[k].written.clone(), &axes.list[k].unit, of(k)))
        .collect();
    columns.push(integer(
        "seed",
        rows.iter().map(|((seed, _), _)| *seed as i64).collect(),
    ));
    let label = |cell: &MapCell| cell.label.to_string();
    columns.push(text(
        "label",
        rows.iter().map(|(_, cell)| label(cell)).collect(),
    ));
    for (n, column) in wanted.columns.iter().enumerate() {
        let values = rows.iter().map(|(_, cell)| cell.values[n]);
        columns.push(column.heading.clone().column(values));
    }
    for (k, axis) in axes.list.iter().enumerate() {
        if axis.parameter.is_frequency() && axis.unit == "rad/s" {
            let rpm = of(k).into_iter().map(|w| w * 30.0 / PI);
            columns.push(float("speed_rpm", "rpm", rpm.collect()));
        }
    }
    let table = Table {
        name: String::new(),
        columns,
    };
    axes.drawn(table, [0, 1].map(|k| axes.list[k].written.as_str()))
}

/// The longest period among the labels.
fn longest(field: &Field<'_>) -> usize {
    let period = |cell: &MapCell| match cell.label {
        Label::Period(n) => n,
        _ => 1,
    };
    field.cells.values().map(period).max().unwrap_or(1)
}

/// Labels with what a legend says of them: long periods are one kind, so that no two kinds have one colour.
fn kinds(longest: usize) -> Vec<(String, String)> {
    let own = |n: usize| (format!("period {n}"), format!("period {n}"));
    let mut list: Vec<(String, String)> = (1..=4).map(own).collect();
    let words = ["quasi-periodic", "chaotic", "undecided"];
    list.extend(words.map(|word| (word.to_string(), word.to_string())));
    let together = |n: usize| match n {
        5..=8 => "period 5 to 8",
        _ => "longer period",
    };
    list.extend((5..=longest.max(9)).map(|n| (format!("period {n}"), together(n).to_string())));
    list
}

/// A panel per seed, or one of the drawn measure per seed, with the curves over it.
fn figure(
    (setting, keys): (&Setting<'_>, &RegimeMap),
    axes: &Axes,
    (wanted, longest): (&WantedColumns, usize),
    curves: &[(String, String)],
) -> Figure {
    let heading = |seed: usize| match keys.seeds.len() {
        1 => String::new(),
        _ => format!("seed {seed}"),
    };
    let cells = |seed: usize| Curve {
        table: String::new(),
        x: "x".into(),
        y: "y".into(),
        label: String::new(),
        style: CurveStyle::Cells {
            value: wanted.drawn.clone().unwrap_or_else(|| "label".into()),
            names: match wanted.drawn {
                None => kinds(longest),
                Some(_) => Vec::new(),
            },
        },
        only: Some(("seed".into(), seed.to_string())),
    };
    let line = |(number, label): &(String, String)| Curve {
        table: "curves".into(),
        x: "x".into(),
        y: "y".into(),
        label: label.clone(),
        style: CurveStyle::Line,
        only: Some(("curve".into(), number.clone())),
    };
    let panel = |seed: usize| Panel {
        x_label: axes.list[0].label(setting),
        y_label: axes.list[1].label(setting),
        heading: heading(seed),
        curves: std::iter::once(cells(seed))
            .chain(curves.iter().map(line))
            .collect(),
        ..Panel::default()
    };
    Figure {
        title: String::new(),
        panels: (0..keys.seeds.len()).map(panel).collect(),
    }
}
