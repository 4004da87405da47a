//! Several numbers moved together by one, in every analysis that varies a number.

use crate::response_support::marked;
use crate::time_domain_support::{floats, main_table, refusal, run};
use gearlash::report::Report;

/// Two loose gears with drag; the driving torque balances them.
const TRAIN: &str = "
schema: 1
reference: {body: A, speed: 1000 rpm}
balance: A
bodies: {A: {inertia: 2.0e-3}, B: {inertia: 1.0e-3, drag: 1 N m}, C: {inertia: 1.5e-3, drag: 1 N m}}
connections:
  mesh_1: {gear: {A: 40 mm, B: 60 mm}, stiffness: 1.0e7, element: {type: backlash, half_gap: 20 um}}
  mesh_2: {gear: {A: 40 mm, C: 50 mm}, stiffness: 1.0e7, element: {type: backlash, half_gap: 20 um}}
damping: {modal_ratio: 0.05}
loads: {A: {harmonics: [{order: 1, amplitude: 1 N m}]}}
report: {units: si}
";

fn at(report: &Report, column: &str) -> f64 {
    let table = main_table(report);
    floats(table, column)[marked(table)[0]]
}

fn direct(drags: [f64; 2]) -> Report {
    let model = TRAIN.replacen("drag: 1 N m", &format!("drag: {} N m", drags[0]), 1);
    let model = model.replacen("drag: 1 N m", &format!("drag: {} N m", drags[1]), 1);
    run(
        &model,
        "{type: frequency_response, from: 400 Hz, to: 450 Hz, harmonics: 8, marks: [420 Hz], stability: false, tolerance: 1e-12}",
    )
}

#[test]
fn a_response_moves_two_drags_and_balances_again() {
    let linked = run(
        TRAIN,
        "{type: parameter_response, at: 420 Hz, parameter: B.drag, from: 2 N m, to: 4 N m, marks: [3 N m], link: {C.drag: \"0.5*x\"}, harmonics: 8, stability: false, tolerance: 1e-12}",
    );
    assert_eq!(linked.ended_early, None);
    let wanted = direct([3.0, 1.5]);
    for column in ["mean.mesh_1", "mean.mesh_2", "rms.mesh_1", "rms.mesh_2"] {
        let [a, b] = [at(&linked, column), at(&wanted, column)];
        // Scales are those of the model as written: the iteration ends elsewhere.
        assert!((a - b).abs() < 1e-9 * b.abs(), "{column}: {a:e} {b:e}");
    }
    let mean = at(&linked, "force_mean.mesh_2");
    assert!((mean.abs() - 1.5 / 0.05).abs() < 1e-6, "{mean}");
}

#[test]
fn a_study_and_a_diagram_move_them_too() {
    let study = run(
        TRAIN,
        "{type: parameter_study, grid: {B.drag: [2 N m, 3 N m]}, link: {C.drag: \"0.5*x\"}, \
          analysis: {type: operating_point, at: 420 Hz, settle: 400, periods: 20}, \
          collect: {b: {column: force_mean.mesh_1, reduce: first}, c: {column: force_mean.mesh_2, reduce: first}}}",
    );
    let table = main_table(&study);
    for (k, drag) in [2.0, 3.0].into_iter().enumerate() {
        let [b, c] = ["b", "c"].map(|name| floats(table, name)[k].abs());
        assert!((b - drag / 0.06).abs() < 1e-6 * b, "{b}");
        assert!((c - 0.5 * drag / 0.05).abs() < 1e-6 * c, "{c}");
    }
    let diagram = run(
        TRAIN,
        "{type: bifurcation_diagram, parameter: B.drag, at: 420 Hz, from: 2 N m, to: 3 N m, points: 2, transient: 400, periods: 4, link: {C.drag: \"0.5*x\"}}",
    );
    assert_eq!(diagram.ended_early, None);
}

/// Drags in proportion to the speed, as formulas of the frequency and written for one frequency.
#[test]
fn numbers_follow_the_frequency() {
    let link = "link: {B.drag: \"2e-3*x\", C.drag: \"1e-3*x\"}";
    let x = 420.0 * std::f64::consts::TAU;
    let wanted = direct([2e-3 * x, 1e-3 * x]);
    for method in [
        "galerkin",
        "shooting",
        "integration, points: 2, transient: 400",
    ] {
        let linked = run(
            TRAIN,
            &format!(
                "{{type: frequency_response, from: 400 Hz, to: 450 Hz, method: {method}, harmonics: 8, marks: [420 Hz], stability: false, tolerance: 1e-12, {link}}}"
            ),
        );
        assert_eq!(linked.ended_early, None);
        let columns = match method {
            "galerkin" => ["mean.mesh_1", "mean.mesh_2", "rms.mesh_1", "rms.mesh_2"].as_slice(),
            // Truncated series differ from the flow.
            _ => ["mean.mesh_1", "mean.mesh_2"].as_slice(),
        };
        for column in columns {
            let [a, b] = [at(&linked, column), at(&wanted, column)];
            assert!(
                (a - b).abs() < 1e-8 * b.abs(),
                "{method} {column}: {a:e} {b:e}"
            );
        }
    }
}

#[test]
fn a_study_and_a_map_move_numbers_with_the_frequency() {
    let x = [400.0, 420.0].map(|f: f64| f * std::f64::consts::TAU);
    let study = run(
        TRAIN,
        "{type: parameter_study, grid: {frequency: [400 Hz, 420 Hz]}, link: {C.drag: \"1e-3*x\"}, \
          analysis: {type: operating_point, at: 420 Hz, settle: 400, periods: 20}, \
          collect: {c: {column: force_mean.mesh_2, reduce: first}}}",
    );
    let table = main_table(&study);
    for (k, x) in x.into_iter().enumerate() {
        let c = floats(table, "c")[k].abs();
        assert!((c - 1e-3 * x / 0.05).abs() < 1e-6 * c, "{c} at {x} rad/s");
    }
    let diagram = |keys: &str| {
        let analysis = format!(
            "{{type: bifurcation_diagram, from: 400 Hz, to: 420 Hz, points: 2, transient: 400, periods: 4, parameter: frequency, {keys}}}"
        );
        let report = run(TRAIN, &analysis);
        assert_eq!(report.ended_early, None);
        floats(main_table(&report), "q.mesh_2")
    };
    let linked = diagram("link: {C.drag: \"1e-3*x\"}");
    let plain = diagram("direction: up");
    assert!(linked.iter().zip(&plain).all(|(a, b)| (a - b).abs() > 1e-9));
}

#[test]
fn mistakes_in_links_are_named() {
    let response = |link: &str| {
        format!(
            "{{type: parameter_response, at: 420 Hz, parameter: B.drag, from: 2 N m, to: 4 N m, link: {link}}}"
        )
    };
    for (link, wanted) in [
        ("{D.drag: x}", "link.D.drag"),
        ("{C.drag: \"2*\"}", "wanted a formula of x"),
        ("{C.drag: \"2*q\"}", "only x has a value"),
        ("{B.drag: \"2*x\"}", "is the parameter itself"),
        ("{E.drag: {C.drag: x}}", "is none of the parameters"),
        ("{C.drag: \"-x\"}", "must be >= 0"),
    ] {
        let said = refusal(TRAIN, &response(link));
        assert!(said.contains(wanted), "{link}: {said}");
    }
    let map = "{type: regime_map, parameters: {B.drag: {from: 1 N m, to: 2 N m, points: 2}, frequency: {from: 400 Hz, to: 410 Hz, points: 2}}, link: {C.drag: x}}";
    assert!(refusal(TRAIN, map).contains("say which one is x"));
}
