//! Numbers, quantities and texts, as the loader reads them: numbers in quotes too, texts that look like numbers too.

use crate::quantity::{NUMBER_PATTERN, QUANTITY};
use serde_json::{Map, Value, json};

/// A mantissa with a digit that is not 0, and no minus.
const ABOVE_ZERO: &str = r"(?=\s*\+?[0-9.]*[1-9])";
/// No minus.
const NOT_BELOW_ZERO: &str = r"(?!\s*-\.?[0-9.]*[1-9])";

/// Range of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberRange {
    Any,
    NotNegative,
    Positive,
}

impl NumberRange {
    const ALL: [NumberRange; 3] = [
        NumberRange::Any,
        NumberRange::NotNegative,
        NumberRange::Positive,
    ];

    fn prefix(self) -> &'static str {
        match self {
            NumberRange::Any => "",
            NumberRange::NotNegative => "not_negative_",
            NumberRange::Positive => "positive_",
        }
    }

    /// The pattern of numbers in this range, from one of all numbers.
    fn narrowed(self, pattern: &str) -> String {
        let rest = pattern.strip_prefix('^').unwrap_or(pattern);
        match self {
            NumberRange::Any => pattern.to_owned(),
            NumberRange::NotNegative => format!("^{NOT_BELOW_ZERO}{rest}"),
            NumberRange::Positive => format!("^{ABOVE_ZERO}{rest}"),
        }
    }

    fn number(self, pattern: &str) -> Value {
        let pattern = self.narrowed(pattern);
        let mut value = json!({ "type": ["number", "string"], "pattern": pattern });
        match self {
            NumberRange::Any => {}
            NumberRange::NotNegative => value["minimum"] = json!(0),
            NumberRange::Positive => value["exclusiveMinimum"] = json!(0),
        }
        value
    }
}

/// Definitions of numbers with and without units in every range, and of counts.
pub(super) fn define(definitions: &mut Map<String, Value>) {
    let quantity = crate::quantity::pattern();
    for range in NumberRange::ALL {
        let name = |kind: &str| format!("{}{kind}", range.prefix());
        definitions.insert(name(QUANTITY), range.number(&quantity));
        definitions.insert(name("number"), range.number(NUMBER_PATTERN));
    }
    let mut count = NumberRange::Positive.number(NUMBER_PATTERN);
    count["type"] = json!(["integer", "string"]);
    definitions.insert("count".into(), count);
}

/// A number with or without a unit, which the description names.
pub(super) fn quantity(about: &str, range: NumberRange) -> Value {
    super::described(&format!("{}{QUANTITY}", range.prefix()), about)
}

/// A bare number.
pub(super) fn number(about: &str, range: NumberRange) -> Value {
    super::described(&format!("{}number", range.prefix()), about)
}

/// Pattern of the numbers above 0.
pub(super) fn positive_number() -> String {
    NumberRange::Positive.narrowed(NUMBER_PATTERN)
}

/// A whole number from 1.
pub(super) fn count(about: &str) -> Value {
    super::described("count", about)
}

/// Any text; what looks like a number or a truth value is text as well.
pub(super) fn text(about: &str) -> Value {
    json!({ "description": about, "type": ["string", "number", "boolean"] })
}

/// The same, or nothing: null counts as absent.
pub(super) fn nullable(mut value: Value) -> Value {
    let about = value.get_mut("description").map(Value::take);
    if let Some(map) = value.as_object_mut() {
        map.shift_remove("description");
    }
    let mut either = json!({ "anyOf": [value, { "type": "null" }] });
    if let Some(about) = about {
        either["description"] = about;
    }
    either
}

/// Adds to a derived schema what the loader takes beyond serde's types, and drops formats that are not formats of JSON schema.
pub(super) fn loosen(value: &mut Value) {
    match value {
        Value::Array(list) => list.iter_mut().for_each(loosen),
        Value::Object(map) => {
            map.shift_remove("format");
            if let Some(reference) = map.get("$ref").cloned().filter(|_| map.len() > 1) {
                map.shift_remove("$ref");
                map.insert("allOf".into(), json!([{ "$ref": reference }]));
            }
            loosen_type(map);
            for (key, inner) in map.iter_mut() {
                if !matches!(key.as_str(), "default" | "const" | "enum") {
                    loosen(inner);
                }
            }
        }
        _ => {}
    }
}

fn loosen_type(map: &mut Map<String, Value>) {
    let is_closed = ["enum", "const", "pattern"]
        .iter()
        .any(|key| map.contains_key(*key));
    let mut types: Vec<String> = match map.get("type") {
        Some(Value::String(one)) => vec![one.clone()],
        Some(Value::Array(list)) => list
            .iter()
            .filter_map(|t| t.as_str().map(str::to_owned))
            .collect(),
        _ => return,
    };
    let has = |types: &[String], name: &str| types.iter().any(|t| t == name);
    if is_closed {
        return;
    }
    if has(&types, "number") || has(&types, "integer") {
        types.push("string".into());
        map.insert("pattern".into(), json!(NUMBER_PATTERN));
    } else if has(&types, "string") {
        types.extend(["number".to_owned(), "boolean".to_owned()]);
    } else {
        return;
    }
    map.insert("type".into(), json!(types));
}
