//! Trains in a model file: bodies, damping, loads, scaling.

use super::connection::{Bodies, connection, unknown_body};
use super::fields::{Fields, Measure, Mistakes, Range, check_name, entries, is_scalar, number};
use super::series::load;
use super::{
    Body, Connection, Damping, DeformationUnit, FrequencyScale, Load, ModalDamping, Motion,
    Scaling, Train,
};
use crate::error::{Diagnostic, did_you_mean};
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::Node;
use indexmap::IndexMap;

/// Most connections of a model.
pub(super) const MOST_CONNECTIONS: usize = 4096;

/// Most bodies of a model: two for each connection.
const MOST_BODIES: usize = 2 * MOST_CONNECTIONS;

/// Keys of the top level that make a train.
pub(super) const KEYS: [&str; 5] = ["bodies", "connections", "damping", "loads", "scaling"];

/// The train of a document, and what the user must know about it.
pub(super) fn train(root: &Fields<'_>, mistakes: &mut Mistakes) -> Option<(Train, Vec<String>)> {
    refuse_too_many(root, mistakes)?;
    let bodies = bodies(root, mistakes);
    let mut held = vec![false; bodies.len()];
    let connections = connections(root, &bodies, &mut held, mistakes);
    refuse_unheld(root, &bodies, &held, mistakes);
    let damping = root
        .get("damping")
        .and_then(|node| damping(node, "damping", mistakes));
    let loads = root
        .get("loads")
        .map(|node| loads(node, &bodies, &held, mistakes));
    let (scaling, warnings) = scaling(root, connections.as_ref(), mistakes);
    let bodies = bodies.into_iter().map(|(name, body)| Some((name, body?)));
    let train = Train {
        bodies: bodies.collect::<Option<_>>()?,
        connections: connections?,
        damping: damping.unwrap_or_default(),
        loads: loads.unwrap_or_default(),
        scaling,
    };
    Some((train, warnings))
}

/// Bodies and connections are counted before any of them is read.
fn refuse_too_many(root: &Fields<'_>, mistakes: &mut Mistakes) -> Option<()> {
    let before = mistakes.count();
    for (key, most) in [("bodies", MOST_BODIES), ("connections", MOST_CONNECTIONS)] {
        let Some(node) = root.get(key) else {
            continue;
        };
        let found = node.as_map(key).map_or(0, |map| map.len());
        if found > most {
            let message = format!("found {found}, wanted at most {most}");
            mistakes.add(Diagnostic::at(node, key, message));
        }
    }
    (mistakes.count() == before).then_some(())
}

fn bodies(root: &Fields<'_>, mistakes: &mut Mistakes) -> Bodies {
    let mut map = Bodies::new();
    let wanted = "at least one body with its inertia";
    let Some(node) = root.required("bodies", wanted, mistakes) else {
        return map;
    };
    let Some(fields) = Fields::open(node, "bodies", mistakes) else {
        return map;
    };
    if fields.len() == 0 {
        let message = format!("none: wanted {wanted}");
        mistakes.add(Diagnostic::at(node, "bodies", message));
    }
    for (name, entry) in fields.entries() {
        let path = fields.path_of(name);
        mistakes.note(check_name(entry, name, &path));
        map.insert(name.to_owned(), body(&entry.node, &path, mistakes));
    }
    map
}

fn body(node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<Body> {
    let fields = Fields::known(node, path, &["inertia"], mistakes)?;
    let wanted = "kg m^2, or kg for a translating mass";
    let node = fields.required("inertia", wanted, mistakes)?;
    let path = fields.path_of("inertia");
    let quantity = mistakes.note(Quantity::from_node(node, &path))?;
    let (motion, dimension) = match quantity.dimension {
        Some(UnitDimension::MASS) => (Motion::Translation, UnitDimension::MASS),
        _ => (Motion::Rotation, UnitDimension::INERTIA),
    };
    let inertia = number(node, &path, Measure::Si(dimension), Range::Positive);
    let inertia = mistakes.note(inertia)?;
    Some(Body { inertia, motion })
}

fn connections(
    root: &Fields<'_>,
    bodies: &Bodies,
    held: &mut [bool],
    mistakes: &mut Mistakes,
) -> Option<IndexMap<String, Connection>> {
    let wanted = "at least one connection (gear, internal_gear, shaft, ground or acts_on, with its stiffness)";
    let node = root.required("connections", wanted, mistakes)?;
    let fields = Fields::open(node, "connections", mistakes)?;
    if fields.len() == 0 {
        let message = format!("none: wanted {wanted}");
        mistakes.add(Diagnostic::at(node, "connections", message));
        return None;
    }
    let mut list = Vec::new();
    for (name, entry) in fields.entries() {
        let path = fields.path_of(name);
        mistakes.note(check_name(entry, name, &path));
        let read = connection(&entry.node, &path, bodies, held, mistakes);
        list.push(read.map(|connection| (name.to_owned(), connection)));
    }
    list.into_iter().collect()
}

/// Bodies that no connection acts on; silent when no connection could be read, which says it better.
fn refuse_unheld(root: &Fields<'_>, bodies: &Bodies, held: &[bool], mistakes: &mut Mistakes) {
    if !held.iter().any(|h| *h) {
        return;
    }
    let unheld = (bodies.keys().zip(held)).filter(|(_, held)| !**held);
    for (name, _) in unheld {
        let path = format!("bodies.{name}");
        let node = root.node.at(&path).unwrap_or(root.node);
        let message = "nothing holds it: no connection acts on this body";
        let help = "add a connection, or leave the body out";
        mistakes.add(Diagnostic::at(node, &path, message).with_help(help));
    }
}

fn damping(node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<Damping> {
    let keys = ["modal_ratio", "modal_ratios", "stiffness_proportional"];
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let ratio = Measure::Si(UnitDimension::NUMBER);
    let uniform = fields.number("modal_ratio", ratio, Range::NotNegative, mistakes);
    let modal = match fields.get("modal_ratios") {
        None => uniform.map(ModalDamping::Uniform),
        Some(node) => {
            let path = fields.path_of("modal_ratios");
            if fields.get("modal_ratio").is_some() {
                let message = "modal_ratio and modal_ratios exclude each other";
                mistakes.add(Diagnostic::at(node, &path, message));
            }
            let list = entries(node, &path, mistakes);
            let read =
                |(path, node): &(String, &Node)| number(node, path, ratio, Range::NotNegative);
            let list: Vec<_> = list.iter().map(|x| mistakes.note(read(x))).collect();
            list.into_iter()
                .collect::<Option<_>>()
                .map(ModalDamping::PerMode)
        }
    };
    let time = Measure::Si(UnitDimension::TIME);
    let share = fields.number("stiffness_proportional", time, Range::NotNegative, mistakes);
    Some(Damping {
        modal,
        stiffness_proportional: share.unwrap_or(0.0),
    })
}

fn loads(
    node: &Node,
    bodies: &Bodies,
    held: &[bool],
    mistakes: &mut Mistakes,
) -> IndexMap<String, Load> {
    let mut map = IndexMap::new();
    let Some(fields) = Fields::open(node, "loads", mistakes) else {
        return map;
    };
    for (name, entry) in fields.entries() {
        let path = fields.path_of(name);
        let found = bodies.get_full(name);
        match found {
            None if bodies.is_empty() => {}
            None => {
                let at = Diagnostic::at_key(entry, &path, "");
                mistakes.add(unknown_body(name, bodies, at));
            }
            Some((k, ..)) if held.iter().any(|h| *h) && !held[k] => {
                let message = format!("acts on `{name}`, which no connection holds");
                mistakes.add(Diagnostic::at_key(entry, &path, message));
            }
            Some(_) => {}
        }
        let dimension = match found {
            Some((_, _, Some(body))) if body.motion == Motion::Translation => UnitDimension::FORCE,
            _ => UnitDimension::MOMENT,
        };
        let series = load(&entry.node, &path, Measure::Si(dimension), mistakes);
        map.extend(series.map(|series| (name.to_owned(), Load { series })));
    }
    map
}

fn scaling(
    root: &Fields<'_>,
    connections: Option<&IndexMap<String, Connection>>,
    mistakes: &mut Mistakes,
) -> (Scaling, Vec<String>) {
    let mut scaling = Scaling {
        frequency: FrequencyScale::FirstMode,
        length: None,
    };
    let mut warnings = Vec::new();
    let Some(node) = root.get("scaling") else {
        return (scaling, warnings);
    };
    let Some(fields) = Fields::known(node, "scaling", &["frequency", "length"], mistakes) else {
        return (scaling, warnings);
    };
    if let Some(node) = fields.get("frequency") {
        let read = frequency(node, &fields.path_of("frequency"));
        scaling.frequency = mistakes.note(read).unwrap_or(scaling.frequency);
    }
    if let Some(node) = fields.get("length") {
        let path = fields.path_of("length");
        let (dimension, unit) = match Quantity::from_node(node, &path).map(|q| q.dimension) {
            Ok(Some(UnitDimension::ANGLE)) => (UnitDimension::ANGLE, DeformationUnit::Radian),
            _ => (UnitDimension::LENGTH, DeformationUnit::Metre),
        };
        let length = number(node, &path, Measure::Si(dimension), Range::Positive);
        scaling.length = mistakes.note(length);
        let others = connections.into_iter().flatten();
        let others: Vec<&str> = others
            .filter(|(_, c)| c.unit != unit && c.length.is_none())
            .map(|(name, _)| name.as_str())
            .collect();
        if !others.is_empty() {
            warnings.push(format!(
                "scaling.length {} also scales {}, whose deformation is in {}: give them a `length` of their own",
                node.describe(),
                others.join(", "),
                if unit == DeformationUnit::Metre { "rad" } else { "m" }
            ));
        }
    }
    (scaling, warnings)
}

fn frequency(node: &Node, path: &str) -> Result<FrequencyScale, Diagnostic> {
    const WORDS: [&str; 2] = ["first_mode", "first_connection"];
    if is_scalar(node) {
        match node.as_text(path)? {
            "first_mode" => return Ok(FrequencyScale::FirstMode),
            "first_connection" => return Ok(FrequencyScale::FirstConnection),
            text if text.starts_with(|c: char| c.is_alphabetic()) => {
                let message = format!(
                    "found {}, wanted {} or a frequency",
                    node.describe(),
                    WORDS.join(", ")
                );
                return Err(
                    Diagnostic::at(node, path, message).with_help(did_you_mean(text, WORDS))
                );
            }
            _ => {}
        }
    }
    let value = number(
        node,
        path,
        Measure::Si(UnitDimension::FREQUENCY),
        Range::Positive,
    )?;
    Ok(FrequencyScale::Value(value))
}
