//! Quantities as a regular expression, for the JSON schema.

use super::{Quantity, symbols};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use std::borrow::Cow;

/// Name of quantities in the JSON schema.
pub const QUANTITY: &str = "quantity";
/// Bare numbers in quotes: decimal, hexadecimal, octal.
pub const NUMBER_PATTERN: &str =
    r"^\s*(?:[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|0x[0-9a-fA-F]+|0o[0-7]+)\s*$";

/// The regular expression of texts that [`Quantity::parse`] takes.
///
/// It knows all symbols but no dimensions, and brackets one level deep; what it cannot say the loader says.
pub fn pattern() -> String {
    let mut known: Vec<&str> = symbols().collect();
    known.sort_by_key(|symbol| std::cmp::Reverse(symbol.chars().count()));
    let number = r"[-+]?[0-9]+(?:\.[0-9]+)?";
    let fraction = format!(r"\(\s*{number}\s*(?:/\s*[0-9]+\s*)?\)");
    let power = format!(r"(?:[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+|\s*(?:\^|\*\*)\s*(?:{number}|{fraction}))?");
    let joint = r"\s*[*.·⋅/]?\s*";
    let symbol = format!(
        "(?:(?:{})(?![A-Za-zµμ°%_])|1(?![0-9])){power}",
        known.join("|")
    );
    let inner = format!(r"(?:/\s*)?{symbol}(?:{joint}{symbol})*");
    let factor = format!(r"(?:{symbol}|\(\s*{inner}\s*\){power})");
    let unit = format!(r"(?:/\s*)?{factor}(?:{joint}{factor})*");
    let number = NUMBER_PATTERN.strip_suffix('$').unwrap_or(NUMBER_PATTERN);
    format!(r"{number}(?:{unit}\s*)?$")
}

impl JsonSchema for Quantity {
    fn schema_name() -> Cow<'static, str> {
        QUANTITY.into()
    }

    fn json_schema(_generator: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"], "pattern": pattern() })
    }
}
