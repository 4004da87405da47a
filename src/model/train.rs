//! Trains in a model file: bodies, damping, loads, scaling.

use super::arms::{Bodies, unknown_body};
use super::connection::{Placed, connection, place};
use super::drawing::centre_distances;
use super::fields::{Fields, Mistakes, NumberMeasure, Range, check_name, entries, is_scalar};
use super::load::load;
use super::matrices::{self, PlacedMatrices};
use super::mean_motion::{ConnectionRows, add_drag, balance, drag, reference};
use super::motion::{motions, refuse_loads};
use super::orders::{Orders, on_common_base};
use super::planets::refuse_mass;
use super::{
    Body, Connection, Damping, DeformationUnit, Drag, FrequencyScale, Load, MeanMotion,
    ModalDamping, Motion, Scaling, Train,
};
use crate::error::{Diagnostic, did_you_mean};
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::{Entry, Node};
use indexmap::IndexMap;

/// Most connections of a model.
pub(super) const MOST_CONNECTIONS: usize = 4096;

/// Most bodies of a model: two for each connection.
const MOST_BODIES: usize = 2 * MOST_CONNECTIONS;

/// Keys of the top level that make a train.
pub(super) const KEYS: [&str; 8] = [
    "bodies",
    "matrices",
    "connections",
    "damping",
    "loads",
    "scaling",
    "reference",
    "balance",
];

/// The train of a document, and what the user must know about it.
pub(super) fn train(root: &Fields<'_>, mistakes: &mut Mistakes) -> Option<(Train, Vec<String>)> {
    refuse_too_many(root, mistakes)?;
    let mut bodies = bodies(root, mistakes);
    let parts = matrices::parts(root, &mut bodies, mistakes);
    let mut held = vec![false; bodies.len()];
    let own = parts.iter().flatten();
    own.flat_map(PlacedMatrices::held)
        .for_each(|k| held[k] = true);
    let placed = places(root, &bodies, &mut held, mistakes);
    refuse_unheld(root, &bodies, &held, mistakes);
    let rows = placed
        .as_ref()
        .zip(parts.as_ref())
        .and_then(|(placed, parts)| rows(placed, parts));
    let mean_motion = reference(root, &bodies, rows.as_ref(), mistakes);
    let ratios = mean_motion.as_ref().map(|motion| motion.ratios.as_slice());
    let read = |orders: &mut Orders<'_>, mistakes: &mut Mistakes| {
        let placed = placed.as_ref();
        let connections =
            placed.and_then(|placed| connections(placed, mean_motion.as_ref(), orders, mistakes));
        let node = root.get("loads");
        let loads = node.map(|node| loads(node, (&bodies, &held), orders, mistakes));
        let motions = motions(root, &bodies, mean_motion.as_ref(), orders, mistakes);
        (connections, loads.unwrap_or_default(), motions)
    };
    let ((mut connections, (mut loads, notes), (motions, said)), revolutions) =
        on_common_base((&bodies, ratios), root.node, mistakes, read);
    let damping = root
        .get("damping")
        .and_then(|node| damping(node, "damping", mistakes));
    let (scaling, mut warnings) = scaling(root, connections.as_ref(), mistakes);
    warnings.extend(notes);
    warnings.extend(said);
    refuse_loads(root, &bodies, &motions, &loads, mistakes);
    warnings.extend(
        connections
            .iter()
            .flat_map(|c| centre_distances(&bodies, c)),
    );
    let whole = bodies
        .iter()
        .map(|(name, body)| Some((name.clone(), (*body)?)));
    let whole: Option<IndexMap<String, Body>> = whole.collect();
    if let Some(whole) = &whole {
        add_drag(root, whole, mean_motion.as_ref(), &mut loads, mistakes);
    }
    let motion = mean_motion.as_ref();
    let balanced = balance(root, &bodies, (rows.as_ref(), motion), &mut loads, mistakes);
    let mut join = |part: &PlacedMatrices| part.join(connections.as_mut()?, (root.node, mistakes));
    let parts: Option<Vec<_>> = parts?.iter().map(&mut join).collect();
    let train = Train {
        bodies: whole?,
        connections: connections?,
        damping: damping.unwrap_or_default(),
        loads,
        motions,
        scaling,
        mean_motion,
        balanced,
        revolutions,
        parts: parts?,
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
    let fields = Fields::known(node, path, &["inertia", "drag", "mass", "motion"], mistakes)?;
    refuse_mass(&fields, mistakes);
    if fields.get("motion").is_some() && fields.get("inertia").is_none() {
        // Its inertia has no effect.
        return Some(Body {
            inertia: 1.0,
            motion: moved_as(&fields),
            drag: Drag::default(),
        });
    }
    let wanted = "kg m^2, or kg for a translating mass";
    let node = fields.required("inertia", wanted, mistakes)?;
    let path = fields.path_of("inertia");
    let quantity = mistakes.note(Quantity::from_node(node, &path))?;
    let (motion, dimension) = match quantity.dimension {
        Some(UnitDimension::MASS) => (Motion::Translation, UnitDimension::MASS),
        _ => (Motion::Rotation, UnitDimension::INERTIA),
    };
    let inertia = mistakes.number(node, &path, NumberMeasure::Si(dimension), Range::Positive)?;
    let drag = match fields.get("drag") {
        Some(node) => drag(node, &fields.path_of("drag"), motion, mistakes)?,
        None => Drag::default(),
    };
    Some(Body {
        inertia,
        motion,
        drag,
    })
}

/// Whether the unit of a measured motion is that of a sliding mass.
fn moved_as(fields: &Fields<'_>) -> Motion {
    let unit = fields.get("motion").and_then(|motion| motion.get("unit"));
    let unit = unit.and_then(|unit| unit.as_text("").ok());
    let one = unit.and_then(|unit| Quantity::parse(&format!("1 {unit}")).ok());
    match one.and_then(|one| one.dimension) {
        Some(UnitDimension::LENGTH | UnitDimension::VELOCITY) => Motion::Translation,
        _ => Motion::Rotation,
    }
}

/// The connections with their geometry, by name.
fn places<'n>(
    root: &Fields<'n>,
    bodies: &Bodies,
    held: &mut [bool],
    mistakes: &mut Mistakes,
) -> Option<Vec<(&'n str, Option<Placed<'n>>)>> {
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
        let placed = place(&entry.node, &path, bodies, held, mistakes);
        list.push((name, placed));
    }
    Some(list)
}

/// What the connections make of rigid motion, where all of them are right.
fn rows<'n>(
    placed: &[(&'n str, Option<Placed<'_>>)],
    parts: &'n [PlacedMatrices],
) -> Option<ConnectionRows<'n>> {
    let row = |(name, placed): &(&'n str, Option<Placed<'_>>)| {
        let geometry = placed.as_ref()?.geometry.as_ref()?;
        Some((*name, geometry.row()))
    };
    let own: Vec<_> = placed.iter().map(row).collect::<Option<_>>()?;
    let of_parts = parts.iter().flat_map(PlacedMatrices::rigid_rows);
    let (names, rows) = own.into_iter().chain(of_parts).unzip();
    Some(ConnectionRows { names, rows })
}

fn connections(
    placed: &[(&str, Option<Placed<'_>>)],
    motion: Option<&MeanMotion>,
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> Option<IndexMap<String, Connection>> {
    let mut list = Vec::new();
    for (name, placed) in placed {
        let Some(placed) = placed else {
            list.push(None);
            continue;
        };
        let teeth = placed.geometry.as_ref().and_then(|g| g.teeth.as_ref());
        let mesh = motion.zip(teeth).map(|(motion, teeth)| motion.order(teeth));
        let read = connection(placed, mesh.as_ref(), orders, mistakes);
        list.push(read.map(|connection| ((*name).to_owned(), connection)));
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
        let help = "add a connection, or remove the body";
        mistakes.add(Diagnostic::at(node, &path, message).with_help(help));
    }
}

fn damping(node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<Damping> {
    let keys = ["modal_ratio", "modal_ratios", "stiffness_proportional"];
    let fields = Fields::known(node, path, &keys, mistakes)?;
    let ratio = NumberMeasure::Si(UnitDimension::NUMBER);
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
            let mut read = |(path, node): &(String, &Node)| {
                mistakes.number(node, path, ratio, Range::NotNegative)
            };
            let list: Vec<_> = list.iter().map(&mut read).collect();
            list.into_iter()
                .collect::<Option<_>>()
                .map(ModalDamping::PerMode)
        }
    };
    let time = NumberMeasure::Si(UnitDimension::TIME);
    let share = fields.number("stiffness_proportional", time, Range::NotNegative, mistakes);
    Some(Damping {
        modal,
        stiffness_proportional: share.unwrap_or(0.0),
    })
}

fn loads(
    node: &Node,
    (bodies, held): (&Bodies, &[bool]),
    orders: &mut Orders<'_>,
    mistakes: &mut Mistakes,
) -> (IndexMap<String, Load>, Vec<String>) {
    let (mut map, mut notes) = (IndexMap::new(), Vec::new());
    let Some(fields) = Fields::open(node, "loads", mistakes) else {
        return (map, notes);
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
        let is_motion = |(key, _): (&str, &Entry)| key == "motion";
        let own = Fields::open(&entry.node, &path, &mut Mistakes::default());
        if own.is_some_and(|own| own.len() > 0 && own.entries().all(is_motion)) {
            continue;
        }
        if let Some((load, note)) = load(&entry.node, &path, dimension, orders, mistakes) {
            map.insert(name.to_owned(), load);
            notes.extend(note);
        }
    }
    (map, notes)
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
        let read = frequency(node, &fields.path_of("frequency"), mistakes);
        scaling.frequency = read.unwrap_or(scaling.frequency);
    }
    if let Some(node) = fields.get("length") {
        let path = fields.path_of("length");
        let (dimension, unit) = match Quantity::from_node(node, &path).map(|q| q.dimension) {
            Ok(Some(UnitDimension::ANGLE)) => (UnitDimension::ANGLE, DeformationUnit::Radian),
            _ => (UnitDimension::LENGTH, DeformationUnit::Metre),
        };
        scaling.length =
            mistakes.number(node, &path, NumberMeasure::Si(dimension), Range::Positive);
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

fn frequency(node: &Node, path: &str, mistakes: &mut Mistakes) -> Option<FrequencyScale> {
    const WORDS: [&str; 2] = ["first_mode", "first_connection"];
    if is_scalar(node) {
        match mistakes.note(node.as_text(path))? {
            "first_mode" => return Some(FrequencyScale::FirstMode),
            "first_connection" => return Some(FrequencyScale::FirstConnection),
            text if text.starts_with(|c: char| c.is_alphabetic()) => {
                let message = format!(
                    "found {}, wanted {} or a frequency",
                    node.describe(),
                    WORDS.join(", ")
                );
                let mistake = Diagnostic::at(node, path, message);
                mistakes.add(mistake.with_help(did_you_mean(text, WORDS)));
                return None;
            }
            _ => {}
        }
    }
    let measure = NumberMeasure::Si(UnitDimension::FREQUENCY);
    let value = mistakes.number(node, path, measure, Range::Positive)?;
    Some(FrequencyScale::Value(value))
}
