//! A model in words and numbers, as its author wrote it.

use super::Study;
use crate::model::{GEOMETRY, Motion, Structure, Train};
use crate::report::{ArmNote, BodyNote, ConnectionNote, Description};
use crate::yaml::{Node, Value};
use serde_json::Map;
use std::f64::consts::TAU;

/// Keys of a connection that are said elsewhere.
const SAID: [&str; 2] = ["stiffness", "element"];
/// Parts of a document that are not part of the model.
const NO_MODEL: [&str; 3] = ["analyses", "schema", "name"];
/// Characters of a list or table that are shown.
const LONGEST: usize = 60;

impl Study {
    /// The model in words and numbers.
    pub fn describe(&self) -> Description {
        let root = self.model.document();
        let mut values = Map::new();
        if let Value::Map(map) = &root.value {
            let parts = map
                .iter()
                .filter(|(key, _)| !NO_MODEL.contains(&key.as_str()) && !key.starts_with("x-"));
            parts.for_each(|(key, entry)| flatten(key, &entry.node, &mut values));
        }
        let (bodies, connections) = match &self.model.structure {
            Structure::Train(train) => (bodies(root, train), connections(root, train)),
            Structure::Reduced(_) => (Vec::new(), elements(root)),
        };
        Description {
            name: self.model.name.clone(),
            bodies,
            connections,
            values,
        }
    }
}

/// Every scalar below a node with its dotted path.
fn flatten(path: &str, node: &Node, into: &mut Map<String, serde_json::Value>) {
    match &node.value {
        Value::Map(map) => {
            for (key, entry) in map {
                flatten(&format!("{path}.{key}"), &entry.node, into);
            }
        }
        Value::List(list) => {
            for (k, entry) in list.iter().enumerate() {
                flatten(&format!("{path}.{k}"), entry, into);
            }
        }
        Value::Scalar { .. } => {
            into.insert(path.to_owned(), node.to_json());
        }
    }
}

/// A value as it was written, in one line.
fn written(node: &Node) -> String {
    match &node.value {
        Value::Scalar { text, .. } => text.clone(),
        Value::Map(map) => {
            let parts = map
                .iter()
                .map(|(key, entry)| format!("{key} {}", written(&entry.node)));
            shortened(parts.collect::<Vec<_>>().join(", "))
        }
        Value::List(list) => {
            let parts: Vec<String> = list.iter().map(written).collect();
            shortened(parts.join("; "))
        }
    }
}

fn shortened(text: String) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}\u{2026}", &text[..end]),
        None => text,
    }
}

fn bodies(root: &Node, train: &Train) -> Vec<BodyNote> {
    let note = |(k, (name, body)): (usize, (&String, &crate::model::Body))| {
        let own = root.at(&format!("bodies.{name}"));
        let inertia = own.and_then(|n| n.get("inertia")).map(written);
        let unit = match body.motion {
            Motion::Rotation => "kg m^2",
            Motion::Translation => "kg",
        };
        BodyNote {
            name: name.clone(),
            inertia: match inertia {
                _ if train.is_moved(k) => "prescribed motion".into(),
                Some(text) => with_unit(text, unit),
                None => format!("{:.4e} {unit}", body.inertia),
            },
            loads: loads(root, name),
            speed_rpm: train
                .mean_motion
                .as_ref()
                .map(|m| m.speed_of(k) * 60.0 / TAU),
            slides: body.motion == Motion::Translation,
        }
    };
    train.bodies.iter().enumerate().map(note).collect()
}

/// A bare number is SI.
fn with_unit(text: String, unit: &str) -> String {
    match text.trim().parse::<f64>() {
        Ok(_) if !unit.is_empty() => format!("{text} {unit}"),
        _ => text,
    }
}

fn loads(root: &Node, body: &str) -> Vec<String> {
    let mut list = Vec::new();
    if let Some(drag) = root
        .at(&format!("bodies.{body}"))
        .and_then(|n| n.get("drag"))
    {
        list.push(format!("drag {}", with_unit(written(drag), "N m")));
    }
    let Some(Value::Map(map)) = root.at(&format!("loads.{body}")).map(|n| &n.value) else {
        return list;
    };
    for (key, entry) in map {
        match &entry.node.value {
            Value::List(parts) if key == "harmonics" => {
                for part in parts.iter().take(3) {
                    let text = |key: &str| part.get(key).map(written).unwrap_or_default();
                    list.push(format!(
                        "order {}: {}",
                        text("order"),
                        with_unit(text("amplitude"), "N m")
                    ));
                }
                if parts.len() > 3 {
                    list.push(format!("and {} orders more", parts.len() - 3));
                }
            }
            _ => list.push(format!("{key} {}", with_unit(written(&entry.node), "N m"))),
        }
    }
    list
}

fn connections(root: &Node, train: &Train) -> Vec<ConnectionNote> {
    let body = |k: usize| {
        train
            .bodies
            .get_index(k)
            .map_or(String::new(), |(name, _)| name.clone())
    };
    let note = |(name, connection): (&String, &crate::model::Connection)| {
        let own = root.at(&format!("connections.{name}"));
        let kind = GEOMETRY
            .iter()
            .find(|key| own.is_some_and(|n| n.get(key).is_some()));
        let unit = match connection.unit {
            crate::model::DeformationUnit::Metre => "N/m",
            crate::model::DeformationUnit::Radian => "N m/rad",
        };
        let stiffness = own
            .and_then(|n| n.get("stiffness"))
            .map(written)
            .unwrap_or_default();
        let (law, parameters) = law(own.and_then(|n| n.get("element")));
        ConnectionNote {
            name: name.clone(),
            kind: kind.map_or("acts_on", |kind| kind).to_owned(),
            arms: (connection.arms.iter())
                .map(|(k, length)| ArmNote {
                    body: body(*k),
                    length: *length,
                })
                .collect(),
            stiffness: with_unit(stiffness, unit),
            law,
            parameters,
            further: own.map(further).unwrap_or_default(),
        }
    };
    train.connections.iter().map(note).collect()
}

/// Tag and parameters of a law.
fn law(element: Option<&Node>) -> (String, String) {
    let Some(Value::Map(map)) = element.map(|n| &n.value) else {
        return ("linear".into(), String::new());
    };
    let tag = map.get("type").map(|entry| written(&entry.node));
    let own = map.iter().filter(|(key, _)| *key != "type");
    let own = own.map(|(key, entry)| format!("{} {}", key.replace('_', " "), written(&entry.node)));
    (tag.unwrap_or_default(), own.collect::<Vec<_>>().join(", "))
}

fn further(node: &Node) -> String {
    let Value::Map(map) = &node.value else {
        return String::new();
    };
    let rest = map.iter().filter(|(key, entry)| {
        !SAID.contains(&key.as_str()) && !GEOMETRY.contains(&key.as_str()) && !entry.node.is_null()
    });
    let rest =
        rest.map(|(key, entry)| format!("{}: {}", key.replace('_', " "), written(&entry.node)));
    rest.collect::<Vec<_>>().join("; ")
}

/// Laws of a reduced model.
fn elements(root: &Node) -> Vec<ConnectionNote> {
    let Some(Value::Map(map)) = root.at("reduced.elements").map(|n| &n.value) else {
        return Vec::new();
    };
    let note = |(name, entry): (&String, &crate::yaml::Entry)| {
        let (law, parameters) = law(Some(&entry.node));
        ConnectionNote {
            name: name.clone(),
            law,
            parameters,
            ..ConnectionNote::default()
        }
    };
    map.iter().map(note).collect()
}
