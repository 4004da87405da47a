//! Strokes, dots, markers and texts of a static figure, as primitives of `kuva`.

use std::fmt::Write as _;

use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};

use super::legend::NEUTRAL;

/// Adds a path that is stroked and not filled; nothing when it is empty.
pub(super) fn stroke(scene: &mut Scene, d: String, color: &str, width: f64, dashes: Option<&str>) {
    if d.is_empty() {
        return;
    }
    scene.add(Primitive::Path(Box::new(PathData {
        d,
        fill: None,
        stroke: color.into(),
        stroke_width: width,
        opacity: None,
        stroke_dasharray: dashes.map(str::to_string),
    })));
}

/// Adds a path that is filled and not stroked; nothing when it is empty.
pub(super) fn fill(scene: &mut Scene, d: String, color: &str) {
    if d.is_empty() {
        return;
    }
    scene.add(Primitive::Path(Box::new(PathData {
        d,
        fill: Some(color.into()),
        stroke: "none".into(),
        stroke_width: 0.0,
        opacity: None,
        stroke_dasharray: None,
    })));
}

/// Round dots as strokes of no length: one path however many they are.
pub(super) fn dots(scene: &mut Scene, points: &[(f64, f64)], color: &str, size: f64) {
    let mut d = String::new();
    for (x, y) in points {
        let _ = write!(d, "M{x:.2} {y:.2}h0");
    }
    scene.add(Primitive::GroupStart {
        transform: None,
        title: None,
        extra_attrs: Some("stroke-linecap=\"round\"".to_string()),
    });
    stroke(scene, d, color, size, None);
    scene.add(Primitive::GroupEnd);
}

/// Diagonal crosses.
pub(super) fn crosses(scene: &mut Scene, points: &[(f64, f64)], color: &str) {
    let mut d = String::new();
    for (x, y) in points {
        let _ = write!(d, "M{:.2} {:.2}l6 6m0 -6l-6 6", x - 3.0, y - 3.0);
    }
    stroke(scene, d, color, 1.2, None);
}

/// Marker of an event: its own shape for each kind, with a white edge so that it stands out on a curve.
pub(super) fn marker(scene: &mut Scene, (x, y): (f64, f64), kind: &str) {
    let d = match kind {
        "fold" => format!("M{x:.2} {:.2}l5 9h-10Z", y - 5.5),
        "branch_point" => format!("M{:.2} {:.2}h8v8h-8Z", x - 4.0, y - 4.0),
        "period_doubling" => format!("M{x:.2} {:.2}l5.5 5.5l-5.5 5.5l-5.5 -5.5Z", y - 5.5),
        "neimark_sacker" => {
            let left = x - 4.6;
            format!("M{left:.2} {y:.2}a4.6 4.6 0 1 0 9.2 0a4.6 4.6 0 1 0 -9.2 0Z")
        }
        "grazing" => {
            let d = format!("M{x:.2} {:.2}v10M{:.2} {y:.2}h10", y - 5.0, x - 5.0);
            stroke(scene, d.clone(), "#ffffff", 3.6, None);
            return stroke(scene, d, NEUTRAL, 1.8, None);
        }
        _ => format!("M{x:.2} {:.2}l5 -9h-10Z", y + 5.5),
    };
    scene.add(Primitive::Path(Box::new(PathData {
        d,
        fill: Some(NEUTRAL.into()),
        stroke: "#ffffff".into(),
        stroke_width: 1.0,
        opacity: None,
        stroke_dasharray: None,
    })));
}

/// Where and how a text stands.
#[derive(Clone, Copy)]
pub(super) struct TextStyle {
    pub size: u32,
    pub anchor: TextAnchor,
    /// Degrees, clockwise.
    pub rotate: Option<f64>,
}

impl TextStyle {
    /// Level text.
    pub fn level(size: u32, anchor: TextAnchor) -> Self {
        TextStyle {
            size,
            anchor,
            rotate: None,
        }
    }
}

/// Adds a text with its baseline at this place.
pub(super) fn put_text(scene: &mut Scene, (x, y): (f64, f64), text: &str, style: TextStyle) {
    scene.add(Primitive::Text {
        x,
        y,
        // A dollar sign would start a formula.
        content: text.replace('$', "\\$"),
        size: style.size,
        anchor: style.anchor,
        rotate: style.rotate,
        bold: false,
        color: None,
    });
}
