//! Strokes, dots, markers and texts of a static figure, as primitives of `kuva`.

use std::fmt::Write as _;

use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};

use super::look::{Mark, NEUTRAL};

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

/// Round dots as strokes of next to no length: one path however many they are. A path without any length would not be drawn
/// by readers of SVG that look at its box.
pub(super) fn dots(scene: &mut Scene, points: &[(f64, f64)], color: &str, size: f64) {
    let mut d = String::new();
    for (x, y) in points {
        let _ = write!(d, "M{x:.2} {y:.2}h.01");
    }
    scene.add(Primitive::GroupStart {
        transform: None,
        title: None,
        extra_attrs: Some("stroke-linecap=\"round\"".to_string()),
    });
    stroke(scene, d, color, size, None);
    scene.add(Primitive::GroupEnd);
}

/// Small diagonal crosses.
pub(super) fn crosses(scene: &mut Scene, points: &[(f64, f64)], color: &str) {
    let mut d = String::new();
    for (x, y) in points {
        let _ = write!(d, "M{:.2} {:.2}l4 4m0 -4l-4 4", x - 2.0, y - 2.0);
    }
    stroke(scene, d, color, 0.8, None);
}

/// Adds a path that is filled, with an edge if it has a colour; nothing when it is empty.
pub(super) fn fill(scene: &mut Scene, d: String, color: &str, edge: Option<&str>) {
    if d.is_empty() {
        return;
    }
    scene.add(Primitive::Path(Box::new(PathData {
        d,
        fill: Some(color.into()),
        stroke: edge.unwrap_or(color).into(),
        stroke_width: if edge.is_some() { 0.6 } else { 0.0 },
        opacity: None,
        stroke_dasharray: None,
    })));
}

/// Open marks on a curve, white inside.
pub(super) fn marks(scene: &mut Scene, points: &[(f64, f64)], mark: Mark, color: &str) {
    let mut d = String::new();
    for (x, y) in points {
        let _ = match mark {
            Mark::None => return,
            Mark::Circle => write!(
                d,
                "M{:.2} {y:.2}a2.6 2.6 0 1 0 5.2 0a2.6 2.6 0 1 0 -5.2 0Z",
                x - 2.6
            ),
            Mark::Square => write!(d, "M{:.2} {:.2}h4.6v4.6h-4.6Z", x - 2.3, y - 2.3),
        };
    }
    if d.is_empty() {
        return;
    }
    scene.add(Primitive::Path(Box::new(PathData {
        d,
        fill: Some("#ffffff".into()),
        stroke: color.into(),
        stroke_width: 1.0,
        opacity: None,
        stroke_dasharray: None,
    })));
}

/// Marker of an event: small, its own shape for each kind, with a white edge so that it stands out on a curve.
pub(super) fn marker(scene: &mut Scene, (x, y): (f64, f64), kind: &str) {
    let d = match kind {
        "fold" => format!("M{x:.2} {:.2}l3.4 6h-6.8Z", y - 3.8),
        "branch_point" => format!("M{:.2} {:.2}h5.4v5.4h-5.4Z", x - 2.7, y - 2.7),
        "period_doubling" => format!("M{x:.2} {:.2}l3.7 3.7l-3.7 3.7l-3.7 -3.7Z", y - 3.7),
        "neimark_sacker" => {
            let left = x - 3.0;
            format!("M{left:.2} {y:.2}a3 3 0 1 0 6 0a3 3 0 1 0 -6 0Z")
        }
        "grazing" => {
            let d = format!("M{x:.2} {:.2}v7M{:.2} {y:.2}h7", y - 3.5, x - 3.5);
            stroke(scene, d.clone(), "#ffffff", 2.8, None);
            return stroke(scene, d, NEUTRAL, 1.2, None);
        }
        super::groups::SEVERAL => format!(
            "M{x:.2} {:.2}l1.4 2.6l3 .4l-2.1 2.1l.5 3l-2.8 -1.4l-2.8 1.4l.5 -3l-2.1 -2.1l3 -.4Z",
            y - 4.4
        ),
        "cusp" => format!("M{:.2} {:.2}h7.2l-3.6 6.4Z", x - 3.6, y - 2.2),
        "fold_flip" => format!("M{:.2} {:.2}h6.4l-6.4 6.4h6.4Z", x - 3.2, y - 3.2),
        "turning_1" => format!("M{:.2} {y:.2}l6 -3.4v6.8Z", x - 3.8),
        "turning_2" => format!("M{:.2} {y:.2}l-6 -3.4v6.8Z", x + 3.8),
        "meets_grazing" => format!(
            "M{:.2} {:.2}h2.2v2.4h2.4v2.2h-2.4v2.4h-2.2v-2.4h-2.4v-2.2h2.4Z",
            x - 1.1,
            y - 3.5
        ),
        kind if kind.starts_with("generalised") => {
            format!("M{x:.2} {:.2}l3.7 2.7l-1.4 4.4h-4.6l-1.4 -4.4Z", y - 3.9)
        }
        kind if kind.starts_with("resonance") => format!(
            "M{:.2} {y:.2}a3.4 3.4 0 1 0 6.8 0a3.4 3.4 0 1 0 -6.8 0ZM{:.2} {y:.2}a1.7 1.7 0 1 1 3.4 0a1.7 1.7 0 1 1 -3.4 0Z",
            x - 3.4,
            x - 1.7
        ),
        _ => format!("M{x:.2} {:.2}l3.4 -6h-6.8Z", y + 3.8),
    };
    scene.add(Primitive::Path(Box::new(PathData {
        d,
        fill: Some(NEUTRAL.into()),
        stroke: "#ffffff".into(),
        stroke_width: 0.8,
        opacity: None,
        stroke_dasharray: None,
    })));
}

/// Position and alignment of a text.
#[derive(Clone, Copy)]
pub(super) struct TextStyle {
    pub size: u32,
    pub anchor: TextAnchor,
    /// Degrees, clockwise.
    pub rotate: Option<f64>,
    pub bold: bool,
}

impl TextStyle {
    /// Level text.
    pub fn level(size: u32, anchor: TextAnchor) -> Self {
        TextStyle {
            size,
            anchor,
            rotate: None,
            bold: false,
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
        bold: style.bold,
        color: None,
    });
}
