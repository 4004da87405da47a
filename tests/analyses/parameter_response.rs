//! Responses against any number of the model: they meet the frequency responses at that number, and independent values.

use crate::common::{self, reference};
use crate::response_support::*;
use crate::time_domain_support::*;
use gearlash::report::Report;
use serde_json::Value;

/// The mark of one report against the nearest mark of another.
fn nearest_gap(one: &Report, other: &Report) -> (f64, String) {
    let (a, b) = (main_table(one), main_table(other));
    let (rows, others) = (marked(a), marked(b));
    assert!(
        !rows.is_empty() && !others.is_empty(),
        "{:?} {:?}",
        one.ended_early,
        other.ended_early
    );
    let all = rows
        .iter()
        .flat_map(|r| others.iter().map(move |s| (*r, *s)));
    let gaps = all.map(|(r, s)| gap(&measures(a, r), &measures(b, s)));
    gaps.min_by(|x, y| x.0.total_cmp(&y.0)).unwrap()
}

#[test]
fn an_amplitude_meets_the_frequency_response_and_the_reference() {
    let data = reference("fig11_case1");
    for method in ["galerkin", "shooting"] {
        for omega in [2.2, 1.8, 1.2, 1.0] {
            let common = format!(
                "method: {method}, harmonics: 12, tolerance: 1e-12, orbits: marks, stability: false"
            );
            let text = format!(
                "{{type: parameter_response, at: {omega}, parameter: cos.0, from: 0.02, to: 0.3, marks: [0.25], {common}}}"
            );
            let along_amplitude = run(PAIR, &text);
            assert_eq!(along_amplitude.ended_early, None, "{method} at {omega}");
            let table = main_table(&along_amplitude);
            let parameter = floats(table, "parameter");
            assert_eq!((parameter[0], parameter[parameter.len() - 1]), (0.02, 0.3));
            assert!(marked(table).iter().all(|row| parameter[*row] == 0.25));
            assert!(floats(table, "omega").iter().all(|x| *x == omega));
            assert_eq!(
                along_amplitude.summary["parameter"],
                "reduced.loads.harmonics.0.cos.0"
            );
            let text = format!(
                "{{type: frequency_response, from: 2.5, to: 0.99, marks: [{omega}], {common}}}"
            );
            let along_frequency = run(PAIR, &text);
            let (gap, what) = nearest_gap(&along_amplitude, &along_frequency);
            assert!(gap < 1e-9, "{method} at {omega}: {what}");
            if method == "shooting" {
                let gap = reference_gap(&along_amplitude, &data, omega);
                assert!(gap < 1e-10, "u0 at {omega}: {gap:e}");
            }
        }
    }
}

/// Distance of the nearest orbit at a mark from the reference solutions at a frequency.
fn reference_gap(report: &Report, data: &Value, omega: f64) -> f64 {
    let orbits = report.table("orbits").unwrap();
    let columns = ["q.mesh_1", "q.mesh_2", "v.mesh_1", "v.mesh_2"].map(|name| floats(orbits, name));
    let solutions = data["solutions"].as_array().unwrap().iter();
    let here = solutions.filter(|s| s["omega"].as_f64() == Some(omega) && s["nu"] == 1);
    let states: Vec<Vec<f64>> = here.map(|s| common::floats(&s["u0"])).collect();
    let mut best = f64::INFINITY;
    for row in (0..orbits.rows()).step_by(256) {
        for state in &states {
            let gaps = columns.iter().zip(state).map(|(c, x)| (c[row] - x).abs());
            best = best.min(gaps.fold(0.0, f64::max));
        }
    }
    best
}

fn folds(report: &Report) -> Vec<f64> {
    let events = report.table("events").unwrap();
    let (kind, value) = (texts(events, "kind"), floats(events, "parameter"));
    let located = floats(events, "located");
    (0..kind.len())
        .filter(|k| kind[*k] == "fold" && located[*k] == 1.0)
        .map(|k| value[k])
        .collect()
}

/// A fold in the frequency at one amplitude is a fold in the amplitude at that frequency.
#[test]
fn folds_are_those_of_the_frequency_response() {
    let data = reference("one_dof_backlash");
    let model = "schema: 1\nreduced:\n  stiffness: [[1]]\n  damping: {matrix: [[0.1]]}\n  \
                 elements: {mesh: {type: backlash, half_gap: 1.0}}\n  loads: {mean: [0.1], harmonics: [{order: 1, cos: [0.05]}]}\n";
    let number = |key: &str| data[key].as_f64().unwrap();
    assert_eq!(
        (number("zeta"), number("Fm"), number("Fa")),
        (0.05, 0.1, 0.05)
    );
    // The second fold of the reference: where the response jumps on the way down the main resonance.
    let omega = data["bifurcations"][1]["parameter"].as_f64().unwrap();
    for (method, tolerance) in [
        ("shooting", 1e-9),
        ("galerkin, harmonics: 40, samples: 4096", 1e-7),
    ] {
        let text = format!(
            "{{type: parameter_response, at: {omega:?}, parameter: cos.0, from: 0.02, to: 0.09, method: {method}, \
             stability: false}}"
        );
        let found = folds(&run(model, &text));
        assert_eq!(found.len(), 2, "{found:?}");
        assert!((found[0] - 0.05).abs() < tolerance, "{method}: {found:?}");
        // And the other way round for the other end of the overhang.
        let lower = model.replace("cos: [0.05]", &format!("cos: [{:?}]", found[1]));
        let text = format!(
            "{{type: frequency_response, from: 0.9, to: 0.7, method: {method}, stability: false}}"
        );
        let again = folds(&run(&lower, &text));
        let nearest = again.iter().map(|w| (w - omega).abs()).fold(1.0, f64::min);
        assert!(nearest < tolerance, "{method}: {again:?}");
    }
}

/// A train in SI units with much that can be varied, for the exact flow.
const RICH: &str = "
schema: 1
bodies:
  A: {inertia: 2.0e-3}
  B: {inertia: 1.0e-3}
  C: {inertia: 3.0e-3}
connections:
  mesh:
    gear: {A: 50 mm, B: 40 mm}
    stiffness: 2.0e8
    element: {type: backlash, half_gap: 20 um}
    transmission_error: {harmonics: [{order: 1, amplitude: 2 um, phase: 20 deg}]}
    stiffness_variation: {rectangular: {high: 1.1, low: 0.9, duty: 0.5}}
  stop: {shaft: [B, C], stiffness: 4.0e4, element: {type: one_sided, gap: 0.1 mrad, side: negative}}
  shaft: {ground: C, stiffness: 1.0e5, damping: 0.5}
damping: {modal_ratio: 0.04}
loads:
  A: {mean: 100, harmonics: [{order: 1, amplitude: 30}]}
  C: {mean: 10}
";

/// As above, with a law that the exact flow does not accept.
fn smooth() -> String {
    RICH.replace(
        "rectangular: {high: 1.1, low: 0.9, duty: 0.5}",
        "harmonics: [{order: 1, amplitude: 0.1}]",
    )
    .replace(
        "type: one_sided, gap: 0.1 mrad, side: negative",
        "type: cubic, cubic: 2.0e3",
    )
}

/// The response along a number against the frequency response of the model with that number written in, which has other
/// scales. SI units, all measures.
fn meets_the_written_model(
    model: &str,
    [path, from, to, mark]: [&str; 4],
    method: &str,
    tolerance: f64,
) -> Option<String> {
    let common = "harmonics: 8, tolerance: 1e-12, stability: false";
    let text = format!(
        "{{type: parameter_response, at: 3 kHz, parameter: {path}, from: {from}, to: {to}, marks: [{mark}], \
         method: {method}, {common}}}"
    );
    let along = run(model, &text);
    if let Some(reason) = along.ended_early {
        return Some(format!("{path}, {method}: {reason}"));
    }
    let text = format!(
        "{{type: frequency_response, from: 3050 Hz, to: 2950 Hz, marks: [3 kHz], method: {method}, {common}, \
         set: {{{path}: {mark}}}}}"
    );
    let (gap, what) = nearest_gap(&along, &run(model, &text));
    (gap >= tolerance).then(|| format!("{path}, {method}: {gap:.1e} {what}"))
}

#[test]
fn every_kind_of_number_meets_the_model_that_has_it_written() {
    let error = "connections.mesh.transmission_error.harmonics.0";
    let (amplitude, phase) = (format!("{error}.amplitude"), format!("{error}.phase"));
    let mut faults = Vec::new();
    for case in [
        [
            "connections.mesh.element.half_gap",
            "10 um",
            "40 um",
            "30 um",
        ],
        ["connections.mesh.element.half_gap", "20 um", "0", "5 um"],
        [
            "connections.mesh.stiffness",
            "4e8 N/m",
            "2e8 N/m",
            "3e8 N/m",
        ],
        ["connections.mesh.damping", "0", "2 kN s/m", "700 N s/m"],
        ["connections.mesh.gear.B", "45 mm", "42 mm", "43 mm"],
        [&amplitude, "0 um", "6 um", "5 um"],
        [&phase, "0 deg", "1 rad", "33 deg"],
        ["connections.stop.element.gap", "0", "0.5 mrad", "0.3 mrad"],
        [
            "connections.shaft.stiffness",
            "0.5e5",
            "2e5",
            "1.3e5 N m/rad",
        ],
        [
            "bodies.A.inertia",
            "1e-3 kg m^2",
            "4e-3 kg m^2",
            "27 kg cm^2",
        ],
        ["damping.modal_ratio", "0.1", "0.02", "0.07"],
        ["damping.stiffness_proportional", "0", "2 us", "1.1 us"],
        ["loads.A.mean", "80 N m", "200 N m", "137 N m"],
        ["loads.A.harmonics.0.amplitude", "0", "90 N m", "77 N m"],
        ["loads.A.harmonics.0.phase", "0", "90 deg", "33 deg"],
    ] {
        for method in ["galerkin", "shooting"] {
            faults.extend(meets_the_written_model(RICH, case, method, 1e-9));
        }
    }
    let variation = "connections.mesh.stiffness_variation.harmonics.0.amplitude";
    for case in [
        [variation, "0", "0.3", "0.2"],
        ["connections.stop.element.cubic", "0", "8e3 1/rad^2", "7e3"],
    ] {
        faults.extend(meets_the_written_model(&smooth(), case, "galerkin", 1e-9));
        // DOPRI5 keeps 1e-10 a step, and there are some hundred of them.
        faults.extend(meets_the_written_model(&smooth(), case, "shooting", 1e-7));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Parameters of laws that change what the law is: impact damping ends the exact flow.
#[test]
fn the_integrators_that_ran_are_named() {
    let text = "{type: parameter_response, at: 2 kHz, parameter: mesh.impact_damping, from: 0, to: 0.4 s/m, marks: [0.3 s/m], \
                methods: [galerkin, shooting], harmonics: 24}";
    let report = run(TRAIN, text);
    let branches = &report.summary["branches"];
    assert_eq!(branches[0]["integrator"], Value::Null);
    assert_eq!(branches[1]["integrator"], "exact, series");
    let table = main_table(&report);
    let rows = marked(table);
    assert_eq!(rows.len(), 2);
    let (gap, what) = gap(&measures(table, rows[0]), &measures(table, rows[1]));
    // 24 harmonics of a force with kinks.
    assert!(gap < 1e-3, "{what}");
    assert_eq!(table.column("parameter").unwrap().unit, "s/m");
    assert_eq!(floats(table, "parameter")[rows[0]], 0.3);
}

/// A train of the reference file as a model in SI units.
fn train(data: &Value) -> String {
    let list = |key: &str| common::floats(&data[key]);
    let (inertia, mean, amplitude) = (
        list("inertia"),
        list("mean_torque"),
        list("alternating_torque_cos"),
    );
    let (k, b) = (list("k"), list("b"));
    let mut text = String::from("schema: 1\nbodies:\n");
    for (i, x) in inertia.iter().enumerate() {
        text += &format!("  b{i}: {{inertia: {x:?}}}\n");
    }
    text += "connections:\n";
    for (j, row) in data["G"].as_array().unwrap().iter().enumerate() {
        let arms: Vec<String> = (common::floats(row).iter().enumerate())
            .filter(|(_, arm)| **arm != 0.0)
            .map(|(i, arm)| format!("b{i}: {arm:?}"))
            .collect();
        text += &format!(
            "  c{j}: {{acts_on: {{{}}}, stiffness: {:?}, element: {{type: backlash, half_gap: {:?}}}}}\n",
            arms.join(", "),
            k[j],
            b[j]
        );
    }
    text += &format!("damping: {{modal_ratio: {}}}\nloads:\n", data["zeta"]);
    for (i, mean) in mean.iter().enumerate() {
        text += &format!(
            "  b{i}: {{mean: {mean:?}, harmonics: [{{order: 1, amplitude: {:?}}}]}}\n",
            amplitude[i]
        );
    }
    text
}

/// States at phase 0 in SI units, a chain and a loop, reached along a load and along a gap.
#[test]
fn trains_in_si_units_reach_the_reference_states() {
    let data = reference("trains_si");
    for (name, data) in data.as_object().unwrap() {
        let model = train(data);
        let (gaps, torque) = (
            common::floats(&data["b"]),
            common::floats(&data["alternating_torque_cos"])[0],
        );
        for solution in data["solutions"].as_array().unwrap() {
            let omega = solution["omega"].as_f64().unwrap();
            for (path, value) in [("b0.amplitude", torque), ("c1.half_gap", gaps[1])] {
                let text = format!(
                    "{{type: parameter_response, at: {omega:?} rad/s, parameter: {path}, from: {:?}, to: {:?}, \
                     marks: [{value:?}], method: shooting, harmonics: 20, orbits: marks, stability: false}}",
                    1.1 * value,
                    0.9 * value
                );
                let report = run(&model, &text);
                let orbits = report.table("orbits").unwrap();
                let mut best = f64::INFINITY;
                for row in (0..orbits.rows()).step_by(256) {
                    let mut worst = 0.0_f64;
                    for (kind, key, unit) in [
                        ("q", "r0", 1.0),
                        ("v", "rdot0", data["omega_n"][1].as_f64().unwrap()),
                    ] {
                        for (i, wanted) in common::floats(&solution[key]).iter().enumerate() {
                            let found = floats(orbits, &format!("{kind}.c{i}"))[row];
                            worst = worst.max((found - wanted).abs() / (unit * gaps[i]));
                        }
                    }
                    best = best.min(worst);
                }
                assert!(best < 1e-8, "{name} at {omega} along {path}: {best:e}");
            }
        }
    }
}

#[test]
fn integration_follows_the_attractor_along_a_number() {
    let model = PAIR.replace("half_gap: 0.1", "half_gap: 1.0");
    let common =
        "at: 0.2, parameter: cos.0, from: 0.27, to: 0.29, points: 5, transient: 300, periods: 120";
    let report = run(
        &model,
        &format!("{{type: parameter_response, method: integration, {common}}}"),
    );
    let diagram = run(&model, &format!("{{type: bifurcation_diagram, {common}}}"));
    let (table, summary) = (main_table(&report), diagram.table("summary").unwrap());
    assert_eq!(floats(table, "parameter"), floats(summary, "parameter"));
    let labels = texts(table, "label");
    assert_eq!(labels, texts(summary, "label"));
    assert_eq!(
        (labels[0].as_str(), labels[4].as_str()),
        ("period 1", "chaotic")
    );
    let panel = &report.figure.as_ref().unwrap().panels[0];
    assert_eq!(
        (panel.x_label.as_str(), panel.curves[0].x.as_str()),
        ("cos 1", "parameter")
    );
    // Natural frequencies have no place on an axis of loads.
    assert!(panel.curves.iter().all(|c| c.x == "parameter"));
}

#[test]
fn subharmonic_branches_have_their_own_range() {
    // Case 1, b2 = 0.1: the response doubles its period near omega = 1.92.
    let text = "{type: parameter_response, at: 1.8, parameter: cos.0, from: 0.25, to: 0.2, subharmonic: 2, marks: [0.22], \
                methods: [galerkin, shooting], harmonics: 16}";
    let report = run(PAIR, text);
    let table = main_table(&report);
    let rows = marked(table);
    let (gap, what) = gap(&measures(table, rows[0]), &measures(table, rows[1]));
    assert!(gap < 2e-3, "{what}");
    // Two excitation periods in one response period: the multipliers are squares of those over one.
    let single = run(PAIR, &text.replace("subharmonic: 2, ", ""));
    let modulus = |report: &Report| {
        floats(main_table(report), "multiplier_modulus")[marked(main_table(report))[1]]
    };
    assert!((modulus(&report) - modulus(&single).powi(2)).abs() < 1e-6);
}
