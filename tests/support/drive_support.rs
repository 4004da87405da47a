//! Trains of the reference values for loads of time, run-ups and measured torques, as model files.
#![allow(dead_code)] // Every test file takes its own share.

use serde_json::Value;

/// Reference values of a file in `tests/data`.
pub fn reference(name: &str) -> Vec<Value> {
    let path = format!("{}/tests/data/{name}.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let file: Value = serde_json::from_str(&text).unwrap();
    file["cases"].as_array().unwrap().clone()
}

/// Numbers of a list.
pub fn list(value: &Value) -> Vec<f64> {
    let values = value.as_array().unwrap().iter();
    values.map(|x| x.as_f64().unwrap()).collect()
}

/// Bodies and connections of a case, with loads.
pub fn train(case: &Value, loads: &str) -> String {
    let mut text = "schema: 1\nname: reference\nbodies:\n".to_owned();
    for (body, inertia) in case["bodies"].as_object().unwrap() {
        text += &format!("  {body}: {{inertia: {inertia}}}\n");
    }
    text += "connections:\n";
    for (name, c) in case["connections"].as_object().unwrap() {
        let arms = c["arms"].as_object().unwrap().iter();
        let arms: Vec<String> = arms.map(|(b, a)| format!("{b}: {a}")).collect();
        let law = match c["b"].as_f64() {
            Some(b) if b > 0.0 => format!(", element: {{type: backlash, half_gap: {b}}}"),
            _ => String::new(),
        };
        text += &format!(
            "  {name}: {{acts_on: {{{}}}, stiffness: {}, damping: {}{law}}}\n",
            arms.join(", "),
            c["k"],
            c["c"]
        );
    }
    format!("{text}loads:\n{loads}report: {{units: si}}\n")
}

/// Mean loads of all bodies but one.
pub fn means(case: &Value, but: &str) -> String {
    let loads = case["loads"].as_object().unwrap().iter();
    let others = loads.filter(|(body, _)| *body != but);
    others
        .map(|(body, load)| format!("  {body}: {{mean: {}}}\n", load["mean"]))
        .collect()
}

/// A harmonic of a run-up's load.
pub fn harmonic(h: &Value, reference_speed: &Value) -> String {
    let growth = match h["grows_with_speed_power"].as_f64() {
        Some(power) if power > 0.0 => {
            format!(", speed_power: {power}, at: {reference_speed} rad/s")
        }
        _ => String::new(),
    };
    format!(
        "{{order: {}, amplitude: {}, phase: {} rad{growth}}}",
        h["order"], h["amplitude"], h["phase"]
    )
}
