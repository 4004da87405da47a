//! Torques over time and courses of speed against values computed elsewhere, closed forms and the other integrator.

use crate::drive_support::{harmonic, list, means, reference, train};
use crate::time_domain_support::{floats, main_table, refusal, run, texts};
use serde_json::Value;

fn profile(case: &Value) -> String {
    let table = &case["torque_table"];
    let points = list(&table["t"]).into_iter().zip(list(&table["T"]));
    let points: Vec<String> = points.map(|(t, y)| format!("[{t} s, {y} N m]")).collect();
    let body = table["body"].as_str().unwrap();
    let own = format!(
        "  {body}: {{profile: {{points: [{}]}}}}\n",
        points.join(", ")
    );
    train(case, &(means(case, body) + &own))
}

/// States and switches of every reference transient: 1e-9 of the largest value, 1e-9 s.
#[test]
fn steps_and_ramps_of_torque_follow_the_reference() {
    for case in reference("transient_torque") {
        let name = case["name"].as_str().unwrap();
        let instants = list(&case["instants"]);
        let last = instants[instants.len() - 1];
        let q = list(&case["initial"]["deformation"]);
        for (integrator, tolerance) in [("auto", 1e-9), ("dopri5", 1e-7)] {
            let analysis = format!(
                "{{type: time_history, integrator: {integrator}, duration: {last} s, samples: {instants:?}, initial: {{q: {q:?}}}}}"
            );
            let report = run(&profile(&case), &analysis);
            let main = main_table(&report);
            for (kind, key) in [("q", "deformation"), ("v", "rate")] {
                for (connection, values) in case[key].as_object().unwrap() {
                    let wanted = list(values);
                    let size = wanted.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                    let found = floats(main, &format!("{kind}.{connection}"));
                    for (a, b) in found.iter().zip(&wanted) {
                        let gap = (a - b).abs() / size;
                        assert!(gap < tolerance, "{name} {kind}.{connection}: {gap:e}");
                    }
                }
            }
            let switches = report.table("switches").unwrap();
            let times = floats(switches, "time");
            let wanted = &case["switchings"];
            assert_eq!(
                times.len() as u64,
                wanted["total"].as_u64().unwrap(),
                "{name}"
            );
            let sides = (floats(switches, "from"), floats(switches, "to"));
            for (k, switch) in wanted["first"].as_array().unwrap().iter().enumerate() {
                let gap = (times[k] - switch[0].as_f64().unwrap()).abs();
                assert!(gap < 1e-9, "{name} switch {k}: {gap:e} s");
                assert_eq!(
                    texts(switches, "connection")[k],
                    switch[1].as_str().unwrap()
                );
                assert_eq!(Some(sides.0[k]), switch[2].as_f64());
                assert_eq!(Some(sides.1[k]), switch[3].as_f64());
            }
            let rattle = report.table("rattle").unwrap();
            for (k, connection) in texts(rattle, "connection").iter().enumerate() {
                let peak = &case["peaks"][connection];
                for (column, key) in [("force_max", "max_force"), ("force_min", "min_force")] {
                    let (found, wanted) = (floats(rattle, column)[k], peak[key].as_f64().unwrap());
                    if wanted == 0.0 {
                        // The reference begins its search there.
                        continue;
                    }
                    let size = peak["max_force"].as_f64().unwrap().abs();
                    let size = size.max(peak["min_force"].as_f64().unwrap().abs());
                    let gap = (found - wanted).abs() / size;
                    assert!(gap < 1e-8, "{name} {connection} {column}: {gap:e}");
                }
            }
        }
    }
}

/// Energies of impacts: half the mass that the mesh feels alone times the square of the speed.
#[test]
fn impacts_have_speeds_and_energies() {
    let cases = reference("transient_torque");
    let case = cases.iter().find(|c| c["name"] == "back_out").unwrap();
    let q = list(&case["initial"]["deformation"]);
    let analysis = format!("{{type: time_history, duration: 0.3 s, initial: {{q: {q:?}}}}}");
    let report = run(&profile(case), &analysis);
    let impacts = report.table("impacts").unwrap();
    let switches = report.table("switches").unwrap();
    let mass = |c: &str| match c {
        "mesh" => 1.0 / (0.042 * 0.042 / 0.004 + 0.078 * 0.078 / 0.011),
        _ => 1.0 / (1.0 / 0.011 + 1.0 / 0.006),
    };
    let made: Vec<usize> = (0..floats(switches, "time").len())
        .filter(|k| floats(switches, "from")[*k] == 0.0)
        .collect();
    let (speeds, energies) = (floats(impacts, "speed"), floats(impacts, "energy"));
    assert_eq!(made.len(), speeds.len());
    let names = texts(impacts, "connection");
    for (row, k) in made.iter().enumerate() {
        assert_eq!(speeds[row], floats(switches, "rate")[*k].abs());
        let wanted = 0.5 * mass(&names[row]) * speeds[row] * speeds[row];
        assert!((energies[row] / wanted - 1.0).abs() < 1e-12);
    }
}

/// A load whose order and speed change against the closed forms of the reference (complex error functions).
#[test]
fn linear_run_ups_follow_the_closed_form() {
    for case in reference("run_up") {
        if case["kind"] != "linear, closed form" {
            continue;
        }
        let name = case["name"].as_str().unwrap();
        let load = &case["loads"]["A"];
        let loads = format!(
            "  A: {{harmonics: [{}]}}\n",
            harmonic(load, &load["reference_speed"])
        );
        let phase = &case["phase"];
        let [phi, w0, a] = ["phi0", "w0", "a"].map(|key| phase[key].as_f64().unwrap());
        let instants = list(&case["instants"]);
        let last = instants[instants.len() - 1];
        // time_history starts at phase 0: the phase of the load makes up for it.
        let order = load["order"].as_f64().unwrap();
        let shifted = load["phase"].as_f64().unwrap() + order * phi;
        let written = format!("phase: {} rad", load["phase"]);
        let loads = loads.replace(&written, &format!("phase: {shifted} rad"));
        let n = case["connections"].as_object().unwrap().len();
        let zero = vec![0.0; n];
        for (integrator, tolerance) in [("auto", 1e-10), ("dopri5", 1e-7)] {
            let analysis = format!(
                "{{type: time_history, integrator: {integrator}, duration: {last} s, samples: {instants:?}, \
                 speed: {{points: [[0 s, {w0} rad/s], [{last} s, {} rad/s]]}}, initial: {{q: {zero:?}}}}}",
                w0 + a * last
            );
            let report = run(&train(&case, &loads), &analysis);
            for (kind, key) in [("q", "deformation"), ("v", "rate")] {
                let connection = case["connections"]
                    .as_object()
                    .unwrap()
                    .keys()
                    .next()
                    .unwrap();
                let found = floats(main_table(&report), &format!("{kind}.{connection}"));
                let wanted = list(&case[key]);
                let size = wanted.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                for (a, b) in found.iter().zip(&wanted) {
                    let gap = (a - b).abs() / size;
                    assert!(gap < tolerance, "{name} {integrator} {kind}: {gap:e}");
                }
            }
        }
    }
}

/// Tables over the phase, a transmission error with a dashpot, tables of amplitudes and a varying stiffness along one course:
/// the series flow and Dormand and Prince's method go the same way.
#[test]
fn both_integrators_follow_a_course_with_corners_of_all_kinds() {
    let model = "
schema: 1
bodies: {A: {inertia: 2.0e-3}, B: {inertia: 1.0e-3}, C: {inertia: 0.5}}
connections:
  mesh:
    gear: {A: 50 mm, B: 40 mm}
    stiffness: 2.0e6
    damping: 40
    element: {type: backlash, half_gap: 20 um, impact_damping: 0.2}
    transmission_error: {harmonics: [{order: 3, amplitude: 5 um}]}
    stiffness_variation: {table: [0.9, 1.1, 1.05, 0.95]}
  shaft: {shaft: [B, C], stiffness: 2.0e3, damping: 0.05}
loads:
  A:
    mean: 1
    harmonics: [{order: 0.5, amplitude: {speed: [50 rad/s, 90 rad/s, 130 rad/s], values: [4, 1, 6]}}]
    cycle: {values: [0, 5, -3, 1, -2, 0.5], revolutions: 2}
    profile: {points: [[0, 0], [40 ms, 3], [40 ms, -2], [70 ms, 1]]}
reference: {body: A, speed: 60 rad/s}
";
    let course = "speed: {points: [[0 s, 60 rad/s], [60 ms, 120 rad/s], [80 ms, 120 rad/s], [120 ms, -40 rad/s]]}";
    let found = ["auto", "dopri5"].map(|integrator| {
        let analysis = format!(
            "{{type: time_history, integrator: {integrator}, duration: 120 ms, points: 61, {course}}}"
        );
        let report = run(model, &analysis);
        assert_eq!(report.ended_early, None);
        assert_eq!(report.warnings.iter().filter(|w| w.contains("pull")).count(), 0);
        let q = ["mesh", "shaft"].map(|c| floats(main_table(&report), &format!("q.{c}")));
        (q, floats(report.table("switches").unwrap(), "time"))
    });
    for (a, b) in found[0].0.iter().zip(&found[1].0) {
        let size = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-7 * size, "{a} {b}");
        }
    }
    assert_eq!(found[0].1.len(), found[1].1.len());
    assert!(found[0].1.len() > 10);
    for (a, b) in found[0].1.iter().zip(&found[1].1) {
        assert!((a - b).abs() < 1e-8, "{a} {b}");
    }
}

/// At constant speed a course is the periodic motion.
#[test]
fn a_constant_speed_gives_the_periodic_motion() {
    let model = "
schema: 1
bodies: {A: {inertia: 2.0e-3}}
connections: {spring: {ground: A, stiffness: 2.0e3, damping: 0.05, element: {type: backlash, half_gap: 1 mrad}}}
loads: {A: {mean: 3, harmonics: [{order: 1, amplitude: 4}, {order: 2, amplitude: 3, speed_power: 2, at: 100 rad/s}]}}
";
    let periods = "{type: time_history, at: 150 rad/s, periods: 3, samples_per_period: 8}";
    let end = 3.0 * std::f64::consts::TAU / 150.0;
    let duration = format!("{{type: time_history, at: 150 rad/s, duration: {end} s, points: 25}}");
    let [a, b] = [periods, &duration].map(|analysis| run(model, analysis));
    let [x, y] = [&a, &b].map(|r| floats(main_table(r), "q.spring"));
    let size = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert_eq!(x.len(), y.len());
    for (x, y) in x.iter().zip(&y) {
        assert!((x - y).abs() < 1e-10 * size, "{x} {y}");
    }
    let impacts = [&a, &b].map(|r| floats(r.table("impacts").unwrap(), "energy"));
    assert_eq!(impacts[0].len(), impacts[1].len());
}

#[test]
fn what_does_not_go_together_is_named() {
    let model = "
schema: 1
bodies: {A: {inertia: 2.0e-3}}
connections: {spring: {ground: A, stiffness: 2.0e3}}
loads: {A: {mean: 3, harmonics: [{order: 1, amplitude: 4, speed_power: 0.5, at: 100 rad/s}], profile: {points: [[0, 1], [1 s, 2]]}}}
";
    for (analysis, words) in [
        ("{type: time_history, duration: 1 s}", vec!["at", "missing"]),
        ("{type: time_history}", vec!["at", "missing", "duration"]),
        (
            "{type: time_history, at: 100 rpm}",
            vec!["loads.A.profile", "duration"],
        ),
        (
            "{type: frequency_response, from: 100 rpm, to: 200 rpm}",
            vec!["loads.A.profile", "run_up"],
        ),
        (
            "{type: time_history, at: 9 rpm, duration: 1 kg}",
            vec!["duration", "kg"],
        ),
        (
            "{type: time_history, at: 9 rpm, duration: -1 s}",
            vec!["duration", "> 0"],
        ),
        (
            "{type: time_history, at: 9 rpm, duration: 1 s, samples: [0, 2]}",
            vec!["samples.1", "outside"],
        ),
        (
            "{type: time_history, at: 9 rpm, duration: 1 s, samples: [0.5, 0.2]}",
            vec!["samples.1", "ascend"],
        ),
        (
            "{type: time_history, at: 9 rpm, duration: 1 s, periods: 3}",
            vec!["periods", "duration"],
        ),
        (
            "{type: time_history, duration: 1 s, speed: {points: [[0 s, 9 rpm], [1 s, -9 rpm]]}}",
            vec!["speed", "speed_power"],
        ),
        (
            "{type: time_history, duration: 1 s, speed: {points: [[1 s, 9 rpm], [1 s, 10 rpm]]}}",
            vec!["speed.points.1", "jump"],
        ),
        (
            "{type: time_history, at: 9 rpm, duration: 1 s, columns: [q.sprin]}",
            vec!["columns.0", "q.spring"],
        ),
    ] {
        let said = refusal(model, analysis);
        for word in words {
            assert!(said.contains(word), "{analysis}: {said}\nlacks {word}");
        }
    }
    let said = run(model, "{type: modes}");
    assert_eq!(said.ended_early, None);
}

/// An order without a common period: a motion over time is the linear one in closed form, periodic methods name the order.
#[test]
fn orders_without_a_common_period_are_for_motions_over_time() {
    let order = std::f64::consts::SQRT_2;
    let model = |second: f64| {
        format!(
            "
schema: 1
bodies: {{A: {{inertia: 1}}}}
connections: {{spring: {{ground: A, stiffness: 100, damping: 40}}}}
loads: {{A: {{harmonics: [{{order: 1, amplitude: 3}}, {{order: {second}, amplitude: 5, phase: 0.4}}]}}}}
"
        )
    };
    let text = model(order);
    let said = refusal(
        &text,
        "{type: frequency_response, from: 3 rad/s, to: 4 rad/s}",
    );
    for word in ["1.414213562373095", "loads.A", "common period", "run_up"] {
        assert!(said.contains(word), "{said}");
    }
    // Long after the start: x = sum of F / |k - w^2 + i c w| cos(w t + phase - arg).
    let analysis = "{type: time_history, at: 7 rad/s, duration: 20 s, samples: [19, 19.4, 20]}";
    let report = run(&text, analysis);
    let steady = |t: f64| {
        [(1.0, 3.0, 0.0), (order, 5.0, 0.4)]
            .iter()
            .fold(0.0, |sum, (o, f, phase)| {
                let w: f64 = 7.0 * o;
                let (re, im) = (100.0 - w * w, 40.0 * w);
                sum + f / re.hypot(im) * (w * t + phase - im.atan2(re)).cos()
            })
    };
    let found = floats(main_table(&report), "q.spring");
    for (x, t) in found.iter().zip([19.0, 19.4, 20.0]) {
        assert!((x - steady(t)).abs() < 1e-12, "{x} {}", steady(t));
    }
}
