//! The JSON schema of the model file, for completion and validation in editors.
//!
//! Analyses come from their settings (schemars), laws from the registry, plugins included; the parts of the model that are read
//! by hand are described by hand. Draft 07, which the YAML servers of editors understand in full.
//!
//! A file that extends another may leave out whatever is required and may remove entries with `null`: for such files every
//! definition has a partial twin.

mod laws;
mod partial;
mod reduced;
mod scalars;
mod series;
mod train;

use crate::analysis;
use crate::model::SCHEMA;
use crate::report::Plot;
use scalars::{nullable, text};
use schemars::SchemaGenerator;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

/// Names of bodies, connections, elements and analyses.
const NAME: &str = "^[A-Za-z_][A-Za-z0-9_-]*$";
/// Names of analyses: those of the files of a whole run are taken.
const ANALYSIS_NAME: &str = "^(?!(manifest|report)$)[A-Za-z_][A-Za-z0-9_-]*$";
const DRAFT: &str = "http://json-schema.org/draft-07/schema#";

/// The schema of the model file.
pub fn schema() -> Value {
    let mut definitions = Map::new();
    scalars::define(&mut definitions);
    series::define(&mut definitions);
    laws::define(&mut definitions);
    train::define(&mut definitions);
    reduced::define(&mut definitions);
    define_analyses(&mut definitions);
    definitions.insert("model".into(), model());
    let twins = partial::twins(&definitions);
    definitions.extend(twins);
    json!({
        "$schema": DRAFT,
        "title": "gearlash model file",
        "if": { "required": ["extends"] },
        "then": reference(&partial::twin("model")),
        "else": reference("model"),
        "definitions": definitions,
    })
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/definitions/{name}") })
}

/// A reference with a description of its own, which draft 07 would ignore beside `$ref`.
fn described(name: &str, about: &str) -> Value {
    json!({ "description": about, "allOf": [reference(name)] })
}

/// A map with exactly these keys; `required` among them.
fn object(about: &str, properties: Value, required: &[&str]) -> Value {
    json!({
        "description": about,
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

/// A map from names to values.
fn named(about: &str, pattern: &str, value: Value) -> Value {
    json!({
        "description": about,
        "type": "object",
        "propertyNames": { "pattern": pattern },
        "additionalProperties": value,
    })
}

/// That a key is given and not empty: null counts as absent.
fn given(key: &str) -> Value {
    json!({ "required": [key], "properties": { key: { "not": { "type": "null" } } } })
}

/// That exactly one of several keys is given.
fn exactly_one(keys: &[&str]) -> Value {
    json!({ "oneOf": keys.iter().map(|key| given(key)).collect::<Vec<_>>() })
}

/// That none of several keys is given beside another.
fn excludes(key: &str, others: &[&str]) -> Value {
    let others: Vec<Value> = others.iter().map(|other| given(other)).collect();
    json!({ "not": { "allOf": [given(key), { "anyOf": others }] } })
}

fn model() -> Value {
    let of_trains = [
        "bodies",
        "matrices",
        "connections",
        "damping",
        "loads",
        "scaling",
        "reference",
        "balance",
    ];
    let mut all = object(
        "A gear train, or a reduced nondimensional system, and what to compute.",
        json!({
            "schema": {
                "description": "Version of the model file.",
                "enum": [SCHEMA, SCHEMA.to_string(), null],
            },
            "name": nullable(text("Name of the model, for titles.")),
            "extends": text("Base model file, relative to this one: maps merge, lists and single values are replaced, null removes."),
            "bodies": described("bodies", "Inertias by name."),
            "matrices": nullable(train::matrices()),
            "connections": described("connections", "Compliant connections by name; the first independent ones are the relative coordinates."),
            "damping": nullable(described("damping", "Damping of the whole train, in addition to the dashpots of connections.")),
            "loads": nullable(described("loads", "Torques (forces on sliding masses) by body.")),
            "scaling": nullable(described("scaling", "Characteristic frequency and displacement.")),
            "reference": nullable(train::mean_motion()),
            "balance": nullable(train::balance()),
            "reduced": described("reduced", "Nondimensional system, instead of bodies and connections."),
            "report": nullable(object(
                "Units of the results.",
                json!({ "units": {
                    "description": "`si` (the default for trains) or `nondimensional` (the only choice for reduced systems).",
                    "enum": ["si", "nondimensional", null],
                }}),
                &[],
            )),
            "analyses": nullable(named("Analyses by name.", ANALYSIS_NAME, reference("analysis"))),
        }),
        &[],
    );
    all["patternProperties"] = json!({ "^x-": true });
    all["allOf"] = json!([
        { "anyOf": [given("reduced"), { "allOf": [given("bodies"), given("connections")] }] },
        excludes("reduced", &of_trains),
    ]);
    all
}

/// Settings of every analysis type, each with the keys that all of them take.
fn define_analyses(definitions: &mut Map<String, Value>) {
    let mut generator = SchemaGenerator::new(SchemaSettings::draft07());
    let mut types = Vec::new();
    let mut plot = nullable(generator.subschema_for::<Plot>().to_value());
    plot["description"] =
        json!("What the figure shows: columns, axes, ranges, events, connections, methods.");
    for (tag, about, settings) in analysis::TYPES {
        let mut own = settings(&mut generator).to_value();
        scalars::loosen(&mut own);
        own["title"] = json!(tag);
        own["description"] = json!(about);
        let mut properties = common(tag, about);
        properties.insert("plot".into(), plot.clone());
        if let Some(Value::Object(keys)) = own.get_mut("properties").map(Value::take) {
            properties.extend(keys);
        }
        own["properties"] = Value::Object(properties);
        match own.get_mut("required").and_then(Value::as_array_mut) {
            Some(required) => required.insert(0, json!("type")),
            None => own["required"] = json!(["type"]),
        }
        types.push(own);
    }
    for (name, mut value) in generator.take_definitions(false) {
        scalars::loosen(&mut value);
        definitions.entry(name).or_insert(value);
    }
    definitions.insert("analysis".into(), json!({ "oneOf": types }));
}

/// Measured curves over the figures of an analysis.
fn compare() -> Value {
    let one = object(
        "Measured values, drawn over the computed curve of the same quantity.",
        json!({
            "file": text("Table with a header row (CSV), relative to this file."),
            "x": text("Name of its column of abscissas."),
            "y": text("Name of its column of ordinates."),
            "over": nullable(text("Computed column over which the values lie, such as `rms.mesh_1`; the one called `y` when absent, else that of the first panel.")),
            "x_unit": nullable(text("Unit of the abscissas; that of the axis when absent.")),
            "y_unit": nullable(text("Unit of the ordinates; that of the computed column when absent.")),
            "label": nullable(text("Text in the legend; the name of the file when absent.")),
        }),
        &["file", "x", "y"],
    );
    json!({
        "description": "Measured values over the computed curve, or a list of them.",
        "anyOf": [one, { "type": "array", "items": one }],
    })
}

fn common(tag: &str, about: &str) -> Map<String, Value> {
    let keys = json!({
        "type": { "description": about, "const": tag },
        "title": nullable(text("Title of the figure and of the section in the report.")),
        "caption": nullable(text("Caption: what the figure shows.")),
        "assumed": {
            "description": "Assumed parameters, listed in the report.",
            "type": "array",
            "items": text(""),
        },
        "compare": nullable(compare()),
        "set": {
            "description": "Values of the model that differ in this analysis, by dotted path.",
            "type": ["object", "null"],
        },
    });
    match keys {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}
