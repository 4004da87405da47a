//! Curves of a figure as numbers: columns looked up, branches cut into runs of one stability, colours chosen.
//! Shared by the static figure and the page, so that both draw the same.

use std::ops::Range;

use super::legend::NEUTRAL;
use super::raster::Raster;
use crate::error::{Diagnostic, Error};
use crate::report::{
    Curve, CurveStyle, Figure, FrequencyAxis, FrequencyUnit, Panel, Report, Table, Values,
};

/// Colours that stay apart for colour-blind readers (Okabe and Ito), without the two that are weak on white.
pub(super) const PALETTE: [&str; 6] = [
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9",
];

/// Index of the colour of dots on cells.
const ON_CELLS: usize = usize::MAX;

/// Stability of a run of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    Stable,
    Unstable,
    Unknown,
    /// The curve has no stability.
    Plain,
}

/// Consecutive points drawn with one stroke. A run that follows another one of the same branch without a break starts at
/// the last point of that one, so that no gap is left at a change of stability.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Run {
    pub state: State,
    pub rows: Range<usize>,
}

/// What a series shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Drawing {
    Runs(Vec<Run>),
    Crosses,
    Dots,
    Cells(Raster),
    /// One kind a point.
    Events(Vec<String>),
}

/// A curve with its numbers; `x` and `y` have equal length and may hold NaN.
#[derive(Debug, Clone)]
pub(super) struct Series<'a> {
    pub curve: &'a Curve,
    pub table: &'a Table,
    /// Column of the abscissae, or what they are in the unit of the axis.
    pub x_name: String,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub drawing: Drawing,
    /// Index of the colour family within the figure.
    pub color: usize,
}

impl Series<'_> {
    /// Colour as `#rrggbb`.
    pub fn color(&self) -> &'static str {
        if self.color == ON_CELLS {
            return NEUTRAL;
        }
        PALETTE[self.color % PALETTE.len()]
    }

    /// Abscissae in the unit of the axis.
    fn convert(&mut self, axis: Option<FrequencyAxis>) {
        let Some(axis) = axis.filter(|axis| axis.written != axis.shown) else {
            return;
        };
        let factor = axis.factor();
        self.x.iter_mut().for_each(|x| *x *= factor);
        if axis.shown == FrequencyUnit::RevolutionsPerMinute {
            self.x_name = self.x_name.replace("frequency_hz", "speed_rpm");
        }
    }

    /// Points that can be drawn.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let pairs = self.x.iter().copied().zip(self.y.iter().copied());
        pairs.filter(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// All series of a figure, one list a panel.
pub(super) fn resolve<'a>(
    figure: &'a Figure,
    report: &'a Report,
) -> Result<Vec<Vec<Series<'a>>>, Error> {
    let by_label = families_clash(figure);
    let mut families: Vec<&str> = Vec::new();
    let mut panels = Vec::new();
    for panel in &figure.panels {
        let mut list = Vec::new();
        for curve in &panel.curves {
            let family = family(curve, by_label);
            let color = families.iter().position(|f| *f == family);
            let is_colourless = match curve.style {
                CurveStyle::Events { .. } | CurveStyle::Cells { .. } => true,
                CurveStyle::Dots if has_cells(panel) => {
                    list.push(series(report, curve, ON_CELLS)?);
                    continue;
                }
                _ => false,
            };
            let color = color.unwrap_or_else(|| {
                if is_colourless {
                    return 0;
                }
                families.push(family);
                families.len() - 1
            });
            let mut series = series(report, curve, color)?;
            series.convert(panel.x_frequency);
            list.push(series);
        }
        panels.push(list);
    }
    Ok(panels)
}

fn has_cells(panel: &Panel) -> bool {
    let is_cells = |curve: &Curve| matches!(curve.style, CurveStyle::Cells { .. });
    panel.curves.iter().any(is_cells)
}

/// Name that decides the colour: the connection in `rms.mesh_1`, else the label.
fn family(curve: &Curve, by_label: bool) -> &str {
    match curve.y.split_once('.') {
        Some((_, connection)) if !by_label => connection,
        _ => &curve.label,
    }
}

/// Whether some panel has two curves of one connection drawn alike: then labels decide the colours.
fn families_clash(figure: &Figure) -> bool {
    figure.panels.iter().any(|panel| {
        panel.curves.iter().enumerate().any(|(i, a)| {
            panel.curves[..i].iter().any(|b| {
                std::mem::discriminant(&a.style) == std::mem::discriminant(&b.style)
                    && !matches!(a.style, CurveStyle::Events { .. })
                    && family(a, false) == family(b, false)
                    && a.label != b.label
            })
        })
    })
}

fn series<'a>(report: &'a Report, curve: &'a Curve, color: usize) -> Result<Series<'a>, Error> {
    let table = report
        .table(&curve.table)
        .ok_or_else(|| misfit(report, format!("table \"{}\"", curve.table)))?;
    let mut x = floats(report, table, &curve.x)?;
    if let Some((column, value)) = &curve.only {
        let column = table
            .column(column)
            .ok_or_else(|| misfit(report, format!("column \"{column}\"")))?;
        let is_drawn = |row: usize| match &column.values {
            Values::Text(words) => words[row] == *value,
            Values::Integer(numbers) => numbers[row].to_string() == *value,
            Values::Float(numbers) => numbers[row].to_string() == *value,
        };
        x.iter_mut()
            .enumerate()
            .filter(|(row, _)| !is_drawn(*row))
            .for_each(|(_, x)| *x = f64::NAN);
    }
    let y = match (&curve.style, table.column(&curve.y)) {
        (CurveStyle::Events { .. }, None) => ordinates_on_branches(report, table, curve, &x)?,
        _ => floats(report, table, &curve.y)?,
    };
    let drawing = match &curve.style {
        CurveStyle::Crosses => Drawing::Crosses,
        CurveStyle::Dots => Drawing::Dots,
        CurveStyle::Cells { value, names } => {
            let column = table.column(value);
            let column = column.ok_or_else(|| misfit(report, format!("column \"{value}\"")))?;
            Drawing::Cells(Raster::new(&x, &y, &column.values, names))
        }
        CurveStyle::Line => Drawing::Runs(runs(&x, &y, &[], None)),
        CurveStyle::Branch { branch, stable } => {
            let branch = floats(report, table, branch)?;
            let stable = floats(report, table, stable)?;
            Drawing::Runs(runs(&x, &y, &branch, Some(&stable)))
        }
        CurveStyle::Events { kind } => Drawing::Events(texts(report, table, kind)?),
    };
    Ok(Series {
        curve,
        table,
        x_name: curve.x.clone(),
        x,
        y,
        drawing,
        color,
    })
}

/// Ordinates of events whose table has none: interpolated in the main table between the two points that bracket the
/// event (`branch`, `after_point`). NaN where that branch is not there.
fn ordinates_on_branches(
    report: &Report,
    events: &Table,
    curve: &Curve,
    x: &[f64],
) -> Result<Vec<f64>, Error> {
    let main = report
        .table("")
        .ok_or_else(|| misfit(report, "a main table".into()))?;
    let (branch, point) = (
        floats(report, main, "branch")?,
        floats(report, main, "point")?,
    );
    let (xs, ys) = (
        floats(report, main, &curve.x)?,
        floats(report, main, &curve.y)?,
    );
    let (on, after) = (
        floats(report, events, "branch")?,
        floats(report, events, "after_point")?,
    );
    let ordinate = |k: usize| {
        let row = (0..main.rows()).find(|&r| branch[r] == on[k] && point[r] == after[k])?;
        let next = row + 1;
        if next >= main.rows() || branch[next] != on[k] || xs[next] == xs[row] {
            return Some(ys[row]);
        }
        let share = ((x[k] - xs[row]) / (xs[next] - xs[row])).clamp(0.0, 1.0);
        Some(ys[row] + share * (ys[next] - ys[row]))
    };
    Ok((0..x.len())
        .map(|k| ordinate(k).unwrap_or(f64::NAN))
        .collect())
}

/// Cuts a curve at empty values, changes of branch and changes of stability.
fn runs(x: &[f64], y: &[f64], branch: &[f64], stable: Option<&[f64]>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for row in 0..x.len().min(y.len()) {
        if !(x[row].is_finite() && y[row].is_finite()) {
            continue;
        }
        let state = match stable {
            None => State::Plain,
            Some(s) if s[row] == 1.0 => State::Stable,
            Some(s) if s[row] == 0.0 => State::Unstable,
            Some(_) => State::Unknown,
        };
        match runs.last_mut() {
            Some(last) if last.rows.end == row && same_branch(branch, row) => {
                if last.state == state {
                    last.rows.end = row + 1;
                } else {
                    runs.push(Run {
                        state,
                        rows: row - 1..row + 1,
                    });
                }
            }
            _ => runs.push(Run {
                state,
                rows: row..row + 1,
            }),
        }
    }
    runs
}

fn same_branch(branch: &[f64], row: usize) -> bool {
    branch.is_empty() || branch[row] == branch[row - 1]
}

/// Numbers of a column, integers converted.
pub(super) fn floats(report: &Report, table: &Table, name: &str) -> Result<Vec<f64>, Error> {
    let column = table.column(name);
    match column.map(|c| &c.values) {
        Some(Values::Float(v)) => Ok(v.clone()),
        // Counts and marks: far below 2^53.
        Some(Values::Integer(v)) => Ok(v.iter().map(|&i| i as f64).collect()),
        _ => Err(misfit(
            report,
            format!("column \"{name}\" of numbers in table \"{}\"", table.name),
        )),
    }
}

fn texts(report: &Report, table: &Table, name: &str) -> Result<Vec<String>, Error> {
    match table.column(name).map(|c| &c.values) {
        Some(Values::Text(v)) => Ok(v.clone()),
        _ => Err(misfit(
            report,
            format!("column \"{name}\" of words in table \"{}\"", table.name),
        )),
    }
}

fn misfit(report: &Report, wanted: String) -> Error {
    Error::Input(vec![Diagnostic {
        location: None,
        path: format!("analyses.{}", report.name),
        message: format!("the figure wants {wanted}, which the results do not have"),
        help: None,
    }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_join_at_a_change_of_stability_and_break_elsewhere() {
        let x = [0.0, 1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0];
        let y = [0.0; 7];
        let branch = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0];
        let stable = [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, f64::NAN];
        let list = runs(&x, &y, &branch, Some(&stable));
        let expected = [
            (State::Stable, 0..2),
            (State::Unstable, 1..3),
            (State::Unstable, 4..5),
            (State::Unstable, 5..6),
            (State::Unknown, 5..7),
        ];
        let found: Vec<_> = list.into_iter().map(|r| (r.state, r.rows)).collect();
        assert_eq!(found, expected);
    }
}
