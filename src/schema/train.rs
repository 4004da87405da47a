//! Bodies, connections, damping, scaling.

use super::scalars::{Range, nullable, quantity, text};
use super::series::{Units, keys};
use super::{NAME, exactly_one, excludes, named, object, reference};
use crate::model::GEOMETRY;
use serde_json::{Map, Value, json};

pub(super) fn define(definitions: &mut Map<String, Value>) {
    let inertia = "kg m^2 for a turning body; a mass in kg (`250 kg`) makes it a sliding one.";
    let body = object(
        "A body and its inertia.",
        json!({ "inertia": quantity(inertia, Range::Positive) }),
        &["inertia"],
    );
    definitions.insert("body".into(), body);
    let mut bodies = named("Inertias by name.", NAME, reference("body"));
    bodies["minProperties"] = json!(1);
    definitions.insert("bodies".into(), bodies);
    definitions.insert("connection".into(), connection());
    let mut connections = named(
        "Compliant connections by name; the first independent ones are the relative coordinates.",
        NAME,
        reference("connection"),
    );
    connections["minProperties"] = json!(1);
    definitions.insert("connections".into(), connections);
    let loads = named("Torques and forces by body.", NAME, reference("load"));
    definitions.insert("loads".into(), loads);
    definitions.insert("damping".into(), damping());
    definitions.insert("scaling".into(), scaling());
}

/// Two wheels with their base radii.
fn wheels(about: &str) -> Value {
    let radius = quantity("Base radius [m].", Range::Positive);
    let mut pair = named(about, NAME, radius);
    pair["minProperties"] = json!(2);
    pair["maxProperties"] = json!(2);
    pair
}

fn geometry(kind: &str) -> Value {
    match kind {
        "gear" => wheels("External mesh {A: R_A, B: R_B}: deformation R_A th_A + R_B th_B [m]."),
        "internal_gear" => {
            wheels("Internal mesh {A: R_A, B: R_B}: deformation R_A th_A - R_B th_B [m].")
        }
        "shaft" => json!({
            "description": "Shaft [A, B]: deformation th_A - th_B [rad] (x_A - x_B [m] between sliding masses).",
            "type": "array",
            "items": text("Name of a body."),
            "minItems": 2,
            "maxItems": 2,
        }),
        "ground" => text("A body held by the frame: deformation th_A [rad], or x_A [m]."),
        _ => {
            let arm = "Lever arm [m] of a turning body; a number (1) for a sliding mass, and for turning bodies where the \
                       deformation is an angle.";
            let mut arms = named(
                "Any lever arms by body: deformation is their sum times the motions.",
                NAME,
                quantity(arm, Range::Any),
            );
            arms["minProperties"] = json!(1);
            arms
        }
    }
}

fn connection() -> Value {
    let mut properties: Map<String, Value> = GEOMETRY
        .iter()
        .map(|kind| ((*kind).to_owned(), nullable(geometry(kind))))
        .collect();
    let law = json!({
        "description": "Force law of the deformation; linear when absent.",
        "anyOf": [reference("law"), { "type": "null" }],
    });
    properties.insert(
        "stiffness".into(),
        quantity(
            "Reference stiffness, > 0 [N/m; N m/rad for shafts].",
            Range::Positive,
        ),
    );
    let dashpot = "Viscous damper parallel to the law [N s/m; N m s/rad].";
    properties.insert(
        "damping".into(),
        nullable(quantity(dashpot, Range::NotNegative)),
    );
    properties.insert("element".into(), law);
    let scale = "Own displacement scale [m; rad for shafts].";
    properties.insert("length".into(), nullable(quantity(scale, Range::Positive)));
    properties.extend(keys(Units::Si));
    let about = "A compliant connection: one geometry, a stiffness, a law.";
    let mut value = object(about, Value::Object(properties), &["stiffness"]);
    value["allOf"] = json!([exactly_one(&GEOMETRY)]);
    value
}

fn damping() -> Value {
    let ratio = |about: &str| quantity(about, Range::NotNegative);
    let list = json!({
        "description": "One ratio for each elastic mode, ascending frequency.",
        "type": "array",
        "items": ratio(""),
    });
    let mut value = object(
        "Damping of the whole train.",
        json!({
            "modal_ratio": nullable(ratio("Damping ratio of every elastic mode.")),
            "modal_ratios": nullable(list),
            "stiffness_proportional": nullable(ratio("c of C = c K [s].")),
        }),
        &[],
    );
    value["allOf"] = json!([excludes("modal_ratios", &["modal_ratio"])]);
    value
}

fn scaling() -> Value {
    let words = json!({ "enum": ["first_mode", "first_connection"] });
    object(
        "Characteristic values; they never change an answer in SI units.",
        json!({
            "frequency": {
                "description": "omega_c: `first_mode` (default), `first_connection`, or a value [rad/s].",
                "anyOf": [words, reference("positive_quantity"), { "type": "null" }],
            },
            "length": nullable(quantity(
                "l of every connection without its own `length`; the default is its first nonzero breakpoint, else 1.",
                Range::Positive,
            )),
        }),
        &[],
    )
}
