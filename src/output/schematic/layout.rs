//! Positions of the parts of a train: axes by height, wheels in slots along them.

mod links;

use std::collections::hash_map::Entry;
use std::collections::{HashMap, VecDeque};

use crate::report::{BodyNote, ConnectionNote, Description};

/// A wheel of a body.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wheel {
    pub body: usize,
    pub slot: f64,
    /// Height of its axis, m.
    pub y: f64,
    /// m.
    pub radius: f64,
    /// A ring with inner teeth.
    pub is_ring: bool,
    /// Whether the radius is that of the model, not a picture of an inertia.
    pub is_to_scale: bool,
}

/// The axis of a body.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shaft {
    pub y: f64,
    /// Slots at its ends.
    pub ends: (f64, f64),
    pub slides: bool,
}

/// Appearance of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Appearance {
    /// Teeth that touch.
    Mesh,
    /// A mesh of wheels that the drawing keeps apart.
    FarMesh,
    Spring,
    Clutch,
    Ground,
    /// The arm of a carrier.
    Carrier,
}

/// A connection on the drawing.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DrawnLink {
    pub name: String,
    pub look: Appearance,
    pub from: (f64, f64),
    pub to: (f64, f64),
    /// Whether it has a gap.
    pub has_gap: bool,
}

#[derive(Debug, Default)]
pub(super) struct Schematic {
    pub names: Vec<String>,
    pub bodies: Vec<BodyNote>,
    pub wheels: Vec<Wheel>,
    pub axes: Vec<Shaft>,
    pub links: Vec<DrawnLink>,
    pub slots: usize,
    pub low: f64,
    pub high: f64,
    heights: HashMap<usize, f64>,
    /// Radius of a body that has no wheel, m.
    usual: f64,
}

/// Slots searched on either side.
const REACH: i64 = 60;

impl Schematic {
    /// Places every body, one part of the train after another.
    pub fn of(model: &Description) -> Schematic {
        let wheels = model
            .connections
            .iter()
            .filter(|c| is_mesh(c))
            .flat_map(|c| &c.arms);
        let largest = wheels.map(|arm| arm.length.abs()).fold(0.0, f64::max);
        let mut layout = Schematic {
            names: model.bodies.iter().map(|b| b.name.clone()).collect(),
            bodies: model.bodies.clone(),
            usual: if largest > 0.0 { 0.45 * largest } else { 0.05 },
            ..Schematic::default()
        };
        for start in 0..model.bodies.len() {
            if let Entry::Vacant(place) = layout.heights.entry(start) {
                place.insert(0.0);
                layout.spread(start, &model.connections);
            }
        }
        layout.complete();
        for connection in &model.connections {
            layout.join(connection);
        }
        layout.finish();
        layout
    }

    fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Places everything that hangs together with a body.
    fn spread(&mut self, start: usize, connections: &[ConnectionNote]) {
        let mut queue = VecDeque::from([start]);
        while let Some(body) = queue.pop_front() {
            for connection in connections {
                let arms: Vec<(usize, f64)> = (connection.arms.iter())
                    .filter_map(|arm| Some((self.index(&arm.body)?, arm.length)))
                    .collect();
                let Some(own) = arms.iter().find(|(b, _)| *b == body) else {
                    continue;
                };
                for other in arms.iter().filter(|(b, _)| *b != body) {
                    if !self.heights.contains_key(&other.0) {
                        self.place(connection, *own, *other);
                        queue.push_back(other.0);
                    }
                }
            }
        }
    }

    fn place(&mut self, connection: &ConnectionNote, own: (usize, f64), other: (usize, f64)) {
        let y = self.heights[&own.0];
        let is_carrier = connection.arms.len() == 3
            && (connection.arms.last()).is_some_and(|arm| self.index(&arm.body) == Some(other.0));
        if !is_mesh(connection) || is_carrier {
            return self.place_beside(own.0, other.0, y);
        }
        let (a, b) = (own.1.abs(), other.1.abs());
        let is_internal = is_internal(connection);
        let distance = if is_internal { (a - b).abs() } else { a + b };
        let start = self.slot_of(own.0);
        for k in 0..REACH {
            // Outward from the body's own wheels, to the right first.
            let slot = start + if k % 2 == 1 { (k + 1) / 2 } else { -(k / 2) };
            // A ring surrounds the parts that already turn there.
            let is_taken = |side: &f64| {
                let place = y + side * distance;
                self.heights
                    .values()
                    .any(|h| (h - place).abs() < 0.01 * distance)
            };
            let sides = match is_internal && is_taken(&1.0) {
                true => [1.0, -1.0],
                false => [-1.0, 1.0],
            };
            for side in sides {
                let place = y + side * distance;
                let has_own = self.wheel_at(own.0, slot, a);
                let is_free = (has_own || self.is_free(slot, y, a, own.0))
                    && (is_internal || self.is_free(slot, place, b, other.0));
                if is_free {
                    self.heights.insert(other.0, place);
                    self.put(own.0, slot, a, is_internal && a > b);
                    self.put(other.0, slot, b, is_internal && b > a);
                    return;
                }
            }
        }
    }

    /// A body on the same axis, with room for what joins the two.
    fn place_beside(&mut self, own: usize, other: usize, y: f64) {
        let start = self.slot_of(own);
        // The slot before it holds the spring.
        let free = |slot: &i64| {
            self.is_free(*slot, y, self.usual, other) && self.is_free(slot - 1, y, 0.0, own)
        };
        let right = (start + 2..start + REACH).find(free);
        self.heights.insert(other, y);
        self.put(other, right.unwrap_or(start + 2), 0.0, false);
    }

    /// Slot of the outermost wheel of a body.
    fn slot_of(&self, body: usize) -> i64 {
        let own = self.wheels.iter().filter(|w| w.body == body);
        own.map(|w| w.slot as i64).max().unwrap_or(0)
    }

    fn wheel_at(&self, body: usize, slot: i64, radius: f64) -> bool {
        self.wheels.iter().any(|w| {
            w.body == body && w.slot == slot as f64 && (w.radius - radius).abs() < 0.02 * radius
        })
    }

    fn is_free(&self, slot: i64, y: f64, radius: f64, body: usize) -> bool {
        let clear = 0.02 * self.usual;
        self.wheels
            .iter()
            .filter(|w| w.slot == slot as f64)
            .all(|w| {
                let apart = (w.y - y).abs();
                w.is_ring && apart + radius < w.radius
                    || apart >= w.radius + radius - clear
                    || (w.body == body && w.radius == radius)
            })
    }

    fn put(&mut self, body: usize, slot: i64, radius: f64, is_ring: bool) {
        if self.wheel_at(body, slot, radius) {
            return;
        }
        let y = self.heights[&body];
        let is_to_scale = radius > 0.0;
        self.wheels.push(Wheel {
            body,
            slot: slot as f64,
            y,
            radius: if is_to_scale { radius } else { self.usual },
            is_ring,
            is_to_scale,
        });
    }

    /// A picture for each body that has no wheel.
    fn complete(&mut self) {
        for body in 0..self.names.len() {
            if self.wheels.iter().all(|w| w.body != body) {
                let y = self.heights.get(&body).copied().unwrap_or(0.0);
                let slot = (0..REACH).find(|slot| self.is_free(*slot, y, self.usual, body));
                self.put(body, slot.unwrap_or(0), 0.0, false);
            }
        }
    }

    /// Axes, and the extent of the drawing from slot 0.
    fn finish(&mut self) {
        let slots = self.wheels.iter().map(|w| w.slot);
        let ends = self.links.iter().flat_map(|l| [l.from.0, l.to.0]);
        let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for slot in slots.chain(ends) {
            (first, last) = (first.min(slot), last.max(slot));
        }
        let first = if first.is_finite() { first } else { 0.0 };
        self.wheels.iter_mut().for_each(|w| w.slot -= first);
        for link in &mut self.links {
            link.from.0 -= first;
            link.to.0 -= first;
        }
        self.slots = (last - first).max(0.0) as usize + 1;
        for body in 0..self.names.len() {
            let own: Vec<&Wheel> = self.wheels.iter().filter(|w| w.body == body).collect();
            let low = own.iter().map(|w| w.slot).fold(f64::INFINITY, f64::min);
            let high = own.iter().map(|w| w.slot).fold(f64::NEG_INFINITY, f64::max);
            if let Some(wheel) = own.first() {
                self.axes.push(Shaft {
                    y: wheel.y,
                    ends: (low - 0.22, high + 0.22),
                    slides: self.bodies[body].slides,
                });
            }
        }
        let tops = self.wheels.iter().map(|w| w.y + 1.08 * w.radius);
        self.high = tops.fold(f64::NEG_INFINITY, f64::max);
        let bottoms = self.wheels.iter().map(|w| w.y - 1.08 * w.radius);
        self.low = bottoms.fold(f64::INFINITY, f64::min);
    }
}

fn is_mesh(connection: &ConnectionNote) -> bool {
    matches!(
        connection.kind.as_str(),
        "gear" | "internal_gear" | "planet_gear" | "planet_ring"
    )
}

fn is_internal(connection: &ConnectionNote) -> bool {
    matches!(connection.kind.as_str(), "internal_gear" | "planet_ring")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::ArmNote;

    fn connection(name: &str, kind: &str, arms: &[(&str, f64)]) -> ConnectionNote {
        let arm = |(body, length): &(&str, f64)| ArmNote {
            body: body.to_string(),
            length: *length,
        };
        ConnectionNote {
            name: name.into(),
            kind: kind.into(),
            arms: arms.iter().map(arm).collect(),
            ..ConnectionNote::default()
        }
    }

    fn layout(names: &[&str], connections: Vec<ConnectionNote>) -> Schematic {
        let body = |name: &&str| BodyNote {
            name: name.to_string(),
            ..BodyNote::default()
        };
        Schematic::of(&Description {
            bodies: names.iter().map(body).collect(),
            connections,
            ..Description::default()
        })
    }

    #[test]
    fn wheels_that_mesh_touch_and_shafts_are_level() {
        let drawn = layout(
            &["a", "b", "c"],
            vec![
                connection("m", "gear", &[("a", 0.05), ("b", 0.03)]),
                connection("s", "shaft", &[("b", 1.0), ("c", -1.0)]),
            ],
        );
        let wheel = |body: usize| drawn.wheels.iter().find(|w| w.body == body).unwrap();
        assert!(((wheel(0).y - wheel(1).y).abs() - 0.08).abs() < 1e-12);
        assert_eq!(wheel(0).slot, wheel(1).slot);
        assert_eq!(wheel(1).y, wheel(2).y);
        assert!((wheel(1).slot - wheel(2).slot).abs() >= 2.0);
        let looks: Vec<Appearance> = drawn.links.iter().map(|l| l.look).collect();
        assert_eq!(looks, [Appearance::Mesh, Appearance::Spring]);
    }

    #[test]
    fn a_planet_stands_inside_its_ring() {
        let drawn = layout(
            &["sun", "planet", "ring"],
            vec![
                connection("s", "gear", &[("sun", 0.03), ("planet", 0.02)]),
                connection("r", "internal_gear", &[("planet", 0.02), ("ring", -0.07)]),
            ],
        );
        let ring = drawn.wheels.iter().find(|w| w.is_ring).unwrap();
        assert!(ring.y.abs() < 1e-12 && ring.radius == 0.07);
        assert!(
            drawn.links.iter().all(|l| l.look == Appearance::Mesh),
            "{:?}",
            drawn.links
        );
    }

    #[test]
    fn no_two_wheels_overlap() {
        let gears: Vec<ConnectionNote> = (0..6)
            .map(|k| {
                connection(
                    "m",
                    "gear",
                    &[("hub", 0.04), (["a", "b", "c", "d", "e", "f"][k], 0.02)],
                )
            })
            .collect();
        let drawn = layout(&["hub", "a", "b", "c", "d", "e", "f"], gears);
        for (k, one) in drawn.wheels.iter().enumerate() {
            for other in &drawn.wheels[..k] {
                let apart = (one.y - other.y).abs() - one.radius - other.radius;
                assert!(one.slot != other.slot || apart > -1e-6, "{one:?} {other:?}");
            }
        }
    }
}
