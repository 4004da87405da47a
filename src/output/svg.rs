//! Static figures: panels one above the other, legend below, fit for a paper (18 cm wide).
//!
//! The drawing primitives and the SVG text come from `kuva`; the page layout is our own, because kuva's numbers its clip
//! paths over the life of the process (the same input would not give the same bytes) and its legend shows no dashes.

use std::collections::HashSet;
use std::fmt::Write as _;

use kuva::backend::svg::SvgBackend;
use kuva::render::render::{Primitive, Scene, TextAnchor};
use kuva::render::render_utils::wrap_text;

use super::axis::{Axis, extent, power_of_ten};
use super::draw::{TextStyle, crosses, dots, fill, marker, put_text, stroke};
use super::legend::{self, Entry, SAMPLE_WIDTH, Sample};
use super::raster::{Raster, edges};
use super::series::{Drawing, Series, State, resolve};
use crate::error::Error;
use crate::report::{Figure, Panel, Report, shown};

/// 18 cm at 96 pixels an inch.
const WIDTH: f64 = 680.0;
/// Height of the frame of a lone panel, and of one of several.
const FRAME_HEIGHT: (f64, f64) = (340.0, 235.0);
const TICK_FONT: u32 = 13;
const LABEL_FONT: u32 = 14;
const TITLE_FONT: u32 = 16;
const LEGEND_ROW: f64 = 21.0;
const LINE_HEIGHT: f64 = 1.3;
const FONTS: &str = "DejaVu Sans, Verdana, Arial, Helvetica, sans-serif";
const DASHES: &str = "7 4";
/// Cells drawn along each axis at most.
const CELLS: usize = 600;

/// Frame of a panel in pixels, with its axes.
struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
    x: Axis,
    y: Axis,
}

impl Frame {
    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + self.x.share(x) * self.width,
            self.top + (1.0 - self.y.share(y)) * self.height,
        )
    }

    /// Whether a point lies inside, give or take a pixel.
    fn holds(&self, (x, y): (f64, f64)) -> bool {
        x >= self.left - 1.0
            && x <= self.left + self.width + 1.0
            && y >= self.top - 1.0
            && y <= self.top + self.height + 1.0
    }
}

/// The figure as an SVG document; the same input gives the same bytes.
///
/// # Errors
///
/// `Error::Input` when a curve names a table or column that the report does not have.
pub fn render(figure: &Figure, report: &Report) -> Result<String, Error> {
    let svg = SvgBackend::new().render_scene(&scene(figure, report)?);
    // A view box lets pages and papers scale the figure.
    let (width, height) = size(&svg).unwrap_or((WIDTH, WIDTH));
    let head = format!("<svg viewBox=\"0 0 {width} {height}\" ");
    Ok(shown(&svg.replacen("<svg ", &head, 1)).into_owned())
}

fn size(svg: &str) -> Option<(f64, f64)> {
    let number = |key: &str| {
        let rest = &svg[svg.find(key)? + key.len()..];
        rest[..rest.find('"')?].parse().ok()
    };
    Some((number(" width=\"")?, number(" height=\"")?))
}

/// The figure as drawing primitives.
pub(super) fn scene(figure: &Figure, report: &Report) -> Result<Scene, Error> {
    let panels = resolve(figure, report)?;
    let mut scene = Scene::new(WIDTH, WIDTH);
    scene.font_family = Some(FONTS.to_string());
    scene.text_color = Some("#000000".to_string());
    let mut top = title(&mut scene, &figure.title);
    let height = match figure.panels.len() {
        1 => FRAME_HEIGHT.0,
        _ => FRAME_HEIGHT.1,
    };
    let axes: Vec<(Axis, Axis)> = figure
        .panels
        .iter()
        .zip(&panels)
        .map(|(panel, list)| axes(panel, list))
        .collect();
    let left = left_margin(figure, &axes, height);
    for (index, ((panel, list), (x, y))) in figure.panels.iter().zip(&panels).zip(axes).enumerate()
    {
        top += if y.exponent != 0 { 20.0 } else { 8.0 };
        let frame = Frame {
            left,
            top,
            width: WIDTH - left - 18.0,
            height,
            x,
            y,
        };
        draw_panel(&mut scene, &frame, panel, list, index);
        top += height + 56.0;
    }
    draw_legend(&mut scene, legend::entries(&panels), left, &mut top);
    scene.height = top.round();
    Ok(scene)
}

fn title(scene: &mut Scene, text: &str) -> f64 {
    let mut top = 6.0;
    if text.trim().is_empty() {
        return top;
    }
    for line in wrap_text(text, 66) {
        top += f64::from(TITLE_FONT) * LINE_HEIGHT;
        let at = (WIDTH / 2.0, top - 3.0);
        put_text(
            scene,
            at,
            &line,
            TextStyle::level(TITLE_FONT, TextAnchor::Middle),
        );
    }
    top + 6.0
}

/// Axes of a panel, the same on the page.
pub(super) fn axes(panel: &Panel, list: &[Series]) -> (Axis, Axis) {
    let cells = list.iter().find_map(|s| match &s.drawing {
        Drawing::Cells(raster) if !raster.cells.is_empty() => Some(raster),
        _ => None,
    });
    if let Some(raster) = cells {
        let (x, y) = (edges(&raster.x), edges(&raster.y));
        let ends = |list: &[f64]| (list[0], list[list.len() - 1]);
        return (Axis::exact(ends(&x), 7), Axis::exact(ends(&y), 6));
    }
    let only_dots = list.iter().all(|s| matches!(s.drawing, Drawing::Dots));
    let xs = || list.iter().flat_map(|s| s.points().map(|p| p.0));
    let factor = panel.x_frequency.map_or(1.0, |axis| axis.factor());
    let x_range = panel.x_range.map(|(a, b)| (a * factor, b * factor));
    let x = match (x_range, extent(xs())) {
        (Some(range), _) if range.0.is_finite() && range.1.is_finite() => Axis::exact(range, 7),
        (_, Some(range)) if !only_dots => Axis::exact(range, 7),
        _ => Axis::framing(xs(), 7),
    };
    let inside = |p: &(f64, f64)| p.0 >= x.low && p.0 <= x.high;
    let ys = list.iter().flat_map(|s| s.points().filter(inside));
    let ys = ys.map(|p| p.1);
    let y = match only_dots {
        true => Axis::framing(ys, 6),
        false => Axis::around(ys, 6),
    };
    (x, y)
}

/// Room for the widest tick text and the ordinate's label, the same for all panels.
fn left_margin(figure: &Figure, axes: &[(Axis, Axis)], height: f64) -> f64 {
    let ticks = axes.iter().flat_map(|(_, y)| &y.ticks);
    let widest = ticks.map(|t| legend::text_width(&t.text, f64::from(TICK_FONT)));
    let lines = figure.panels.iter().map(|p| y_label(p, height).len());
    let lines = lines.max().unwrap_or(1) as f64;
    widest.fold(20.0, f64::max) + 18.0 + lines * f64::from(LABEL_FONT) * LINE_HEIGHT
}

fn y_label(panel: &Panel, height: f64) -> Vec<String> {
    wrap_text(
        &panel.y_label,
        (height / (0.55 * f64::from(LABEL_FONT))) as usize,
    )
}

fn draw_panel(scene: &mut Scene, frame: &Frame, panel: &Panel, list: &[Series], index: usize) {
    draw_grid(scene, frame);
    let id = format!("panel-{index}");
    scene.defs.push(format!(
        "<clipPath id=\"{id}\"><rect x=\"{:.2}\" y=\"{:.2}\" width=\"{:.2}\" height=\"{:.2}\"/></clipPath>",
        frame.left, frame.top, frame.width, frame.height
    ));
    scene.add(Primitive::ClipStart {
        x: frame.left,
        y: frame.top,
        width: frame.width,
        height: frame.height,
        id,
    });
    for series in list {
        draw_series(scene, frame, series);
    }
    scene.add(Primitive::ClipEnd);
    if list.iter().all(|s| s.points().next().is_none()) {
        let at = (
            frame.left + frame.width / 2.0,
            frame.top + frame.height / 2.0,
        );
        put_text(
            scene,
            at,
            "no points",
            TextStyle::level(LABEL_FONT, TextAnchor::Middle),
        );
    }
    draw_axes(scene, frame, panel);
    // Events may sit on the frame: drawn whole, above everything else.
    for series in list {
        draw_events(scene, frame, series);
    }
}

fn draw_grid(scene: &mut Scene, frame: &Frame) {
    let mut d = String::new();
    for tick in &frame.x.ticks {
        let (x, _) = frame.at(tick.value, frame.y.low);
        let _ = write!(d, "M{x:.2} {:.2}v{:.2}", frame.top, frame.height);
    }
    for tick in &frame.y.ticks {
        let (_, y) = frame.at(frame.x.low, tick.value);
        let _ = write!(d, "M{:.2} {y:.2}h{:.2}", frame.left, frame.width);
    }
    stroke(scene, d, "#e4e4e4", 0.8, None);
}

fn draw_axes(scene: &mut Scene, frame: &Frame, panel: &Panel) {
    let bottom = frame.top + frame.height;
    let mut d = format!(
        "M{:.2} {:.2}h{:.2}v{:.2}h{:.2}Z",
        frame.left, frame.top, frame.width, frame.height, -frame.width
    );
    for tick in &frame.x.ticks {
        let (x, y) = frame.at(tick.value, frame.y.low);
        let _ = write!(d, "M{x:.2} {y:.2}v-5M{x:.2} {:.2}v5", frame.top);
        let at = (x, bottom + 18.0);
        put_text(
            scene,
            at,
            &tick.text,
            TextStyle::level(TICK_FONT, TextAnchor::Middle),
        );
    }
    for tick in &frame.y.ticks {
        let (x, y) = frame.at(frame.x.low, tick.value);
        let _ = write!(d, "M{x:.2} {y:.2}h5M{:.2} {y:.2}h-5", x + frame.width);
        let at = (x - 7.0, y + 4.7);
        put_text(
            scene,
            at,
            &tick.text,
            TextStyle::level(TICK_FONT, TextAnchor::End),
        );
    }
    stroke(scene, d, "#000000", 1.0, None);
    let right = frame.left + frame.width;
    if frame.x.exponent != 0 {
        let text = power_of_ten(frame.x.exponent);
        let at = (right, bottom + 36.0);
        put_text(
            scene,
            at,
            &text,
            TextStyle::level(TICK_FONT, TextAnchor::End),
        );
    }
    if frame.y.exponent != 0 {
        let text = power_of_ten(frame.y.exponent);
        let at = (frame.left, frame.top - 6.0);
        put_text(
            scene,
            at,
            &text,
            TextStyle::level(TICK_FONT, TextAnchor::Start),
        );
    }
    let middle = frame.left + frame.width / 2.0;
    let at = (middle, bottom + 38.0);
    put_text(
        scene,
        at,
        &panel.x_label,
        TextStyle::level(LABEL_FONT, TextAnchor::Middle),
    );
    for (line, text) in y_label(panel, frame.height).iter().enumerate() {
        let x = f64::from(LABEL_FONT) * (1.1 + LINE_HEIGHT * line as f64);
        let at = (x, frame.top + frame.height / 2.0);
        let mut style = TextStyle::level(LABEL_FONT, TextAnchor::Middle);
        style.rotate = Some(-90.0);
        put_text(scene, at, text, style);
    }
}

fn draw_series(scene: &mut Scene, frame: &Frame, series: &Series) {
    match &series.drawing {
        Drawing::Runs(runs) => {
            for state in [State::Unknown, State::Unstable, State::Stable, State::Plain] {
                let mut d = String::new();
                for run in runs.iter().filter(|r| r.state == state) {
                    trace(&mut d, frame, series, run.rows.clone());
                }
                let (width, dashes) = stroke_of(state);
                stroke(scene, d, series.color(), width, dashes);
            }
        }
        Drawing::Crosses => {
            crosses(scene, &distinct(frame, series, 1.0), series.color());
        }
        Drawing::Dots => dots(scene, &distinct(frame, series, 4.0), series.color(), 2.2),
        Drawing::Cells(raster) => draw_cells(scene, frame, &raster.thinned(CELLS)),
        Drawing::Events(_) => {}
    }
}

/// Neighbours of one colour in a row are one rectangle; one path per colour.
fn draw_cells(scene: &mut Scene, frame: &Frame, raster: &Raster) {
    let (x, y, width) = (edges(&raster.x), edges(&raster.y), raster.x.len());
    let mut paths = vec![String::new(); raster.levels.len()];
    for (j, row) in raster.cells.chunks_exact(width.max(1)).enumerate() {
        let mut first = 0;
        while first < width {
            let same = row[first..].iter().take_while(|c| **c == row[first]);
            let end = first + same.count();
            if let Some(level) = row[first] {
                let (left, bottom) = frame.at(x[first], y[j]);
                let (right, top) = frame.at(x[end], y[j + 1]);
                let d = &mut paths[level];
                let (w, h) = (right - left, bottom - top);
                let _ = write!(d, "M{left:.2} {top:.2}h{w:.2}v{h:.2}h-{w:.2}Z");
            }
            first = end;
        }
    }
    scene.add(Primitive::GroupStart {
        transform: None,
        title: None,
        extra_attrs: Some("shape-rendering=\"crispEdges\"".to_string()),
    });
    for (d, level) in paths.into_iter().zip(&raster.levels) {
        fill(scene, d, &level.color);
    }
    scene.add(Primitive::GroupEnd);
}

fn draw_events(scene: &mut Scene, frame: &Frame, series: &Series) {
    let Drawing::Events(kinds) = &series.drawing else {
        return;
    };
    for (kind, (x, y)) in kinds.iter().zip(series.x.iter().zip(&series.y)) {
        let at = frame.at(*x, *y);
        if x.is_finite() && y.is_finite() && frame.holds(at) {
            marker(scene, at, kind);
        }
    }
}

fn stroke_of(state: State) -> (f64, Option<&'static str>) {
    match state {
        State::Stable | State::Plain => (1.8, None),
        State::Unstable => (1.8, Some(DASHES)),
        State::Unknown => (0.9, None),
    }
}

/// Adds a polyline to a path. Points closer than a tenth of a pixel to the last one drawn are left out; a lone point
/// becomes a short tick.
fn trace(d: &mut String, frame: &Frame, series: &Series, rows: std::ops::Range<usize>) {
    let end = rows.end;
    let alone = rows.len() == 1;
    let mut last: Option<(f64, f64)> = None;
    for row in rows {
        let (x, y) = frame.at(series.x[row], series.y[row]);
        match last {
            None => {
                let _ = write!(d, "M{x:.2} {y:.2}");
            }
            Some((a, b)) if row + 1 < end && (x - a).hypot(y - b) < 0.1 => continue,
            Some(_) => {
                let _ = write!(d, "L{x:.2} {y:.2}");
            }
        }
        last = Some((x, y));
    }
    if alone {
        d.push_str("m-1.5 0h3");
    }
}

/// Positions of the points inside the frame, one for each cell of a grid of 1/`cells` pixel.
fn distinct(frame: &Frame, series: &Series, cells: f64) -> Vec<(f64, f64)> {
    let mut seen = HashSet::new();
    let positions = series.points().map(|(x, y)| frame.at(x, y));
    positions
        .filter(|&at| frame.holds(at))
        .filter(|(x, y)| seen.insert(((x * cells).round() as i64, (y * cells).round() as i64)))
        .collect()
}

fn draw_legend(scene: &mut Scene, mut entries: Vec<Entry>, left: f64, top: &mut f64) {
    let font = f64::from(TICK_FONT);
    let width = WIDTH - left - 18.0;
    let columns = legend::columns(&mut entries, width, font);
    let column_width = width / columns as f64;
    for (index, entry) in entries.iter().enumerate() {
        let x = left + (index % columns) as f64 * column_width;
        let y = *top + (index / columns) as f64 * LEGEND_ROW + 6.0;
        let middle = x + (SAMPLE_WIDTH - 8.0) / 2.0;
        match &entry.sample {
            Sample::Stroke(state) => {
                let (width, dashes) = stroke_of(*state);
                let d = format!("M{x:.2} {y:.2}h{:.2}", SAMPLE_WIDTH - 8.0);
                stroke(scene, d, entry.color, width, dashes);
            }
            Sample::Cross => crosses(scene, &[(middle, y)], entry.color),
            Sample::Dot => dots(scene, &[(middle, y)], entry.color, 4.0),
            Sample::Patch(color) => {
                let (height, width) = (11.0, SAMPLE_WIDTH - 14.0);
                let d = format!("M{x:.2} {:.2}h{width:.2}v{height:.2}h-{width:.2}Z", y - 5.5);
                fill(scene, d, color);
            }
            Sample::Event(kind) => marker(scene, (middle, y), kind),
        }
        let at = (x + SAMPLE_WIDTH, y + 4.7);
        put_text(
            scene,
            at,
            &entry.text,
            TextStyle::level(TICK_FONT, TextAnchor::Start),
        );
    }
    *top += entries.len().div_ceil(columns) as f64 * LEGEND_ROW + 4.0;
}
