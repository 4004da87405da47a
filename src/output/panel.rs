//! One panel of a static figure: frame, ticks, labels, curves.

mod colors;

use std::collections::HashSet;
use std::fmt::Write as _;

use kuva::render::render::{Primitive, Scene, TextAnchor};

use super::axis::{DrawnAxis, power_of_ten};
use super::draw::{TextStyle, crosses, dots, fill, marks, put_text, stroke};
use super::look::{self, FAINT, Mark, NEUTRAL, StabilityState, tint};
use super::series::{DrawnContent, DrawnSeries};
use super::sheet::{LINE_HEIGHT, Sheet};
use super::shown::Shown;
use super::sparse;
use super::text::{cut, cut_front, text_width, wrapped};

/// Pixels between the marks on a curve.
const BETWEEN_MARKS: f64 = 42.0;
/// A curve through so few points shows each of them: what was computed, and what is a line between.
const FEW_POINTS: usize = 30;
/// Parts of a pixel that a long line resolves.
const FINE: f64 = 4.0;
/// More dots than these are drawn small.
const FEW_DOTS: usize = 600;
/// More dots than these are told apart by whole pixels only.
const MANY_DOTS: usize = 50_000;

/// Frame of a panel in pixels.
#[derive(Debug)]
pub(super) struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    /// Whether ticks and label of the abscissa are written below it.
    pub has_x_texts: bool,
}

impl Frame {
    /// Place of a point.
    pub fn at(&self, panel: &Shown<'_>, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + panel.x.share(x) * self.width,
            self.top + (1.0 - panel.y.share(y)) * self.height,
        )
    }

    /// Whether a place lies inside, give or take a pixel.
    pub fn holds(&self, (x, y): (f64, f64)) -> bool {
        x >= self.left - 1.0
            && x <= self.left + self.width + 1.0
            && y >= self.top - 1.0
            && y <= self.top + self.height + 1.0
    }
}

pub(super) fn draw_panel(
    scene: &mut Scene,
    sheet: &Sheet,
    frame: &Frame,
    panel: &Shown<'_>,
    index: usize,
) {
    draw_grid(scene, frame, panel);
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
    // The backbone and halos lie behind the curves, dots on top; those on the frame are whole.
    let layer = |wanted: usize| panel.list.iter().filter(move |s| layer(s) == wanted);
    for series in layer(0).chain(layer(1)) {
        draw_series(scene, frame, panel, series);
    }
    scene.add(Primitive::ClipEnd);
    layer(2).for_each(|series| draw_series(scene, frame, panel, series));
    if panel.list.iter().all(|s| s.points().next().is_none()) {
        let at = (
            frame.left + frame.width / 2.0,
            frame.top + frame.height / 2.0,
        );
        put_text(
            scene,
            at,
            "no points",
            TextStyle::level(sheet.label, TextAnchor::Middle),
        );
    }
    draw_frame(scene, sheet, frame, panel);
    if let Some(bar) = &panel.bar {
        colors::draw_bar(scene, sheet, frame, bar);
    }
}

/// From the back to the front.
fn layer(series: &DrawnSeries<'_>) -> usize {
    match series.drawing {
        DrawnContent::Crosses | DrawnContent::Cells(_) => 0,
        _ if is_halo(series) => 0,
        DrawnContent::Dots => 2,
        _ => 1,
    }
}

/// The second of two curves of dots lies as a broad ring behind the first: both are seen where they agree.
fn is_halo(series: &DrawnSeries<'_>) -> bool {
    series.drawing == DrawnContent::Dots && series.rank.place > 0
}

fn draw_grid(scene: &mut Scene, frame: &Frame, panel: &Shown<'_>) {
    let mut d = String::new();
    for tick in &panel.x.ticks {
        let (x, _) = frame.at(panel, tick.value, panel.y.low);
        let _ = write!(d, "M{x:.2} {:.2}v{:.2}", frame.top, frame.height);
    }
    for tick in &panel.y.ticks {
        let (_, y) = frame.at(panel, panel.x.low, tick.value);
        let _ = write!(d, "M{:.2} {y:.2}h{:.2}", frame.left, frame.width);
    }
    stroke(scene, d, "#ececec", 0.8, None);
}

fn draw_frame(scene: &mut Scene, sheet: &Sheet, frame: &Frame, panel: &Shown<'_>) {
    let bottom = frame.top + frame.height;
    let mut d = format!(
        "M{:.2} {:.2}h{:.2}v{:.2}h{:.2}Z",
        frame.left, frame.top, frame.width, frame.height, -frame.width
    );
    let tick_font = f64::from(sheet.tick);
    let stride = stride(frame, panel, tick_font);
    for (k, tick) in panel.x.ticks.iter().enumerate() {
        let (x, _) = frame.at(panel, tick.value, panel.y.low);
        let _ = write!(d, "M{x:.2} {:.2}v4M{x:.2} {bottom:.2}v-4", frame.top);
        if frame.has_x_texts && k % stride == 0 {
            let at = (x, bottom + 1.3 * tick_font);
            put_text(
                scene,
                at,
                &tick.text,
                TextStyle::level(sheet.tick, TextAnchor::Middle),
            );
        }
    }
    for tick in &panel.y.ticks {
        let (_, y) = frame.at(panel, panel.x.low, tick.value);
        let _ = write!(
            d,
            "M{:.2} {y:.2}h4M{:.2} {y:.2}h-4",
            frame.left,
            frame.left + frame.width
        );
        let at = (frame.left - 6.0, y + 0.36 * tick_font);
        put_text(
            scene,
            at,
            &tick.text,
            TextStyle::level(sheet.tick, TextAnchor::End),
        );
    }
    stroke(scene, d, "#000000", 0.9, None);
    draw_labels(scene, sheet, frame, panel);
}

/// Every how many ticks of the abscissa one has a text, so that no two touch.
fn stride(frame: &Frame, panel: &Shown<'_>, font: f64) -> usize {
    let ticks = &panel.x.ticks;
    let widest = ticks.iter().map(|t| text_width(&t.text, font));
    let widest = widest.fold(0.0, f64::max) + 0.6 * font;
    let places = ticks.iter().map(|t| panel.x.share(t.value) * frame.width);
    let places: Vec<f64> = places.collect();
    let closest = places.windows(2).map(|w| (w[1] - w[0]).abs());
    let closest = closest.fold(f64::INFINITY, f64::min).max(1.0);
    (widest / closest).ceil().max(1.0) as usize
}

fn draw_labels(scene: &mut Scene, sheet: &Sheet, frame: &Frame, panel: &Shown<'_>) {
    let (bottom, right) = (frame.top + frame.height, frame.left + frame.width);
    let (tick_font, font) = (f64::from(sheet.tick), f64::from(sheet.label));
    let power = |axis: &DrawnAxis| (axis.exponent != 0).then(|| power_of_ten(axis.exponent));
    if let Some(text) = power(&panel.y) {
        let at = (frame.left, frame.top - 5.0);
        put_text(
            scene,
            at,
            &text,
            TextStyle::level(sheet.tick, TextAnchor::Start),
        );
    }
    let below = bottom + 1.6 * tick_font + 1.1 * font;
    if let Some(text) = power(&panel.x).filter(|_| frame.has_x_texts) {
        put_text(
            scene,
            (right, below),
            &text,
            TextStyle::level(sheet.tick, TextAnchor::End),
        );
    }
    let middle = frame.left + frame.width / 2.0;
    if frame.has_x_texts {
        // A long text in smaller type, and its end alone where that does not help.
        let room = frame.left.min(40.0) + frame.width;
        let font = fitted(font, text_width(&panel.x_label, font), room);
        let style = TextStyle::level(font as u32, TextAnchor::Middle);
        let label = cut_front(&panel.x_label, font, room);
        put_text(scene, (middle, below), &label, style);
    }
    if !panel.panel.heading.is_empty() {
        let at = match panel.y.exponent {
            0 => (frame.left, frame.top - 5.0),
            _ => (frame.left + 4.5 * tick_font, frame.top - 5.0),
        };
        // Bold letters are wider by a tenth.
        let room = frame.left + frame.width - at.0 + 8.0;
        let width = 1.1 * text_width(&panel.panel.heading, font);
        let font = fitted(font, width, room);
        let style = TextStyle {
            bold: true,
            ..TextStyle::level(font as u32, TextAnchor::Start)
        };
        let heading = cut(&panel.panel.heading, 1.1 * font, room);
        put_text(scene, at, &heading, style);
    }
    let lines = wrapped(&panel.y_label, font, frame.height + 20.0);
    let ticks = panel.y.ticks.iter().map(|t| text_width(&t.text, tick_font));
    let edge = frame.left - ticks.fold(14.0, f64::max) - 12.0;
    for (line, text) in lines.iter().rev().enumerate() {
        let x = (edge - font * LINE_HEIGHT * line as f64).max(font);
        let style = TextStyle {
            rotate: Some(-90.0),
            ..TextStyle::level(sheet.label, TextAnchor::Middle)
        };
        put_text(scene, (x, frame.top + frame.height / 2.0), text, style);
    }
}

/// Size of type in which a text of a width fits a room, as far as it stays legible.
fn fitted(font: f64, width: f64, room: f64) -> f64 {
    font * (room / width).clamp(0.6, 1.0)
}

fn draw_series(scene: &mut Scene, frame: &Frame, panel: &Shown<'_>, series: &DrawnSeries<'_>) {
    match &series.drawing {
        DrawnContent::Runs(_) => draw_runs(scene, frame, panel, series),
        DrawnContent::Crosses => crosses(scene, &distinct(frame, panel, series, 0.5), FAINT),
        DrawnContent::Dots => {
            let cells = if series.x.len() > MANY_DOTS { 1.0 } else { 4.0 };
            let places = distinct(frame, panel, series, cells);
            let size = if places.len() > FEW_DOTS { 1.9 } else { 3.6 };
            let has_lines = panel
                .list
                .iter()
                .any(|s| matches!(s.drawing, DrawnContent::Runs(_)));
            match (is_halo(series), has_lines) {
                (true, _) => dots(scene, &places, &tint(series.color, 0.62), 2.2 * size),
                (false, true) => dots(scene, &places, NEUTRAL, size),
                (false, false) => dots(scene, &places, series.color, size),
            }
        }
        DrawnContent::Coloured(values) => {
            for (color, places) in colors::by_color(frame, panel, series, values) {
                dots(scene, &places, &color, 4.2);
            }
        }
        DrawnContent::Cells(raster) => colors::draw_cells(scene, frame, panel, raster),
        DrawnContent::Bars(widths) => {
            let mut d = String::new();
            let bars = series.x.iter().zip(&series.y).zip(widths);
            let is_drawn = |bar: &((&f64, &f64), &f64)| bar.0.0.is_finite() && bar.0.1.is_finite();
            for ((x, y), width) in bars.filter(is_drawn) {
                let (left, top) = frame.at(panel, x - width / 2.0, *y);
                let (right, bottom) = frame.at(panel, x + width / 2.0, panel.y.low.max(0.0));
                let _ = write!(d, "M{left:.2} {bottom:.2}V{top:.2}H{right:.2}V{bottom:.2}Z");
            }
            fill(scene, d, &tint(series.color, 0.45), Some(series.color));
        }
        DrawnContent::Tornado(_) => {
            let mut d = String::new();
            for (x, y) in series.points() {
                let (left, top) = frame.at(panel, 0.0, y + 0.34);
                let (right, bottom) = frame.at(panel, x, y - 0.34);
                let _ = write!(d, "M{left:.2} {bottom:.2}V{top:.2}H{right:.2}V{bottom:.2}Z");
            }
            fill(scene, d, &tint(series.color, 0.45), Some(series.color));
        }
        DrawnContent::Events(_) => {}
    }
}

fn draw_runs(scene: &mut Scene, frame: &Frame, panel: &Shown<'_>, series: &DrawnSeries<'_>) {
    let DrawnContent::Runs(runs) = &series.drawing else {
        return;
    };
    let look = look::stroke(series.color, series.rank);
    if look.mark == Mark::None && runs.iter().all(|run| run.state == StabilityState::Plain) {
        let points = series.points().count();
        if (1..=FEW_POINTS).contains(&points) {
            let places = series.points().map(|(x, y)| frame.at(panel, x, y));
            let places: Vec<_> = places.filter(|at| frame.holds(*at)).collect();
            dots(scene, &places, &look.color, 4.2);
        }
    }
    // On cells of any colour a curve has white edges.
    let is_cells = |s: &DrawnSeries<'_>| matches!(s.drawing, DrawnContent::Cells(_));
    let has_cells = panel.list.iter().any(is_cells);
    let mut places = Vec::new();
    for state in [
        StabilityState::Unknown,
        StabilityState::Unstable,
        StabilityState::Stable,
        StabilityState::Plain,
    ] {
        let mut d = String::new();
        for run in runs.iter().filter(|r| r.state == state) {
            trace(&mut d, frame, panel, series, run.rows.clone());
            if look.mark != Mark::None {
                spread(&mut places, frame, panel, series, run.rows.clone());
            }
        }
        let (width, dashes) = look::state_stroke(look.width, state);
        if has_cells {
            stroke(scene, d.clone(), "#ffffff", width + 2.4, None);
        }
        stroke(scene, d, &look.color, width, dashes);
    }
    places.retain(|at| frame.holds(*at));
    marks(scene, &places, look.mark, &look.color);
}

/// Adds a polyline to a path. Points closer than a tenth of a pixel to the last one drawn are left out; a lone point
/// becomes a short tick. Counts change in steps.
fn trace(
    d: &mut String,
    frame: &Frame,
    panel: &Shown<'_>,
    series: &DrawnSeries<'_>,
    rows: std::ops::Range<usize>,
) {
    let alone = rows.len() == 1;
    let at = |row: usize| frame.at(panel, series.x[row], series.y[row]);
    let fine = |row: usize| {
        let (x, y) = at(row);
        (x * FINE, y * FINE)
    };
    let is_count = series.is_count();
    for stretch in sparse::line(rows, fine) {
        let mut last: Option<(f64, f64)> = None;
        let end = stretch.last().copied();
        for row in stretch {
            let (x, y) = at(row);
            match last {
                None => {
                    let _ = write!(d, "M{x:.2} {y:.2}");
                }
                Some((a, b)) if Some(row) != end && (x - a).hypot(y - b) < 0.1 => continue,
                Some((a, b)) => {
                    if is_count && y != b {
                        let _ = write!(d, "H{:.2}V{y:.2}", 0.5 * (a + x));
                    }
                    let _ = write!(d, "L{x:.2} {y:.2}");
                }
            }
            last = Some((x, y));
        }
    }
    if alone {
        d.push_str("m-1.5 0h3");
    }
}

/// Places of marks along a run, evenly spread over its length.
fn spread(
    places: &mut Vec<(f64, f64)>,
    frame: &Frame,
    panel: &Shown<'_>,
    series: &DrawnSeries<'_>,
    rows: std::ops::Range<usize>,
) {
    let mut way = BETWEEN_MARKS / 2.0;
    let mut last: Option<(f64, f64)> = None;
    for row in rows {
        let at = frame.at(panel, series.x[row], series.y[row]);
        if let Some(before) = last.filter(|_| frame.holds(at)) {
            way += (at.0 - before.0).hypot(at.1 - before.1);
        }
        if way >= BETWEEN_MARKS {
            places.push(at);
            way = 0.0;
        }
        last = Some(at);
    }
}

/// Positions of the points inside the frame, one for each cell of a grid of 1/`cells` pixel.
fn distinct(
    frame: &Frame,
    panel: &Shown<'_>,
    series: &DrawnSeries<'_>,
    cells: f64,
) -> Vec<(f64, f64)> {
    let mut seen = HashSet::new();
    let positions = series.points().map(|(x, y)| frame.at(panel, x, y));
    positions
        .filter(|&at| frame.holds(at))
        .filter(|(x, y)| seen.insert(((x * cells).round() as i64, (y * cells).round() as i64)))
        .collect()
}
