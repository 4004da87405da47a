//! Reduced, nondimensional systems.

use super::scalars::{NumberRange, count, nullable, number};
use super::{NAME, exactly_one, named, object, reference};
use serde_json::{Map, Value, json};

pub(super) fn define(definitions: &mut Map<String, Value>) {
    definitions.insert("vector".into(), vector());
    definitions.insert(
        "matrix".into(),
        json!({ "type": "array", "items": reference("vector"), "minItems": 1 }),
    );
    let mut elements = named(
        "Laws by name, one per column of kappa.",
        NAME,
        reference("reduced_law"),
    );
    elements["minProperties"] = json!(1);
    let system = object(
        "q'' + Gam q' + kappa f(W q, W q') = mean + cos parts cos(order Om T) + sin parts sin(order Om T); bare numbers only.",
        json!({
            "stiffness": super::described("matrix", "kappa, n x e, a list of rows."),
            "damping": nullable(damping()),
            "elements": elements,
            "element_map": nullable(super::described("matrix", "W, e x n; default: the identity.")),
            "loads": nullable(loads()),
        }),
        &["stiffness", "elements"],
    );
    definitions.insert("reduced".into(), system);
}

fn vector() -> Value {
    json!({ "type": "array", "items": number("", NumberRange::Any) })
}

fn damping() -> Value {
    let mut value = object(
        "One of three.",
        json!({
            "modal_ratio": nullable(number("zeta of Gam = 2 zeta (kappa W)^(1/2).", NumberRange::NotNegative)),
            "matrix": nullable(super::described("matrix", "Gam itself, n x n.")),
            "stiffness_proportional": nullable(number("c of Gam = c kappa W.", NumberRange::NotNegative)),
        }),
        &[],
    );
    value["allOf"] = json!([exactly_one(&[
        "modal_ratio",
        "matrix",
        "stiffness_proportional"
    ])]);
    value
}

fn loads() -> Value {
    let part = |about: &str| nullable(super::described("vector", about));
    let harmonic = object(
        "cos cos(order Om T) + sin sin(order Om T)",
        json!({
            "order": count("1 for the excitation frequency."),
            "cos": part("One value per coordinate."),
            "sin": part("One value per coordinate."),
        }),
        &["order"],
    );
    object(
        "Loads on the relative coordinates.",
        json!({
            "mean": part("Mean loads, one per coordinate."),
            "harmonics": nullable(json!({ "type": "array", "items": harmonic })),
        }),
        &[],
    )
}
