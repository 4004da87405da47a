//! Data of an interactive plot: every column once, curves as references to columns, runs as ranges of rows.

use std::collections::HashSet;

use serde_json::{Map, Value, json};

use super::legend::kind_text;
use super::raster::Level;
use super::series::{Drawing, Series, State, floats, resolve};
use super::svg;
use crate::error::Error;
use crate::report::{Figure, FrequencyAxis, FrequencyUnit, Report};

/// Columns shown when the pointer is over a point, where the table has them; the first ones lead to its orbit.
const HOVER: [&str; 5] = ["branch", "point", "after_point", "omega", "parameter"];

/// Cells on the page along each axis at most.
const CELLS: usize = 300;

/// What the script of the page draws from.
pub(super) fn value(figure: &Figure, report: &Report) -> Result<Value, Error> {
    let mut columns = Map::new();
    let mut kinds = Map::new();
    let mut panels = Vec::new();
    for (panel, list) in figure.panels.iter().zip(&resolve(figure, report)?) {
        let mut curves = Vec::new();
        for series in list {
            if let Drawing::Events(names) = &series.drawing {
                for name in names {
                    kinds.insert(name.clone(), json!(kind_text(name)));
                }
            }
            curves.push(curve(report, series, &mut columns)?);
        }
        let (x, y) = svg::axes(panel, list);
        panels.push(json!({
            "x_label": panel.x_label,
            "y_label": panel.y_label,
            "x_range": [x.low, x.high],
            "y_range": [y.low, y.high],
            "frequency": panel.x_frequency.map(frequency),
            "curves": curves,
        }));
    }
    Ok(json!({"columns": columns, "kinds": kinds, "panels": panels}))
}

/// What the page needs to show the abscissa in another unit.
fn frequency(axis: FrequencyAxis) -> Value {
    let written = match axis.shown {
        FrequencyUnit::Nondimensional => "\u{3c9}/\u{3c9}c",
        FrequencyUnit::RadianPerSecond => "rad/s",
        FrequencyUnit::Hertz => "Hz",
        FrequencyUnit::RevolutionsPerMinute => "rpm",
    };
    json!({"written": written, "omega_c": axis.omega_c})
}

fn curve(
    report: &Report,
    series: &Series,
    columns: &mut Map<String, Value>,
) -> Result<Value, Error> {
    let table = &series.curve.table;
    let mut put = |name: &str, values: &[f64]| {
        let key = format!("{table}:{name}");
        if !columns.contains_key(&key) {
            columns.insert(key.clone(), numbers(values));
        }
        key
    };
    let (x, y) = (&series.x_name, &series.curve.y);
    // Curves of other rows of the same columns are other numbers.
    let only = match &series.curve.only {
        Some((column, value)) => format!(" where {column} is {value}"),
        None => String::new(),
    };
    let mut out = json!({
        "name": y,
        "label": series.curve.label,
        "color": series.color(),
        "style": style(&series.drawing),
        "hover": [],
    });
    if let Drawing::Cells(raster) = &series.drawing {
        let raster = raster.thinned(CELLS);
        let width = raster.x.len().max(1);
        out["x"] = numbers(&raster.x);
        out["y"] = numbers(&raster.y);
        out["cells"] = raster.cells.chunks(width).map(|row| json!(row)).collect();
        let level = |l: &Level| json!([l.text, l.color]);
        out["levels"] = raster.levels.iter().map(level).collect();
        out["is_continuous"] = json!(raster.is_continuous);
        return Ok(out);
    }
    if series.drawing == Drawing::Dots {
        let rows = distinct(series);
        let at = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Vec<f64>>();
        out["x"] = json!(put(&format!("{x} against {y}{only}"), &at(&series.x)));
        out["y"] = json!(put(&format!("{y} against {x}{only}"), &at(&series.y)));
        let mut hover = vec![json!([x, out["x"]])];
        for name in HOVER.iter().filter(|name| **name != *x) {
            if series.table.column(name).is_some() {
                let values = at(&floats(report, series.table, name)?);
                hover.push(json!([
                    name,
                    put(&format!("{name} against {y}{only}"), &values)
                ]));
            }
        }
        out["hover"] = Value::Array(hover);
        return Ok(out);
    }
    out["x"] = json!(put(&format!("{x}{only}"), &series.x));
    out["y"] = json!(put(y, &series.y));
    let mut hover = Vec::new();
    for name in HOVER {
        if series.table.column(name).is_some() {
            let values = floats(report, series.table, name)?;
            hover.push(json!([name, put(name, &values)]));
        }
    }
    if !HOVER.contains(&x.as_str()) {
        hover.push(json!([x, out["x"]]));
    }
    out["hover"] = Value::Array(hover);
    match &series.drawing {
        Drawing::Runs(runs) => {
            let run = |r: &super::series::Run| json!([state(r.state), r.rows.start, r.rows.end]);
            out["runs"] = runs.iter().map(run).collect();
        }
        Drawing::Events(kinds) => out["kinds"] = json!(kinds),
        Drawing::Crosses | Drawing::Dots | Drawing::Cells(_) => {}
    }
    Ok(out)
}

fn style(drawing: &Drawing) -> &'static str {
    match drawing {
        Drawing::Runs(_) => "runs",
        Drawing::Crosses => "crosses",
        Drawing::Dots => "dots",
        Drawing::Cells(_) => "cells",
        Drawing::Events(_) => "events",
    }
}

fn state(state: State) -> &'static str {
    match state {
        State::Stable => "stable",
        State::Unstable => "unstable",
        State::Unknown => "unknown",
        State::Plain => "plain",
    }
}

/// Rows whose points differ in their seven digits: an attractor of period 1 is one point, not hundreds.
fn distinct(series: &Series) -> Vec<usize> {
    let mut seen = HashSet::new();
    let (x, y) = (&series.x, &series.y);
    (0..x.len().min(y.len()))
        .filter(|&row| x[row].is_finite() && y[row].is_finite())
        .filter(|&row| seen.insert((format!("{:.6e}", x[row]), format!("{:.6e}", y[row]))))
        .collect()
}

fn numbers(values: &[f64]) -> Value {
    values.iter().map(|v| rounded(*v)).collect()
}

/// Seven significant digits; null when not finite. Whole numbers are written as such.
pub(super) fn rounded(value: f64) -> Value {
    if value.fract() == 0.0 && value.abs() < 1e7 {
        return json!(value as i64);
    }
    // What `format!` wrote reads back; NaN and infinities become null.
    json!(format!("{value:.6e}").parse::<f64>().unwrap_or(f64::NAN))
}
