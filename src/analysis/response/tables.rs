//! Which tables of a response are computed and written.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// An optional table. Tables with a key of their own (`orbits`, `verify`, ..) follow that key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ResponseTable {
    /// One row per point: `NAME.csv`. Always written, because figures and page draw it.
    Main,
    /// Events of the branches.
    Events,
    /// Contacts, impacts, forces, accelerations.
    Rattle,
    /// Floquet multipliers.
    Multipliers,
    /// Estimate of the multipliers from the averaged system.
    MultiplierEstimates,
}

/// The requested tables.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum TableChoice {
    /// All but the estimated multipliers; rattle where a law has a gap.
    #[default]
    Usual,
    /// All.
    All,
    /// These, and the main one.
    Listed(Vec<ResponseTable>),
}

impl TableChoice {
    /// Whether a table is computed; `has_gap`: whether any law has one.
    pub fn include(&self, table: ResponseTable, has_gap: bool) -> bool {
        match (self, table) {
            (_, ResponseTable::Main) | (TableChoice::All, _) => true,
            (TableChoice::Listed(list), _) => list.contains(&table),
            (TableChoice::Usual, ResponseTable::Rattle) => has_gap,
            (TableChoice::Usual, ResponseTable::MultiplierEstimates) => false,
            (TableChoice::Usual, ResponseTable::Events | ResponseTable::Multipliers) => true,
        }
    }

    /// Whether no tables were requested.
    pub fn are_usual(&self) -> bool {
        *self == TableChoice::Usual
    }
}

impl JsonSchema for TableChoice {
    fn schema_name() -> Cow<'static, str> {
        "Tables".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<ResponseTable>();
        json_schema!({ "anyOf": [{ "const": "all" }, { "type": "array", "items": table }] })
    }
}

impl Serialize for TableChoice {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            TableChoice::Usual => serializer.serialize_none(),
            TableChoice::All => serializer.serialize_str("all"),
            TableChoice::Listed(list) => list.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for TableChoice {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WrittenTables)
    }
}

struct WrittenTables;

impl<'de> serde::de::Visitor<'de> for WrittenTables {
    type Value = TableChoice;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("`all`, or a list of tables such as [main, events, rattle]")
    }

    fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<TableChoice, E> {
        match word {
            "all" => Ok(TableChoice::All),
            _ => Err(E::invalid_value(serde::de::Unexpected::Str(word), &self)),
        }
    }

    fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut list: A) -> Result<TableChoice, A::Error> {
        let mut tables = Vec::new();
        while let Some(table) = list.next_element()? {
            tables.push(table);
        }
        Ok(TableChoice::Listed(tables))
    }
}
