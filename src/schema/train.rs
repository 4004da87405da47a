//! Bodies, connections, damping, scaling.

use super::scalars::{Range, count, nullable, quantity, text};
use super::series::{Units, keys};
use super::{NAME, exactly_one, excludes, named, object, reference};
use crate::element::{find, registered};
use crate::model::GEOMETRY;
use serde_json::{Map, Value, json};

pub(super) fn define(definitions: &mut Map<String, Value>) {
    let inertia = "kg m^2 for a turning body; a mass in kg (`250 kg`) makes it a sliding one.";
    let body = object(
        "A body and its inertia.",
        json!({
            "inertia": quantity(inertia, Range::Positive),
            "drag": nullable(drag()),
            "mass": nullable(quantity("Mass of a planet, carried by its carrier where meshes have `planets: N` [kg].", Range::NotNegative)),
        }),
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

fn drag() -> Value {
    let parts = object(
        "Constant and viscous part, at the mean speed.",
        json!({
            "constant": nullable(quantity("[N m]", Range::NotNegative)),
            "viscous": nullable(quantity("[N m s/rad]", Range::NotNegative)),
        }),
        &[],
    );
    json!({
        "description": "Torque [N m] that opposes the mean rotation, whichever way the body turns; needs a `reference`.",
        "anyOf": [reference("not_negative_quantity"), parts],
    })
}

/// The `reference` of a train.
pub(super) fn mean_motion() -> Value {
    let speed = |about: &str| quantity(about, Range::Any);
    object(
        "The shaft whose revolutions orders count; its speed gives every other one.",
        json!({
            "body": text("Name of a body."),
            "speed": speed("Mean speed, such as `800 rpm`; a negative one turns the other way."),
            "also": nullable(named("Speeds for further rigid-body modes, by body.", NAME, speed(""))),
        }),
        &["body", "speed"],
    )
}

/// The `balance` of a train.
pub(super) fn balance() -> Value {
    json!({
        "description": "Body whose mean torque is computed from all others, one for each rigid-body mode.",
        "anyOf": [text(""), { "type": "array", "items": text(""), "minItems": 1 }],
    })
}

/// Keys of a mesh with teeth, besides the bodies.
fn toothed(about: &str, bodies: &[&str]) -> Value {
    let mut teeth = named("Numbers of teeth by body.", NAME, count(""));
    teeth["minProperties"] = json!(2);
    teeth["maxProperties"] = json!(2);
    let mut properties = json!({
        "teeth": teeth,
        "module": quantity("Normal module [m].", Range::Positive),
        "pressure_angle": nullable(quantity("Normal pressure angle [rad]; 20 deg when absent.", Range::NotNegative)),
        "helix_angle": nullable(quantity("Helix angle [rad]; 0 when absent.", Range::NotNegative)),
        "centre_distance": nullable(quantity("Working centre distance [m], where profiles are shifted.", Range::Positive)),
    });
    if !bodies.is_empty() {
        properties["planets"] = nullable(count(
            "Number of equal planets, copied with the phases of their meshes.",
        ));
    }
    for body in bodies {
        properties[*body] = text("Name of a body.");
    }
    let required: Vec<&str> = bodies.iter().copied().chain(["teeth", "module"]).collect();
    object(about, properties, &required)
}

/// Two wheels with their base radii.
fn wheels(about: &str) -> Value {
    let radius = quantity("Base radius [m].", Range::Positive);
    let mut pair = named(about, NAME, radius);
    pair["minProperties"] = json!(2);
    pair["maxProperties"] = json!(2);
    pair
}

/// Two wheels by their base radii or by their teeth.
fn pair(about: &str) -> Value {
    json!({
        "description": about,
        "anyOf": [wheels("Base radii."), toothed("Numbers of teeth.", &[])],
    })
}

fn geometry(kind: &str) -> Value {
    match kind {
        "gear" => pair("External mesh {A: R_A, B: R_B}: deformation R_A th_A + R_B th_B [m]."),
        "internal_gear" => {
            pair("Internal mesh {A: R_A, B: R_B}: deformation R_A th_A - R_B th_B [m].")
        }
        "planet_gear" => toothed(
            "Sun and planet on a turning carrier: R_s th_s + R_p th_p - (R_s + R_p) th_c [m].",
            &["sun", "planet", "carrier"],
        ),
        "planet_ring" => toothed(
            "Planet and ring on a turning carrier: R_p th_p - R_r th_r + (R_r - R_p) th_c [m].",
            &["ring", "planet", "carrier"],
        ),
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
            "Reference stiffness, > 0 [N/m; N m/rad for shafts]; may be left out for laws without displacement (friction).",
            Range::Positive,
        ),
    );
    let dashpot = "Viscous damper parallel to the law [N s/m; N m s/rad].";
    properties.insert(
        "damping".into(),
        nullable(quantity(dashpot, Range::NotNegative)),
    );
    properties.insert("element".into(), law);
    let lag =
        "Share of a mesh period by which transmission error and stiffness variation come later.";
    properties.insert("lag".into(), nullable(quantity(lag, Range::Any)));
    let scale = "Own displacement scale [m; rad for shafts].";
    properties.insert("length".into(), nullable(quantity(scale, Range::Positive)));
    properties.extend(keys(Units::Si));
    let about = "A compliant connection: one geometry, a stiffness, a law.";
    let mut value = object(about, Value::Object(properties), &[]);
    value["allOf"] = json!([exactly_one(&GEOMETRY), stiffness_or_friction()]);
    value
}

/// A stiffness, or a law that may do without one.
fn stiffness_or_friction() -> Value {
    let is_optional = |tag: &&str| {
        let example = find(tag).and_then(|info| info.example_law());
        *tag == "expression" || example.is_some_and(|law| !law.is_spring())
    };
    let tags = registered().into_iter().map(|info| info.tag);
    let tags: Vec<&str> = tags.filter(|tag| is_optional(tag)).collect();
    let law = json!({ "type": "object", "properties": { "type": { "enum": tags } }, "required": ["type"] });
    json!({ "anyOf": [
        { "required": ["stiffness"] },
        { "properties": { "element": law }, "required": ["element"] },
    ] })
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
