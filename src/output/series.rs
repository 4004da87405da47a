//! Curves of a figure as numbers: columns looked up, branches cut into runs of one stability, colours chosen.
//! Shared by the static figure and the page, so that both draw the same.

use std::ops::Range;

use super::look::{FAINT, NEUTRAL, PALETTE, Rank, StabilityState};
use super::raster::Raster;
use crate::error::{Diagnostic, Error};
use crate::report::{Column, Curve, CurveStyle, Figure, Panel, Report, Table, Values, readable};

/// Consecutive points drawn with one stroke. A run that follows another one of the same branch without a break starts at
/// the last point of that one, so that no gap is left at a change of stability.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StabilityRun {
    pub state: StabilityState,
    pub rows: Range<usize>,
}

/// Content of a series.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum DrawnContent {
    Runs(Vec<StabilityRun>),
    Crosses,
    Dots,
    /// One kind per point.
    Events(Vec<String>),
    /// One value per point, for its colour.
    Coloured(Vec<f64>),
    /// In the units of the columns until the panel is shown.
    Cells(Raster),
    /// One width a bar.
    Bars(Vec<f64>),
    /// Horizontal bars with their names; `x` their lengths, `y` their places from below.
    Tornado(Vec<String>),
}

/// A curve with its numbers; `x` and `y` have equal length and may hold NaN.
#[derive(Debug, Clone)]
pub(super) struct DrawnSeries<'a> {
    pub curve: &'a Curve,
    pub table: &'a Table,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub drawing: DrawnContent,
    /// Colour of the family, `#rrggbb`.
    pub color: &'static str,
    /// Place among the curves of the panel that show the same quantity drawn alike.
    pub rank: Rank,
}

impl DrawnSeries<'_> {
    /// Whether the ordinate counts something: it changes in steps. Averages of counts do not.
    pub fn is_count(&self) -> bool {
        let quantity = self.curve.y.split('.').next().unwrap_or_default();
        let counts = [
            "impacts",
            "impacts_front",
            "impacts_back",
            "regime",
            "period",
        ];
        counts.contains(&quantity) && self.points().all(|(_, y)| y.fract() == 0.0)
    }

    /// Points that can be drawn.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let pairs = self.x.iter().copied().zip(self.y.iter().copied());
        pairs.filter(|(x, y)| x.is_finite() && y.is_finite())
    }
}

/// A panel with its numbers, in the units of the columns.
#[derive(Debug)]
pub(super) struct Resolved<'a> {
    pub panel: &'a Panel,
    pub list: Vec<DrawnSeries<'a>>,
}

/// All series of a figure, panel by panel.
pub(super) fn resolve<'a>(
    figure: &'a Figure,
    report: &'a Report,
) -> Result<Vec<Resolved<'a>>, Error> {
    // Connections come first, so that each has the same colour in every figure of a run.
    let mut families: Vec<&str> = report.connections.iter().map(String::as_str).collect();
    let mut panels = Vec::new();
    for panel in &figure.panels {
        let mut list = Vec::new();
        for (k, curve) in panel.curves.iter().enumerate() {
            let rank = rank(&panel.curves, k);
            let is_own = rank.count > MOST_ALIKE || !is_version(curve) && rank.count > 1;
            let family = match is_own {
                true => curve.label.as_str(),
                false => family(curve),
            };
            let color = match curve.style {
                CurveStyle::Events { .. } => PALETTE[0],
                CurveStyle::Crosses => FAINT,
                // Cells have their colours by themselves, and dots on them are dark.
                CurveStyle::Cells { .. } => NEUTRAL,
                CurveStyle::Dots if has_cells(panel) || is_measured(report, curve) => NEUTRAL,
                _ => {
                    let known = families.iter().position(|f| *f == family);
                    let index = known.unwrap_or_else(|| {
                        families.push(family);
                        families.len() - 1
                    });
                    PALETTE[index % PALETTE.len()]
                }
            };
            let rank = match is_own {
                true => Rank { place: 0, count: 1 },
                false => rank,
            };
            list.push(series(report, curve, color, rank)?);
        }
        panels.push(Resolved { panel, list });
    }
    Ok(panels)
}

/// Whether a curve was not computed.
fn is_measured(report: &Report, curve: &Curve) -> bool {
    report
        .plot
        .measured
        .iter()
        .any(|measured| measured.table == curve.table)
}

fn has_cells(panel: &Panel) -> bool {
    let is_cells = |curve: &Curve| matches!(curve.style, CurveStyle::Cells { .. });
    panel.curves.iter().any(is_cells)
}

/// Curves of one quantity in a panel that share its colour; more have colours by their labels.
const MOST_ALIKE: usize = 3;

/// Name that decides the colour: the connection in `rms.mesh_1`, else the label.
fn family(curve: &Curve) -> &str {
    match curve.y.split_once('.') {
        Some((_, connection)) if connection.parse::<usize>().is_err() => connection,
        _ => &curve.label,
    }
}

/// Whether a curve is one of several versions of the same quantity: results of a method, of a sweep, of one of two runs. Curves
/// that differ in anything else, such as the order, have colours of their own.
fn is_version(curve: &Curve) -> bool {
    let columns = ["method", "run"];
    (curve.only.as_ref()).is_none_or(|(column, _)| columns.contains(&column.as_str()))
}

fn rank(curves: &[Curve], k: usize) -> Rank {
    let is_alike = |other: &&Curve| {
        std::mem::discriminant(&other.style) == std::mem::discriminant(&curves[k].style)
            && family(other) == family(&curves[k])
    };
    Rank {
        place: curves[..k].iter().filter(is_alike).count(),
        count: curves.iter().filter(is_alike).count(),
    }
}

fn series<'a>(
    report: &'a Report,
    curve: &'a Curve,
    color: &'static str,
    rank: Rank,
) -> Result<DrawnSeries<'a>, Error> {
    let table = report
        .table(&curve.table)
        .ok_or_else(|| misfit(report, format!("table \"{}\"", curve.table)))?;
    let mut x = floats(report, table, &curve.x)?;
    let mut y = match (&curve.style, table.column(&curve.y)) {
        (CurveStyle::Events { .. }, None) => ordinates_on_branches(report, table, curve, &x)?,
        _ => floats(report, table, &curve.y)?,
    };
    let drawn = drawn_rows(report, table, curve)?;
    let left_out = x.iter_mut().zip(drawn).filter(|(_, drawn)| !drawn);
    left_out.for_each(|(x, _)| *x = f64::NAN);
    let drawing = match &curve.style {
        CurveStyle::Crosses => DrawnContent::Crosses,
        CurveStyle::Dots => DrawnContent::Dots,
        CurveStyle::Line => DrawnContent::Runs(runs(&x, &y, &[], None)),
        CurveStyle::Branch { branch, stable } => {
            let branch = floats(report, table, branch)?;
            let stable = floats(report, table, stable)?;
            DrawnContent::Runs(runs(&x, &y, &branch, Some(&stable)))
        }
        CurveStyle::Events { kind } => DrawnContent::Events(texts(report, table, kind)?),
        CurveStyle::Coloured { by } => DrawnContent::Coloured(floats(report, table, by)?),
        CurveStyle::Cells { value, names } => {
            let column = table
                .column(value)
                .ok_or_else(|| misfit(report, format!("column \"{value}\"")))?;
            DrawnContent::Cells(Raster::new(&x, &y, &column.values, names))
        }
        CurveStyle::Bars { width } => {
            let mut widths = floats(report, table, width)?;
            let left_out = widths.iter_mut().zip(&x).filter(|(_, x)| !x.is_finite());
            left_out.for_each(|(width, _)| *width = f64::NAN);
            DrawnContent::Bars(widths)
        }
        CurveStyle::Tornado { name } => {
            let own: Vec<usize> = (0..x.len()).filter(|row| x[*row].is_finite()).collect();
            let names = texts(report, table, name)?;
            x = own.iter().map(|row| y[*row]).collect();
            y = (0..x.len()).rev().map(|k| k as f64).collect();
            DrawnContent::Tornado(own.iter().map(|row| readable(&names[*row])).collect())
        }
    };
    Ok(DrawnSeries {
        curve,
        table,
        x,
        y,
        drawing,
        color,
        rank,
    })
}

/// Whether each row belongs to a curve.
fn drawn_rows(report: &Report, table: &Table, curve: &Curve) -> Result<Vec<bool>, Error> {
    let rows = 0..table.rows();
    if let (CurveStyle::Events { kind }, Some(kinds)) = (&curve.style, &report.plot.events) {
        let words = texts(report, table, kind)?;
        return Ok(words.iter().map(|word| kinds.contains(word)).collect());
    }
    let Some((name, value)) = &curve.only else {
        return Ok(rows.map(|_| true).collect());
    };
    let column = table
        .column(name)
        .or_else(|| joined(report, table, name))
        .ok_or_else(|| misfit(report, format!("column \"{name}\"")))?;
    let is_drawn = |row: usize| match &column.values {
        Values::Text(words) => words[row] == *value,
        Values::Integer(numbers) => numbers[row].to_string() == *value,
        Values::Float(numbers) => numbers[row].to_string() == *value,
    };
    Ok(rows.map(is_drawn).collect())
}

/// A column of the main table for another one that has the same points, row by row.
fn joined<'a>(report: &'a Report, table: &Table, name: &str) -> Option<&'a Column> {
    let main = report.table("")?;
    let has_points = |t: &Table| t.column("branch").is_some() && t.column("point").is_some();
    let column = main.column(name)?;
    let is_same = has_points(main) && has_points(table) && main.rows() == table.rows();
    is_same.then_some(column)
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
fn runs(x: &[f64], y: &[f64], branch: &[f64], stable: Option<&[f64]>) -> Vec<StabilityRun> {
    let mut runs: Vec<StabilityRun> = Vec::new();
    for row in 0..x.len().min(y.len()) {
        if !(x[row].is_finite() && y[row].is_finite()) {
            continue;
        }
        let state = match stable {
            None => StabilityState::Plain,
            Some(s) if s[row] == 1.0 => StabilityState::Stable,
            Some(s) if s[row] == 0.0 => StabilityState::Unstable,
            Some(_) => StabilityState::Unknown,
        };
        match runs.last_mut() {
            Some(last) if last.rows.end == row && same_branch(branch, row) => {
                if last.state == state {
                    last.rows.end = row + 1;
                } else {
                    runs.push(StabilityRun {
                        state,
                        rows: row - 1..row + 1,
                    });
                }
            }
            _ => runs.push(StabilityRun {
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
    let column = match table.column(name) {
        Some(column) => Some(column),
        None => joined(report, table, name),
    };
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
            (StabilityState::Stable, 0..2),
            (StabilityState::Unstable, 1..3),
            (StabilityState::Unstable, 4..5),
            (StabilityState::Unstable, 5..6),
            (StabilityState::Unknown, 5..7),
        ];
        let found: Vec<_> = list.into_iter().map(|r| (r.state, r.rows)).collect();
        assert_eq!(found, expected);
    }
}
