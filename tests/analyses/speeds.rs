//! Drags that follow the speed, measured run-ups, trains that follow, amplitudes by order.

use crate::response_support::marked;
use crate::time_domain_support::{floats, load, main_table, refusal, run, texts};
use std::f64::consts::{PI, TAU};

const RPM: f64 = TAU / 60.0;

/// A motor drives a wheel with drag over a shaft.
fn train(drag: &str) -> String {
    format!(
        "schema: 1\nreference: {{body: A, speed: 1000 rpm}}\nbalance: A\n\
         bodies: {{A: {{inertia: 2.0e-2}}, B: {{inertia: 1.0e-2, drag: {drag}}}}}\n\
         connections: {{s: {{shaft: [A, B], stiffness: 500, damping: 0.2}}}}\n\
         loads: {{A: {{harmonics: [{{order: 2, amplitude: 3 N m}}]}}}}\nreport: {{units: si}}\n"
    )
}

#[test]
fn viscous_drag_and_its_balance_follow_the_speed() {
    let model = train("{constant: 0.5 N m, viscous: 0.01 N m s/rad}");
    for method in ["galerkin", "shooting", "integration"] {
        let own = match method {
            "integration" => "points: 2, transient: 400, periods: 10",
            _ => "stability: false",
        };
        let report = run(
            &model,
            &format!(
                "{{type: frequency_response, from: 500 rpm, to: 2000 rpm, method: {method}, marks: [500 rpm, 2000 rpm], {own}}}"
            ),
        );
        assert_eq!(report.ended_early, None, "{method}");
        let table = main_table(&report);
        let (speeds, means) = (floats(table, "speed_rpm"), floats(table, "force_mean.s"));
        for row in marked(table) {
            let wanted = 0.5 + 0.01 * speeds[row] * RPM;
            assert!(
                (means[row] - wanted).abs() < 1e-8,
                "{method}: {} {wanted}",
                means[row]
            );
        }
    }
}

#[test]
fn diagrams_over_the_frequency_have_speeds() {
    let diagram = "{type: bifurcation_diagram, parameter: frequency, from: 500 rpm, to: 2000 rpm, points: 3, transient: 2, \
                   periods: 1, lyapunov: false, extend: 1}";
    let report = run(&train("0.5 N m"), diagram);
    for table in &report.tables {
        let speeds = floats(table, "speed_rpm");
        for (speed, wanted) in speeds.iter().zip([500.0, 1250.0, 2000.0]) {
            assert!((speed - wanted).abs() < 1e-9, "{} {speeds:?}", table.name);
        }
        assert_eq!(speeds.len(), 3, "{}", table.name);
    }
}

#[test]
fn viscous_drag_turns_round_with_the_speed_and_constant_drag_does_not() {
    let history = "{type: time_history, duration: 4 s, speed: {points: [[0 s, 1000 rpm], [1 s, -1000 rpm]]}, samples: [4 s]}";
    let model = train("{viscous: 0.01 N m s/rad}").replace("amplitude: 3", "amplitude: 0");
    let report = run(&model, history);
    let force = floats(main_table(&report), "f.s")[0];
    assert!((force + 0.01 * 1000.0 * RPM).abs() < 1e-6, "{force}");
    let said = refusal(&train("0.5 N m"), history);
    assert!(said.contains("constant drag of `B`"), "{said}");
    // From rest is allowed.
    let start = history.replace(
        "[0 s, 1000 rpm], [1 s, -1000 rpm]",
        "[0 s, 0 rpm], [1 s, 1000 rpm]",
    );
    assert_eq!(run(&train("0.5 N m"), &start).ended_early, None);
}

#[test]
fn amplitudes_by_order_are_those_of_the_closed_form() {
    let model = train("0.5 N m");
    let report = run(
        &model,
        "{type: frequency_response, from: 900 rpm, to: 1100 rpm, marks: [1000 rpm], orders: [1, 2, 0.5], stability: false, tolerance: 1e-13}",
    );
    let table = main_table(&report);
    let row = marked(table)[0];
    let w = 2.0 * 1000.0 * RPM;
    let mass = 1.0 / (1.0 / 2e-2 + 1.0 / 1e-2);
    // Relative motion of two free wheels under a torque on the first.
    let size = (500.0 - mass * w * w).hypot(0.2 * w);
    let q = 3.0 * mass / 2e-2 / size;
    let of = |name: &str| floats(table, name)[row];
    assert!((of("order_2.q.s") / q - 1.0).abs() < 1e-10);
    assert!((of("order_2.f.s") / (500.0 * q) - 1.0).abs() < 1e-10);
    let driven = 500.0_f64.hypot(0.2 * w) * q / 1e-2;
    assert!((of("order_2.acceleration.B") / driven - 1.0).abs() < 1e-9);
    assert!(of("order_1.q.s") < 1e-12 * q);
    // Half an order has no whole wave in a revolution.
    assert!(of("order_1/2.q.s").is_nan());
    let point = run(
        &model,
        "{type: operating_point, at: 1000 rpm, settle: 400, periods: 10, orders: [2], lyapunov: false}",
    );
    assert!((floats(main_table(&point), "order_2.q.s")[0] / q - 1.0).abs() < 1e-8);
    let said = refusal(
        &model,
        "{type: operating_point, at: 1000 rpm, orders: [mesh_9]}",
    );
    assert!(said.contains("orders.0"), "{said}");
}

#[test]
fn a_measured_run_is_the_run_that_its_table_says() {
    let model = train("{viscous: 0.01 N m s/rad}");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("n.csv"),
        "t;n\n0;10\n500;10\n2500;30\n3000;30\n",
    )
    .unwrap();
    let tracks = |keys: &str| {
        let study = load(
            &model,
            &format!("  it: {{type: run_up, {keys}, orders: [2], signals: [q.s, acceleration.B]}}"),
            folder.path(),
        );
        let settings = gearlash::study::RunSettings {
            out: folder.path().join("out"),
            figures: vec![],
            jobs: 1,
        };
        let study = study.unwrap();
        let report = study
            .run(&settings, &crate::time_domain_support::Quiet)
            .unwrap()
            .reports
            .remove(0);
        let table = report.table("orders").unwrap();
        ["speed_rpm", "amplitude.q.s", "amplitude.acceleration.B"].map(|name| floats(table, name))
    };
    let ramp = tracks("from: 600 rpm, to: 1800 rpm, duration: 2 s, hold: 0.5 s");
    let file = tracks("speed: {file: n.csv, time: t, column: n, time_unit: ms, unit: Hz}");
    for (a, b) in ramp.iter().flatten().zip(file.iter().flatten()) {
        assert!((a - b).abs() < 1e-9 * a.abs().max(1e-9), "{a} {b}");
    }
    std::fs::write(folder.path().join("n.csv"), "t;n\n0;10\n5;10\n4;30\n").unwrap();
    for (keys, wanted) in [
        (
            "speed: {file: n.csv, time: t, column: n, unit: Hz}",
            "row 4, column `t`",
        ),
        ("speed: {file: n.csv, time: t, column: m}", "no column `m`"),
        ("speed: {points: [[0, 100], [1, 0]]}", "above 0"),
        (
            "speed: {points: [[0, 100], [1, 200]]}, from: 3 rpm",
            "does not go with `speed`",
        ),
        ("to: 3 rpm, duration: 1 s", "or give `speed`"),
    ] {
        let said = load(
            &model,
            &format!("  it: {{type: run_up, {keys}}}"),
            folder.path(),
        );
        let said = said.err().unwrap();
        assert!(said.contains(wanted), "{keys}: {said}");
    }
}

#[test]
fn a_train_that_follows_has_the_mean_acceleration() {
    let model = train("0.5 N m").replace("amplitude: 3", "amplitude: 0");
    let at = |follow: &str| {
        let report = run(
            &model,
            &format!(
                "{{type: time_history, duration: 2 s, speed: {{points: [[0 s, 100 rpm], [1 s, 700 rpm]]}}, samples: [0.5 s, 1.5 s]{follow}}}"
            ),
        );
        floats(main_table(&report), "acceleration.B")
    };
    let (without, with) = (at(""), at(", follow: true"));
    assert!(
        (with[0] - without[0] - 600.0 * RPM).abs() < 1e-9,
        "{with:?} {without:?}"
    );
    assert!((with[1] - without[1]).abs() < 1e-9);
}

#[test]
fn spectra_have_levels_with_a_reference_and_natural_frequencies_over_them() {
    let report = run(
        &train("0.5 N m"),
        "{type: run_up, from: 600 rpm, to: 1500 rpm, duration: 3 s, orders: [2], signals: [q.s], spectrum_to: 6}",
    );
    let table = report.table("spectra").unwrap();
    let (amplitudes, levels) = (floats(table, "amplitude.q.s"), floats(table, "level.q.s"));
    let largest = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for (a, level) in amplitudes.iter().zip(&levels) {
        let wanted = 20.0 * (a / 2.0_f64.sqrt() / 1e-6).log10();
        assert!((level - wanted.max(largest - 80.0)).abs() < 1e-9);
    }
    let unit = &table.column("level.q.s").unwrap().unit;
    assert_eq!(unit, "dB re 1e-6 rad");
    let campbell = report.table("campbell").unwrap();
    let (orders, speeds) = (floats(campbell, "order"), floats(campbell, "speed_rpm"));
    let natural = (500.0 * (1.0 / 2e-2 + 1.0 / 1e-2_f64)).sqrt() / (2.0 * PI) * 60.0;
    assert!(
        texts(campbell, "line")
            .iter()
            .any(|line| line == "mode 1 in contact")
    );
    assert!(
        orders
            .iter()
            .zip(&speeds)
            .all(|(o, w)| (o * w / natural - 1.0).abs() < 1e-9)
    );
}
