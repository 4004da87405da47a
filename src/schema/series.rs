//! Periodic functions: loads, transmission errors, stiffness variations.

use super::scalars::{Range, count, nullable, number, quantity};
use super::{described, excludes, object};
use serde_json::{Map, Value, json};

/// Numbers with units, or bare ones for reduced systems.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Units {
    Si,
    Bare,
}

impl Units {
    /// Name of a definition that exists for both kinds of systems.
    pub fn name(self, name: &str) -> String {
        match self {
            Units::Si => name.to_owned(),
            Units::Bare => format!("reduced_{name}"),
        }
    }

    /// A number of that kind.
    pub fn number(self, about: &str, range: Range) -> Value {
        match self {
            Units::Si => quantity(about, range),
            Units::Bare => number(about, range),
        }
    }
}

pub(super) fn define(definitions: &mut Map<String, Value>) {
    let load = object(
        "T = mean + sum of amplitude cos(order omega t + phase).",
        json!({
            "mean": nullable(quantity("Mean torque [N m]; force [N] on a sliding mass.", Range::Any)),
            "harmonics": harmonics(Units::Si),
        }),
        &[],
    );
    definitions.insert("load".into(), load);
    for units in [Units::Si, Units::Bare] {
        definitions.insert(units.name("transmission_error"), transmission_error(units));
    }
    definitions.insert("stiffness_variation".into(), stiffness_variation());
}

/// The periodic keys of a connection or of a reduced element.
pub(super) fn keys(units: Units) -> Map<String, Value> {
    let error = units.name("transmission_error");
    let variation =
        "Relative stiffness against the phase of the excitation: mean 1, nowhere negative.";
    let base = "Order 1 of transmission error and stiffness variation is this multiple of the excitation frequency, such \
                as the number of teeth.";
    [
        (
            "transmission_error",
            described(
                &error,
                "Static transmission error against the phase of the excitation.",
            ),
        ),
        (
            "stiffness_variation",
            described("stiffness_variation", variation),
        ),
        ("base_order", count(base)),
    ]
    .into_iter()
    .map(|(key, value)| (key.to_owned(), nullable(value)))
    .collect()
}

fn harmonics(units: Units) -> Value {
    let one = object(
        "amplitude cos(order omega t + phase)",
        json!({
            "order": count("1 for the excitation frequency (times base_order)."),
            "amplitude": units.number("Amplitude of the cosine.", Range::Any),
            "phase": nullable(quantity("Phase [rad]; a text such as `30 deg`.", Range::Any)),
        }),
        &["order", "amplitude"],
    );
    nullable(json!({ "description": "Alternating part, a list.", "type": "array", "items": one }))
}

fn table(value: Value) -> Value {
    nullable(json!({
        "description": "Values over one period, evenly spaced, with straight lines between them.",
        "type": "array",
        "items": value,
        "minItems": 2,
    }))
}

fn own_base() -> Value {
    nullable(count("Overrides the connection's base_order here."))
}

fn transmission_error(units: Units) -> Value {
    let what = "Displacement [m; rad for shafts].";
    let mut error = object(
        "Harmonics or a table.",
        json!({
            "mean": nullable(units.number(what, Range::Any)),
            "harmonics": harmonics(units),
            "table": table(units.number(what, Range::Any)),
            "base_order": own_base(),
        }),
        &[],
    );
    error["allOf"] = json!([excludes("table", &["mean", "harmonics"])]);
    error
}

fn stiffness_variation() -> Value {
    let ratio = |about: &str| quantity(about, Range::NotNegative);
    let rectangle = object(
        "Two levels a period.",
        json!({
            "high": ratio("Relative stiffness of the first part of the period."),
            "low": ratio("Relative stiffness of the rest."),
            "duty": quantity("Share of `high`, between 0 and 1.", Range::Positive),
            "phase": nullable(quantity("Phase at which `high` begins [rad].", Range::Any)),
        }),
        &["high", "low", "duty"],
    );
    let mut variation = object(
        "Harmonics, a table or a rectangle; mean 1.",
        json!({
            "mean": nullable(quantity("1, which is the default.", Range::Any)),
            "harmonics": harmonics(Units::Si),
            "table": table(ratio("Relative stiffness.")),
            "rectangular": nullable(rectangle),
            "base_order": own_base(),
        }),
        &[],
    );
    variation["allOf"] = json!([
        excludes("table", &["mean", "harmonics", "rectangular"]),
        excludes("rectangular", &["mean", "harmonics"]),
    ]);
    variation
}
