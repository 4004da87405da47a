//! Several equal planets written once: `planets: N` on the meshes of a planetary set.
//!
//! Planet i meshes with the sun by frac(i z_S / N) of a mesh period later than planet 0, with the ring by frac(i z_R / N).

use super::fields::{Fields, Mistakes, count};
use crate::error::Diagnostic;
use crate::quantity::{Quantity, UnitDimension};
use crate::yaml::{Entry, Node, Value};
use indexmap::IndexMap;

/// Most planets of a set.
const MOST: usize = 24;

/// A mesh of a planet that represents several.
struct Mesh<'n> {
    connection: &'n str,
    /// `planet_gear` or `planet_ring`.
    kind: &'static str,
    planet: &'n str,
    carrier: &'n str,
    count: usize,
    /// Teeth of sun or ring, and of the planet.
    teeth: (i64, i64),
    /// Radius on which the planets' centres turn [m].
    centre: f64,
}

/// The document with every planet of its own; `None` where no mesh has several.
///
/// A planet P becomes `P_1`, `P_2`, ..; a mesh m of it `m_1`, `m_2`, ..; loads on it likewise. With `mass`, the inertia of the
/// carrier grows by N mass centre radius^2.
pub(super) fn expanded(root: &Node, mistakes: &mut Mistakes) -> Option<Node> {
    let connections = root.get("connections")?.as_map("").ok()?;
    let mut meshes: Vec<Mesh<'_>> = Vec::new();
    for (name, entry) in connections {
        for kind in ["planet_gear", "planet_ring"] {
            meshes.extend(mesh(name, kind, &entry.node, mistakes));
        }
    }
    if meshes.is_empty() {
        return None;
    }
    check(connections, &meshes, mistakes)?;
    let Value::Map(map) = &root.value else {
        return None;
    };
    let copies = |key: &str, entry: &Entry| match key {
        "connections" => with_copies(entry, |name, entry| mesh_copies(name, entry, &meshes)),
        "bodies" => with_copies(entry, |name, entry| body_copies(name, entry, root, &meshes)),
        "loads" => with_copies(entry, |name, entry| load_copies(name, entry, &meshes)),
        _ => entry.clone(),
    };
    let map = map
        .iter()
        .map(|(key, entry)| (key.clone(), copies(key, entry)));
    Some(Node {
        value: Value::Map(map.collect()),
        location: root.location.clone(),
    })
}

/// The mesh of a connection, where it has several planets.
fn mesh<'n>(
    connection: &'n str,
    kind: &'static str,
    node: &'n Node,
    mistakes: &mut Mistakes,
) -> Option<Mesh<'n>> {
    let geometry = node.get(kind)?;
    let planets = geometry.get("planets").filter(|node| !node.is_null())?;
    let path = format!("connections.{connection}.{kind}.planets");
    let count = mistakes.note(count(planets, &path, MOST))?;
    let text = |key: &str| geometry.get(key).and_then(|node| node.as_text("").ok());
    let wheel = match kind {
        "planet_gear" => "sun",
        _ => "ring",
    };
    // What is missing or wrong is said where the mesh is read.
    let (planet, carrier) = (text("planet")?, text("carrier")?);
    let teeth = geometry.get("teeth")?;
    let number = |name: &str| teeth.get(name)?.as_text("").ok()?.parse::<i64>().ok();
    let teeth = (number(text(wheel)?)?, number(planet)?);
    let value = |key: &str, dimension| {
        let quantity = Quantity::from_node(geometry.get(key)?, "").ok()?;
        quantity.si(dimension).ok()
    };
    let module = value("module", UnitDimension::LENGTH).unwrap_or(0.0);
    let helix = value("helix_angle", UnitDimension::ANGLE).unwrap_or(0.0);
    let sum = match kind {
        "planet_gear" => teeth.0 + teeth.1,
        _ => teeth.0 - teeth.1,
    };
    Some(Mesh {
        connection,
        kind,
        planet,
        carrier,
        count,
        teeth,
        centre: 0.5 * module * sum as f64 / helix.cos(),
    })
}

/// Meshes of one planet that disagree, and connections that cannot be copied.
fn check(
    connections: &IndexMap<String, Entry>,
    meshes: &[Mesh<'_>],
    mistakes: &mut Mistakes,
) -> Option<()> {
    let before = mistakes.count();
    for (name, entry) in connections {
        let path = format!("connections.{name}");
        let own = meshes.iter().find(|m| m.connection == name);
        let planet = meshes.iter().find(|m| names_body(&entry.node, m.planet));
        let Some(other) = planet.filter(|m| own.is_none_or(|own| own.count != m.count)) else {
            continue;
        };
        let message = format!(
            "acts on `{}`, of which `{}` has {}: wanted a planet_gear or planet_ring with `planets: {}`",
            other.planet, other.connection, other.count, other.count
        );
        mistakes.add(Diagnostic::at(&entry.node, &path, message));
    }
    (mistakes.count() == before).then_some(())
}

/// Whether the geometry of a connection names a body.
fn names_body(connection: &Node, body: &str) -> bool {
    let names = |node: &Node| match &node.value {
        Value::Scalar { text, .. } => text == body,
        Value::List(list) => list
            .iter()
            .any(|n| n.as_text("").is_ok_and(|text| text == body)),
        Value::Map(map) => {
            map.contains_key(body)
                || map
                    .values()
                    .any(|e| e.node.as_text("").is_ok_and(|text| text == body))
                || map.get("teeth").is_some_and(|e| e.node.get(body).is_some())
        }
    };
    super::GEOMETRY
        .iter()
        .filter_map(|key| connection.get(key))
        .any(names)
}

/// A map with each entry replaced by its copies; entries without copies stay.
fn with_copies(entry: &Entry, copies: impl Fn(&str, &Entry) -> Vec<(String, Entry)>) -> Entry {
    let Value::Map(map) = &entry.node.value else {
        return entry.clone();
    };
    let map = map.iter().flat_map(|(name, entry)| copies(name, entry));
    Entry {
        key_location: entry.key_location.clone(),
        node: Node {
            value: Value::Map(map.collect()),
            location: entry.node.location.clone(),
        },
    }
}

fn mesh_copies(name: &str, entry: &Entry, meshes: &[Mesh<'_>]) -> Vec<(String, Entry)> {
    let Some(mesh) = meshes.iter().find(|m| m.connection == name) else {
        return vec![(name.to_owned(), entry.clone())];
    };
    let one = |i: usize| {
        let mut copy = entry.clone();
        let planet = format!("{}_{}", mesh.planet, i + 1);
        let turns = (i as i64 * mesh.teeth.0).rem_euclid(mesh.count as i64);
        if let Value::Map(map) = &mut copy.node.value {
            if let Some(Value::Map(geometry)) = map.get_mut(mesh.kind).map(|e| &mut e.node.value) {
                geometry.shift_remove("planets");
                if let Some(entry) = geometry.get_mut("planet") {
                    entry.node.value = Node::quoted(planet.clone()).value;
                }
                if let Some(Value::Map(teeth)) =
                    geometry.get_mut("teeth").map(|e| &mut e.node.value)
                {
                    let renamed = std::mem::take(teeth).into_iter().map(|(body, entry)| {
                        let is_planet = body == mesh.planet;
                        (if is_planet { planet.clone() } else { body }, entry)
                    });
                    *teeth = renamed.collect();
                }
            }
            if !map.contains_key("lag") {
                let lag = Node::number(turns as f64 / mesh.count as f64);
                map.insert("lag".to_owned(), lag.into());
            }
        }
        (format!("{name}_{}", i + 1), copy)
    };
    (0..mesh.count).map(one).collect()
}

fn body_copies(
    name: &str,
    entry: &Entry,
    root: &Node,
    meshes: &[Mesh<'_>],
) -> Vec<(String, Entry)> {
    if let Some(mesh) = meshes.iter().find(|m| m.planet == name) {
        let mut own = entry.clone();
        if let Value::Map(map) = &mut own.node.value {
            map.shift_remove("mass");
        }
        let one = |i: usize| (format!("{name}_{}", i + 1), own.clone());
        return (0..mesh.count).map(one).collect();
    }
    let mut copy = entry.clone();
    if let (Some(heavy), Value::Map(map)) =
        (on_carrier(name, entry, root, meshes), &mut copy.node.value)
    {
        map.insert("inertia".to_owned(), Node::number(heavy).into());
    }
    vec![(name.to_owned(), copy)]
}

/// Inertia of a carrier with the masses of its planets at their centres.
fn on_carrier(name: &str, entry: &Entry, root: &Node, meshes: &[Mesh<'_>]) -> Option<f64> {
    let mut added = 0.0;
    let mut seen: Vec<&str> = Vec::new();
    for mesh in meshes.iter().filter(|m| m.carrier == name) {
        if seen.contains(&mesh.planet) {
            continue;
        }
        seen.push(mesh.planet);
        let mass = root.at(&format!("bodies.{}.mass", mesh.planet));
        let mass = mass.and_then(|node| {
            Quantity::from_node(node, "")
                .ok()?
                .si(UnitDimension::MASS)
                .ok()
        });
        added += mesh.count as f64 * mass? * mesh.centre * mesh.centre;
    }
    let own = Quantity::from_node(entry.node.get("inertia")?, "").ok()?;
    (added > 0.0).then_some(own.si(UnitDimension::INERTIA).ok()? + added)
}

fn load_copies(name: &str, entry: &Entry, meshes: &[Mesh<'_>]) -> Vec<(String, Entry)> {
    match meshes.iter().find(|m| m.planet == name) {
        None => vec![(name.to_owned(), entry.clone())],
        Some(mesh) => {
            let one = |i: usize| (format!("{name}_{}", i + 1), entry.clone());
            (0..mesh.count).map(one).collect()
        }
    }
}

/// Errors of a `mass` that is not that of a planet.
pub(super) fn refuse_mass(fields: &Fields<'_>, mistakes: &mut Mistakes) {
    if let Some(node) = fields.get("mass") {
        let message = "applies only to a planet with `planets: N` in its meshes; other bodies need only `inertia`";
        mistakes.add(Diagnostic::at(node, &fields.path_of("mass"), message));
    }
}
