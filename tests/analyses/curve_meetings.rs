//! Places at which curves meet others, and curves of orbits that repeat themselves within their period.

use crate::bifurcation_curves::{ONE, QA, events};
use crate::time_domain_support::*;

const GAP: &str = "reduced.elements.mesh_2.half_gap";

/// A doubling meets a grazing where branches at fixed loads have both. The place does not depend on the ranges, which steps are
/// measured in, nor on whether the curve goes on behind it.
#[test]
fn a_meeting_is_at_the_same_place_in_any_ranges() {
    for ranges in [
        "[[1.7, 1.8], [0.15, 0.156]]",
        "[[1.77, 1.78], [0.1535, 0.154]]",
        "[[1.5, 2.2], [0.1, 0.3]]",
    ] {
        let analysis = format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {QA}], ranges: {ranges}, \
             start: {{kind: period_doubling, at: {{frequency: 1.7746641994, {QA}: 0.1538}}}}}}"
        );
        let report = run(PAIR, &analysis);
        let list = events(&report, "meets_grazing");
        assert_eq!(list.len(), 1, "{ranges}: {list:?}");
        let (w, qa) = list[0];
        assert!((w - 1.77403595665).abs() < 1e-9, "{ranges}: {w}");
        assert!((qa - 0.15357367274).abs() < 1e-9, "{ranges}: {qa}");
    }
}

/// Beside a fold-flip the coefficient of a doubling has a pole, and next to it a root.
#[test]
fn a_change_of_criticality_beside_a_fold_flip_is_found_from_both_sides() {
    let from = |w: f64, gap: f64| {
        let analysis = format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {GAP}], ranges: [[0.8, 2.4], [0.05, 0.486]], \
             start: {{kind: period_doubling, at: {{frequency: {w}, {GAP}: {gap}}}}}}}"
        );
        let mut list = events(&run(PAIR, &analysis), "generalised_flip");
        list.sort_by(|a, b| a.0.total_cmp(&b.0));
        list
    };
    let starts = [(1.355083378441, 0.139), (1.356296352779, 0.139)];
    let [one, other] = starts.map(|(w, gap)| from(w, gap));
    assert!(one.len() == 2 && other.len() == 2, "{one:?} {other:?}");
    for (a, b) in one.iter().zip(&other) {
        assert!(
            (a.0 - b.0).abs() < 1e-7 && (a.1 - b.1).abs() < 1e-7,
            "{a:?} {b:?}"
        );
    }
}

/// Where the extremum that touches meets the next one, the curve turns sharply and goes on with that. The two are one touching there, and no
/// other: of two meetings 5e-9 apart none is true. An independent integration has the multiplier -1 at the meeting with the doubling.
#[test]
fn an_extremum_that_meets_the_next_one_is_no_other_touching() {
    let model = "
schema: 1
reduced:
  stiffness: [[1.0]]
  damping: {modal_ratio: 0.02}
  elements: {m: {type: backlash, half_gap: 0.11048922441292702}}
  loads: {mean: [0.4679958098984377], harmonics: [{order: 1, cos: [0.37390415367410956], sin: [0]}]}
";
    for ranges in [
        "[[0.5, 0.504], [0.5, 0.53]]",
        "[[0.45, 0.55], [0.45, 0.55]]",
    ] {
        for steps in ["step: 0.01", "step: 0.002, max_step: 0.005"] {
            let analysis = format!(
                "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {QA}], ranges: {ranges}, margin: 0, {steps}, \
                 start: {{kind: grazing, at: {{frequency: 0.5020062724, {QA}: 0.50604446}}}}}}"
            );
            let list = events(&run(model, &analysis), "meets_grazing");
            assert_eq!(list.len(), 1, "{ranges}, {steps}: {list:?}");
            let (w, qa) = list[0];
            assert!((w - 0.50228275397).abs() < 1e-9, "{ranges}, {steps}: {w}");
            assert!((qa - 0.50434758890).abs() < 1e-9, "{ranges}, {steps}: {qa}");
        }
    }
}

/// Loads of order 2 alone: every orbit touches twice in its period, at two phases alike. In contact the response is linear, and its
/// amplitude is the mean compression.
#[test]
fn an_orbit_that_repeats_itself_touches_once() {
    let two = ONE.replace("order: 1", "order: 2");
    let closed = |w: f64| 0.5 * ((1.0 - 4.0 * w * w).powi(2) + (0.2 * w).powi(2)).sqrt();
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.21, 0.9], [0.03, 1.1]], \
         start: {{kind: grazing, at: {{frequency: 0.38, {QA}: 0.21}}}}}}"
    );
    let report = run(&two, &analysis);
    let table = main_table(&report);
    let (first, second) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
    assert!(first.len() > 20 && report.ended_early.is_none());
    for (w, qa) in first.iter().zip(&second) {
        assert!((qa - closed(*w)).abs() < 1e-10, "{w} {qa} {}", closed(*w));
    }
    let kinds = texts(report.table("events").unwrap(), "kind");
    assert_eq!(kinds, ["turning_2"]);
    assert!(!floats(table, "confirmed").contains(&0.0));
}
