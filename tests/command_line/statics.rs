//! What `check` and `run` say about rest, locked trains and slips of units.

use crate::program::*;
use serde_json::Value;

fn checked(text: &str) -> (Value, String) {
    let place = Place::with(text);
    let json = place.run(&["check", "--json", "m.yaml"]).ends_with(0);
    let plain = place.run(&["check", "m.yaml"]).ends_with(0);
    (serde_json::from_str(&json.out).unwrap(), plain.out)
}

const OVERRUN: &str = "\
schema: 1
bodies: {A: {inertia: 0.01}, B: {inertia: 0.02}}
connections:
  c: {shaft: [A, B], stiffness: 1e4 N m/rad, element: {type: one_sided, gap: 1 mrad}}
damping: {modal_ratio: 0.02}
loads: {A: {mean: -5}, B: {mean: 5}}
analyses:
  h: {type: time_history, at: 20 Hz, periods: 2}
";

#[test]
fn an_overrunning_coupling_has_no_rest() {
    let (json, text) = checked(OVERRUN);
    assert!(json["static_displacement"].is_null() && json["natural_frequencies_at_rest"].is_null());
    let reason = json["static_reason"].as_str().unwrap();
    assert!(reason.contains("c does not carry it"), "{reason}");
    assert!(
        text.contains("warning: there is no static equilibrium"),
        "{text}"
    );
    let place = Place::with(OVERRUN);
    let run = place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    run.says(&["starts from q = 0, v = 0"]);
    assert_eq!(place.column("o/h.csv", "q.c")[0], 0.0);
}

/// Two stages of a clutch: slope 1 beyond 4 degrees, 0.03 within.
const CLUTCH: &str = "\
schema: 1
bodies: {a: {inertia: 0.15}, b: {inertia: 0.05}}
connections:
  clutch: {shaft: [a, b], stiffness: 1000, element: {type: piecewise_linear, breakpoints: [-4 deg, 4 deg], slopes: [1, 0.03, 1]}}
loads: {a: {mean: 1}, b: {mean: -1}}
analyses:
  contact: {type: modes, effective_stiffness: [0.5, 1], points: 2}
  rest: {type: modes, effective_stiffness: [0.5, 1], points: 2, state: rest}
";

#[test]
fn natural_frequencies_at_rest_are_those_of_the_soft_stage() {
    let (json, text) = checked(CLUTCH);
    let w = |slope: f64| (1000.0 * slope * (1.0 / 0.15 + 1.0 / 0.05)).sqrt();
    let near = |x: &Value, y: f64| (x.as_f64().unwrap() / y - 1.0).abs() < 1e-12;
    assert!(near(&json["natural_frequencies_rad_s"][0], w(1.0)));
    assert!(near(&json["natural_frequencies_at_rest_rad_s"][0], w(0.03)));
    assert!(near(
        &json["natural_frequencies_at_rest"][0],
        0.03_f64.sqrt()
    ));
    assert!(text.contains("mode at rest"), "{text}");
    let place = Place::with(CLUTCH);
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    for (file, slope) in [("o/contact.csv", 1.0), ("o/rest.csv", 0.03)] {
        let list = place.column(file, "natural_frequency.1");
        for (found, share) in list.iter().zip([0.5, 1.0]) {
            let wanted = w(slope * share) / std::f64::consts::TAU;
            assert!((found / wanted - 1.0).abs() < 1e-12, "{file}: {found}");
        }
    }
    // In full contact both are the same, and said once.
    let (_, text) = checked(&CLUTCH.replace("slopes: [1, 0.03, 1]", "slopes: [1, 1, 1]"));
    assert!(!text.contains("mode at rest"), "{text}");
}

const FRICTION: &str = "\
schema: 1
bodies: {a: {inertia: 0.15}, b: {inertia: 0.005}}
connections:
  spring: {shaft: [a, b], stiffness: 30}
  fric: {shaft: [a, b], element: {type: tanh_friction, force: 1 N m, velocity: 0.5 rad/s}}
damping: {modal_ratio: 0.05}
loads: {a: {harmonics: [{order: 1, amplitude: 20 N m}]}}
analyses:
  f: {type: frequency_response, from: 14 Hz, to: 12 Hz, marks: [12 Hz]}
";

#[test]
fn friction_is_no_spring_whatever_its_reference_stiffness() {
    let mut peaks = Vec::new();
    for stiffness in ["", "stiffness: 30, ", "stiffness: 1e5, "] {
        let text = FRICTION.replace(
            "fric: {shaft: [a, b], ",
            &format!("fric: {{shaft: [a, b], {stiffness}"),
        );
        let (json, _) = checked(&text);
        let found = json["natural_frequencies_rad_s"][0].as_f64().unwrap();
        let wanted = (30.0 * (1.0 / 0.15 + 1.0 / 0.005_f64)).sqrt();
        assert!((found / wanted - 1.0).abs() < 1e-12, "{stiffness}: {found}");
        let place = Place::with(&text);
        place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
        let last = *place.column("o/f.csv", "rms.spring").last().unwrap();
        peaks.push(last);
    }
    assert!(
        (peaks[1] / peaks[0] - 1.0).abs() < 1e-8 && (peaks[2] / peaks[0] - 1.0).abs() < 1e-8,
        "{peaks:?}"
    );
    // A formula without q needs no stiffness either, one with q does.
    let formula = |f: &str| {
        FRICTION.replace(
            "type: tanh_friction, force: 1 N m, velocity: 0.5 rad/s",
            &format!("type: expression, force: \"{f}\""),
        )
    };
    checked(&formula("tanh(v/0.5)"));
    let place = Place::with(&formula("3*q"));
    let refused = place.run(&["check", "m.yaml"]).ends_with(2);
    refused.says(&["`stiffness` is missing"]);
}

const PLANETS: &str = "\
schema: 1
bodies:
  carrier: {inertia: 0.01}
  p1: {inertia: 3.5e-4}
  p2: {inertia: 3.5e-4}
  sun: {inertia: 0.02}
  ring: {inertia: 2.5e-2}
connections:
  s1: {acts_on: {sun: 35.24 mm, p1: 28.192 mm, carrier: -63.432 mm}, stiffness: 6.9e8 N/m}
  s2: {acts_on: {sun: 35.24 mm, p2: 28.192 mm, carrier: -63.432 mm}, stiffness: 6.9e8 N/m}
  r1: {acts_on: {p1: 28.192 mm, ring: -91.624 mm, carrier: 63.432 mm}, stiffness: 7.6e8 N/m}
  r2: {acts_on: {p2: 28.192 mm, ring: -91.624 mm, carrier: 63.432 mm}, stiffness: 7.6e8 N/m}
";

#[test]
fn a_wrong_lever_arm_is_named_with_the_value_that_closes_the_loop() {
    let (json, text) = checked(PLANETS);
    assert_eq!(json["rigid_body_modes"], 2);
    assert!(!text.contains("closes"), "{text}");
    for (right, wrong, body) in [
        ("carrier: -63.432 mm", "carrier: -63 mm", "carrier"),
        ("sun: 35.24 mm", "sun: 35.42 mm", "sun"),
        ("ring: -91.624 mm", "ring: -91.264 mm", "ring"),
    ] {
        let (_, text) = checked(&PLANETS.replacen(right, wrong, 1));
        let number = right
            .split([' ', '-'])
            .find(|w| w.parse::<f64>().is_ok())
            .unwrap();
        let wanted = format!("to close the loop, use {number} mm in place of");
        assert!(
            text.contains(&wanted) && text.contains(&format!("lever arm of {body} in")),
            "{text}"
        );
    }
}

#[test]
fn slips_of_units_are_warned_of() {
    let pair = |gap: &str, phase: &str, inertia: &str| {
        format!(
            "schema: 1\nbodies: {{A: {{inertia: {inertia}}}, B: {{inertia: 1e-3}}}}\nconnections:\n  \
             m: {{gear: {{A: 50 mm, B: 50 mm}}, stiffness: 2.4e8, element: {{type: backlash, half_gap: {gap}}}}}\n\
             loads: {{A: {{mean: 100, harmonics: [{{order: 1, amplitude: 50, phase: {phase}}}]}}, B: {{mean: 100}}}}\n"
        )
    };
    let (_, text) = checked(&pair("50 um", "90 deg", "1e-3"));
    assert!(!text.contains("warning"), "{text}");
    let (_, text) = checked(&pair("50 um", "6.2", "1e-3"));
    assert!(!text.contains("warning"), "{text}");
    for (gap, phase, inertia, wanted) in [
        (
            "50",
            "0",
            "1e-3",
            "warning: connections.m.element.half_gap = 50 m is larger",
        ),
        (
            "60 mm",
            "0",
            "1e-3",
            "warning: connections.m.element.half_gap = 0.06 m is larger",
        ),
        (
            "50 um",
            "90",
            "1e-3",
            "warning: loads.A.harmonics.0.phase = 90 is a bare number",
        ),
        (
            "50 um",
            "-45",
            "1e-3",
            "warning: loads.A.harmonics.0.phase = -45 is a bare number",
        ),
        ("50 um", "0", "1e4", "warning: inertias of neighbours"),
    ] {
        let (_, text) = checked(&pair(gap, phase, inertia));
        assert!(text.contains(wanted), "{text}");
        assert_eq!(text.matches("warning").count(), 1, "{text}");
    }
}

#[test]
fn rounded_torques_are_in_balance() {
    let pair = |mean: &str, amplitude: &str| {
        format!(
            "schema: 1\nbodies: {{A: {{inertia: 1e-3}}, B: {{inertia: 1e-3}}}}\nconnections: {{m: {{shaft: [A, B], stiffness: 1e4}}}}\n\
             loads: {{A: {{mean: {mean}, harmonics: [{{order: 1, amplitude: {amplitude}}}]}}, B: {{mean: -0.43153}}}}\n"
        )
    };
    for (mean, amplitude, warns) in [
        ("0.43153", "0", false),
        ("0.43156", "0", false),
        ("0.4317", "0", true),
        // Small beside what the loads do.
        ("0.4317", "60", false),
        ("0.45", "60", true),
    ] {
        let (_, text) = checked(&pair(mean, amplitude));
        assert_eq!(
            text.contains("accelerates"),
            warns,
            "{mean} {amplitude}: {text}"
        );
    }
}

#[test]
fn coordinates_that_are_no_deformations_have_names_of_their_own() {
    let text = "\
schema: 1
bodies: {p: {inertia: 0.0075}, g: {inertia: 0.0075}, w: {inertia: 0.01}}
connections:
  mesh:
    gear: {p: 70.5 mm, g: 70.5 mm}
    stiffness: 4.2e8
    element: {type: backlash, half_gap: 50 um}
    transmission_error: {harmonics: [{order: 1, amplitude: 2 um}]}
  shaft: {shaft: [g, w], stiffness: 1e5}
damping: {modal_ratio: 0.01}
loads: {p: {mean: 340}, w: {mean: 340}}
analyses:
  th: {type: time_history, at: 10 Hz, transient: 3, periods: 1, samples_per_period: 4}
  pm: {type: poincare_map, at: 10 Hz, transient: 3, periods: 1}
";
    let place = Place::with(text);
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let (q, r) = (
        place.column("o/th.csv", "q.mesh"),
        place.column("o/pm.csv", "r.mesh"),
    );
    // The last row of the history is the first point of the map; e(0) = 2 um.
    assert!((r[0] - q[4] - 2e-6).abs() < 1e-12, "{r:?} {q:?}");
    assert!(
        (place.column("o/pm.csv", "q.shaft")[0] - place.column("o/th.csv", "q.shaft")[4]).abs()
            < 1e-12
    );
    place.column("o/pm.csv", "dr.mesh");
}

#[test]
fn a_file_without_analyses_has_nothing_to_run() {
    for text in ["", "analyses: {}\n", "analyses:\n"] {
        let model = REDUCED.split("analyses:").next().unwrap();
        let place = Place::with(&format!("{model}{text}"));
        let run = place.run(&["run", "m.yaml", "--out", "o"]).ends_with(2);
        run.says(&["the file has no analyses"]);
        assert!(!place.path("o").exists());
    }
}
