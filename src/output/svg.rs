//! Static figures: panels in rows, legend and list of events below, in the widths and sizes of type of a journal.
//!
//! The drawing primitives and the SVG text come from `kuva`; the page layout is our own, because kuva's numbers its clip
//! paths over the life of the process (the same input would not give the same bytes) and its legend shows no dashes.

use kuva::backend::svg::SvgBackend;
use kuva::render::render::{Scene, TextAnchor};

use super::arrange::arranged;
use super::draw::{TextStyle, put_text};
use super::groups::{self, EventGroup};
use super::legend;
use super::panel::{Frame, draw_panel};
use super::room::Room;
use super::sheet::{GAP, LINE_HEIGHT, Sheet};
use super::shown::{Shown, is_shared, shown};
use super::text::{text_width, wrapped};
use crate::error::Error;
use crate::report::{Figure, Report};

const FONTS: &str = "DejaVu Sans, Verdana, Arial, Helvetica, sans-serif";
/// Right of a panel, for the half of its last tick text.
const RIGHT: f64 = 14.0;
/// Below a panel without ticks of its own.
const CLOSE: f64 = 10.0;
/// Room of a colour bar with its ticks and its label.
pub(super) const BAR: f64 = 78.0;

/// The figure as an SVG document; the same input gives the same bytes.
///
/// # Errors
///
/// `Error::Input` when a curve names a table or column that the report does not have, or `plot` asks for what it cannot show.
pub fn render(figure: &Figure, report: &Report) -> Result<String, Error> {
    let arranged = arranged(figure, report)?;
    Ok(document(&scene(&arranged, report)?))
}

/// A scene as an SVG document.
pub(super) fn document(scene: &Scene) -> String {
    let svg = SvgBackend::new().render_scene(scene);
    // A view box lets pages and papers scale the figure.
    let (width, height) = size(&svg).unwrap_or((scene.width, scene.height));
    let head = format!("<svg viewBox=\"0 0 {width} {height}\" ");
    crate::report::shown(&svg.replacen("<svg ", &head, 1)).into_owned()
}

fn size(svg: &str) -> Option<(f64, f64)> {
    let number = |key: &str| {
        let rest = &svg[svg.find(key)? + key.len()..];
        rest[..rest.find('"')?].parse().ok()
    };
    Some((number(" width=\"")?, number(" height=\"")?))
}

/// An empty scene in the type of the figures.
pub(super) fn empty(width: f64, height: f64) -> Scene {
    let mut scene = Scene::new(width, height);
    scene.font_family = Some(FONTS.to_string());
    scene.text_color = Some("#000000".to_string());
    scene
}

/// The figure as drawing primitives.
fn scene(figure: &Figure, report: &Report) -> Result<Scene, Error> {
    let panels = shown(figure, report)?;
    let sheet = Sheet::new(report.plot.size.unwrap_or_default(), panels.len());
    let mut scene = empty(sheet.width, sheet.width);
    let top = title(&mut scene, &sheet, &figure.title);
    let (frames, bottom) = frames(&sheet, &panels, top);
    let groups = groups::of(&panels, &frames);
    for (index, (panel, frame)) in panels.iter().zip(&frames).enumerate() {
        draw_panel(&mut scene, &sheet, frame, panel, index);
        groups::draw(&mut scene, &sheet, frame, panel, &groups);
    }
    let write = |scene: &mut Scene, mut room: Room| {
        legend::draw(scene, &sheet, &panels, &groups, &mut room);
        list_events(scene, &sheet, &groups, &mut room);
        room.top
    };
    let free =
        Room::free(&sheet, &frames).filter(|room| write(&mut empty(1.0, 1.0), *room) <= bottom);
    let end = write(
        &mut scene,
        free.unwrap_or(Room::below(&sheet, &frames, bottom)),
    );
    scene.height = end.max(bottom).round();
    Ok(scene)
}

fn title(scene: &mut Scene, sheet: &Sheet, text: &str) -> f64 {
    let mut top = 5.0;
    if text.trim().is_empty() {
        return top;
    }
    let font = f64::from(sheet.title);
    for line in wrapped(text, font, sheet.width - 2.0 * GAP) {
        top += font * LINE_HEIGHT;
        let at = (sheet.width / 2.0, top - 3.0);
        put_text(
            scene,
            at,
            &line,
            TextStyle::level(sheet.title, TextAnchor::Middle),
        );
    }
    top + 5.0
}

/// Places of the panels, and where they end. Ticks of a shared abscissa are written below the lowest panel of each column only.
fn frames(sheet: &Sheet, panels: &[Shown<'_>], mut top: f64) -> (Vec<Frame>, f64) {
    let left = left_margin(sheet, panels);
    let has_bar = panels.iter().any(|p| p.bar.is_some());
    let right = if has_bar { BAR } else { RIGHT };
    let columns = sheet.columns.min(panels.len()).max(1);
    let cell = (sheet.width - GAP) / columns as f64;
    let is_shared = is_shared(panels);
    let names = panels.iter().map(|p| match p.panel.y_range {
        None if p.y.ticks.len() > 12 => p.y.ticks.len() as f64 * f64::from(sheet.tick) * 1.5,
        _ => 0.0,
    });
    let height = names.fold(sheet.height, f64::max);
    let mut frames = Vec::new();
    for (row, list) in panels.chunks(columns).enumerate() {
        let headed = list
            .iter()
            .any(|p| !p.panel.heading.is_empty() || p.y.exponent != 0);
        top += if headed {
            f64::from(sheet.label) * 1.5
        } else {
            GAP
        };
        for column in 0..list.len() {
            let is_lowest = (row + 1) * columns + column >= panels.len();
            frames.push(Frame {
                left: column as f64 * cell + left,
                top,
                width: cell - left - right,
                height,
                has_x_texts: is_lowest || !is_shared,
            });
        }
        // Ticks of a shared abscissa stand below the lowest panels, where no other one follows.
        let is_last = (row + 1) * columns >= panels.len();
        top += height
            + match is_last || !is_shared {
                true => sheet.texts() + GAP,
                false => CLOSE,
            };
    }
    (frames, top)
}

/// Room for the widest tick text and the ordinate's label, the same for all panels.
fn left_margin(sheet: &Sheet, panels: &[Shown<'_>]) -> f64 {
    let ticks = panels.iter().flat_map(|p| &p.y.ticks);
    let widest = ticks.map(|t| text_width(&t.text, f64::from(sheet.tick)));
    let label = f64::from(sheet.label);
    let lines = panels
        .iter()
        .map(|p| wrapped(&p.y_label, label, sheet.height).len());
    let lines = lines.max().unwrap_or(1) as f64;
    let most = 0.4 * sheet.width / sheet.columns.min(panels.len()).max(1) as f64;
    (widest.fold(14.0, f64::max) + 14.0).min(most) + lines * label * LINE_HEIGHT
}

/// What the numbers at the events mean, in columns.
fn list_events(scene: &mut Scene, sheet: &Sheet, groups: &[EventGroup], room: &mut Room) {
    let lines = groups::lines(groups);
    if lines.is_empty() {
        return;
    }
    let size = sheet.tick - 1;
    let font = f64::from(size);
    let widest = lines
        .iter()
        .map(|line| text_width(line, font))
        .fold(0.0, f64::max)
        + 14.0;
    let columns = ((room.width / widest) as usize).clamp(1, lines.len());
    let rows = lines.len().div_ceil(columns);
    room.top += 4.0;
    for (k, line) in lines.iter().enumerate() {
        // Column by column, so that the numbers run down.
        let x = room.left + (k / rows) as f64 * room.width / columns as f64;
        let y = room.top + (k % rows + 1) as f64 * font * LINE_HEIGHT;
        put_text(
            scene,
            (x, y),
            line,
            TextStyle::level(size, TextAnchor::Start),
        );
    }
    room.top += rows as f64 * font * LINE_HEIGHT + GAP;
}
