//! Colours by the values of a column: dots, cells, the bar that explains them.

use std::collections::HashSet;
use std::fmt::Write as _;

use kuva::render::render::{Primitive, Scene, TextAnchor};

use super::Frame;
use crate::output::axis::power_of_ten;
use crate::output::draw::{TextStyle, fill, put_text, stroke};
use crate::output::look::scale_color;
use crate::output::raster::{Raster, edges};
use crate::output::series::DrawnSeries;
use crate::output::sheet::Sheet;
use crate::output::shown::{ColorBar, Shown};
use crate::output::text::{cut, text_width};

/// Colours of a scale that are told apart.
const LEVELS: usize = 48;

type Places = Vec<(f64, f64)>;

/// Level of a value among the colours; `None` when there is no value.
fn level(bar: &ColorBar, value: f64) -> Option<usize> {
    let share = bar.axis.share(value * bar.factor);
    share
        .is_finite()
        .then(|| ((share.clamp(0.0, 1.0) * LEVELS as f64) as usize).min(LEVELS - 1))
}

fn level_color(level: usize) -> String {
    scale_color((level as f64 + 0.5) / LEVELS as f64)
}

pub(super) fn by_color(
    frame: &Frame,
    panel: &Shown<'_>,
    series: &DrawnSeries<'_>,
    values: &[f64],
) -> Vec<(String, Places)> {
    let Some(bar) = &panel.bar else {
        return Vec::new();
    };
    let mut lists: Vec<Places> = vec![Vec::new(); LEVELS];
    let mut seen = HashSet::new();
    for ((x, y), value) in series.x.iter().zip(&series.y).zip(values) {
        let at = frame.at(panel, *x, *y);
        if let Some(level) =
            level(bar, *value).filter(|_| x.is_finite() && y.is_finite() && frame.holds(at))
        {
            // Two dots of one colour within half a pixel are one.
            if seen.insert((level, (2.0 * at.0) as i64, (2.0 * at.1) as i64)) {
                lists[level].push(at);
            }
        }
    }
    let full = lists
        .into_iter()
        .enumerate()
        .filter(|(_, list)| !list.is_empty());
    full.map(|(level, list)| (level_color(level), list))
        .collect()
}

/// Cells drawn along each axis at most.
const CELLS: usize = 600;
/// Pixels by which a cell reaches into its neighbours.
const OVERLAP: f64 = 0.4;

/// Neighbours of one colour in a row are one rectangle; one path per colour.
pub(super) fn draw_cells(scene: &mut Scene, frame: &Frame, panel: &Shown<'_>, raster: &Raster) {
    let raster = raster.thinned(CELLS);
    let (x, y, width) = (edges(&raster.x), edges(&raster.y), raster.x.len());
    let mut paths = vec![String::new(); raster.levels.len()];
    for (j, row) in raster.cells.chunks_exact(width.max(1)).enumerate() {
        let mut first = 0;
        while first < width {
            let same = row[first..].iter().take_while(|c| **c == row[first]);
            let end = first + same.count();
            if let Some(level) = row[first] {
                let (left, bottom) = frame.at(panel, x[first], y[j]);
                let (right, top) = frame.at(panel, x[end], y[j + 1]);
                let d = &mut paths[level];
                // Cells overlap, so that rounding leaves no seam between them.
                let (w, h) = (right - left + OVERLAP, bottom - top + OVERLAP);
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
        fill(scene, d, &level.color, None);
    }
    scene.add(Primitive::GroupEnd);
}

pub(super) fn draw_bar(scene: &mut Scene, sheet: &Sheet, frame: &Frame, bar: &ColorBar) {
    const WIDTH: f64 = 11.0;
    let left = frame.left + frame.width + 10.0;
    let step = frame.height / LEVELS as f64;
    for level in 0..LEVELS {
        let top = frame.top + frame.height - (level + 1) as f64 * step;
        let d = format!("M{left:.2} {top:.2}h{WIDTH}v{step:.2}h-{WIDTH}Z");
        let color = level_color(level);
        fill(scene, d, &color, Some(&color));
    }
    let font = f64::from(sheet.tick);
    let mut d = format!(
        "M{left:.2} {:.2}h{WIDTH}v{:.2}h-{WIDTH}Z",
        frame.top, frame.height
    );
    let mut widest = 0.0_f64;
    for tick in &bar.axis.ticks {
        let y = frame.top + (1.0 - bar.axis.share(tick.value)) * frame.height;
        let _ = write!(d, "M{:.2} {y:.2}h-3", left + WIDTH);
        let at = (left + WIDTH + 4.0, y + 0.36 * font);
        put_text(
            scene,
            at,
            &tick.text,
            TextStyle::level(sheet.tick, TextAnchor::Start),
        );
        widest = widest.max(text_width(&tick.text, font));
    }
    stroke(scene, d, "#000000", 0.9, None);
    let label = match bar.axis.exponent {
        0 => bar.label.clone(),
        power => format!("{} {}", bar.label, power_of_ten(power)),
    };
    let x = left + WIDTH + 6.0 + widest + f64::from(sheet.label);
    let style = TextStyle {
        rotate: Some(-90.0),
        ..TextStyle::level(sheet.label, TextAnchor::Middle)
    };
    let text = cut(&label, f64::from(sheet.label), frame.height + 40.0);
    put_text(scene, (x, frame.top + frame.height / 2.0), &text, style);
}
