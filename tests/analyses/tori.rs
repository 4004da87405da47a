//! Invariant curves against values of an independent program.

use crate::time_domain_support::*;

/// The system of figure 5.
pub const FIGURE_5: &str = "
schema: 1
reduced:
  stiffness: [[1.4180125, 0.4180125], [0.4180125, 1.4180125]]
  damping: {matrix: [[0.0671175, 0.0101175], [0.0101175, 0.0671175]]}
  elements: {mesh_1: {type: backlash, half_gap: 1.0}, mesh_2: {type: backlash, half_gap: 1.0}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.18, 0], sin: [0, 0]}]}
";
const QA: &str = "reduced.loads.harmonics.0.cos.0";

#[test]
fn the_torus_of_figure_5() {
    let analysis = format!(
        "{{type: torus, at: 1.2, parameter: {QA}, start: {{attractor: {{value: 0.1795}}}}, from: 0.1795, to: 0.1835, marks: [0.183], max_step: 0.3}}"
    );
    let report = run(FIGURE_5, &analysis);
    let table = main_table(&report);
    let (x, rotation) = (floats(table, "parameter"), floats(table, "rotation"));
    let (rms, exponent) = (floats(table, "rms.mesh_1"), floats(table, "exponent"));
    for (value, wanted, size, growth) in [
        (0.1795, 0.19223978473, 0.44400194824, -0.00219237),
        (0.183, 0.19268984905, 0.44683579114, -0.01022937),
    ] {
        let row = x.iter().position(|x| *x == value).unwrap();
        let folded = rotation[row].min(1.0 - rotation[row]);
        assert!((folded - wanted).abs() < 1e-9, "{folded} {wanted}");
        assert!((rms[row] - size).abs() < 1e-8, "{} {size}", rms[row]);
        // Per unit of time in the reference, per excitation period here.
        let period = std::f64::consts::TAU / 1.2;
        assert!(
            (exponent[row] / period - growth).abs() < 2e-6,
            "{}",
            exponent[row] / period
        );
        assert_eq!(floats(table, "nu")[row], 2.0);
        assert_eq!(floats(table, "switches_least")[row], 8.0);
        assert_eq!(floats(table, "stable")[row], 1.0);
    }
    assert_eq!(report.ended_early, None);
}

#[test]
fn a_torus_is_born_at_a_neimark_sacker_event() {
    let analyses = "  fr: {type: frequency_response, method: shooting, from: 1.1, to: 1.0}
  it: {type: torus, parameter: frequency, start: {analysis: fr, kind: neimark_sacker, near: 1.032}, from: 1.0322, to: 1.029, marks: [1.03], max_step: 0.3}";
    let reports = run_with(PAIR, analyses, 1, &Quiet);
    let report = reports.iter().find(|r| r.name == "it").unwrap();
    let table = main_table(report);
    let marks = floats(table, "mark");
    let row = marks.iter().position(|m| *m == 1.0).unwrap();
    let rotation = floats(table, "rotation")[row];
    assert!(
        (rotation.min(1.0 - rotation) - 0.27760224316).abs() < 1e-9,
        "{rotation}"
    );
    assert!((floats(table, "rms.mesh_2")[row] - 0.36597767257).abs() < 1e-8);
}

/// The torus of figure 5 ends where its rotation comes to 1/5. Orbits of ten excitation periods were continued through their fold by a program
/// of another kind (DOP853, pseudo-arclength): it lies at 0.22814.
#[test]
fn a_torus_that_locks_is_told_from_one_that_breaks() {
    let analysis = format!(
        "{{type: torus, at: 1.2, parameter: {QA}, start: {{attractor: {{value: 0.1795}}}}, from: 0.1795, to: 0.25, most_points: 81, max_step: 0.05}}"
    );
    let report = run(FIGURE_5, &analysis);
    let end = &report.summary["ends"][0];
    assert_eq!(end["reason"], "locking", "{end}");
    let message = end["message"].as_str().unwrap();
    assert!(message.contains("comes to 1/5"), "{message}");
    let place: f64 = message.rsplit("= ").next().unwrap().parse().unwrap();
    assert!((place - 0.228136).abs() < 2e-6, "{message}");
    assert!(report.ended_early.unwrap().contains("locks"));
}

#[test]
fn what_is_no_torus_is_named() {
    let report = run(
        PAIR,
        "{type: torus, start: {attractor: {value: 2.2}}, from: 2.2, to: 2.3}",
    );
    let reason = report.ended_early.unwrap();
    assert!(reason.contains("is no torus: period 1"), "{reason}");
    let both = refusal(PAIR, "{type: torus, start: {}, from: 2.2, to: 2.3}");
    assert!(both.contains("give an `analysis`"), "{both}");
    let outside = refusal(
        PAIR,
        "{type: torus, start: {attractor: {value: 2}}, from: 2.2, to: 2.3, points: 40}",
    );
    assert!(outside.contains("lies outside the range"), "{outside}");
    assert!(outside.contains("40 must be odd"), "{outside}");
}
