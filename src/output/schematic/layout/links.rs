//! Connections on the drawing, once all wheels have their places.

use super::{Appearance, DrawnLink, Schematic, Wheel, is_mesh};
use crate::report::ConnectionNote;

/// How a link looks, and its ends.
type Drawn = (Appearance, (f64, f64), (f64, f64));

/// Laws of clutches and of what slips.
const CLUTCHES: [&str; 3] = ["clutch", "jenkins", "tanh_friction"];

impl Schematic {
    /// Adds what a connection looks like.
    pub(super) fn join(&mut self, connection: &ConnectionNote) {
        let arms: Vec<(usize, f64)> = (connection.arms.iter())
            .filter_map(|arm| Some((self.index(&arm.body)?, arm.length)))
            .collect();
        let links = match arms.as_slice() {
            [] => Vec::new(),
            [(body, _)] => vec![self.ground(*body)],
            [a, b, rest @ ..] if is_mesh(connection) => {
                let mut links = self.mesh(*a, *b);
                let carrier = rest
                    .first()
                    .and_then(|(carrier, _)| self.carrier(*carrier, b.0));
                links.extend(carrier);
                links
            }
            [(a, _), others @ ..] => {
                let look = match CLUTCHES.contains(&connection.law.as_str()) {
                    true => Appearance::Clutch,
                    false => Appearance::Spring,
                };
                let joined = others.iter().filter_map(|(b, _)| self.beside(*a, *b));
                joined.map(|(from, to)| (look, from, to)).collect()
            }
        };
        let has_gap = connection.parameters.contains("gap") || connection.law == "preloaded";
        for (look, from, to) in links {
            let name = match look {
                Appearance::Carrier => String::new(),
                _ => connection.name.clone(),
            };
            let link = DrawnLink {
                name,
                look,
                from,
                to,
                has_gap,
            };
            // Several meshes of one planet have one carrier.
            if look != Appearance::Carrier
                || !self.links.contains(&DrawnLink {
                    has_gap: !has_gap,
                    ..link.clone()
                })
            {
                self.links.push(link);
            }
        }
    }

    /// Ground at the left end of a body's axis, or at the right end if the left is occupied.
    fn ground(&self, body: usize) -> Drawn {
        let y = self.heights.get(&body).copied().unwrap_or(0.0);
        let own = self
            .wheels
            .iter()
            .filter(|w| w.body == body)
            .map(|w| w.slot);
        let left = own.fold(f64::INFINITY, f64::min);
        let is_free = (self.wheels.iter()).all(|w| w.slot >= left || (w.y - y).abs() > w.radius);
        match is_free && left.is_finite() {
            true => (Appearance::Ground, (left, y), (left - 1.0, y)),
            false => {
                let right = self.slot_of(body) as f64;
                (Appearance::Ground, (right, y), (right + 1.0, y))
            }
        }
    }

    fn mesh(&mut self, a: (usize, f64), b: (usize, f64)) -> Vec<Drawn> {
        self.complete_mesh(a, b);
        let fitting = |(body, arm): (usize, f64)| {
            let radius = arm.abs();
            let own = self.wheels.iter().filter(move |w| w.body == body);
            own.filter(move |w| (w.radius - radius).abs() < 0.02 * radius)
        };
        let pairs = fitting(a).flat_map(|one| fitting(b).map(move |other| (one, other)));
        let touching = pairs.filter(|(one, other)| one.slot == other.slot);
        let contact = touching
            .filter_map(|(one, other)| Some((one.slot, contact(one, other)?)))
            .next();
        match (contact, self.beside(a.0, b.0)) {
            (Some(place), _) => vec![(Appearance::Mesh, place, place)],
            (None, Some((from, to))) => vec![(Appearance::FarMesh, from, to)],
            (None, None) => Vec::new(),
        }
    }

    /// A second wheel of a body whose axis is where this mesh needs it, as of a ring around several planets.
    fn complete_mesh(&mut self, a: (usize, f64), b: (usize, f64)) {
        for ((own, arm), (other, reach)) in [(a, b), (b, a)] {
            let apart = (self.heights[&own] - self.heights[&other]).abs();
            let is_ring = arm.abs() > reach.abs();
            let distance = (arm.abs() - reach.abs()).abs();
            if (apart - distance).abs() > 0.02 * distance || !is_ring {
                continue;
            }
            let slots: Vec<i64> = (self.wheels.iter())
                .filter(|w| w.body == other && (w.radius - reach.abs()).abs() < 0.02 * reach.abs())
                .map(|w| w.slot as i64)
                .collect();
            if !slots
                .iter()
                .any(|slot| self.wheel_at(own, *slot, arm.abs()))
                && let Some(slot) = slots.first()
            {
                self.put(own, *slot, arm.abs(), true);
            }
        }
    }

    fn carrier(&self, carrier: usize, planet: usize) -> Option<Drawn> {
        let ((from, y), (to, other)) = self.beside(carrier, planet)?;
        Some((Appearance::Carrier, (from, y), (to, other)))
    }

    /// The nearest wheels of two bodies.
    fn beside(&self, a: usize, b: usize) -> Option<((f64, f64), (f64, f64))> {
        let of = |body: usize| self.wheels.iter().filter(move |w| w.body == body);
        let pairs = of(a).flat_map(|one| of(b).map(move |other| (one, other)));
        let gap = |(one, other): &(&Wheel, &Wheel)| (one.slot - other.slot).abs();
        let (one, other) = pairs.min_by(|p, q| gap(p).total_cmp(&gap(q)))?;
        Some(((one.slot, one.y), (other.slot, other.y)))
    }
}

/// Height at which two wheels in one slot touch.
fn contact(one: &Wheel, other: &Wheel) -> Option<f64> {
    let apart = (one.y - other.y).abs();
    let touches = |distance: f64| (apart - distance).abs() < 0.02 * (one.radius + other.radius);
    let (small, large) = if one.radius < other.radius {
        (one, other)
    } else {
        (other, one)
    };
    let away = if small.y >= large.y { 1.0 } else { -1.0 };
    if large.is_ring && touches(large.radius - small.radius) {
        Some(small.y + away * small.radius)
    } else if touches(one.radius + other.radius) {
        Some(small.y - away * small.radius)
    } else {
        None
    }
}
