//! Corners of curves at grazings, points of codimension 2, types of grazings, and how close points lie.

use crate::bifurcation_curves::{ONE, QA, events};
use crate::time_domain_support::*;
use gearlash::report::Report;

/// Two meshes in tension, one with a narrow gap.
const TENSE: &str = "
schema: 1
reduced:
  stiffness: [[1.572969, -0.572969], [-0.572969, 1.572969]]
  damping: {modal_ratio: 0.03}
  elements: {m0: {type: backlash, half_gap: 0.1}, m1: {type: backlash, half_gap: 1.0}}
  loads: {mean: [0.529641, 0.373625], harmonics: [{order: 1, cos: [0.495511, 0.0], sin: [0, 0]}]}
";
const MEAN: &str = "reduced.loads.mean.0";

fn near(list: &[(f64, f64)], at: (f64, f64), within: f64) {
    let is_there = |p: &(f64, f64)| (p.0 - at.0).hypot(p.1 - at.1) < within;
    assert!(list.iter().any(is_there), "{at:?} is not in {list:?}");
}

/// Values of the first parameter at marks of the second, with those, sorted.
pub fn marked(report: &Report) -> Vec<(f64, f64)> {
    let table = main_table(report);
    let (a, b) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
    let marks = floats(table, "mark");
    let own = (0..marks.len()).filter(|k| marks[*k] == 1.0);
    let mut list: Vec<(f64, f64)> = own.map(|k| (a[k], b[k])).collect();
    list.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.total_cmp(&b.0)));
    list
}

/// The fold comes to the grazing of m0 on one side and leaves along it on the other; the grazing curve has the place, too.
#[test]
fn a_curve_goes_round_a_corner_whatever_the_steps() {
    let fold = |at: (f64, f64), max_step: f64, ranges: &str| {
        let analysis = format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {MEAN}], ranges: {ranges}, step: 0.002, max_step: {max_step}, \
             start: {{kind: fold, at: {{frequency: {}, {MEAN}: {}}}}}, marks: [0.3303, 0.39, 0.4, 0.426, 0.5376]}}",
            at.0, at.1
        );
        run(TENSE, &analysis)
    };
    let wide = "[[0.25, 0.8], [0.27, 0.79]]";
    let grazing = run(
        TENSE,
        &format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {MEAN}], ranges: [[0.65, 0.68], [0.38, 0.42]], \
             start: {{kind: grazing, connection: m0, at: {{frequency: 0.6633897, {MEAN}: 0.3976}}}}}}"
        ),
    );
    let met = events(&grazing, "meets_grazing");
    let (above, below) = (
        (0.670125479548, 0.529641109338),
        (0.658574071798, 0.330352931121),
    );
    let runs = [
        fold(above, 0.025, wide),
        fold(above, 0.0125, wide),
        fold(above, 0.004, wide),
        fold(below, 0.025, wide),
        fold(above, 0.025, "[[0.6, 0.75], [0.3, 0.6]]"),
    ];
    let first = marked(&runs[0]);
    assert_eq!(first.len(), 5, "{first:?}");
    for report in &runs {
        let list = events(report, "meets_grazing");
        assert_eq!(list.len(), 1, "{list:?}");
        near(&met, list[0], 1e-9);
        let marks = marked(report);
        assert_eq!(marks.len(), first.len(), "{marks:?}");
        for (a, b) in marks.iter().zip(&first) {
            assert!((a.0 - b.0).abs() < 1e-9 && a.1 == b.1, "{a:?} {b:?}");
        }
        // The corner is a point of the curve.
        let table = main_table(report);
        let (w, mean) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
        let all: Vec<(f64, f64)> = w.into_iter().zip(mean).collect();
        near(&all, list[0], 1e-12);
    }
}

/// Values of an independent program: a fold-flip on doublings and on folds, a cusp, and ends at a grazing.
#[test]
fn points_of_codimension_two_are_those_of_another_program() {
    let pair = |kind: &str, at: (f64, f64), ranges: &str| {
        let analysis = format!(
            "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {QA}], ranges: {ranges}, \
             start: {{kind: {kind}, at: {{frequency: {}, {QA}: {}}}}}}}",
            at.0, at.1
        );
        run(PAIR, &analysis)
    };
    let flip_a = (1.426672725008, 0.207618510555);
    let flip_b = (1.661949080619, 0.118825590592);
    let folds = pair("fold", (1.42667, 0.20762), "[[1.4, 1.45], [0.18, 0.23]]");
    near(&events(&folds, "fold_flip"), flip_a, 1e-7);
    let doublings = pair(
        "period_doubling",
        (1.66195, 0.11883),
        "[[1.64, 1.68], [0.11, 0.13]]",
    );
    near(&events(&doublings, "fold_flip"), flip_b, 1e-7);
    let cusp = pair("fold", (1.66195, 0.11883), "[[1.65, 1.68], [0.115, 0.12]]");
    near(
        &events(&cusp, "cusp"),
        (1.666247072992, 0.117375601697),
        1e-7,
    );
    near(&events(&cusp, "fold_flip"), flip_b, 1e-7);
}

/// Beside a corner differences of the flow reach across the grazing: tangents turn where the curve does not, and some points lie on what only
/// looks like a curve. Between its corner and its turning point the curve falls in the first parameter all along.
#[test]
fn a_curve_turns_beside_a_corner_only_where_its_points_do() {
    let model = "
schema: 1
reduced:
  stiffness: [[2.006690777118679, 1.006690777118679], [1.006690777118679, 2.567185551442556]]
  damping: {modal_ratio: 0.05}
  elements: {m: {type: backlash, half_gap: 1.0}, n: {type: backlash, half_gap: 0.3}}
  loads: {mean: [0.26987531711491175, 0.48205701620644287], harmonics: [{order: 1, cos: [0.2984149171671492, 0], sin: [0, 0]}]}
";
    let analysis = format!(
        "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {QA}], ranges: [[0.5476, 4.1983], [0.11937, 0.5073]], max_points: 60, \
         start: {{kind: period_doubling, at: {{frequency: 0.7246909595267248, {QA}: 0.2209330980751692}}}}}}"
    );
    let report = run(model, &analysis);
    let corner = (0.7253745960, 0.2259713507);
    near(&events(&report, "meets_grazing"), corner, 1e-8);
    let is_between = |p: &(f64, f64)| p.0 > 0.7250 && (0.2245..corner.1).contains(&p.1);
    let turns = events(&report, "turning_1");
    let turns: Vec<(f64, f64)> = turns.into_iter().filter(is_between).collect();
    assert_eq!(turns.len(), 1, "{turns:?}");
    near(&turns, (0.7253938421, 0.2250000), 1e-6);
    let table = main_table(&report);
    let points = floats(table, "parameter_1").into_iter();
    let points = points.zip(floats(table, "parameter_2"));
    let mut falling: Vec<(f64, f64)> = points
        .filter(|p| is_between(p) && p.1 > turns[0].1)
        .collect();
    falling.sort_by(|a, b| a.1.total_cmp(&b.1));
    assert!(falling.len() > 2 && falling.windows(2).all(|w| w[1].0 < w[0].0));
}

/// At the 1:2 resonance both multipliers of the pair are -1: no third one is.
#[test]
fn a_resonance_is_not_taken_for_another_multiplier() {
    let model = "
schema: 1
reduced:
  stiffness: [[1.529901, 0.529901, 0.0], [0.529901, 2.059801, 0.529901], [0.0, 0.529901, 1.529901]]
  damping: {modal_ratio: 0.03}
  elements: {m0: {type: backlash, half_gap: 0.844014}, m1: {type: backlash, half_gap: 1.0}, m2: {type: backlash, half_gap: 0.3}}
  loads: {mean: [0.589385, 0.74054, 0.267924], harmonics: [{order: 1, cos: [0.261081, 0.0, 0.0], sin: [0, 0, 0]}]}
";
    let analysis = "{type: bifurcation_curve, confirm: none, parameters: [frequency, reduced.stiffness.0.0], \
         ranges: [[0.64, 0.66], [1.5, 1.7]], start: {kind: neimark_sacker, at: {frequency: 0.644521497306, reduced.stiffness.0.0: 1.623275731}}}";
    let report = run(model, analysis);
    near(
        &events(&report, "resonance_1_2"),
        (0.64118947, 1.59434658),
        1e-7,
    );
    assert_eq!(events(&report, "flip_neimark_sacker"), []);
}

/// A dashpot that pushes and does not pull: the force jumps by c v where contact is made and is 0 where it ends. Entering with the rate v
/// costs c v at once, whatever v: to the first order the rate falls by c times the distance beyond the level, and the derivative of the
/// map jumps.
///
/// ```text
/// untouched: M = exp(A T),    touched: M (I - c e_v e_q^T),    fold where det(I - M) changes its sign
/// ```
#[test]
fn a_contact_that_does_not_pull_is_a_border_collision() {
    let model = "
schema: 1
reduced:
  stiffness: [[1.0, 1.0]]
  damping: {matrix: [[0.1]]}
  elements:
    m: {type: linear}
    s: {type: expression, force: \"if(q > b, max(k*(q - b) + c*v, 0), 0)\", parameters: {k: 2, b: 1, c: 0.8}}
  element_map: [[1], [1]]
  loads: {mean: [0.2], harmonics: [{order: 1, cos: [0.6], sin: [0]}]}
";
    let closed = |w: f64| 0.8 * ((1.0 - w * w).powi(2) + (0.1 * w).powi(2)).sqrt();
    let damped = (1.0_f64 - 0.05 * 0.05).sqrt();
    // M = e^(-0.05 T) [cos + 0.05 s, s; -s, cos - 0.05 s], s = sin(w_d T) / w_d.
    let determinant = |w: f64, c: f64| {
        let period = std::f64::consts::TAU / w;
        let decay = (-0.05 * period).exp();
        let (sin, cos) = (damped * period).sin_cos();
        let s = sin / damped;
        let m = [[cos + 0.05 * s, s], [-s, cos - 0.05 * s]].map(|row| row.map(|x| decay * x));
        let (a, b) = (1.0 - m[0][0] + c * m[0][1], -m[0][1]);
        let (d, e) = (-m[1][0] + c * m[1][1], 1.0 - m[1][1]);
        a * e - b * d
    };
    let analysis = format!(
        "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {QA}], ranges: [[0.9, 1.4], [0.02, 3.6]], max_step: 0.1, step: 0.05, \
         start: {{kind: grazing, connection: s, at: {{frequency: 1.2, {QA}: {}}}}}}}",
        closed(1.2)
    );
    let report = run(model, &analysis);
    let table = main_table(&report);
    let (w, qa) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
    let (kinds, maps) = (texts(table, "type"), texts(table, "map"));
    let mut seen = [0; 2];
    for k in 0..w.len() {
        assert!((qa[k] - closed(w[k])).abs() < 1e-9, "{}", w[k]);
        assert_eq!(maps[k], "border_collision", "{}", w[k]);
        let touched = determinant(w[k], 0.8);
        if touched.abs() < 0.02 {
            continue;
        }
        let is_fold = touched < 0.0;
        let wanted = if is_fold { "fold" } else { "persistence" };
        assert_eq!(kinds[k], wanted, "{}", w[k]);
        seen[usize::from(is_fold)] += 1;
    }
    assert!(seen.iter().all(|n| *n > 2), "{seen:?}");
}

/// The curve between two points stays within a pixel of the straight line: here it is known in closed form.
#[test]
fn pictures_of_curves_are_smooth() {
    let analysis = format!(
        "{{type: bifurcation_curve, confirm: none, parameters: [frequency, {QA}], ranges: [[0.42, 1.8], [0.03, 1.1]], max_step: 0.2, step: 0.1, \
         start: {{kind: grazing, at: {{frequency: 0.7742, {QA}: 0.204}}}}}}"
    );
    let report = run(ONE, &analysis);
    let table = main_table(&report);
    let (w, qa) = (floats(table, "parameter_1"), floats(table, "parameter_2"));
    let closed = |w: f64| 0.5 * ((1.0 - w * w).powi(2) + (0.1 * w).powi(2)).sqrt();
    for k in 1..w.len() {
        for x in [0.25, 0.5, 0.75] {
            let at = w[k - 1] + x * (w[k] - w[k - 1]);
            let line = qa[k - 1] + x * (qa[k] - qa[k - 1]);
            let (slope, long) = ((qa[k] - qa[k - 1]) / 1.07, (w[k] - w[k - 1]) / 1.38);
            let beside = (closed(at) - line) / 1.07 * long.abs() / long.hypot(slope);
            assert!(beside.abs() < 5e-4, "{at}: {beside}");
        }
    }
}
