//! Reading meshes that are given by tooth numbers.

use super::DeformationUnit;
use super::arms::{Finder, Geometry, Teeth};
use super::fields::{Fields, Mistakes, NumberMeasure, Range, count};
use crate::error::Diagnostic;
use crate::quantity::UnitDimension;
use crate::yaml::{Node, Value};

/// Keys that give a tooth its shape.
const SHAPE: [&str; 4] = ["module", "pressure_angle", "helix_angle", "centre_distance"];
/// Most teeth of a wheel.
const MOST_TEETH: usize = 100_000;
/// Normal pressure angle without a word about it \[rad\].
const PRESSURE_ANGLE: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// Largest pressure and helix angles \[rad\]: beyond lies no gear.
const STEEPEST: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Whether a node is a map: the teeth of a mesh, and not the radius of a body of that name.
pub(super) fn is_map(node: &Node) -> bool {
    matches!(node.value, Value::Map(_))
}

/// A pair of wheels on fixed axes.
pub(super) fn pair(
    node: &Node,
    path: &str,
    is_internal: bool,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let keys = ["teeth"].into_iter().chain(SHAPE).collect::<Vec<_>>();
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let wheels = numbers(&fields, find, mistakes);
    mesh(&fields, wheels, is_internal, None, mistakes)
}

/// Sun and planet on a turning carrier: R_s th_s + R_p th_p - (R_s + R_p) th_c.
pub(super) fn planet_gear(
    node: &Node,
    path: &str,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    planet(node, path, ("sun", "planet"), false, find, mistakes)
}

/// Planet and ring on a turning carrier: R_p th_p - R_r th_r + (R_r - R_p) th_c.
pub(super) fn planet_ring(
    node: &Node,
    path: &str,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    planet(node, path, ("planet", "ring"), true, find, mistakes)
}

fn planet(
    node: &Node,
    path: &str,
    roles: (&'static str, &'static str),
    is_internal: bool,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    // `planets` stood for copies of this mesh, which have none.
    let keys = [roles.0, roles.1, "carrier", "teeth", "planets"];
    let keys: Vec<&str> = keys.into_iter().chain(SHAPE).collect();
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let mut body = |role: &str| {
        let node = fields.required(role, "the name of a body", mistakes)?;
        find.named(node, &fields.path_of(role), mistakes)
    };
    let (first, second, carrier) = (body(roles.0), body(roles.1), body("carrier"));
    let numbers = numbers(&fields, find, mistakes)?;
    let (first, second, carrier) = (first?, second?, carrier?);
    if first == second || first == carrier || second == carrier {
        let message = format!("{}, {} and carrier must be three bodies", roles.0, roles.1);
        mistakes.add(Diagnostic::at(node, path, message));
        return None;
    }
    let teeth = |body: usize| numbers.iter().find(|(b, _)| *b == body).copied();
    let Some(wheels) = teeth(first).zip(teeth(second)) else {
        let message = format!("wanted the numbers of teeth of {} and {}", roles.0, roles.1);
        let at = fields.get("teeth").unwrap_or(node);
        mistakes.add(Diagnostic::at(at, &fields.path_of("teeth"), message));
        return None;
    };
    let wheels = Some([wheels.0, wheels.1]);
    mesh(&fields, wheels, is_internal, Some(carrier), mistakes)
}

/// Two bodies with their numbers of teeth, in the order of the file.
fn numbers(
    fields: &Fields<'_>,
    find: &mut Finder<'_>,
    mistakes: &mut Mistakes,
) -> Option<[(usize, usize); 2]> {
    let example = "two wheels with their numbers of teeth, such as {A: 23, B: 41}";
    let node = fields.required("teeth", example, mistakes)?;
    let own = Fields::open(node, &fields.path_of("teeth"), mistakes)?;
    if own.len() != 2 {
        let message = format!("found {} bodies, wanted {example}", own.len());
        mistakes.add(Diagnostic::at(node, &own.path, message));
        return None;
    }
    let mut list = Vec::new();
    for (name, entry) in own.entries() {
        let path = own.path_of(name);
        let body = find.wheel(name, Diagnostic::at_key(entry, &path, ""), mistakes);
        let teeth = mistakes.note(count(&entry.node, &path, MOST_TEETH));
        list.extend(body.zip(teeth));
    }
    list.try_into().ok()
}

fn mesh(
    fields: &Fields<'_>,
    wheels: Option<[(usize, usize); 2]>,
    is_internal: bool,
    carrier: Option<usize>,
    mistakes: &mut Mistakes,
) -> Option<Geometry> {
    let length = NumberMeasure::Si(UnitDimension::LENGTH);
    fields.required("module", "the normal module, such as 2.25 mm", mistakes);
    let module = fields.number("module", length, Range::Positive, mistakes);
    let pressure_angle = angle(fields, "pressure_angle", PRESSURE_ANGLE, mistakes);
    let helix_angle = angle(fields, "helix_angle", 0.0, mistakes);
    let centre_distance = fields.number("centre_distance", length, Range::Positive, mistakes);
    let wheels = wheels?;
    if is_internal && wheels[0].1 >= wheels[1].1 {
        let message = format!(
            "found {} teeth inside a ring of {}: name the ring second; it must have more teeth",
            wheels[0].1, wheels[1].1
        );
        let node = fields.get("teeth").unwrap_or(fields.node);
        mistakes.add(Diagnostic::at(node, &fields.path_of("teeth"), message));
        return None;
    }
    let teeth = Teeth {
        wheels,
        is_internal,
        carrier,
        module: module?,
        pressure_angle: pressure_angle?,
        helix_angle: helix_angle?,
        centre_distance,
    };
    let impossible = centre_distance.filter(|a| teeth.profile_shift(*a).is_none());
    if let (Some(_), Some(node)) = (impossible, fields.get("centre_distance")) {
        let message = format!(
            "no involute mesh of these teeth has this centre distance; without profile shift it is {:.6} m",
            teeth.reference_centre_distance()
        );
        mistakes.add(Diagnostic::at(
            node,
            &fields.path_of("centre_distance"),
            message,
        ));
    }
    Some(Geometry {
        arms: teeth.arms(),
        unit: DeformationUnit::Metre,
        teeth: Some(teeth),
    })
}

fn angle(fields: &Fields<'_>, key: &str, absent: f64, mistakes: &mut Mistakes) -> Option<f64> {
    let Some(node) = fields.get(key) else {
        return Some(absent);
    };
    let path = fields.path_of(key);
    let measure = NumberMeasure::Si(UnitDimension::ANGLE);
    let value = mistakes.number(node, &path, measure, Range::NotNegative)?;
    if value <= STEEPEST {
        return Some(value);
    }
    let message = format!("found {}, wanted at most 60 deg", node.describe());
    mistakes.add(
        Diagnostic::at(node, &path, message).with_help("such as `20 deg`: a bare number is in rad"),
    );
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_centre_distance_asks_for_a_profile_shift() {
        // 20 and 40 teeth, module 1 mm, reference centre distance 30 mm; x_1 + x_2 = 0.5 gives 30.4733 mm.
        let teeth = Teeth {
            wheels: [(0, 20), (1, 40)],
            is_internal: false,
            carrier: None,
            module: 1e-3,
            pressure_angle: PRESSURE_ANGLE,
            helix_angle: 0.0,
            centre_distance: None,
        };
        assert!((teeth.reference_centre_distance() - 0.03).abs() < 1e-15);
        let at = |a: f64| teeth.profile_shift(a).expect("a mesh");
        assert!(at(0.03).abs() < 1e-9);
        assert!((at(0.030_473_3) - 0.5).abs() < 1e-4, "{}", at(0.030_473_3));
        assert_eq!(teeth.profile_shift(0.02), None);
    }
}
