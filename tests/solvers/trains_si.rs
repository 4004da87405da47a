//! Trains written in SI units, through YAML, against an independent program: solutions, forces, accelerations.

use crate::common::{floats, reference};
use crate::texts::{Results, run};
use serde_json::Value;

/// Relative to the largest value of its kind. The reference is good to 1e-10; a state that passes once around a stable orbit
/// loses nothing.
const CLOSE: f64 = 1e-8;

/// A train of the reference file in SI units.
fn yaml(data: &Value, analyses: &str) -> String {
    let list = |key: &str| floats(&data[key]);
    let mut text = String::from("bodies:\n");
    for (i, inertia) in list("inertia").iter().enumerate() {
        text += &format!("  B{i}: {{inertia: {inertia:?} kg m^2}}\n");
    }
    text += "connections:\n";
    let (stiffness, half_gap) = (list("k"), list("b"));
    for (k, row) in data["G"].as_array().unwrap().iter().enumerate() {
        let arms: Vec<String> = floats(row)
            .iter()
            .enumerate()
            .filter(|(_, arm)| **arm != 0.0)
            .map(|(i, arm)| format!("B{i}: {arm:?}"))
            .collect();
        text += &format!(
            "  c{k}: {{acts_on: {{{}}}, stiffness: {:?} N/m, element: {{type: backlash, half_gap: {:?} m}}}}\n",
            arms.join(", "),
            stiffness[k],
            half_gap[k]
        );
    }
    text += &format!("damping: {{modal_ratio: {}}}\nloads:\n", data["zeta"]);
    let amplitudes = list("alternating_torque_cos");
    for (i, mean) in list("mean_torque").iter().enumerate() {
        let amplitude = amplitudes[i];
        text += &format!(
            "  B{i}: {{mean: {mean:?}, harmonics: [{{order: 1, amplitude: {amplitude:?}}}]}}\n"
        );
    }
    text + "scaling: {length: 50 um}\nanalyses:\n" + analyses
}

fn distance(found: &[f64], wanted: &[f64]) -> f64 {
    let scale = wanted.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert_eq!(found.len(), wanted.len());
    let apart = found.iter().zip(wanted).map(|(f, w)| (f - w).abs());
    apart.fold(0.0, f64::max) / scale
}

fn worst(results: &Results, row: usize, columns: &[(&str, &Value)], count: usize) -> f64 {
    let one = |(name, wanted): &(&str, &Value)| {
        let found: Vec<f64> = (0..count)
            .map(|k| results.value(&format!("{name}.c{k}"), row))
            .collect();
        distance(&found, &floats(wanted))
    };
    columns.iter().map(one).fold(0.0, f64::max)
}

/// The branch passes every listed solution.
#[test]
fn shooting_finds_the_reference_solutions() {
    for (name, data) in reference("trains_si").as_object().unwrap() {
        let solutions = data["solutions"].as_array().unwrap();
        let omega: Vec<f64> = solutions
            .iter()
            .map(|s| s["omega"].as_f64().unwrap())
            .collect();
        let (low, high) = (omega[0] * 0.98, omega[omega.len() - 1] * 1.4);
        let marks: Vec<String> = omega.iter().map(|w| format!("{w:?} rad/s")).collect();
        let analysis = format!(
            "  fr: {{type: frequency_response, method: shooting, from: {high:?} rad/s, to: {low:?} rad/s, marks: [{}]}}\n",
            marks.join(", ")
        );
        let results = run(&yaml(data, &analysis)).remove(0);
        let count = floats(&data["k"]).len();
        for (solution, omega) in solutions.iter().zip(&omega) {
            let columns = [
                ("rms", &solution["delta_rms"]),
                ("mean", &solution["delta_mean"]),
                ("rms_velocity", &solution["deltadot_rms"]),
                ("force_mean", &solution["force_mean"]),
            ];
            let at_mark = |row: &usize| {
                let frequency = results.value("frequency_hz", *row) * std::f64::consts::TAU;
                results.value("mark", *row) == 1.0 && (frequency / omega - 1.0).abs() < 1e-12
            };
            let rows = (0..results.rows()).filter(at_mark);
            let best = rows
                .map(|row| worst(&results, row, &columns, count))
                .fold(9.0, f64::min);
            println!("{name} at {omega}: {best:.1e}");
            assert!(best < CLOSE, "{name} at {omega} rad/s: {best:e}");
        }
    }
}

/// Started on a reference orbit the motion has the reference accelerations, and is back after a period.
#[test]
fn integration_keeps_the_reference_orbits_and_accelerations() {
    for (name, data) in reference("trains_si").as_object().unwrap() {
        let solutions = data["solutions"].as_array().unwrap();
        let list = |values: &Value| {
            let texts: Vec<String> = floats(values).iter().map(|x| format!("{x:?}")).collect();
            format!("[{}]", texts.join(", "))
        };
        let analyses: String = solutions
            .iter()
            .enumerate()
            .map(|(i, s)| {
                format!(
                    "  th{i}: {{type: time_history, at: {} rad/s, periods: 1, initial: {{q: {}, v: {}}}}}\n",
                    s["omega"],
                    list(&s["r0"]),
                    list(&s["rdot0"])
                )
            })
            .collect();
        for (results, solution) in run(&yaml(data, &analyses)).iter().zip(solutions) {
            let last = results.rows() - 1;
            let state = |kind: &str, row| -> Vec<f64> {
                let n = floats(&solution["r0"]).len();
                (0..n)
                    .map(|k| results.value(&format!("{kind}.c{k}"), row))
                    .collect()
            };
            let n_b = floats(&data["inertia"]).len();
            let accelerations = |row| -> Vec<f64> {
                (0..n_b)
                    .map(|k| results.value(&format!("acceleration.B{k}"), row))
                    .collect()
            };
            for row in [0, last] {
                let apart = [
                    distance(&state("q", row), &floats(&solution["r0"])),
                    distance(&state("v", row), &floats(&solution["rdot0"])),
                    distance(&accelerations(row), &floats(&solution["theta_dd_t0"])),
                ];
                println!("{name} {} row {row}: {apart:?}", solution["omega"]);
                assert!(apart.iter().all(|a| *a < CLOSE), "{name}: {apart:?}");
            }
        }
    }
}
