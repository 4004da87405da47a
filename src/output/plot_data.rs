//! Data of an interactive plot: every column once, curves as references to columns, runs as ranges of rows.

use std::collections::HashSet;

use serde_json::{Map, Value, json};

use super::arrange::arranged;
use super::groups::kind_text;
use super::look::{self, FAINT, StabilityState};
use super::raster::Level;
use super::series::{DrawnContent, DrawnSeries, StabilityRun, floats};
use super::shown::{Shown, is_shared, shown};
use super::sparse;
use crate::error::Error;
use crate::report::{AxisScale, Figure, FrequencyUnit, Report, readable};

/// Columns shown when the pointer is over a point, where the table has them; the first ones lead to its orbit.
const HOVER: [&str; 5] = ["branch", "point", "after_point", "omega", "parameter"];

/// Curves of more points are reduced to those that a screen tells apart.
const MANY: usize = 20_000;
/// Points across and along a large screen, in either direction.
const SCREEN: (f64, f64) = (3840.0, 1600.0);
/// Cells on the page along each axis at most.
const CELLS: usize = 300;

/// What the script of the page draws from.
pub(super) fn value(figure: &Figure, report: &Report) -> Result<Value, Error> {
    let mut columns = Map::new();
    let mut kinds = Map::new();
    let mut list = Vec::new();
    let figure = arranged(figure, report)?;
    let panels = shown(&figure, report)?;
    for panel in &panels {
        let mut curves = Vec::new();
        for series in &panel.list {
            if let DrawnContent::Events(names) = &series.drawing {
                for name in names {
                    kinds.insert(name.clone(), json!(kind_text(name)));
                }
            }
            curves.push(curve(report, panel, series, &mut columns)?);
        }
        list.push(json!({
            "heading": panel.panel.heading,
            "x_label": panel.x_label,
            "y_label": panel.y_label,
            "x_range": [panel.x.low, panel.x.high],
            "y_range": [panel.y.low, panel.y.high],
            "log": panel.y.scale == AxisScale::Log,
            "frequency": frequency(panel),
            "bar": panel.bar.as_ref().map(|bar| &bar.label),
            "curves": curves,
        }));
    }
    Ok(json!({"columns": columns, "kinds": kinds, "panels": list, "shared": is_shared(&panels)}))
}

/// What the page needs to show the abscissa in another unit.
fn frequency(panel: &Shown<'_>) -> Option<Value> {
    let axis = panel.panel.x_frequency?;
    let written = match (panel.panel.x_unit.as_str(), axis.shown) {
        (unit @ ("Hz" | "rpm" | "rad/s"), _) => unit,
        ("", FrequencyUnit::Nondimensional) => "\u{3c9}/\u{3c9}c",
        ("", FrequencyUnit::RadianPerSecond) => "rad/s",
        ("", FrequencyUnit::Hertz) => "Hz",
        ("", FrequencyUnit::RevolutionsPerMinute) => "rpm",
        _ => return None,
    };
    Some(json!({"written": written, "omega_c": axis.omega_c}))
}

fn curve(
    report: &Report,
    panel: &Shown<'_>,
    series: &DrawnSeries,
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
    // Curves of other rows of the same columns are other numbers, and so are those of another axis.
    let only = match &series.curve.only {
        Some((column, value)) => format!(" where {column} is {value}"),
        None => String::new(),
    };
    let times = |name: &str, factor: f64| match factor {
        1.0 => name.to_string(),
        factor => format!("{name} times {factor}"),
    };
    let (own_x, own_y) = (&series.curve.x, &series.curve.y);
    let (x, y) = (times(own_x, panel.factors.0), times(own_y, panel.factors.1));
    let rows: Vec<usize> = match &series.drawing {
        DrawnContent::Dots => distinct(panel, series),
        _ => Vec::new(),
    };
    let (long, stretches) = match &series.drawing {
        DrawnContent::Runs(runs) => long_line(panel, series, runs),
        _ => (Vec::new(), Vec::new()),
    };
    let rows = if long.is_empty() { rows } else { long };
    let at = |values: &[f64]| rows.iter().map(|&row| values[row]).collect::<Vec<f64>>();
    let look = look::stroke(series.color, series.rank);
    let mut out = json!({
        "name": own_y,
        "label": readable(&series.curve.label),
        "color": match series.drawing {
            DrawnContent::Runs(_) => look.color.as_str(),
            DrawnContent::Crosses => FAINT,
            _ => series.color,
        },
        "style": style(&series.drawing),
        "rank": series.rank.place,
        "ranks": series.rank.count,
        "width": look.width,
    });
    if let DrawnContent::Cells(raster) = &series.drawing {
        let raster = raster.thinned(CELLS);
        let width = raster.x.len().max(1);
        out["x"] = numbers(&raster.x);
        out["y"] = numbers(&raster.y);
        out["cells"] = raster.cells.chunks(width).map(|row| json!(row)).collect();
        let level = |l: &Level| json!([l.text, l.color]);
        out["levels"] = raster.levels.iter().map(level).collect();
        out["is_continuous"] = json!(raster.is_continuous);
        out["only"] = json!(series.curve.only.as_ref().map(|(_, value)| value));
        out["hover"] = json!([]);
        return Ok(out);
    }
    let mut hover = Vec::new();
    let is_reduced = matches!(series.drawing, DrawnContent::Dots) || !stretches.is_empty();
    match series.drawing {
        _ if is_reduced => {
            out["x"] = json!(put(&format!("{x} against {y}{only}"), &at(&series.x)));
            out["y"] = json!(put(&format!("{y} against {x}{only}"), &at(&series.y)));
            for name in HOVER
                .iter()
                .filter(|name| **name != *own_x && series.table.column(name).is_some())
            {
                let values = at(&floats(report, series.table, name)?);
                hover.push(json!([
                    name,
                    put(&format!("{name} against {y}{only}"), &values)
                ]));
            }
        }
        DrawnContent::Tornado(_) => {
            out["x"] = json!(put(&format!("length {own_y}"), &series.x));
            out["y"] = json!(put(&format!("place {own_y}"), &series.y));
        }
        _ => {
            out["x"] = json!(put(&format!("{x}{only}"), &series.x));
            out["y"] = json!(put(&y, &series.y));
            for name in HOVER
                .iter()
                .filter(|name| series.table.column(name).is_some())
            {
                let values = floats(report, series.table, name)?;
                hover.push(json!([name, put(name, &values)]));
            }
        }
    }
    if !HOVER.contains(&own_x.as_str()) || is_reduced {
        let shown = panel.panel.x_frequency.map(|axis| axis.shown);
        let name = match (own_x.as_str(), shown) {
            ("frequency_hz", Some(FrequencyUnit::RevolutionsPerMinute)) => "speed_rpm",
            (name, _) => name,
        };
        hover.push(json!([readable(name), out["x"]]));
    }
    out["hover"] = Value::Array(hover);
    match &series.drawing {
        DrawnContent::Runs(runs) => {
            let runs = if stretches.is_empty() {
                runs
            } else {
                &stretches
            };
            let run = |r: &StabilityRun| json!([state(r.state), r.rows.start, r.rows.end]);
            out["runs"] = runs.iter().map(run).collect();
            if series.is_count() {
                out["shape"] = json!("hvh");
            }
        }
        DrawnContent::Events(kinds) => out["kinds"] = json!(kinds),
        DrawnContent::Coloured(values) => {
            let factor = panel.bar.as_ref().map_or(1.0, |bar| bar.factor);
            let values: Vec<f64> = values.iter().map(|v| v * factor).collect();
            out["z"] = numbers(&values);
        }
        DrawnContent::Bars(widths) => out["widths"] = numbers(widths),
        DrawnContent::Tornado(names) => out["names"] = json!(names),
        DrawnContent::Crosses | DrawnContent::Dots | DrawnContent::Cells(_) => {}
    }
    Ok(out)
}

fn style(drawing: &DrawnContent) -> &'static str {
    match drawing {
        DrawnContent::Runs(_) => "runs",
        DrawnContent::Crosses => "crosses",
        DrawnContent::Dots => "dots",
        DrawnContent::Events(_) => "events",
        DrawnContent::Coloured(_) => "coloured",
        DrawnContent::Cells(_) => "cells",
        DrawnContent::Bars(_) => "bars",
        DrawnContent::Tornado(_) => "tornado",
    }
}

fn state(state: StabilityState) -> &'static str {
    match state {
        StabilityState::Stable => "stable",
        StabilityState::Unstable => "unstable",
        StabilityState::Unknown => "unknown",
        StabilityState::Plain => "plain",
    }
}

/// Rows whose points differ in their seven digits: an attractor of period 1 is one point, not hundreds. Of very many points those that a
/// screen tells apart.
fn distinct(panel: &Shown<'_>, series: &DrawnSeries) -> Vec<usize> {
    let (x, y) = (&series.x, &series.y);
    let finite = (0..x.len().min(y.len())).filter(|&row| x[row].is_finite() && y[row].is_finite());
    if x.len() > MANY {
        let mut seen = HashSet::new();
        let place = |row: usize| {
            let (x, y) = on_screen(panel, (x[row], y[row]));
            (x as i64, y as i64)
        };
        return finite.filter(|row| seen.insert(place(*row))).collect();
    }
    let mut seen = HashSet::new();
    finite
        .filter(|&row| seen.insert((format!("{:.6e}", x[row]), format!("{:.6e}", y[row]))))
        .collect()
}

/// Place of a point on a large screen.
fn on_screen(panel: &Shown<'_>, (x, y): (f64, f64)) -> (f64, f64) {
    (SCREEN.0 * panel.x.share(x), SCREEN.1 * panel.y.share(y))
}

/// Rows that a screen tells apart of a curve with very many of them, and its runs among these rows; nothing of a shorter curve.
fn long_line(
    panel: &Shown<'_>,
    series: &DrawnSeries,
    runs: &[StabilityRun],
) -> (Vec<usize>, Vec<StabilityRun>) {
    let (mut rows, mut list) = (Vec::new(), Vec::new());
    if series.x.len() <= MANY {
        return (rows, list);
    }
    for run in runs {
        let at = |row: usize| on_screen(panel, (series.x[row], series.y[row]));
        for stretch in sparse::line(run.rows.clone(), at) {
            let begin = rows.len();
            rows.extend(stretch);
            list.push(StabilityRun {
                state: run.state,
                rows: begin..rows.len(),
            });
        }
    }
    (rows, list)
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
