//! Numbers of a gear drawing: backlash on the line of action, centre distances.

use super::arms::Bodies;
use super::fields::{Fields, Mistakes, NumberMeasure, Range};
use super::law::{BACKLASH, HALF_GAP};
use super::{Connection, Teeth};
use crate::error::Diagnostic;
use crate::quantity::UnitDimension;
use crate::yaml::{Entry, Node, Value, join};
use indexmap::IndexMap;

/// Where a drawing measures backlash.
const WAYS: [&str; 3] = ["circumferential", "normal", "angular"];

/// Two reference centre distances that differ by less, relative to their size, are one.
const SAME_DISTANCE: f64 = 1e-6;

/// The node of a law with its `backlash` as the half gap on the line of action; any other node as it is.
///
/// ```text
/// b = j_t cos(alpha_t) / 2 (circumferential),  j_n / (2 cos beta_b) (normal),  j R_b / 2 (angle of the first wheel)
/// ```
pub(super) fn on_line_of_action(
    node: &Node,
    path: &str,
    teeth: Option<&Teeth>,
    mistakes: &mut Mistakes,
) -> Option<Node> {
    let Value::Map(map) = &node.value else {
        return Some(node.clone());
    };
    let Some(Entry { node: written, .. }) = map.get(BACKLASH).filter(|e| !e.node.is_null()) else {
        return Some(node.clone());
    };
    let path = join(path, BACKLASH);
    let Some(teeth) = teeth else {
        let message = "the backlash of a drawing needs the `teeth` of the mesh";
        let help = "or give the gap on the line of action: `gap: 80 um`";
        mistakes.add(Diagnostic::at(written, &path, message).with_help(help));
        return None;
    };
    let half_gap = half_gap(written, &path, teeth, mistakes)?;
    let mut plain = IndexMap::new();
    for (key, entry) in map {
        let key_location = entry.key_location.clone();
        let (key, node) = match key.as_str() {
            BACKLASH => {
                let location = written.location.clone();
                (
                    HALF_GAP,
                    Node {
                        location,
                        ..Node::number(half_gap)
                    },
                )
            }
            key => (key, entry.node.clone()),
        };
        if plain
            .insert(key.to_owned(), Entry { key_location, node })
            .is_some()
        {
            let message = "half_gap and backlash exclude each other";
            mistakes.add(Diagnostic::at(written, &path, message));
        }
    }
    Some(Node {
        value: Value::Map(plain),
        location: node.location.clone(),
    })
}

fn half_gap(node: &Node, path: &str, teeth: &Teeth, mistakes: &mut Mistakes) -> Option<f64> {
    let fields = Fields::known(node, path, &WAYS, mistakes)?;
    let (way, _) = fields.exactly_one(&WAYS, "backlash", mistakes)?;
    let dimension = match way {
        "angular" => UnitDimension::ANGLE,
        _ => UnitDimension::LENGTH,
    };
    let backlash = fields.number(
        way,
        NumberMeasure::Si(dimension),
        Range::NotNegative,
        mistakes,
    )?;
    let onto_line = match way {
        "circumferential" => teeth.transverse_pressure_angle().cos(),
        "normal" => 1.0 / teeth.base_helix_angle().cos(),
        _ => teeth.base_radii()[0],
    };
    Some(0.5 * backlash * onto_line)
}

/// Planets that mesh with two wheels at different reference centre distances, and the profile shift that this takes.
pub(super) fn centre_distances(
    bodies: &Bodies,
    connections: &IndexMap<String, Connection>,
) -> Vec<String> {
    let of_planets: Vec<(&str, &Teeth)> = (connections.iter())
        .filter_map(|(name, c)| Some((name.as_str(), c.teeth.as_ref()?)))
        .filter(|(_, teeth)| teeth.carrier.is_some() && teeth.centre_distance.is_none())
        .collect();
    let mut list = Vec::new();
    for (k, (name, teeth)) in of_planets.iter().enumerate() {
        let shared = |other: &Teeth| {
            let planet = other
                .wheels
                .iter()
                .find(|(b, _)| teeth.wheels.iter().any(|w| w.0 == *b));
            planet
                .filter(|_| other.carrier == teeth.carrier)
                .map(|(b, _)| *b)
        };
        for (other_name, other) in &of_planets[k + 1..] {
            let Some(planet) = shared(other) else {
                continue;
            };
            let (a, b) = (
                teeth.reference_centre_distance(),
                other.reference_centre_distance(),
            );
            if (a - b).abs() <= SAME_DISTANCE * a.max(b) {
                continue;
            }
            let shift = other.profile_shift(a).map_or_else(
                || "no profile shift brings them together".to_owned(),
                |x| {
                    format!(
                        "at the first one, {other_name} needs a sum of profile shifts of {x:.4}"
                    )
                },
            );
            let planet = bodies
                .get_index(planet)
                .map_or("", |(name, _)| name.as_str());
            list.push(format!(
                "{planet} meshes in {name} at a reference centre distance of {:.4} mm and in {other_name} at {:.4} mm: \
                 {shift}; set `centre_distance` in both to confirm that this is intended",
                1e3 * a,
                1e3 * b
            ));
        }
    }
    list
}
