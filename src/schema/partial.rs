//! Partial twins of definitions, for files that extend others: nothing is required, null removes.

use serde_json::{Map, Value, json};

const PREFIX: &str = "#/definitions/";
/// Words of conditions on which keys occur together: keys that a file omits may be in its base.
const CONDITIONS: [&str; 4] = ["required", "allOf", "minProperties", "maxProperties"];

/// Name of the partial twin of a definition.
pub(super) fn twin(name: &str) -> String {
    format!("partial_{name}")
}

/// The twins of all definitions that contain maps.
pub(super) fn twins(definitions: &Map<String, Value>) -> Map<String, Value> {
    let mut twins = Map::new();
    for (name, value) in definitions {
        twins.insert(twin(name), loosened(value));
    }
    twins
}

/// Without what is required; every value of a map may be null. Lists are replaced as wholes and stay as they are.
fn loosened(value: &Value) -> Value {
    let Value::Object(map) = value else {
        return value.clone();
    };
    if let Some(name) = map.get("$ref").and_then(Value::as_str) {
        let name = name.strip_prefix(PREFIX).unwrap_or(name);
        return json!({ "$ref": format!("{PREFIX}{}", twin(name)) });
    }
    let is_map = map.contains_key("properties") || map.contains_key("propertyNames");
    let mut loose = Map::new();
    for (key, inner) in map {
        if is_map && CONDITIONS.contains(&key.as_str()) {
            continue;
        }
        let (key, inner) = match key.as_str() {
            "properties" => (key.as_str(), every_value(inner)),
            "additionalProperties" if inner.is_object() => (key.as_str(), removable(inner)),
            // A law without its type fits several.
            "oneOf" => ("anyOf", every_branch(inner)),
            "anyOf" | "allOf" => (key.as_str(), every_branch(inner)),
            _ => (key.as_str(), inner.clone()),
        };
        loose.insert(key.to_owned(), inner);
    }
    Value::Object(loose)
}

fn every_value(properties: &Value) -> Value {
    let map = properties.as_object().into_iter().flatten();
    map.map(|(key, value)| (key.clone(), removable(value)))
        .collect()
}

fn every_branch(list: &Value) -> Value {
    list.as_array()
        .into_iter()
        .flatten()
        .map(loosened)
        .collect()
}

/// The value, or null. The description stays where editors look for it.
fn removable(value: &Value) -> Value {
    let mut either = json!({ "anyOf": [loosened(value), { "type": "null" }] });
    if let Some(about) = value.get("description") {
        either["description"] = about.clone();
    }
    either
}
