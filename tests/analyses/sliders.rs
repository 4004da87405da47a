//! Onsets of slip on branches, and motions that start from saved points.

use crate::time_domain_support::*;

/// Mass on a spring beside a slider of half its stiffness, which holds 0.3.
const SLIDER: &str = "
schema: 1
reduced:
  stiffness: [[1.0, 0.5]]
  damping: {matrix: [[0.06]]}
  elements: {s: {type: linear}, j: {type: jenkins, slip_force: 0.6}}
  element_map: [[1], [1]]
  loads: {mean: [0.2], harmonics: [{order: 1, cos: [0.25], sin: [0]}]}
";

/// Stuck, the response is linear: the slider slips where its amplitude exceeds 0.6, between these two frequencies.
#[test]
fn onsets_of_slip_have_a_closed_form() {
    let report = run(
        SLIDER,
        "{type: frequency_response, from: 0.9, to: 1.6, harmonics: 15}",
    );
    let table = report.table("events").unwrap();
    let (kinds, omega) = (texts(table, "kind"), floats(table, "omega"));
    let own = (0..kinds.len()).filter(|k| kinds[*k] == "slip_onset");
    let own: Vec<usize> = own.collect();
    let found: Vec<f64> = own.iter().map(|k| omega[*k]).collect();
    assert_eq!(found.len(), 2, "{found:?}");
    // (1.5 - w^2)^2 + (0.06 w)^2 = (0.25 / 0.6)^2
    let (b, c) = (3.0 - 0.0036, 2.25 - (0.25_f64 / 0.6).powi(2));
    let root = (0.25 * b * b - c).sqrt();
    for (x, square) in found.iter().zip([0.5 * b - root, 0.5 * b + root]) {
        assert!((x - square.sqrt()).abs() < 1e-8, "{x} {}", square.sqrt());
    }
    let (names, located) = (texts(table, "connection"), floats(table, "located"));
    for k in own {
        assert_eq!((names[k].as_str(), located[k]), ("j", 1.0));
    }
}

#[test]
fn a_motion_starts_from_a_saved_point() {
    let folder = tempfile::tempdir().unwrap();
    let first =
        "  fr: {type: frequency_response, method: shooting, from: 2.1, to: 2.0, orbits: true}";
    let study = load(PAIR, first, folder.path()).unwrap();
    let settings = gearlash::study::RunSettings {
        out: folder.path().join("out"),
        figures: vec![],
        jobs: 1,
    };
    study.run(&settings, &Quiet).unwrap();
    let analysis = format!(
        "{{type: time_history, at: 2.1, periods: 1, initial: {{results: \"{}\", analysis: fr, point: 0}}}}",
        settings.out.display()
    );
    let report = run(PAIR, &analysis);
    let q = floats(main_table(&report), "q.mesh_1");
    assert!(
        (q[0] - q[q.len() - 1]).abs() < 1e-9,
        "{} {}",
        q[0],
        q[q.len() - 1]
    );
    assert!(q[0] != 1.25, "the static equilibrium");
    let lost = refusal(PAIR, &analysis.replace("point: 0", "point: 3000"));
    assert!(
        lost.contains("initial.results") && lost.contains("no point 3000"),
        "{lost}"
    );
    let part = refusal(PAIR, "{type: time_history, at: 2, initial: {point: 3}}");
    assert!(part.contains("a saved point is a folder"), "{part}");
}

/// Largest accelerations of bodies beside a slider: responses by three methods against the samples of the motion.
#[test]
fn peak_accelerations_count_what_sliders_remember() {
    let model = "
schema: 1
bodies: {A: {inertia: 0.02 kg m^2}, B: {inertia: 0.01 kg m^2}}
connections:
  spring: {shaft: [A, B], stiffness: 800 N m/rad, damping: 0.4 N m s/rad, length: 1 deg}
  friction: {shaft: [A, B], stiffness: 500 N m/rad, element: {type: jenkins, slip_force: 2 N m}}
  teeth: {shaft: [A, B], stiffness: 200 N m/rad, element: {type: backlash, half_gap: 5 deg}}
loads: {A: {mean: 3 N m, harmonics: [{order: 1, amplitude: 12 N m}]}, B: {mean: -3 N m}}
";
    let peak = |analysis: &str, table: &str, column: &str| -> f64 {
        let report = run(model, analysis);
        let table = match table {
            "" => main_table(&report),
            name => report.table(name).unwrap(),
        };
        let list = floats(table, column);
        list.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
    };
    let history =
        "{type: time_history, at: 20 Hz, transient: 200, periods: 1, samples_per_period: 4000}";
    let wanted = peak(history, "", "acceleration.B");
    assert!(wanted > 100.0, "{wanted}");
    for (method, allowed) in [
        (
            "method: shooting, from: 20 Hz, to: 19.99 Hz, marks: [20 Hz]",
            1e-4,
        ),
        (
            "method: integration, from: 20 Hz, to: 20 Hz, points: 1, transient: 200",
            1e-4,
        ),
        (
            "harmonics: 40, from: 20 Hz, to: 19.99 Hz, marks: [20 Hz]",
            1e-2,
        ),
    ] {
        let analysis = format!("{{type: frequency_response, {method}, tables: all}}");
        let found = peak(&analysis, "rattle", "peak_acceleration.B");
        assert!(
            (found / wanted - 1.0).abs() < allowed,
            "{method}: {found} {wanted}"
        );
    }
}
