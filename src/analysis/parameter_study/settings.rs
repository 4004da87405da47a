//! Values as a user writes them.

use crate::quantity::Quantity;
use schemars::JsonSchema;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};
use serde::{Deserialize as DeriveDeserialize, Serialize as DeriveSerialize};

/// A value of a parameter: a number, with or without a unit, or a word.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum Given {
    /// A number.
    Quantity(Quantity),
    /// A word of a choice, `true` or `false`.
    Word(String),
}

impl Given {
    /// As written.
    pub fn text(&self) -> &str {
        match self {
            Given::Quantity(quantity) => &quantity.text,
            Given::Word(word) => word,
        }
    }
}

impl Serialize for Given {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Given::Quantity(quantity) => quantity.serialize(serializer),
            Given::Word(word) => match word.as_str() {
                "true" => serializer.serialize_bool(true),
                "false" => serializer.serialize_bool(false),
                word => serializer.serialize_str(word),
            },
        }
    }
}

impl<'de> Deserialize<'de> for Given {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneValue)
    }
}

struct OneValue;

impl OneValue {
    fn number<E: Error>(text: &str) -> Result<Given, E> {
        Quantity::parse(text)
            .map(Given::Quantity)
            .map_err(E::custom)
    }
}

impl Visitor<'_> for OneValue {
    type Value = Given;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number, a number with a unit, or a word")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Given, E> {
        OneValue::number(&format!("{value:?}"))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Given, E> {
        OneValue::number(&value.to_string())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Given, E> {
        OneValue::number(&value.to_string())
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Given, E> {
        Ok(Given::Word(value.to_string()))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Given, E> {
        match text.trim_start().chars().next() {
            Some(c) if c.is_alphabetic() || c == '_' => Ok(Given::Word(text.to_owned())),
            _ => OneValue::number(text),
        }
    }
}

/// Values along one direction of a grid.
#[derive(Debug, Clone, PartialEq, DeriveSerialize, JsonSchema)]
#[serde(untagged)]
pub enum Axis {
    /// A list.
    Values(Vec<Given>),
    /// A range.
    Range(Range),
}

/// Evenly spaced values, both ends included.
#[derive(Debug, Clone, PartialEq, DeriveSerialize, DeriveDeserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// First value.
    pub from: Quantity,
    /// Last value.
    pub to: Quantity,
    /// Number of values.
    pub points: u64,
    /// Spacing.
    #[serde(default)]
    pub spacing: Spacing,
}

/// Spacing of values between two ends.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, DeriveSerialize, DeriveDeserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Spacing {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios.
    Logarithmic,
}

impl<'de> Deserialize<'de> for Axis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneAxis)
    }
}

struct OneAxis;

impl<'de> Visitor<'de> for OneAxis {
    type Value = Axis;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a list of values, or {from, to, points}")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Axis, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(Axis::Values)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Axis, A::Error> {
        Range::deserialize(MapAccessDeserializer::new(map)).map(Axis::Range)
    }
}
