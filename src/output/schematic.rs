//! A drawing of a train: wheels to scale on their axes, seen from the side; meshes, shafts, clutches, ground, loads, speeds.

mod layout;
mod parts;

use kuva::render::render::{Scene, TextAnchor};

use super::draw::{TextStyle, put_text, stroke};
use super::svg::{document, empty};
use super::text::{text_width, wrapped};
use super::units::pretty;
use crate::report::{Description, readable};
use layout::{DrawnLink, Schematic};

/// Width of the drawing in pixels, 178 mm.
const WIDTH: f64 = 673.0;
/// Height of the train in pixels.
const HEIGHT: f64 = 330.0;
/// Room for the texts at the left and right.
const MARGIN: f64 = 40.0;
/// Type of the texts.
const FONT: u32 = 11;

/// Places on the paper.
struct Paper {
    /// Pixels per metre.
    scale: f64,
    /// Pixels per slot.
    slot: f64,
    left: f64,
    /// Ordinate of the highest point, m.
    high: f64,
    top: f64,
}

impl Paper {
    fn x(&self, slot: f64) -> f64 {
        self.left + (slot + 0.5) * self.slot
    }

    fn y(&self, metres: f64) -> f64 {
        self.top + (self.high - metres) * self.scale
    }
}

/// The train as an SVG document; `None` for a model without bodies.
pub fn render(model: &Description) -> Option<String> {
    if model.bodies.is_empty() {
        return None;
    }
    let layout = Schematic::of(model);
    let mut scene = empty(WIDTH, WIDTH);
    let mut top = 6.0;
    for line in wrapped(&readable(&model.name), 14.0, WIDTH - 20.0) {
        top += 18.0;
        let style = TextStyle::level(14, TextAnchor::Middle);
        put_text(&mut scene, (WIDTH / 2.0, top), &line, style);
    }
    let paper = paper(&layout, top + 34.0);
    for link in &layout.links {
        parts::link(&mut scene, &paper, link);
    }
    for axis in &layout.axes {
        parts::axis(&mut scene, &paper, axis);
    }
    for wheel in &layout.wheels {
        parts::wheel(&mut scene, &paper, wheel);
    }
    let names = parts::labels(&mut scene, &paper, &layout);
    let mut bottom = names.max(paper.y(layout.low)) + 24.0;
    if layout.wheels.iter().any(|w| w.is_to_scale) {
        scale_bar(&mut scene, &paper, bottom);
        bottom += 22.0;
    }
    bottom = list(&mut scene, model, bottom);
    scene.height = (bottom + 8.0).round();
    Some(document(&scene))
}

fn paper(layout: &Schematic, top: f64) -> Paper {
    let height = (layout.high - layout.low).max(1e-9);
    let slots = layout.slots.max(1) as f64;
    Paper {
        scale: HEIGHT / height,
        slot: ((WIDTH - 2.0 * MARGIN) / slots).min(150.0),
        left: (WIDTH - ((WIDTH - 2.0 * MARGIN) / slots).min(150.0) * slots) / 2.0,
        high: layout.high,
        top,
    }
}

/// A length with a round number of millimetres.
fn scale_bar(scene: &mut Scene, paper: &Paper, y: f64) {
    let longest = 0.25 * WIDTH / paper.scale * 1e3;
    let power = 10f64.powf(longest.log10().floor());
    let millimetres = [5.0, 2.0, 1.0]
        .into_iter()
        .map(|f| f * power)
        .find(|m| *m <= longest);
    let millimetres = millimetres.unwrap_or(power);
    let length = millimetres * 1e-3 * paper.scale;
    let d = format!("M{MARGIN:.2} {y:.2}v-3v6v-3h{length:.2}v-3v6");
    stroke(scene, d, "#000000", 1.0, None);
    let text = format!("{millimetres} mm");
    let style = TextStyle::level(FONT - 1, TextAnchor::Start);
    put_text(scene, (MARGIN + length + 8.0, y + 4.0), &text, style);
}

/// Bodies and connections with their numbers, in two columns.
fn list(scene: &mut Scene, model: &Description, top: f64) -> f64 {
    let half = WIDTH / 2.0 - MARGIN + 10.0;
    let bodies = model.bodies.iter().map(|body| {
        let speed = body.speed_rpm.map(|rpm| format!("{} rpm", short(rpm)));
        let parts = [body.inertia.clone()]
            .into_iter()
            .chain(speed)
            .chain(body.loads.iter().cloned());
        (readable(&body.name), parts.collect::<Vec<_>>().join(", "))
    });
    let connections = model.connections.iter().map(|c| {
        let parts = [&c.stiffness, &c.law, &c.parameters, &c.further];
        let parts: Vec<&str> = parts
            .into_iter()
            .map(String::as_str)
            .filter(|t| !t.is_empty())
            .collect();
        (readable(&c.name), parts.join(", "))
    });
    let left = column(scene, bodies, (MARGIN - 20.0, top), half);
    let right = column(scene, connections, (WIDTH / 2.0 + 6.0, top), half);
    left.max(right)
}

fn column(
    scene: &mut Scene,
    entries: impl Iterator<Item = (String, String)>,
    (x, mut y): (f64, f64),
    width: f64,
) -> f64 {
    let font = f64::from(FONT - 1);
    for (name, text) in entries {
        let indent = (text_width(&name, font) * 1.1 + 8.0).min(0.5 * width);
        let style = TextStyle {
            bold: true,
            ..TextStyle::level(FONT - 1, TextAnchor::Start)
        };
        put_text(
            scene,
            (x, y + 1.3 * font),
            &super::text::cut(&name, font, 0.5 * width),
            style,
        );
        for line in wrapped(&pretty(&text), font, width - indent) {
            y += font * 1.3;
            put_text(
                scene,
                (x + indent, y),
                &line,
                TextStyle::level(FONT - 1, TextAnchor::Start),
            );
        }
        y += if text.is_empty() { font * 1.5 } else { 4.0 };
    }
    y
}

/// Five significant digits without zeros at the end.
pub(super) fn short(x: f64) -> String {
    let text = format!("{x:.4e}");
    text.parse::<f64>()
        .map_or(text, |rounded| rounded.to_string().replace('-', "\u{2212}"))
}

/// What a link is called on the drawing.
fn link_name(link: &DrawnLink) -> String {
    readable(&link.name)
}
