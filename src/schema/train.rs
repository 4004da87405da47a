//! Bodies, connections, damping, scaling.

use super::scalars::{NumberRange, count, nullable, quantity, text};
use super::series::{SeriesUnits, keys};
use super::{NAME, described, exactly_one, excludes, named, object, reference};
use crate::element::{find, registered};
use crate::model::GEOMETRY;
use serde_json::{Map, Value, json};

pub(super) fn define(definitions: &mut Map<String, Value>) {
    let inertia =
        "Moment of inertia [kg m^2]; a value in kg (`250 kg`) makes the body a sliding mass.";
    let body = object(
        "A body and its inertia.",
        json!({
            "inertia": quantity(inertia, NumberRange::Positive),
            "drag": nullable(drag()),
            "motion": nullable(described("motion", "Measured motion: the body moves as it says and takes whatever torque that needs.")),
            "mass": nullable(quantity("Mass of a planet [kg], added to its carrier if meshes have `planets: N`.", NumberRange::NotNegative)),
        }),
        &[],
    );
    let mut body = body;
    body["anyOf"] = json!([{ "required": ["inertia"] }, { "required": ["motion"] }]);
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
            "constant": nullable(quantity("[N m]", NumberRange::NotNegative)),
            "viscous": nullable(quantity("[N m s/rad]", NumberRange::NotNegative)),
        }),
        &[],
    );
    json!({
        "description": "Torque [N m] that opposes the mean rotation in either direction; requires a `reference`.",
        "anyOf": [reference("not_negative_quantity"), parts],
    })
}

/// The `matrices` of a train.
pub(super) fn matrices() -> Value {
    let matrix = |about: &str| super::described("matrix", about);
    let names = json!({ "type": "array", "items": text("Name of an angle."), "minItems": 1 });
    let motions = named(
        "Names with their motions.",
        NAME,
        json!({ "enum": ["rotation", "translation"] }),
    );
    let part = object(
        "A part given by symmetric matrices over its coordinates, bare numbers in SI units.",
        json!({
            "coordinates": {
                "description": "Names, which connections and loads use like those of bodies.",
                "anyOf": [names, motions],
            },
            "inertia": matrix("M, positive definite."),
            "stiffness": matrix("K, positive semidefinite."),
            "damping": nullable(matrix("C; it damps no motion that K leaves free.")),
        }),
        &["coordinates", "inertia", "stiffness"],
    );
    named(
        "Parts given by matrices, such as reduced finite-element models, by name.",
        NAME,
        part,
    )
}

/// The `reference` of a train.
pub(super) fn mean_motion() -> Value {
    let speed = |about: &str| quantity(about, NumberRange::Any);
    object(
        "Shaft to whose revolutions orders refer; its speed determines all others.",
        json!({
            "body": text("Name of a body."),
            "speed": speed("Mean speed, such as `800 rpm`; a negative value reverses the rotation."),
            "also": nullable(named("Speeds for further rigid-body modes, by body.", NAME, speed(""))),
        }),
        &["body", "speed"],
    )
}

/// The `balance` of a train.
pub(super) fn balance() -> Value {
    json!({
        "description": "Bodies whose mean torques are computed from all others, one per rigid-body mode.",
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
        "module": quantity("Normal module [m].", NumberRange::Positive),
        "pressure_angle": nullable(quantity("Normal pressure angle [rad]; default 20 deg.", NumberRange::NotNegative)),
        "helix_angle": nullable(quantity("Helix angle [rad]; default 0.", NumberRange::NotNegative)),
        "centre_distance": nullable(quantity("Working centre distance [m] of meshes with profile shift.", NumberRange::Positive)),
    });
    if !bodies.is_empty() {
        properties["planets"] = nullable(count(
            "Number of equal planets; bodies and meshes are copied, with the phases of the meshes.",
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
    let radius = quantity("Base radius [m].", NumberRange::Positive);
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
            "Sun and planet on a rotating carrier: deformation R_s th_s + R_p th_p - (R_s + R_p) th_c [m].",
            &["sun", "planet", "carrier"],
        ),
        "planet_ring" => toothed(
            "Planet and ring on a rotating carrier: deformation R_p th_p - R_r th_r + (R_r - R_p) th_c [m].",
            &["ring", "planet", "carrier"],
        ),
        "shaft" => json!({
            "description": "Shaft [A, B]: deformation th_A - th_B [rad] (x_A - x_B [m] between sliding masses).",
            "type": "array",
            "items": text("Name of a body."),
            "minItems": 2,
            "maxItems": 2,
        }),
        "ground" => text("Connection of a body to ground: deformation th_A [rad], or x_A [m]."),
        _ => {
            let arm = "Lever arm [m] of a rotating body; a number (1) for a sliding mass, and for rotating bodies if the deformation is an angle.";
            let mut arms = named(
                "Any lever arms by body: the deformation is the sum of arm times motion.",
                NAME,
                quantity(arm, NumberRange::Any),
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
        "description": "Force law; default linear.",
        "anyOf": [reference("law"), { "type": "null" }],
    });
    properties.insert(
        "stiffness".into(),
        quantity(
            "Reference stiffness, > 0 [N/m; N m/rad for shafts]; optional for laws that do not depend on the displacement (friction).",
            NumberRange::Positive,
        ),
    );
    let dashpot = "Viscous damper parallel to the law [N s/m; N m s/rad].";
    properties.insert(
        "damping".into(),
        nullable(quantity(dashpot, NumberRange::NotNegative)),
    );
    properties.insert("element".into(), law);
    let lag = "Fraction of a mesh period by which transmission error and stiffness variation are delayed.";
    properties.insert("lag".into(), nullable(quantity(lag, NumberRange::Any)));
    let scale = "Own displacement scale [m; rad for shafts].";
    properties.insert(
        "length".into(),
        nullable(quantity(scale, NumberRange::Positive)),
    );
    properties.extend(keys(SeriesUnits::Si));
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
    let ratio = |about: &str| quantity(about, NumberRange::NotNegative);
    let list = json!({
        "description": "One ratio per elastic mode, in ascending frequency.",
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
        "Characteristic values; results in SI units do not depend on them.",
        json!({
            "frequency": {
                "description": "omega_c: `first_mode` (default), `first_connection`, or a value [rad/s].",
                "anyOf": [words, reference("positive_quantity"), { "type": "null" }],
            },
            "length": nullable(quantity(
                "l of every connection without its own `length`; default: its first nonzero breakpoint, else 1.",
                NumberRange::Positive,
            )),
        }),
        &[],
    )
}
