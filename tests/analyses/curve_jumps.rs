//! Curves that come near to others, or to parts of themselves, whatever the steps and the start.

use crate::bifurcation_curves::events;
use crate::curve_corners::marked;
use crate::time_domain_support::*;

/// One mesh, far driven.
const DRIVEN: &str = "
schema: 1
reduced:
  stiffness: [[1.0]]
  damping: {modal_ratio: 0.02}
  elements: {m: {type: backlash, half_gap: 0.18242630866456622}}
  loads: {mean: [0.2805287369918036], harmonics: [{order: 1, cos: [0.320790996720557], sin: [0]}]}
";
const MEAN: &str = "reduced.loads.mean.0";

/// Two meshes, one with a narrow gap.
const TWO: &str = "
schema: 1
reduced:
  stiffness: [[1.9579544029403024, 0.9579544029403024], [0.9579544029403024, 1.9785259837711475]]
  damping: {modal_ratio: 0.03}
  elements: {m: {type: backlash, half_gap: 1.0}, n: {type: backlash, half_gap: 0.3}}
  loads: {mean: [0.5861859545447669, 0.39437107862512505], harmonics: [{order: 1, cos: [0.3903399984760515, 0], sin: [0, 0]}]}
";
const GAP: &str = "reduced.elements.n.half_gap";

/// Two curves of doublings face each other across a gap of 1e-3 of the ranges, both with a sharp turn there, one of them at a grazing. The
/// frequencies at the marks are those at which an independent integration has a multiplier -1, to 5e-8.
#[test]
fn a_curve_does_not_jump_to_another_that_faces_it() {
    let doublings = |(w, mean): (f64, f64), steps: &str| {
        let analysis = format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {MEAN}], ranges: [[0.3, 2.3], [0.11221149479672143, 0.4768988528860661]], {steps}, \
             start: {{kind: period_doubling, at: {{frequency: {w}, {MEAN}: {mean}}}}}, marks: [0.336634, 0.420793]}}"
        );
        run(DRIVEN, &analysis)
    };
    let wanted = [
        (0.5187613082903, 0.336634),
        (0.5565795256365, 0.336634),
        (0.5672490007285, 0.420793),
        (0.6136179988477, 0.420793),
    ];
    for (start, steps) in [
        ((0.498884819, 0.280528737), "step: 0.01, max_step: 0.025"),
        ((0.498884819, 0.280528737), "step: 0.006, max_step: 0.015"),
        ((0.498884819, 0.280528737), "step: 0.002, max_step: 0.004"),
        ((0.613617999, 0.420793), "step: 0.01, max_step: 0.025"),
    ] {
        let report = doublings(start, steps);
        let marks = marked(&report);
        assert_eq!(marks.len(), 4, "{start:?} {steps}: {marks:?}");
        for (found, wanted) in marks.iter().zip(&wanted) {
            assert!((found.0 - wanted.0).abs() < 1e-9, "{found:?} {wanted:?}");
        }
        for (kind, number) in [("turning_1", 1), ("turning_2", 1), ("meets_grazing", 2)] {
            let list = events(&report, kind);
            assert_eq!(list.len(), number, "{start:?} {steps}: {kind} {list:?}");
        }
    }
}

/// At the 1:3 resonance a term of the normal form has a pole whose real part is finite: the criticality passes through it, whether a point
/// lies close by or not. The last point is the resonance at which the curve ends.
#[test]
fn the_criticality_passes_a_resonance() {
    let curve = |steps: &str| {
        let analysis = format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {GAP}], ranges: [[0.6, 0.66], [0.4, 0.48]], {steps}, \
             start: {{kind: neimark_sacker, at: {{frequency: 0.6485838, {GAP}: 0.4064884}}}}}}"
        );
        run(TWO, &analysis)
    };
    for steps in [
        "step: 0.01, max_step: 0.025",
        "step: 0.002, max_step: 0.006",
    ] {
        let report = curve(steps);
        assert_eq!(events(&report, "generalised_neimark_sacker"), [], "{steps}");
        assert_eq!(events(&report, "resonance_1_3").len(), 1, "{steps}");
        let table = main_table(&report);
        let criticality = floats(table, "criticality");
        let theta = floats(table, "theta");
        let near: Vec<f64> = (criticality.iter().zip(&theta))
            .filter(|(_, theta)| (**theta - 2.0944).abs() < 0.1)
            .map(|(d, _)| *d)
            .collect();
        assert!(near.len() > 3, "{near:?}");
        assert!(
            near.iter().all(|d| (-1800.0..-1500.0).contains(d)),
            "{near:?}"
        );
        let end = events(&report, "resonance_1_2")[0];
        let (a, b) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
        assert!(
            a.into_iter().zip(b).any(|point| point == end),
            "{end:?} is no point"
        );
    }
}

/// A grazing that does not depend on the first parameter: the start is corrected at that one.
#[test]
fn a_curve_straight_across_the_second_parameter_has_a_start() {
    let model = "
schema: 1
reduced:
  stiffness: [[1.0]]
  damping: {modal_ratio: 0.05}
  elements: {m: {type: backlash, half_gap: 0.5}}
  loads: {mean: [0.5], harmonics: [{order: 1, cos: [0.2], sin: [0]}]}
";
    // Contact is first lost where the linear response has the amplitude of the mean load: |1 - w^2 + 0.1 i w| = 0.4.
    let w = {
        let b = 2.0 - 0.01;
        ((b + f64::sqrt(b * b - 4.0 * (1.0 - 0.16))) / 2.0).sqrt()
    };
    let analysis = format!(
        "{{type: bifurcation_curve, confirm: none, parameters: [reduced.elements.m.half_gap, frequency], ranges: [[0.3, 0.8], [1.0, 1.4]], \
         start: {{kind: grazing, connection: m, at: {{reduced.elements.m.half_gap: 0.5, frequency: {w:.4}}}}}}}"
    );
    let report = run(model, &analysis);
    let table = main_table(&report);
    let (gaps, frequencies) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
    assert!(frequencies.iter().all(|f| (f - w).abs() < 1e-10));
    let near = |wanted: f64| gaps.iter().any(|g| (g - wanted).abs() < 1e-9);
    assert!(near(0.3) && near(0.8), "{gaps:?}");
}
