//! Laws, from the registry: plugins included.

use super::scalars::{Range, text};
use super::series::{Units, keys};
use super::{exactly_one, object, reference};
use crate::element::{ElementInfo, ParameterInfo, ParameterKind, ParameterRange, registered};
use serde_json::{Map, Value, json};

pub(super) fn define(definitions: &mut Map<String, Value>) {
    for units in [Units::Si, Units::Bare] {
        let mut laws = Vec::new();
        for info in registered() {
            let name = units.name(&format!("law_{}", info.tag));
            laws.push(reference(&name));
            definitions.insert(name, law(info, units));
        }
        definitions.insert(units.name("law"), json!({ "oneOf": laws }));
    }
}

fn law(info: &ElementInfo, units: Units) -> Value {
    let mut properties = Map::new();
    properties.insert(
        "type".into(),
        json!({ "description": info.doc, "const": info.tag }),
    );
    for p in info.parameters {
        properties.insert(p.name.into(), parameter(p, units));
    }
    if units == Units::Bare {
        properties.extend(keys(units));
    }
    let own = info.parameters.iter().filter(|p| p.is_required());
    let required: Vec<&str> = ["type"].into_iter().chain(own.map(|p| p.name)).collect();
    let mut value = object(info.doc, Value::Object(properties), &required);
    value["title"] = json!(info.tag);
    let mut groups: Vec<&[&str]> = Vec::new();
    for p in info.parameters.iter().filter(|p| !p.one_of.is_empty()) {
        if !groups.contains(&p.one_of) {
            groups.push(p.one_of);
        }
    }
    if !groups.is_empty() {
        value["allOf"] = groups.into_iter().map(exactly_one).collect();
    }
    value
}

fn parameter(p: &ParameterInfo, units: Units) -> Value {
    let range = match p.range {
        ParameterRange::Any => Range::Any,
        ParameterRange::NotNegative => Range::NotNegative,
        ParameterRange::Positive => Range::Positive,
    };
    let unit = match units {
        Units::Si => p.dimension.unit(),
        Units::Bare => None,
    };
    let about = unit.map_or_else(|| p.doc.to_owned(), |unit| format!("{} [{unit}]", p.doc));
    let one = |about: &str| units.number(about, range);
    let mut value = match p.kind {
        ParameterKind::Number => one(&about),
        ParameterKind::List => {
            json!({ "description": about, "type": "array", "items": one("") })
        }
        ParameterKind::Choice(words) => json!({ "description": about, "enum": words }),
        ParameterKind::Text => text(&about),
        ParameterKind::Map => {
            json!({ "description": about, "type": "object", "additionalProperties": one("") })
        }
    };
    if let Some(default) = p.default {
        // Numbers, lists and maps are the same in JSON; words are not.
        let written = serde_json::from_str(default);
        value["default"] = written.unwrap_or_else(|_| json!(default));
    }
    value
}
