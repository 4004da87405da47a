//! Run-ups: order tracks against values computed elsewhere, rattle, resonances; measured torques and operating points.

use crate::drive_support::{harmonic, list, means, reference, train};
use crate::time_domain_support::{floats, main_table, names, refusal, run};
use serde_json::Value;
use std::f64::consts::TAU;

fn model(case: &Value) -> (String, String) {
    let mut loads = String::new();
    let mut driven = String::new();
    for (body, load) in case["loads"].as_object().unwrap() {
        let harmonics = load["harmonics"].as_array().unwrap().iter();
        let list: Vec<String> = harmonics
            .map(|h| harmonic(h, &case["reference_speed"]))
            .collect();
        if !list.is_empty() {
            driven.clone_from(body);
        }
        loads += &format!(
            "  {body}: {{mean: {}, harmonics: [{}]}}\n",
            load["mean"],
            list.join(", ")
        );
    }
    let text = train(case, &loads);
    let speed = &case["phase"]["w0"];
    (
        format!("{text}reference: {{body: {driven}, speed: {speed} rad/s}}\n"),
        driven,
    )
}

fn analysis(case: &Value, orders: &[String], more: &str) -> String {
    let phase = &case["phase"];
    let [w0, a] = ["w0", "a"].map(|key| phase[key].as_f64().unwrap());
    let end = case["t_end"].as_f64().unwrap();
    let track = &case["order_tracks"];
    format!(
        "{{type: run_up, from: {w0} rad/s, to: {} rad/s, duration: {end} s, phase: {} rad, orders: [{}], window: {}, hop: 1{more}}}",
        w0 + a * end,
        phase["phi0"],
        orders.join(", "),
        track["revolutions"]
    )
}

/// Order tracks, speeds and switches of the clearance trains: amplitudes to 1e-8 of the largest, instants to 1e-9 s.
#[test]
fn order_tracks_follow_the_reference() {
    for case in reference("run_up") {
        if case["kind"] != "backlash" {
            continue;
        }
        let name = case["name"].as_str().unwrap();
        let (text, _) = model(&case);
        let track = &case["order_tracks"];
        let windows = track["windows"].as_array().unwrap();
        let orders: Vec<String> = windows[0]["orders"]
            .as_object()
            .unwrap()
            .keys()
            .cloned()
            .collect();
        // The reference samples as coarsely.
        let more = format!(
            ", samples_per_revolution: {}, signals: [{}], tables: [switches]",
            track["samples_per_revolution"],
            case["connections"]
                .as_object()
                .unwrap()
                .keys()
                .map(|c| format!("q.{c}"))
                .collect::<Vec<_>>()
                .join(", ")
        );
        let report = run(&text, &analysis(&case, &orders, &more));
        assert_eq!(report.ended_early, None, "{name}");
        let table = report.table("orders").unwrap();
        let (first, order) = (floats(table, "first_revolution"), floats(table, "order"));
        for window in windows {
            let begun = window["first_revolution"].as_f64().unwrap();
            let main = main_table(&report);
            let row = floats(main, "first_revolution")
                .iter()
                .position(|r| *r == begun);
            let row = row.expect("a window");
            let speed = floats(main, "speed_rpm")[row] * TAU / 60.0;
            assert!((speed / window["speed_mid"].as_f64().unwrap() - 1.0).abs() < 1e-10);
            let time = floats(main, "t")[row];
            assert!((time - window["t_mid"].as_f64().unwrap()).abs() < 1e-10);
            for (o, waves) in window["orders"].as_object().unwrap() {
                let value: f64 = o.parse().unwrap();
                let row = (0..first.len()).find(|k| first[*k] == begun && order[*k] == value);
                let row = row.expect("an order");
                for (c, wave) in waves.as_object().unwrap() {
                    let largest = window["orders"].as_object().unwrap().values();
                    let largest = largest
                        .map(|w| w[c][0].as_f64().unwrap())
                        .fold(0.0, f64::max);
                    let amplitude = floats(table, &format!("amplitude.q.{c}"))[row];
                    let gap = (amplitude - wave[0].as_f64().unwrap()).abs() / largest;
                    assert!(gap < 1e-8, "{name} {begun} order {o} {c}: {gap:e}");
                    if wave[0].as_f64().unwrap() > 1e-3 * largest {
                        let phase = floats(table, &format!("phase.q.{c}"))[row];
                        let turn = (phase - wave[1].as_f64().unwrap()) / TAU;
                        assert!(
                            (turn - turn.round()).abs() < 1e-6,
                            "{name} {begun} order {o}"
                        );
                    }
                }
            }
        }
        let times = floats(report.table("switches").unwrap(), "time");
        let wanted = &case["switchings"];
        assert_eq!(
            times.len() as u64,
            wanted["total"].as_u64().unwrap(),
            "{name}"
        );
        let firsts = wanted["first_five"].as_array().unwrap().iter().zip(&times);
        let tail = &times[times.len() - 5..];
        let lasts = wanted["last_five"].as_array().unwrap().iter().zip(tail);
        for (switch, time) in firsts.chain(lasts) {
            let gap = (time - switch[0].as_f64().unwrap()).abs();
            assert!(gap < 1e-8, "{name}: {gap:e} s");
        }
        extremes(&case, &report);
    }
}

/// Largest and least deformation of all windows, where the reference has them inside whole windows.
fn extremes(case: &Value, report: &gearlash::report::Report) {
    for (c, wanted) in case["extremes"].as_object().unwrap() {
        let speed = |key: &str| wanted[key].as_f64().unwrap();
        for (key, column) in [("max", "max"), ("min", "min")] {
            let found = floats(main_table(report), &format!("{column}.q.{c}"));
            let inside = speed(&format!("t_{key}")) > 0.6;
            let extreme = match key {
                "max" => found.into_iter().fold(f64::MIN, f64::max),
                _ => found.into_iter().fold(f64::MAX, f64::min),
            };
            let gap = (extreme / wanted[key].as_f64().unwrap() - 1.0).abs();
            assert!(!inside || gap < 1e-8, "{} {c} {key}: {gap:e}", case["name"]);
        }
    }
}

/// Default samples, hop and orders; impacts of a window add up to those of the switches in it.
#[test]
fn rattle_and_resonances_stand_beside_the_tracks() {
    let cases = reference("run_up");
    let case = cases
        .iter()
        .find(|c| c["name"] == "two_body_up_speed_squared")
        .unwrap();
    let (text, _) = model(case);
    let report = run(
        &text,
        &analysis(
            case,
            &["2".into()],
            ", tables: [switches, spectra, series], bands: [[0 Hz, 200 Hz]]",
        ),
    );
    let main = main_table(&report);
    let (first, rate) = (
        floats(main, "first_revolution"),
        floats(main, "impacts_per_s.mesh"),
    );
    let switches = report.table("switches").unwrap();
    let made: Vec<f64> = (floats(switches, "time").into_iter())
        .zip(floats(switches, "from"))
        .filter(|(_, from)| *from == 0.0)
        .map(|(t, _)| t)
        .collect();
    // phi = w0 t + a t^2 / 2
    let (w0, a) = (60.0, 40.0);
    let time = |turns: f64| (f64::sqrt(w0 * w0 + 2.0 * a * TAU * turns) - w0) / a;
    for (first, rate) in first.iter().zip(&rate) {
        let (begin, end) = (time(*first), time(first + 4.0));
        let inside = made.iter().filter(|t| (begin..end).contains(*t)).count() as f64;
        assert!(
            (rate * (end - begin) - inside).abs() < 1e-9,
            "{first}: {rate} {inside}"
        );
    }
    let spectra = (report.further_figures.iter())
        .find(|f| f.name == "spectra")
        .unwrap();
    let mut panels = spectra.figure.panels.iter();
    assert!(panels.all(|p| !p.heading.contains("q.") && p.heading.contains(", mesh")));
    let resonances = report.table("resonances").unwrap();
    // Mesh: m = 1 / (0.05^2 / 0.012 + 0.09^2 / 0.05) kg against 6e5 N/m, order 2.
    let mass: f64 = 1.0 / (0.0025 / 0.012 + 0.0081 / 0.05);
    let wanted = (6e5 / mass).sqrt() / 2.0 * 60.0 / TAU;
    let found = floats(resonances, "speed_rpm")[0];
    assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
    // The spectrum at order 2 is the track; the level of a narrow response that of its order.
    let spectra = report.table("spectra").unwrap();
    let (order, amplitude) = (
        floats(spectra, "order"),
        floats(spectra, "amplitude.q.mesh"),
    );
    let tracks = floats(report.table("orders").unwrap(), "amplitude.q.mesh");
    let lines: Vec<f64> = (order.iter().zip(&amplitude))
        .filter(|(o, _)| **o == 2.0)
        .map(|(_, a)| *a)
        .collect();
    for (line, track) in lines.iter().zip(&tracks) {
        assert!((line / track - 1.0).abs() < 1e-10, "{line} {track}");
    }
    assert!(names(main).contains(&"level.0.q.mesh"));
    let series = report.table("series").unwrap();
    assert!(floats(series, "t").windows(2).all(|t| t[1] > t[0]));
}

/// Coefficients of the broken line through the samples of a cycle: X_k / N sinc^2(k / N), to 1e-12 of the largest.
#[test]
fn a_measured_cycle_has_the_orders_of_its_broken_line() {
    for case in reference("measured_torque") {
        let values = cycle(&case);
        let table = gearlash::numeric::periodic::Periodic::Table {
            values,
            base_order: 1,
        };
        let mut coefficients = vec![0.0; 2 * 12 + 1];
        table.coefficients(1, &mut coefficients);
        let wanted = case["half_orders"]["values"].as_object().unwrap();
        let all = wanted.values().flat_map(list);
        let size = all.fold(0.0_f64, |m, x| m.max(x.abs()));
        for (order, wave) in wanted {
            let k = (2.0 * order.parse::<f64>().unwrap()) as usize;
            for (found, place) in [(coefficients[2 * k], 0), (coefficients[2 * k - 1], 1)] {
                // The file has eleven digits.
                let gap = (found - wave[place].as_f64().unwrap()).abs() / size;
                assert!(gap < 1e-10, "order {order}: {gap:e}");
            }
        }
    }
}

fn cycle(case: &Value) -> Vec<f64> {
    let p = &case["torque"]["parameters"];
    let of = |key: &str| p[key].as_f64().unwrap();
    let torque = |x: f64| {
        let gas =
            of("gas") * x.sin() * (of("kappa") * (((x - of("theta_f")) / 2.0).cos() - 1.0)).exp();
        let lam = of("lam");
        let inertia = lam / 4.0 * x.sin() - 0.5 * (2.0 * x).sin() - 0.75 * lam * (3.0 * x).sin();
        of("T0") + gas + of("inertia") * inertia
    };
    (0..720)
        .map(|i| torque(2.0 * TAU * f64::from(i) / 720.0))
        .collect()
}

/// The steady response to the table itself, against the reference: r.m.s. to 1e-8.
#[test]
fn operating_points_under_a_measured_torque_follow_the_reference() {
    let cases = reference("measured_torque");
    for case in &cases {
        let body = case["torque"]["body"].as_str().unwrap();
        let own = format!(
            "  {body}: {{cycle: {{values: {:?}, unit: N m, revolutions: 2}}}}\n",
            cycle(case)
        );
        let text = train(case, &(means(case, body) + &own));
        for steady in case["steady"].as_array().unwrap() {
            let speed = steady["speed_rad_s"].as_f64().unwrap();
            let reference = format!("reference: {{body: {body}, speed: {speed} rad/s}}\n");
            let analysis =
                format!("{{type: operating_point, at: {speed} rad/s, settle: 400, periods: 8}}");
            let report = run(&(text.clone() + &reference), &analysis);
            let main = main_table(&report);
            for (c, wanted) in steady["connections"].as_object().unwrap() {
                for (column, key) in [("rms", "rms"), ("force_std", "force_std"), ("max", "max")] {
                    let found = floats(main, &format!("{column}.{c}"))[0];
                    let wanted = wanted[key].as_f64().unwrap();
                    let gap = (found / wanted - 1.0).abs();
                    assert!(gap < 1e-8, "{} {speed} {column}.{c}: {gap:e}", case["name"]);
                }
                let made = wanted["contacts_made_per_cycle"].as_f64().unwrap();
                assert_eq!(2.0 * floats(main, &format!("impacts.{c}"))[0], made);
            }
            let rpm = floats(main, "speed_rpm")[0] * TAU / 60.0;
            assert!((rpm / speed - 1.0).abs() < 1e-14);
        }
    }
}

/// Deformation plus static transmission error of the spur pair, up and down: r.m.s. to 1e-8.
#[test]
fn dynamic_transmission_errors_follow_the_reference() {
    let cases = reference("spur_pair_dte");
    let case = &cases[0];
    let p = &case["parameters"];
    let series = |key: &str| {
        let list = p[key].as_array().unwrap().iter();
        let one = |h: &Value| {
            format!(
                "{{order: {}, amplitude: {}, phase: {} rad}}",
                h["order_of_mesh"], h["amplitude"], h["phase"]
            )
        };
        list.map(one).collect::<Vec<_>>().join(", ")
    };
    let text = format!(
        "schema: 1\nbodies: {{A: {{inertia: {}}}, B: {{inertia: {}}}}}\nconnections:\n  mesh: {{gear: {{A: {r}, B: {r}}}, \
         stiffness: {}, damping: {}, element: {{type: backlash, half_gap: {}}}, stiffness_variation: {{harmonics: [{}]}}, \
         transmission_error: {{harmonics: [{}]}}}}\nloads: {{A: {{mean: {}}}, B: {{mean: {}}}}}\nreport: {{units: si}}\n",
        p["inertia_A"],
        p["inertia_B"],
        p["mean_stiffness"],
        p["dashpot"],
        p["half_gap"],
        series("relative_stiffness_variation"),
        series("transmission_error"),
        p["torque_A"],
        p["torque_B"],
        r = p["base_radius"],
    );
    for value in case["sweep_values"].as_array().unwrap().iter().step_by(4) {
        let frequency = value["mesh_frequency_hz"].as_f64().unwrap();
        let up = &value["up"];
        let q = up["initial_dte"].as_f64().unwrap();
        let v = up["initial_dte_rate"].as_f64().unwrap();
        let analysis = format!(
            "{{type: time_history, at: {frequency} Hz, periods: 1, samples_per_period: 4, initial: {{q: [{q}], v: [{v}]}}}}"
        );
        // The orbit of the reference closes.
        let report = run(&text, &analysis);
        let main = main_table(&report);
        let found = floats(main, "q.mesh");
        let size = up["max_deformation"].as_f64().unwrap();
        assert!((found[4] - found[0]).abs() < 1e-8 * size, "{frequency}");
        if (value["down"]["rms_dte"].as_f64().unwrap() / up["rms_dte"].as_f64().unwrap() - 1.0)
            .abs()
            > 1e-6
        {
            continue;
        }
        // One attractor: the operating point finds it.
        let analysis =
            format!("{{type: operating_point, at: {frequency} Hz, settle: 1500, periods: 20}}");
        let report = run(&text, &analysis);
        let found = floats(main_table(&report), "dte_rms.mesh")[0];
        let gap = (found / up["rms_dte"].as_f64().unwrap() - 1.0).abs();
        assert!(gap < 1e-8, "{frequency} Hz: {gap:e}");
        let range = floats(main_table(&report), "dte_peak_to_peak.mesh")[0];
        assert!(range > 2.0 * found && range < 4.0 * found);
    }
}

/// Amplitudes that grow with the speed: Galerkin, shooting and integration agree, at every speed of a branch.
#[test]
fn growing_amplitudes_are_the_same_for_all_methods() {
    let text = "
schema: 1
bodies: {A: {inertia: 2.0e-3}}
connections: {spring: {ground: A, stiffness: 2.0e3, damping: 0.4, element: {type: backlash, half_gap: 1 mrad}}}
loads:
  A:
    mean: 3
    harmonics:
      - {order: 1, amplitude: {speed: [100 rad/s, 800 rad/s], values: [0.5, 2]}}
      - {order: 2, amplitude: 0.4, speed_power: 2, at: 300 rad/s}
";
    let analysis = "{type: frequency_response, from: 200 rad/s, to: 600 rad/s, methods: [galerkin, shooting, integration], harmonics: 60, marks: [250 rad/s, 400 rad/s], points: 3, max_step: 0.05}";
    let report = run(text, analysis);
    let main = main_table(&report);
    let methods = crate::time_domain_support::texts(main, "method");
    let (mark, parameter, rms) = (
        floats(main, "mark"),
        floats(main, "parameter"),
        floats(main, "rms.spring"),
    );
    for speed in [250.0, 400.0] {
        let at: Vec<(String, f64)> = (0..mark.len())
            .filter(|k| mark[*k] == 1.0 && (parameter[*k] - speed).abs() < 1e-9)
            .map(|k| (methods[k].clone(), rms[k]))
            .collect();
        assert_eq!(at.len(), 3, "{at:?}");
        for (_, rms) in &at {
            assert!((rms / at[1].1 - 1.0).abs() < 1e-6, "{at:?}");
        }
    }
}

#[test]
fn settings_of_run_ups_that_are_wrong_are_named() {
    let text = "
schema: 1
bodies: {A: {inertia: 2.0e-3}}
connections: {spring: {ground: A, stiffness: 2.0e3, element: {type: backlash, half_gap: 1 mrad}}}
loads: {A: {mean: 3, harmonics: [{order: 1, amplitude: 4}]}}
";
    let with = |more: &str| format!("{{type: run_up, from: 600 rpm, to: 900 rpm, {more}}}");
    for (more, words) in [
        ("", vec!["duration", "missing", "rate"]),
        ("duration: 1 s, rate: 3 rpm/s", vec!["rate", "exclude"]),
        ("duration: 1 ms", vec!["window", "whole"]),
        ("duration: 9 s, orders: [0]", vec!["orders.0", "above 0"]),
        ("duration: 9 s, orders: [1, 1]", vec!["orders.1", "twice"]),
        ("duration: 9 s, orders: [spring]", vec!["orders.0", "teeth"]),
        (
            "duration: 9 s, signals: [q.sprin]",
            vec!["signals.0", "q.sprin", "spring"],
        ),
        (
            "duration: 9 s, signals: [w.spring]",
            vec!["signals.0", "w.spring"],
        ),
        (
            "duration: 9 s, signals: []",
            vec!["signals", "at least one"],
        ),
        ("duration: 9 s, window: 0", vec!["window", "at least 1"]),
        (
            "duration: 9 s, samples_per_revolution: 2",
            vec!["samples_per_revolution", "twice"],
        ),
        (
            "duration: 9 s, bands: [[9 Hz, 3 Hz]]",
            vec!["bands.0", "lower"],
        ),
        ("duration: 9 s, tables: [orders]", vec!["tables"]),
    ] {
        let said = refusal(text, &with(more));
        for word in words {
            assert!(said.contains(word), "{more}: {said}\nlacks {word}");
        }
    }
}
