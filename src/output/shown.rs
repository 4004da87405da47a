//! Panels ready to be drawn: numbers in the units of their axes, the axes and their texts. The static figure and the page draw
//! the same.

use super::axis::{DrawnAxis, extent};
use super::raster::edges;
use super::series::{DrawnContent, DrawnSeries, resolve};
use super::units::Scaled;
use crate::error::{Diagnostic, Error};
use crate::report::{AxisScale, CurveStyle, Figure, Panel, Report, Words};

/// A panel with everything that is drawn.
#[derive(Debug)]
pub(super) struct Shown<'a> {
    pub panel: &'a Panel,
    pub x_label: String,
    pub y_label: String,
    /// Factors from the columns to the axes.
    pub factors: (f64, f64),
    pub list: Vec<DrawnSeries<'a>>,
    pub x: DrawnAxis,
    pub y: DrawnAxis,
    pub bar: Option<ColorBar>,
}

/// Meaning of colours.
#[derive(Debug)]
pub(super) struct ColorBar {
    pub label: String,
    pub axis: DrawnAxis,
    /// From the numbers of the column to those of the axis.
    pub factor: f64,
}

/// All panels of a figure that has been arranged.
///
/// # Errors
/// `Error::Input` when a curve names a table or column that the report does not have.
pub(super) fn shown<'a>(figure: &'a Figure, report: &'a Report) -> Result<Vec<Shown<'a>>, Error> {
    let panels = resolve(figure, report)?.into_iter();
    let panels = panels.map(|resolved| panel(report, resolved.panel, resolved.list));
    let mut panels = panels.collect::<Result<Vec<Shown<'a>>, Error>>()?;
    align(&mut panels);
    Ok(panels)
}

/// One range of the abscissa for all panels where it is the same quantity and nobody chose a range: some quantities have no values at
/// one end of it.
fn align(panels: &mut [Shown<'_>]) {
    let is_free = |shown: &Shown<'_>| {
        let fixed = |s: &DrawnSeries<'_>| {
            matches!(
                s.drawing,
                DrawnContent::Cells(_) | DrawnContent::Bars(_) | DrawnContent::Tornado(_)
            )
        };
        shown.panel.x_range.is_none() && !shown.list.iter().any(fixed)
    };
    let is_same = panels.windows(2).all(|w| w[0].x_label == w[1].x_label);
    if panels.len() < 2 || !is_same || !panels.iter().all(is_free) {
        return;
    }
    let with_points = panels
        .iter()
        .filter(|p| p.list.iter().any(|s| s.points().next().is_some()));
    let ends = extent(with_points.flat_map(|p| [p.x.low, p.x.high]));
    let Some((low, high)) = ends else { return };
    for shown in panels
        .iter_mut()
        .filter(|p| (p.x.low, p.x.high) != (low, high))
    {
        shown.x = DrawnAxis::exact((low, high), 7);
    }
}

/// Whether all panels have one abscissa: its ticks are written once, and zooming one zooms all.
pub(super) fn is_shared(panels: &[Shown<'_>]) -> bool {
    panels.windows(2).all(|w| {
        w[0].x_label == w[1].x_label && (w[0].x.low, w[0].x.high) == (w[1].x.low, w[1].x.high)
    })
}

fn panel<'a>(
    report: &Report,
    panel: &'a Panel,
    mut list: Vec<DrawnSeries<'a>>,
) -> Result<Shown<'a>, Error> {
    let tornado = list
        .iter()
        .any(|s| matches!(s.drawing, DrawnContent::Tornado(_)));
    let x = match panel.x_unit.as_str() {
        _ if tornado => Scaled::suiting(&panel.x_label, 1.0),
        "" => {
            let range = panel.x_range.map_or(0.0, |(a, b)| a.abs().max(b.abs()));
            let largest = match range > 0.0 {
                true => range,
                false => largest(&list, |p| p.0),
            };
            let base = drawn_over_written(panel);
            let own = Scaled::suiting(&panel.x_label, largest * base);
            Scaled {
                factor: own.factor * base,
                ..own
            }
        }
        _ => Scaled::abscissa(panel).map_err(|message| misfit(report, message))?,
    };
    let y = match tornado {
        true => Scaled::suiting(&panel.y_label, 1.0),
        false => Scaled::suiting(&panel.y_label, largest(&list, |p| p.1)),
    };
    for series in &mut list {
        series.x.iter_mut().for_each(|value| *value *= x.factor);
        series.y.iter_mut().for_each(|value| *value *= y.factor);
        match &mut series.drawing {
            DrawnContent::Bars(widths) => widths.iter_mut().for_each(|width| *width *= x.factor),
            DrawnContent::Cells(raster) => {
                raster.x.iter_mut().for_each(|value| *value *= x.factor);
                raster.y.iter_mut().for_each(|value| *value *= y.factor);
            }
            _ => {}
        }
    }
    let x_range = match panel.x_unit.as_str() {
        "" => panel.x_range.map(|(a, b)| (a * x.factor, b * x.factor)),
        // Given in that unit.
        _ => panel.x_range,
    };
    let y_range = panel.y_range.map(|(a, b)| (a * y.factor, b * y.factor));
    let bar = (list.iter()).find_map(|series| color_bar(report, &panel.heading, series));
    let (x_axis, y_axis) = axes(&list, (x_range, y_range), panel.y_scale);
    Ok(Shown {
        panel,
        x_label: x.label,
        y_label: y.label,
        factors: (x.factor, y.factor),
        list,
        x: x_axis,
        y: y_axis,
        bar,
    })
}

/// Factor from the numbers of a column of frequencies to those of its axis.
pub(super) fn drawn_over_written(panel: &Panel) -> f64 {
    panel.x_frequency.map_or(1.0, |axis| axis.factor())
}

/// Largest modulus among the points drawn.
fn largest(list: &[DrawnSeries<'_>], of: impl Fn((f64, f64)) -> f64) -> f64 {
    let points = list.iter().flat_map(DrawnSeries::points);
    points.map(|p| of(p).abs()).fold(0.0, f64::max)
}

fn color_bar(report: &Report, heading: &str, series: &DrawnSeries<'_>) -> Option<ColorBar> {
    let by = match (&series.drawing, &series.curve.style) {
        (DrawnContent::Coloured(_), CurveStyle::Coloured { by }) => by,
        (DrawnContent::Cells(raster), CurveStyle::Cells { value, .. }) if raster.is_continuous => {
            value
        }
        _ => return None,
    };
    let column = report.table(&series.curve.table)?.column(by)?;
    let values = column.values.as_floats()?;
    let (low, high) = extent(values.iter().copied()).unwrap_or((0.0, 1.0));
    let mut words = Words::of(by);
    if words.subject == heading {
        words.subject.clear();
    }
    let label = words.axis(&column.unit);
    let scaled = Scaled::suiting(&label, low.abs().max(high.abs()));
    Some(ColorBar {
        label: scaled.label,
        axis: DrawnAxis::exact((low * scaled.factor, high * scaled.factor), 5),
        factor: scaled.factor,
    })
}

type AxisRange = Option<(f64, f64)>;

fn axes(
    list: &[DrawnSeries<'_>],
    (x_range, y_range): (AxisRange, AxisRange),
    scale: AxisScale,
) -> (DrawnAxis, DrawnAxis) {
    if let Some((series, names)) = list.iter().find_map(|s| match &s.drawing {
        DrawnContent::Tornado(names) => Some((s, names)),
        _ => None,
    }) {
        let widest = series.x.iter().fold(0.1, |m: f64, x| m.max(x.abs()));
        let reach = (1.1 * widest).min(1.05 * widest.max(1.0));
        return (
            DrawnAxis::exact((-reach, reach), 7),
            DrawnAxis::of_names(names),
        );
    }
    let is = |wanted: fn(&DrawnContent) -> bool| {
        !list.is_empty() && list.iter().all(|s| wanted(&s.drawing))
    };
    let only_dots = is(|d| matches!(d, DrawnContent::Dots | DrawnContent::Coloured(_)));
    let cells = list.iter().find_map(|s| match &s.drawing {
        DrawnContent::Cells(raster) if !raster.cells.is_empty() => Some(raster),
        _ => None,
    });
    if let Some(raster) = cells {
        let around = |centres: &[f64]| {
            let edges = edges(centres);
            (edges[0], edges[edges.len() - 1])
        };
        let x = DrawnAxis::exact(x_range.unwrap_or_else(|| around(&raster.x)), 7);
        let y = DrawnAxis::exact(y_range.unwrap_or_else(|| around(&raster.y)), 6);
        return (x, y);
    }
    let bars = list.iter().find_map(|s| match &s.drawing {
        DrawnContent::Bars(widths) => Some((s, widths)),
        _ => None,
    });
    let xs = || list.iter().flat_map(|s| s.points().map(|p| p.0));
    let x = match (x_range, extent(xs()), bars) {
        (Some(range), _, _) if range.0.is_finite() && range.1.is_finite() => {
            DrawnAxis::exact(range, 7)
        }
        (_, Some((low, high)), Some((_, widths))) => {
            // NaN: bars of other curves.
            let half = widths.iter().copied().fold(0.0, f64::max) / 2.0;
            DrawnAxis::exact((low - half, high + half), 7)
        }
        (_, Some(range), None) if !only_dots => DrawnAxis::exact(range, 7),
        _ => DrawnAxis::framing(xs(), 7),
    };
    let inside = |p: &(f64, f64)| p.0 >= x.low && p.0 <= x.high;
    let ys = list.iter().flat_map(|s| s.points().filter(inside));
    let ys = ys.map(|p| p.1);
    let y = match (scale, y_range) {
        (AxisScale::Log, range) => DrawnAxis::logarithmic(range, ys),
        (_, Some(range)) => DrawnAxis::exact(range, 6),
        _ if bars.is_some() => {
            let top = extent(ys).map_or(1.0, |(_, high)| high);
            DrawnAxis::exact((0.0, 1.05 * top), 6)
        }
        _ if only_dots => DrawnAxis::framing(ys, 6),
        _ => DrawnAxis::around(ys, 6),
    };
    (x, y)
}

fn misfit(report: &Report, message: String) -> Error {
    Error::Input(vec![Diagnostic {
        location: None,
        path: format!("analyses.{}.plot.x_unit", report.name),
        message,
        help: None,
    }])
}
