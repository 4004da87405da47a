//! Connections in a model file: geometry, units, stiffness, law.

use super::fields::{Fields, Measure, Mistakes, Range, entries, is_scalar, number};
use super::law::{LawUnits, law};
use super::series::{base_order, stiffness_variation, transmission_error};
use super::{Body, Connection, DeformationUnit, Motion};
use crate::error::{Diagnostic, did_you_mean, nearest};
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;
use indexmap::IndexMap;

/// Keys of a connection that say what it acts on, exactly one of which is given.
pub const GEOMETRY: [&str; 5] = ["gear", "internal_gear", "shaft", "ground", "acts_on"];

const KEYS: [&str; 12] = [
    "gear",
    "internal_gear",
    "shaft",
    "ground",
    "acts_on",
    "stiffness",
    "damping",
    "element",
    "length",
    "transmission_error",
    "stiffness_variation",
    "base_order",
];

/// Bodies by name; `None` for a body that was named but has a mistake of its own.
pub(super) type Bodies = IndexMap<String, Option<Body>>;

/// Arms of a connection and the unit of its deformation.
struct Geometry {
    arms: Vec<(usize, f64)>,
    unit: DeformationUnit,
}

/// The connection of a node.
pub(super) fn connection(
    node: &Node,
    path: &str,
    bodies: &Bodies,
    held: &mut [bool],
    mistakes: &mut Mistakes,
) -> Option<Connection> {
    let fields = Fields::known(node, path, &KEYS, mistakes)?;
    let geometry = geometry(&fields, bodies, held, mistakes);
    // What can be checked without the geometry is checked all the same, as if in metres.
    let unit = geometry.as_ref().map(|g| g.unit);
    let si = |d: fn(DeformationUnit) -> UnitDimension| match unit {
        Some(unit) => Measure::Si(d(unit)),
        None => Measure::Si(d(guessed_unit(&fields))),
    };
    fields.required("stiffness", "the reference stiffness, > 0", mistakes);
    let stiffness = si(DeformationUnit::stiffness);
    let stiffness = fields.number("stiffness", stiffness, Range::Positive, mistakes);
    let damping = si(DeformationUnit::damping);
    let damping = fields.number("damping", damping, Range::NotNegative, mistakes);
    let displacement = si(DeformationUnit::dimension);
    let length = fields.number("length", displacement, Range::Positive, mistakes);
    let units = LawUnits::Si(unit.unwrap_or_else(|| guessed_unit(&fields)));
    let element_path = fields.path_of("element");
    let element = law(fields.get("element"), &element_path, units, &[], mistakes);
    let base = base_order(&fields, mistakes);
    let stiffness_variation = fields.get("stiffness_variation").and_then(|node| {
        let path = fields.path_of("stiffness_variation");
        stiffness_variation(node, &path, base, mistakes)
    });
    let transmission_error = fields.get("transmission_error").and_then(|node| {
        let path = fields.path_of("transmission_error");
        transmission_error(node, &path, displacement, base, mistakes)
    });
    let Geometry { arms, unit } = geometry?;
    Some(Connection {
        arms,
        unit,
        stiffness: stiffness?,
        damping: damping.unwrap_or(0.0),
        element: element?,
        stiffness_variation,
        transmission_error,
        length,
    })
}

/// Unit of a deformation whose geometry has a mistake: what the key suggests.
fn guessed_unit(fields: &Fields<'_>) -> DeformationUnit {
    if fields.get("shaft").is_some() || fields.get("ground").is_some() {
        DeformationUnit::Radian
    } else {
        unit_of_stiffness(fields)
    }
}

/// rad when the stiffness is written in N m/rad (or N m), else m.
fn unit_of_stiffness(fields: &Fields<'_>) -> DeformationUnit {
    let written = fields.get("stiffness").filter(|node| is_scalar(node));
    let quantity = written.and_then(|node| Quantity::from_node(node, "").ok());
    match quantity.and_then(|q| q.dimension) {
        Some(d) if d.fits(UnitDimension::TORSIONAL_STIFFNESS) => DeformationUnit::Radian,
        _ => DeformationUnit::Metre,
    }
}

fn geometry(
    fields: &Fields<'_>,
    bodies: &Bodies,
    held: &mut [bool],
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let (kind, node) = fields.exactly_one(&GEOMETRY, "geometry", mistakes)?;
    let path = fields.path_of(kind);
    let mut find = Finder { bodies, held };
    match kind {
        "gear" => wheels(node, &path, 1.0, &mut find, mistakes),
        "internal_gear" => wheels(node, &path, -1.0, &mut find, mistakes),
        "shaft" => shaft(node, &path, &mut find, mistakes),
        "ground" => {
            let body = find.named(node, &path, mistakes)?;
            let arms = vec![(body, 1.0)];
            let unit = DeformationUnit::of(find.motion(body)?);
            Some(Geometry { arms, unit })
        }
        _ => levers(node, &path, unit_of_stiffness(fields), &mut find, mistakes),
    }
}

/// Finds bodies by name and notes that something holds them.
struct Finder<'b> {
    bodies: &'b Bodies,
    held: &'b mut [bool],
}

impl Finder<'_> {
    fn body(&mut self, name: &str, at: Diagnostic, mistakes: &mut Mistakes) -> Option<usize> {
        let found = self.bodies.get_index_of(name);
        match found {
            Some(body) => self.held[body] = true,
            None => {
                // The body that was probably meant is not reported as unheld on top.
                let meant = nearest(name, self.bodies.keys());
                if let Some(body) = meant.and_then(|name| self.bodies.get_index_of(name)) {
                    self.held[body] = true;
                }
                // Without any body the mistake is above.
                if !self.bodies.is_empty() {
                    mistakes.add(unknown_body(name, self.bodies, at));
                }
            }
        }
        found
    }

    /// The body that a scalar names.
    fn named(&mut self, node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<usize> {
        let name = mistakes.note(node.as_text(path))?;
        self.body(name, Diagnostic::at(node, path, ""), mistakes)
    }

    fn motion(&self, body: usize) -> Option<Motion> {
        self.bodies[body].map(|body| body.motion)
    }
}

/// An unknown body, at the place of `at`.
pub(super) fn unknown_body(name: &str, bodies: &Bodies, at: Diagnostic) -> Diagnostic {
    Diagnostic {
        message: format!("unknown body `{name}`"),
        ..at
    }
    .with_help(did_you_mean(name, bodies.keys()))
}

/// R_A th_A + sign R_B th_B [m].
fn wheels(
    node: &Node,
    path: &str,
    sign: f64,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let fields = Fields::open(node, path, mistakes)?;
    if fields.len() != 2 {
        let message = format!(
            "found {} bodies, wanted two with their base radii, such as {{A: 50 mm, B: 40 mm}}",
            fields.len()
        );
        mistakes.add(Diagnostic::at(node, path, message));
    }
    let before = mistakes.count();
    let mut arms = Vec::new();
    for (name, entry) in fields.entries() {
        let path = fields.path_of(name);
        let body = find.body(name, Diagnostic::at_key(entry, &path, ""), mistakes);
        if body.and_then(|body| find.motion(body)) == Some(Motion::Translation) {
            let message = format!("`{name}` is a translating mass (inertia in kg), no wheel");
            let mistake = Diagnostic::at_key(entry, &path, message);
            mistakes.add(mistake.with_help("use acts_on with lever arm 1 for it"));
        }
        let radius = Measure::Si(UnitDimension::LENGTH);
        let radius = mistakes.note(number(&entry.node, &path, radius, Range::Positive));
        let side = if arms.is_empty() { 1.0 } else { sign };
        arms.extend(body.zip(radius).map(|(body, radius)| (body, side * radius)));
    }
    let unit = DeformationUnit::Metre;
    (mistakes.count() == before && arms.len() == 2).then_some(Geometry { arms, unit })
}

/// th_A - th_B [rad], or z_A - z_B [m] between translating masses.
fn shaft(
    node: &Node,
    path: &str,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let list = entries(node, path, mistakes);
    let ends: Vec<Option<usize>> = (list.iter())
        .map(|(path, node)| find.named(node, path, mistakes))
        .collect();
    let wrong = match ends.as_slice() {
        [Some(a), Some(b)] if a == b => "both ends are the same body".to_owned(),
        [Some(a), Some(b)] => {
            let (first, second) = (find.motion(*a)?, find.motion(*b)?);
            if first == second {
                let arms = vec![(*a, 1.0), (*b, -1.0)];
                let unit = DeformationUnit::of(first);
                return Some(Geometry { arms, unit });
            }
            "joins a turning body and a translating mass (inertia in kg)".to_owned()
        }
        [_, _] => return None,
        [] if !matches!(node.value, crate::yaml::Value::List(_)) => return None,
        list => format!("found {} bodies, wanted two: [A, B]", list.len()),
    };
    mistakes.add(Diagnostic::at(node, path, wrong));
    None
}

/// Any lever arms; a length for a turning body when the deformation is in m, else a number.
fn levers(
    node: &Node,
    path: &str,
    unit: DeformationUnit,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let fields = Fields::open(node, path, mistakes)?;
    if fields.len() == 0 {
        let message =
            "acts on nothing: wanted bodies with their lever arms, such as {A: 0.05, B: -0.04}";
        mistakes.add(Diagnostic::at(node, path, message));
    }
    let before = mistakes.count();
    let mut arms = Vec::new();
    for (name, entry) in fields.entries() {
        let path = fields.path_of(name);
        let body = find.body(name, Diagnostic::at_key(entry, &path, ""), mistakes);
        let is_turning = body.and_then(|b| find.motion(b)) != Some(Motion::Translation);
        let measure = match unit {
            DeformationUnit::Metre if is_turning => UnitDimension::LENGTH,
            _ => UnitDimension::NUMBER,
        };
        let arm = number(&entry.node, &path, Measure::Si(measure), Range::Any);
        let arm = mistakes.note(arm);
        if arm == Some(0.0) {
            let message = "a lever arm of 0 does nothing: leave the body out";
            mistakes.add(Diagnostic::at(&entry.node, &path, message));
        }
        arms.extend(body.zip(arm));
    }
    (mistakes.count() == before && !arms.is_empty()).then_some(Geometry { arms, unit })
}
