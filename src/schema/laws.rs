//! Laws, from the registry: plugins included.

use super::scalars::{NumberRange, nullable, quantity, text};
use super::series::{SeriesUnits, keys};
use super::{exactly_one, object, reference};
use crate::element::{ElementInfo, ParameterInfo, ParameterKind, ParameterRange, registered};
use serde_json::{Map, Value, json};

pub(super) fn define(definitions: &mut Map<String, Value>) {
    for units in [SeriesUnits::Si, SeriesUnits::Bare] {
        let mut laws = Vec::new();
        for info in registered() {
            let name = units.name(&format!("law_{}", info.tag));
            laws.push(reference(&name));
            definitions.insert(name, law(info, units));
        }
        definitions.insert(units.name("law"), json!({ "oneOf": laws }));
    }
}

fn law(info: &ElementInfo, units: SeriesUnits) -> Value {
    let mut properties = Map::new();
    properties.insert(
        "type".into(),
        json!({ "description": info.doc, "const": info.tag }),
    );
    for p in info.parameters {
        properties.insert(p.name.into(), parameter(p, units));
    }
    if units == SeriesUnits::Bare {
        properties.extend(keys(units));
    }
    // On a mesh with teeth the gap may be given as on a drawing.
    let is_drawn = |p: &ParameterInfo| units == SeriesUnits::Si && p.name == DRAWN;
    if info.parameters.iter().any(is_drawn) {
        properties.insert(BACKLASH.into(), nullable(drawing()));
    }
    let own = info
        .parameters
        .iter()
        .filter(|p| p.is_required() && !is_drawn(p));
    let required: Vec<&str> = ["type"].into_iter().chain(own.map(|p| p.name)).collect();
    let mut value = object(info.doc, Value::Object(properties), &required);
    value["title"] = json!(info.tag);
    let mut groups: Vec<Vec<&str>> = Vec::new();
    for p in info.parameters {
        let mut group = p.one_of.to_vec();
        if is_drawn(p) || group.contains(&DRAWN) && units == SeriesUnits::Si {
            if group.is_empty() {
                group.push(DRAWN);
            }
            group.push(BACKLASH);
        }
        if !group.is_empty() && !groups.contains(&group) {
            groups.push(group);
        }
    }
    if !groups.is_empty() {
        value["allOf"] = groups.iter().map(|group| exactly_one(group)).collect();
    }
    value
}

/// The parameter given by the backlash of a drawing.
const DRAWN: &str = "half_gap";
/// Key of the backlash of a drawing.
const BACKLASH: &str = "backlash";

fn drawing() -> Value {
    let way = |about: &str| nullable(quantity(about, NumberRange::NotNegative));
    let mut value = object(
        "Backlash from a drawing, for a mesh with `teeth`; converted to the half gap on the line of action.",
        json!({
            "circumferential": way("On the reference circle [m]."),
            "normal": way("Normal to the flanks [m]."),
            "angular": way("Angle of the first wheel with the other wheel fixed [rad]."),
        }),
        &[],
    );
    value["allOf"] = json!([exactly_one(&["circumferential", "normal", "angular"])]);
    value
}

fn parameter(p: &ParameterInfo, units: SeriesUnits) -> Value {
    let range = match p.range {
        ParameterRange::Any => NumberRange::Any,
        ParameterRange::NotNegative => NumberRange::NotNegative,
        ParameterRange::Positive => NumberRange::Positive,
    };
    let unit = match units {
        SeriesUnits::Si => p.dimension.unit(),
        SeriesUnits::Bare => None,
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
        ParameterKind::Switch => json!({ "description": about, "type": "boolean" }),
        ParameterKind::Records(fields) => {
            let properties = fields
                .iter()
                .map(|f| (f.name.to_string(), parameter(f, units)));
            let required: Vec<&str> = fields
                .iter()
                .filter(|f| f.is_required())
                .map(|f| f.name)
                .collect();
            let one = object("", Value::Object(properties.collect()), &required);
            json!({ "description": about, "type": "array", "items": one })
        }
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
