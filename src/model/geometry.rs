//! What a connection acts on: bodies with their lever arms.

use super::arms::{Bodies, Finder, Geometry};
use super::fields::{Fields, Mistakes, NumberMeasure, Range, entries};
use super::teeth;
use super::{DeformationUnit, Motion};
use crate::error::Diagnostic;
use crate::quantity::UnitDimension;
use crate::yaml::Node;

/// Keys of a connection that say what it acts on, exactly one of which is given.
pub const GEOMETRY: [&str; 7] = [
    "gear",
    "internal_gear",
    "planet_gear",
    "planet_ring",
    "shaft",
    "ground",
    "acts_on",
];

/// The geometry of a connection; `unit`: of its stiffness, as far as that tells.
pub(super) fn geometry(
    fields: &Fields<'_>,
    bodies: &Bodies,
    held: &mut [bool],
    unit: DeformationUnit,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let (kind, node) = fields.exactly_one(&GEOMETRY, "geometry", mistakes)?;
    let path = fields.path_of(kind);
    let mut find = Finder { bodies, held };
    match kind {
        "gear" | "internal_gear" if node.get("teeth").is_some_and(teeth::is_map) => {
            teeth::pair(node, &path, kind == "internal_gear", &mut find, mistakes)
        }
        "gear" => wheels(node, &path, 1.0, &mut find, mistakes),
        "internal_gear" => wheels(node, &path, -1.0, &mut find, mistakes),
        "planet_gear" => teeth::planet_gear(node, &path, &mut find, mistakes),
        "planet_ring" => teeth::planet_ring(node, &path, &mut find, mistakes),
        "shaft" => shaft(node, &path, &mut find, mistakes),
        "ground" => {
            let body = find.named(node, &path, mistakes)?;
            let arms = vec![(body, 1.0)];
            let unit = DeformationUnit::of(find.motion(body)?);
            Some(Geometry::new(arms, unit))
        }
        _ => levers(node, &path, unit, &mut find, mistakes),
    }
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
        let body = find.wheel(name, Diagnostic::at_key(entry, &path, ""), mistakes);
        let radius = NumberMeasure::Si(UnitDimension::LENGTH);
        let radius = mistakes.number(&entry.node, &path, radius, Range::Positive);
        let side = if arms.is_empty() { 1.0 } else { sign };
        arms.extend(body.zip(radius).map(|(body, radius)| (body, side * radius)));
    }
    let geometry = Geometry::new(arms, DeformationUnit::Metre);
    (mistakes.count() == before && geometry.arms.len() == 2).then_some(geometry)
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
                return Some(Geometry::new(arms, DeformationUnit::of(first)));
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
        let arm = mistakes.number(&entry.node, &path, NumberMeasure::Si(measure), Range::Any);
        if arm == Some(0.0) {
            let message = "a lever arm of 0 has no effect: leave the body out";
            mistakes.add(Diagnostic::at(&entry.node, &path, message));
        }
        arms.extend(body.zip(arm));
    }
    (mistakes.count() == before && !arms.is_empty()).then(|| Geometry::new(arms, unit))
}
