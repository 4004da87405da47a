//! Wheels, axes, springs, clutches and ground as strokes.

use std::fmt::Write as _;

use kuva::render::render::{Scene, TextAnchor};

use super::layout::{Appearance, DrawnLink, Schematic, Shaft, Wheel};
use super::{FONT, Paper, link_name, short};
use crate::output::draw::{TextStyle, fill, put_text, stroke};
use crate::output::look::{NEUTRAL, PALETTE};
use crate::output::text::cut;
use crate::report::readable;

/// Half the width of a wheel, as a share of a slot.
const HALF: f64 = 0.15;

pub(super) fn axis(scene: &mut Scene, paper: &Paper, axis: &Shaft) {
    let (left, right, y) = (paper.x(axis.ends.0), paper.x(axis.ends.1), paper.y(axis.y));
    stroke(
        scene,
        format!("M{left:.2} {y:.2}H{right:.2}"),
        NEUTRAL,
        2.4,
        None,
    );
    if axis.slides {
        // Rollers of a sliding mass.
        let d = format!("M{left:.2} {:.2}H{right:.2}", y + 7.0);
        stroke(scene, d, NEUTRAL, 0.9, Some("2 2"));
    }
}

pub(super) fn wheel(scene: &mut Scene, paper: &Paper, wheel: &Wheel) {
    let (x, y) = (paper.x(wheel.slot), paper.y(wheel.y));
    let (half, radius) = (HALF * paper.slot, wheel.radius * paper.scale);
    let color = if wheel.is_to_scale {
        "#dfe5ec"
    } else {
        "#f3f3f3"
    };
    if wheel.is_ring {
        let rim = (0.08 * radius).max(4.0);
        for (a, b) in [
            (y - radius - rim, y - radius),
            (y + radius, y + radius + rim),
        ] {
            let d = format!(
                "M{:.2} {a:.2}h{:.2}V{b:.2}h{:.2}Z",
                x - half,
                2.0 * half,
                -2.0 * half
            );
            fill(scene, d.clone(), color, None);
            stroke(scene, d, NEUTRAL, 1.2, None);
        }
        // The web that joins the rim to the axis.
        let edge = x + half;
        let d = format!(
            "M{edge:.2} {:.2}V{:.2}M{edge:.2} {y:.2}H{x:.2}",
            y - radius - rim,
            y + radius + rim
        );
        return stroke(scene, d, NEUTRAL, 1.2, None);
    }
    let d = format!(
        "M{:.2} {:.2}h{:.2}v{:.2}h{:.2}Z",
        x - half,
        y - radius,
        2.0 * half,
        2.0 * radius,
        -2.0 * half
    );
    fill(scene, d.clone(), color, None);
    stroke(scene, d, NEUTRAL, 1.2, None);
    let cross = format!("M{:.2} {y:.2}h{:.2}", x - half, 2.0 * half);
    stroke(scene, cross, NEUTRAL, 0.8, Some("6 2 1 2"));
}

pub(super) fn link(scene: &mut Scene, paper: &Paper, link: &DrawnLink) {
    let (a, b) = (place(paper, link.from), place(paper, link.to));
    let half = HALF * paper.slot;
    match link.look {
        Appearance::Mesh => {}
        Appearance::FarMesh => {
            let d = format!("M{:.2} {:.2}L{:.2} {:.2}", a.0, a.1, b.0, b.1);
            stroke(scene, d, PALETTE[1], 1.2, Some("3 3"));
        }
        Appearance::Carrier => {
            let d = format!("M{:.2} {:.2}V{:.2}H{:.2}", a.0, a.1, b.1, b.0);
            stroke(scene, d, NEUTRAL, 2.4, None);
        }
        Appearance::Spring | Appearance::Clutch => {
            let (left, right) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            let (x, end) = (left.0 + half, right.0 - half);
            if (left.1 - right.1).abs() > 1.0 || end <= x {
                let d = format!("M{:.2} {:.2}L{:.2} {:.2}", a.0, a.1, b.0, b.1);
                return stroke(scene, d, PALETTE[0], 1.2, Some("3 3"));
            }
            match link.look {
                Appearance::Spring => spring(scene, (x, left.1), end),
                _ => clutch(scene, (x, left.1), end),
            }
        }
        Appearance::Ground if b.0 < a.0 => {
            spring(scene, (b.0 + 12.0, a.1), a.0 - half);
            ground(scene, (b.0 + 12.0, b.1), -6.0);
        }
        Appearance::Ground => {
            spring(scene, (a.0 + half, a.1), b.0 - 12.0);
            ground(scene, (b.0 - 12.0, b.1), 6.0);
        }
    }
}

fn place(paper: &Paper, (slot, y): (f64, f64)) -> (f64, f64) {
    (paper.x(slot), paper.y(y))
}

fn spring(scene: &mut Scene, (x, y): (f64, f64), end: f64) {
    let length = end - x;
    let (lead, teeth) = (0.18 * length, 6);
    let step = (length - 2.0 * lead) / f64::from(teeth);
    let mut d = format!("M{x:.2} {y:.2}h{lead:.2}");
    for k in 0..teeth {
        let side = if k % 2 == 0 { 5.0 } else { -5.0 };
        let _ = write!(
            d,
            "l{:.2} {:.2}l{:.2} {:.2}",
            0.5 * step,
            side,
            0.5 * step,
            -side
        );
    }
    let _ = write!(d, "h{lead:.2}");
    stroke(scene, d, PALETTE[0], 1.4, None);
}

fn clutch(scene: &mut Scene, (x, y): (f64, f64), end: f64) {
    let middle = 0.5 * (x + end);
    let d = format!(
        "M{x:.2} {y:.2}H{:.2}M{:.2} {:.2}v22M{:.2} {:.2}v22M{:.2} {y:.2}H{end:.2}",
        middle - 3.0,
        middle - 3.0,
        y - 11.0,
        middle + 3.0,
        y - 11.0,
        middle + 3.0
    );
    stroke(scene, d, PALETTE[0], 1.8, None);
}

fn ground(scene: &mut Scene, (x, y): (f64, f64), length: f64) {
    let mut d = format!("M{x:.2} {:.2}v28", y - 14.0);
    for k in 0..5 {
        let _ = write!(d, "M{x:.2} {:.2}l{length} 5", y - 14.0 + 6.0 * f64::from(k));
    }
    stroke(scene, d, NEUTRAL, 1.2, None);
}

/// Names of bodies at their wheels, with loads and speeds, and of connections at their places. Returns where they end.
pub(super) fn labels(scene: &mut Scene, paper: &Paper, layout: &Schematic) -> f64 {
    let font = f64::from(FONT);
    let mut lowest = 0.0_f64;
    for link in layout.links.iter().filter(|l| !l.name.is_empty()) {
        let (a, b) = (place(paper, link.from), place(paper, link.to));
        let half = HALF * paper.slot;
        let room = match link.look {
            Appearance::Mesh => paper.slot - 2.0 * half - 12.0,
            _ => 0.95 * paper.slot,
        };
        let name = cut(&link_name(link), font - 1.0, room);
        let (at, anchor) = match link.look {
            Appearance::Mesh => {
                // The two pairs of teeth that touch; apart where there is a gap.
                let gap = if link.has_gap { 1.6 } else { 0.0 };
                let d = format!(
                    "M{:.2} {:.2}h{:.2}M{:.2} {:.2}h{:.2}",
                    a.0 - half - 3.0,
                    a.1 - gap,
                    2.0 * half + 6.0,
                    a.0 - half - 3.0,
                    a.1 + gap,
                    2.0 * half + 6.0
                );
                stroke(scene, d, PALETTE[1], 1.3, None);
                ((a.0 + half + 6.0, a.1 + 4.0), TextAnchor::Start)
            }
            _ => {
                let middle = 0.5 * (a.0 + b.0);
                ((middle, 0.5 * (a.1 + b.1) - 15.0), TextAnchor::Middle)
            }
        };
        put_text(scene, at, &name, TextStyle::level(FONT - 1, anchor));
    }
    for (body, name) in layout.names.iter().enumerate() {
        let own = layout.wheels.iter().filter(|w| w.body == body);
        let Some(wheel) = own.min_by(|a, b| a.slot.total_cmp(&b.slot)) else {
            continue;
        };
        let (x, y) = (paper.x(wheel.slot), paper.y(wheel.y));
        let half = HALF * paper.slot;
        let name = cut(&readable(name), font, paper.slot * 0.9);
        // Wheels are stacked: their names are beside them. Others have springs beside them.
        let reach = wheel.radius * paper.scale;
        let (place, anchor, below) = match wheel.is_to_scale {
            // A ring has its name at its rim: others turn about the same axis.
            true if wheel.is_ring => ((x - half - 5.0, y - reach), TextAnchor::End, y - reach),
            true => ((x - half - 5.0, y - 5.0), TextAnchor::End, y),
            false => ((x, y - reach - 5.0), TextAnchor::Middle, y + reach),
        };
        let style = TextStyle {
            bold: true,
            ..TextStyle::level(FONT, anchor)
        };
        put_text(scene, place, &name, style);
        let end = load(scene, layout, body, ((place.0, below), anchor));
        lowest = lowest.max(end);
    }
    lowest
}

/// Speed and loads of a body in words, from a height downward. Returns where they end.
fn load(
    scene: &mut Scene,
    layout: &Schematic,
    body: usize,
    ((x, y), anchor): ((f64, f64), TextAnchor),
) -> f64 {
    let note = &layout.bodies[body];
    let size = FONT - 2;
    let mut line = y + 3.0;
    let mut put = |text: &str| {
        line += f64::from(size) * 1.25;
        put_text(scene, (x, line), text, TextStyle::level(size, anchor));
    };
    if let Some(speed) = note.speed_rpm {
        put(&format!("{} rpm", short(speed)));
    }
    let mean = note.loads.iter().find(|l| l.starts_with("mean"));
    let is_steady = |l: &&String| l.starts_with("mean") || l.starts_with("drag");
    match (mean, note.loads.iter().all(|l| is_steady(&l))) {
        (Some(mean), true) => put(&format!("T = {}", mean.trim_start_matches("mean "))),
        (Some(mean), false) => put(&format!("T = {} + T(t)", mean.trim_start_matches("mean "))),
        (None, false) => put("T(t)"),
        (None, true) => {}
    }
    line
}
