//! Periodic functions: loads, transmission errors, stiffness variations.

use super::scalars::{NumberRange, count, nullable, number, quantity, text};
use super::{described, exactly_one, excludes, object};
use serde_json::{Map, Value, json};

/// Numbers with units, or bare ones for reduced systems.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SeriesUnits {
    Si,
    Bare,
}

impl SeriesUnits {
    /// Name of a definition that exists for both kinds of systems.
    pub fn name(self, name: &str) -> String {
        match self {
            SeriesUnits::Si => name.to_owned(),
            SeriesUnits::Bare => format!("reduced_{name}"),
        }
    }

    /// A number of that kind.
    pub fn number(self, about: &str, range: NumberRange) -> Value {
        match self {
            SeriesUnits::Si => quantity(about, range),
            SeriesUnits::Bare => number(about, range),
        }
    }
}

pub(super) fn define(definitions: &mut Map<String, Value>) {
    let load = object(
        "T = mean + sum of amplitude cos(order omega t + phase).",
        json!({
            "mean": nullable(quantity("Mean torque [N m]; force [N] on a sliding mass.", NumberRange::Any)),
            "harmonics": harmonics_of_loads(),
            "cycle": nullable(cycle()),
            "motion": nullable(described("motion", "As `motion` of the body.")),
            "profile": nullable(profile("Torque as a function of time [N m], linear between instants; a repeated instant is a jump. Only for `run_up` and for `time_history` with `duration`.")),
        }),
        &[],
    );
    definitions.insert("load".into(), load);
    definitions.insert("motion".into(), motion());
    definitions.insert("order".into(), order());
    for units in [SeriesUnits::Si, SeriesUnits::Bare] {
        definitions.insert(units.name("transmission_error"), transmission_error(units));
    }
    definitions.insert("stiffness_variation".into(), stiffness_variation());
}

/// The periodic keys of a connection or of a reduced element.
pub(super) fn keys(units: SeriesUnits) -> Map<String, Value> {
    let error = units.name("transmission_error");
    let variation =
        "Relative stiffness against the phase of the excitation; mean 1, never negative.";
    let unit = "Order that counts as 1 in transmission error and stiffness variation, in multiples of the excitation frequency: `mesh` (tooth passing) or a number such as the number of teeth.";
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
        ("order_unit", described("order", unit)),
        (
            "base_order",
            described("order", "Former name of `order_unit`."),
        ),
    ]
    .into_iter()
    .map(|(key, value)| (key.to_owned(), nullable(value)))
    .collect()
}

fn cycle() -> Value {
    let torque = quantity(
        "Torque [N m]; bare numbers are in `unit`.",
        NumberRange::Any,
    );
    let mut value = object(
        "Measured torque over a cycle, uniform in angle, the first value at phase 0, linear between values.",
        json!({
            "values": nullable(json!({ "type": "array", "items": torque, "minItems": 2 })),
            "file": nullable(text("Table with a header row (CSV), relative to this file, instead of `values`.")),
            "column": nullable(text("Column of torques.")),
            "angle": nullable(text("Column of angles, ascending over at most one cycle; default: rows are uniform in angle.")),
            "angle_unit": nullable(text("Unit of the angles; default rad.")),
            "unit": nullable(text("Unit of bare numbers; default N m.")),
            "revolutions": nullable(count("Revolutions of the reference per cycle, such as 2 for a four-stroke engine.")),
        }),
        &[],
    );
    value["allOf"] = json!([exactly_one(&["values", "file"])]);
    value
}

/// Measured motion of a body.
fn motion() -> Value {
    let value = quantity(
        "Speed, or deviation from even rotation; bare numbers in `unit`.",
        NumberRange::Any,
    );
    let pair = json!({ "type": "array", "items": quantity("Instant [s], value.", NumberRange::Any), "minItems": 2, "maxItems": 2 });
    let mut value = object(
        "Measured motion, which the body then has whatever acts on it: over the cycle of the reference, or over time.",
        json!({
            "values": nullable(json!({ "description": "Values uniform in angle, the first one at phase 0.", "type": "array", "items": value, "minItems": 2 })),
            "points": nullable(json!({ "description": "Instants with values: [[0 s, 800 rpm], [50 ms, 820 rpm]].", "type": "array", "items": pair, "minItems": 1 })),
            "file": nullable(text("Table with a header row (CSV), relative to this file.")),
            "column": nullable(text("Name of its column of values.")),
            "angle": nullable(text("Name of its column of angles, ascending over at most a cycle; uniform when absent.")),
            "angle_unit": nullable(text("Unit of the angles; rad when absent.")),
            "time": nullable(text("Name of its column of instants, for a motion over time.")),
            "time_unit": nullable(text("Unit of the instants; s when absent.")),
            "unit": nullable(text("Unit of bare numbers; it says whether they are speeds (rpm, rad/s; the default) or angles (deg, rad).")),
            "revolutions": nullable(count("Revolutions of the reference per cycle, such as 2 for a four-stroke engine.")),
            "orders": nullable(count("Orders of the cycle kept of a measured angle; half the number of rows when absent.")),
        }),
        &[],
    );
    value["allOf"] = json!([exactly_one(&["values", "points", "file"])]);
    value
}

/// A function of time.
fn profile(about: &str) -> Value {
    let pair = json!({
        "type": "array",
        "items": quantity("Time [s], value.", NumberRange::Any),
        "minItems": 2,
        "maxItems": 2,
    });
    let mut value = object(
        about,
        json!({
            "points": nullable(json!({ "description": "Pairs of time and torque: [[0 s, 10 N m], [50 ms, 200 N m]].", "type": "array", "items": pair, "minItems": 1 })),
            "file": nullable(text("Table with a header row (CSV), relative to this file, instead of `points`.")),
            "time": nullable(text("Column of times.")),
            "column": nullable(text("Column of values.")),
            "unit": nullable(text("Unit of the values; default SI.")),
            "time_unit": nullable(text("Unit of the times; default s.")),
        }),
        &[],
    );
    value["allOf"] = json!([exactly_one(&["points", "file"])]);
    value
}

/// Harmonics whose amplitudes may depend on the speed.
fn harmonics_of_loads() -> Value {
    let list = |about: &str, range| json!({ "type": "array", "items": quantity(about, range), "minItems": 1 });
    let table = object(
        "Amplitude against the speed of the reference, linear between the speeds, constant outside.",
        json!({
            "speed": list("Ascending speeds [rad/s].", NumberRange::NotNegative),
            "values": list("Amplitudes at these speeds.", NumberRange::Any),
        }),
        &["speed", "values"],
    );
    let amplitude = quantity("Amplitude of the cosine.", NumberRange::Any);
    let one = object(
        "amplitude (speed / at)^speed_power cos(order omega t + phase)",
        json!({
            "order": described("order", "1 for the excitation frequency."),
            "amplitude": { "anyOf": [amplitude, table] },
            "phase": nullable(quantity("Phase [rad], or a quantity such as `30 deg`.", NumberRange::Any)),
            "speed_power": nullable(quantity("Exponent p: the amplitude is proportional to speed^p.", NumberRange::Any)),
            "at": nullable(quantity("Speed at which the amplitude has the given value [rad/s].", NumberRange::Positive)),
        }),
        &["order", "amplitude"],
    );
    nullable(
        json!({ "description": "Alternating part: a list of harmonics.", "type": "array", "items": one }),
    )
}

fn harmonics(units: SeriesUnits) -> Value {
    let one = object(
        "amplitude cos(order omega t + phase)",
        json!({
            "order": described("order", "1 for the excitation frequency (times order_unit)."),
            "amplitude": units.number("Amplitude of the cosine.", NumberRange::Any),
            "phase": nullable(quantity("Phase [rad], or a quantity such as `30 deg`.", NumberRange::Any)),
        }),
        &["order", "amplitude"],
    );
    nullable(
        json!({ "description": "Alternating part: a list of harmonics.", "type": "array", "items": one }),
    )
}

fn table(value: Value) -> Value {
    nullable(json!({
        "description": "Values over one period, evenly spaced, linear between values.",
        "type": "array",
        "items": value,
        "minItems": 2,
    }))
}

/// An order of the reference shaft.
fn order() -> Value {
    let shaft = object(
        "Orders of another shaft.",
        json!({
            "shaft": text("Name of a body."),
            "times": nullable(described("order", "Order of that shaft; default 1.")),
        }),
        &["shaft"],
    );
    json!({
        "description": "A whole number, a decimal, a fraction such as 35/47, `mesh` (tooth passing), or an order of another shaft.",
        "anyOf": [
            { "type": ["number", "string"], "pattern": super::scalars::positive_number(), "exclusiveMinimum": 0 },
            { "type": "string", "pattern": "^\\s*[0-9.]+\\s*/\\s*[0-9.]+\\s*$" },
            { "const": "mesh" },
            shaft,
        ],
    })
}

fn own_unit() -> [Value; 2] {
    let about = "Overrides the `order_unit` of the connection.";
    [about, "Former name of `order_unit`."].map(|about| nullable(described("order", about)))
}

fn transmission_error(units: SeriesUnits) -> Value {
    let what = "Displacement [m; rad for shafts].";
    let [unit, former] = own_unit();
    let mut error = object(
        "Harmonics or a table.",
        json!({
            "mean": nullable(units.number(what, NumberRange::Any)),
            "harmonics": harmonics(units),
            "table": table(units.number(what, NumberRange::Any)),
            "order_unit": unit,
            "base_order": former,
        }),
        &[],
    );
    error["allOf"] = json!([excludes("table", &["mean", "harmonics"])]);
    error
}

fn stiffness_variation() -> Value {
    let [unit, former] = own_unit();
    let ratio = |about: &str| quantity(about, NumberRange::NotNegative);
    let rectangle = object(
        "Two levels per period.",
        json!({
            "high": ratio("Relative stiffness of the first part of the period."),
            "low": ratio("Relative stiffness of the rest of the period."),
            "duty": quantity("Fraction of the period with `high`, between 0 and 1.", NumberRange::Positive),
            "phase": nullable(quantity("Phase at which `high` begins [rad].", NumberRange::Any)),
        }),
        &["high", "low", "duty"],
    );
    let mut variation = object(
        "Harmonics, a table or a rectangle; mean 1.",
        json!({
            "mean": nullable(quantity("Must be 1, the default.", NumberRange::Any)),
            "harmonics": harmonics(SeriesUnits::Si),
            "table": table(ratio("Relative stiffness.")),
            "rectangular": nullable(rectangle),
            "order_unit": unit,
            "base_order": former,
        }),
        &[],
    );
    variation["allOf"] = json!([
        excludes("table", &["mean", "harmonics", "rectangular"]),
        excludes("rectangular", &["mean", "harmonics"]),
    ]);
    variation
}
