//! Branches that end with a reason, marks beside folds, breaks that are passed, and no event that sampling invents.

use crate::response_support::marked;
use crate::time_domain_support::{PAIR, floats, refusal, run, texts};
use gearlash::report::{Report, Table};
use std::time::Instant;

fn table<'r>(report: &'r Report, name: &str) -> &'r Table {
    report.table(name).expect("the table")
}

/// One coordinate of stiffness 1: damping, law, mean and alternating load.
fn one(damping: f64, law: &str, (mean, cos): (f64, f64)) -> String {
    format!(
        "
schema: 1
reduced:
  stiffness: [[1]]
  damping: {{matrix: [[{damping}]]}}
  elements: {{m: {{{law}}}}}
  loads: {{mean: [{mean}], harmonics: [{{order: 1, cos: [{cos}], sin: [0]}}]}}
"
    )
}

fn respond(model: &str, keys: &str) -> Report {
    run(model, &format!("{{type: frequency_response, {keys}}}"))
}

/// Parameters of the events of a kind.
fn events(report: &Report, kind: &str) -> Vec<f64> {
    let events = table(report, "events");
    let kinds = texts(events, "kind");
    let all = floats(events, "parameter").into_iter().zip(kinds);
    let chosen = all.filter(|(_, k)| k == kind).map(|(x, _)| x);
    chosen.collect()
}

fn end(report: &Report, branch: usize) -> (String, String) {
    let end = &report.summary["branches"][branch]["end"];
    let text = |key: &str| end[key].as_str().expect("a text").to_owned();
    (text("reason"), text("message"))
}

fn near(found: &[f64], wanted: &[f64], tolerance: f64) {
    assert_eq!(found.len(), wanted.len(), "{found:?} {wanted:?}");
    for (x, y) in found.iter().zip(wanted) {
        assert!((x / y - 1.0).abs() < tolerance, "{x} {y}");
    }
}

/// Stiffness 1.3 and 0.7, half a period each.
const RECTANGULAR: &str = "type: linear, stiffness_variation: {rectangular: {high: 1.3, low: 0.7, duty: 0.5, phase: 0 deg}}";

#[test]
fn a_linear_mesh_doubles_at_one_frequency_only() {
    // Meissner's equation in closed form.
    let doublings = [2.185_110_905_984_9, 1.806_758_838_410_2];
    for (damping, wanted) in [(0.02, &doublings[..])] {
        let model = one(damping, RECTANGULAR, (0.5, 0.1));
        for method in ["shooting", "galerkin, harmonics: 60"] {
            let keys = format!("method: {method}, from: 3, to: 1.2, branches: all");
            let report = respond(&model, &keys);
            assert_eq!(report.ended_early, None, "{method}");
            let tolerance = if method == "shooting" { 1e-8 } else { 1e-5 };
            near(&events(&report, "period_doubling"), wanted, tolerance);
            assert_eq!(events(&report, "fold"), [0.0; 0], "{method}");
            assert_eq!(events(&report, "branch_point"), [0.0; 0], "{method}");
            let branches = table(&report, "branches");
            let ends = texts(branches, "end");
            assert_eq!(ends, ["range_reached", "vertical", "vertical"], "{method}");
            let points = floats(branches, "points");
            assert!(points[1..].iter().all(|n| *n < 20.0), "{points:?}");
        }
    }
}

#[test]
fn a_pole_of_a_linear_mesh_is_passed() {
    let model = one(0.02, RECTANGULAR, (0.5, 0.1));
    for (method, bound) in [("shooting", ""), ("galerkin", ", bound: 50")] {
        let report = respond(
            &model,
            &format!("method: {method}, from: 3, to: 0.4{bound}"),
        );
        let (reason, message) = end(&report, 0);
        assert_eq!(reason, "unbounded", "{method}");
        assert!(message.contains("without bound"), "{message}");
        // The response exists again behind the pole.
        assert_eq!(report.ended_early, None, "{method}");
        let omega = floats(table(&report, ""), "omega");
        assert_eq!(omega.last(), Some(&0.4));
        let points = floats(table(&report, ""), "max.m");
        assert!(points.len() < 700, "{}", points.len());
        let largest = points.iter().fold(0.0_f64, |m, x| m.max(*x));
        let bound = if bound.is_empty() { 1000.0 } else { 50.0 };
        assert!(largest > 0.5 * bound && largest < 5.0 * bound, "{largest}");
    }
    let message = refusal(
        &model,
        "{type: frequency_response, from: 3, to: 0.4, bound: 0.5}",
    );
    assert!(message.contains("bound"), "{message}");
}

#[test]
fn a_backlash_bends_what_is_vertical_below_it() {
    // In contact the mesh is linear: the doubled motion is vertical up to the loss of contact, and leads on from there.
    let law = RECTANGULAR.replace("linear", "backlash, half_gap: 1");
    let model = one(0.02, &law, (0.5, 0.1));
    let report = respond(
        &model,
        "method: shooting, from: 3, to: 1.9, branches: {depth: 1}",
    );
    let branches = table(&report, "branches");
    assert_eq!(texts(branches, "kind")[1], "period_doubling");
    assert_ne!(texts(branches, "end")[1], "vertical");
    let points = table(&report, "");
    let rows = floats(points, "branch")
        .into_iter()
        .zip(floats(points, "parameter"));
    let doubled: Vec<f64> = rows.filter(|(b, _)| *b == 1.0).map(|(_, x)| x).collect();
    let (least, most) = doubled
        .iter()
        .fold((f64::MAX, 0.0_f64), |(a, b), x| (a.min(*x), b.max(*x)));
    assert!(most - least > 0.05, "{least} {most}");
}

#[test]
fn marks_beside_a_fold_are_solved_at_every_passage() {
    let model = one(0.04, "type: backlash, half_gap: 1.0", (0.5, 0.25));
    // Independent exact flow: the fold at 0.7496752384 and the orbits 3e-4 above it.
    let fold = 0.749_675_238_4;
    let keys = "method: shooting, from: 2.5, to: 0.35";
    let report = respond(&model, &format!("{keys}, marks: [0.75]"));
    let points = table(&report, "");
    let rms = floats(points, "rms.m");
    let mut found: Vec<f64> = marked(points).into_iter().map(|row| rms[row]).collect();
    found.sort_by(f64::total_cmp);
    let wanted = [1.391_370_741_188, 1.423_641_137_948_5, 2.366_906_596_082_1];
    near(&found, &wanted, 1e-8);
    let located = events(&report, "fold");
    assert!(
        located.iter().any(|x| (x - fold).abs() < 1e-9),
        "{located:?}"
    );
    for (above, passages) in [(1e-2, 3), (1e-5, 3), (1e-7, 3), (-1e-7, 1)] {
        let mark = fold + above;
        for method in ["shooting", "shooting, max_step: 0.3"] {
            let keys = format!("method: {method}, from: 2.5, to: 0.35, marks: [{mark}]");
            let report = respond(&model, &keys);
            assert_eq!(
                marked(table(&report, "")).len(),
                passages,
                "{above:e} {method}"
            );
        }
    }
}

#[test]
fn a_cascade_is_the_same_over_any_range() {
    // Independent exact flow, two programs: the doublings of figure 7.
    let wanted = [0.282_097_128_682, 0.282_295_239_301, 0.282_328_335_523];
    let model = PAIR.replace("half_gap: 0.1", "half_gap: 1.0");
    for (from, to) in [(0.274, 0.2824), (0.27, 0.29)] {
        let report = run(
            &model,
            &format!(
                "{{type: parameter_response, method: shooting, at: 0.2, parameter: cos.0, from: {from}, to: {to}, \
                 branches: {{depth: 4, limit: 12}}, max_points: 150}}"
            ),
        );
        let found = events(&report, "period_doubling");
        for value in wanted {
            let is_found = found.iter().any(|x| (x - value).abs() < 1e-9);
            assert!(is_found, "{from}..{to}: {value} in {found:?}");
        }
    }
}

#[test]
fn breaks_at_jumps_of_the_force_are_passed() {
    let model = one(
        0.1,
        "type: preloaded, half_gap: 0.5, preload: 0.15",
        (0.3, 0.6),
    );
    for method in ["shooting", "galerkin, harmonics: 20"] {
        let marks = "marks: [1.6, 1.2, 0.9, 0.7]";
        let keys = format!("method: {method}, from: 2.5, to: 0.5, {marks}");
        let report = respond(&model, &keys);
        let points = table(&report, "");
        let omega = floats(points, "omega");
        let solved: Vec<f64> = marked(points).into_iter().map(|row| omega[row]).collect();
        for mark in [1.6, 0.9, 0.7] {
            assert!(solved.contains(&mark), "{method}: {mark} in {solved:?}");
        }
        assert_eq!(report.ended_early, None, "{method}");
        let branches = report.summary["branches"].as_array().expect("branches");
        if branches.len() == 1 {
            // The exact flow follows the branch across the grazings.
            assert_eq!(method, "shooting");
            continue;
        }
        let (reason, message) = end(&report, 0);
        assert_eq!(reason, "broken", "{method}: {message}");
        assert!(message.contains("continues at"), "{message}");
        let origin = branches[1]["origin"].as_str().expect("an origin");
        assert!(origin.starts_with("behind the break at"), "{origin}");
    }
}

#[test]
fn stops_of_any_stiffness_answer_at_once() {
    let model = |stiffness: f64| {
        format!(
            "
schema: 1
bodies: {{m1: {{inertia: 1 kg}}, m2: {{inertia: 1 kg}}}}
connections:
  c12: {{acts_on: {{m1: 1, m2: -1}}, stiffness: 1 N/m, damping: 0.03 N s/m}}
  ground2: {{ground: m2, stiffness: 1 N/m, damping: 0.03 N s/m}}
  stop: {{ground: m1, stiffness: {stiffness:e} N/m, element: {{type: one_sided, gap: 1 m}}}}
loads: {{m2: {{harmonics: [{{order: 1, amplitude: 0.1}}]}}}}
scaling: {{frequency: 1 rad/s, length: 1 m}}
report: {{units: nondimensional}}
"
        )
    };
    let mut folds = Vec::new();
    for stiffness in [1e4, 1e6, 1e9] {
        let began = Instant::now();
        let keys = "method: shooting, from: 0.8, to: 0.5, max_points: 100";
        let report = respond(&model(stiffness), keys);
        // Two seconds in an optimised build; here for a debug build on a busy machine.
        assert!(began.elapsed().as_secs() < 60, "{stiffness:e}");
        let count = floats(table(&report, ""), "omega").len();
        assert!(count > 20, "{stiffness:e}: {count}");
        folds.push(events(&report, "fold")[0]);
    }
    // The stop tends to a rigid one like K^(-1/2).
    let gaps = [folds[0] - folds[2], folds[1] - folds[2]];
    assert!(gaps[1].abs() < 0.2 * gaps[0].abs() + 1e-9, "{folds:?}");
}

#[test]
fn exact_integrals_unless_samples_are_given() {
    let model = one(0.1, "type: backlash, half_gap: 1.0", (0.0, 1.2));
    // Two arms leave the branch point at 0.46691817563 smoothly.
    let report = respond(&model, "from: 0.5, to: 0.45, harmonics: 40, branches: all");
    let folds = events(&report, "fold");
    let is_invented = |x: &&f64| (**x - 0.466_918_2).abs() < 5e-4;
    assert_eq!(folds.iter().filter(is_invented).count(), 0, "{folds:?}");
    assert_eq!(report.summary["quadrature"]["used"], "exact");
    let keys = "from: 1.5, to: 1.4, samples: 512";
    let sampled = respond(&model, keys);
    let summary = &sampled.summary["quadrature"];
    assert_eq!(summary["used"], "sampled");
    let because = summary["sampled_because"].as_str().expect("a reason");
    assert!(because.contains("`samples`"), "{because}");
    let by_hand = respond(&model, &format!("{keys}, quadrature: sampled"));
    let rms = |report: &Report| floats(table(report, ""), "rms.m");
    assert_eq!(rms(&sampled), rms(&by_hand));
    let law = "type: backlash, half_gap: 1.0, impact_damping: 0.1";
    let damped = respond(&one(0.1, law, (0.5, 0.2)), "from: 1.5, to: 1.4");
    let because = damped.summary["quadrature"]["sampled_because"].as_str();
    assert!(
        because.is_some_and(|b| b.contains("impact_damping")),
        "{because:?}"
    );
}

#[test]
fn integration_in_both_directions_and_at_one_value() {
    // Between the folds of this mesh two attractors exist: each direction sees its own.
    let model = one(0.04, "type: backlash, half_gap: 1.0", (0.5, 0.25));
    let keys = "method: integration, points: 25, transient: 400, periods: 20";
    let report = respond(
        &model,
        &format!("from: 1.0, to: 0.7, {keys}, direction: both"),
    );
    let points = table(&report, "");
    let (branch, omega) = (floats(points, "branch"), floats(points, "omega"));
    assert_eq!(branch.len(), 50);
    let up: Vec<f64> = omega[..25].to_vec();
    let down: Vec<f64> = omega[25..].to_vec();
    assert!(up.windows(2).all(|w| w[0] < w[1]) && down.windows(2).all(|w| w[0] > w[1]));
    assert_eq!(up.iter().rev().copied().collect::<Vec<f64>>(), down);
    let rms = floats(points, "rms.m");
    let differ = (0..25).filter(|k| (rms[*k] / rms[49 - k] - 1.0).abs() > 0.05);
    assert!(differ.count() > 0);
    let whole = respond(
        &model,
        &format!("from: 1.0, to: 0.7, {keys}, direction: up"),
    );
    assert_eq!(floats(table(&whole, ""), "rms.m"), rms[..25]);

    let single = "method: integration, points: 1, transient: 400, periods: 20";
    let report = respond(&model, &format!("at: 0.7, {single}"));
    let rms_at = floats(table(&report, ""), "rms.m");
    assert_eq!(rms_at, rms[..1]);
    let keys =
        format!("{{type: parameter_response, at: 0.7, parameter: cos.0, from: 0.25, {single}}}");
    assert_eq!(floats(table(&run(&model, &keys), ""), "rms.m"), rms_at);
    for (keys, wanted) in [
        ("at: 0.7", "points: 1"),
        (
            "at: 0.7, from: 1, to: 0.7, method: integration, points: 1",
            "excludes",
        ),
        ("from: 1", "`to`"),
        (
            "from: 1, to: 0.7, points: 1, methods: [galerkin, integration]",
            "points: 1",
        ),
        ("from: 1, to: 0.7, direction: both", "direction"),
    ] {
        let message = refusal(&model, &format!("{{type: frequency_response, {keys}}}"));
        assert!(message.contains(wanted), "{keys}: {message}");
    }
}

/// Beside a pole the response is steep, not vertical: the branch goes on behind it, past everything that follows. Borders of the tongues by
/// matrix exponentials on 960 intervals of the period and bisection.
#[test]
fn a_pole_is_no_vertical_branch() {
    let harmonics = "{order: 1, amplitude: 0.0233063109069, phase: 1.24930060393}, {order: 2, amplitude: 0.116727518834, \
                     phase: 5.92465066904}, {order: 3, amplitude: 0.153134228233, phase: 1.14180508645}";
    let law = format!("type: linear, stiffness_variation: {{harmonics: [{harmonics}]}}");
    let model = one(0.0109838227967, &law, (1.0, 0.3));
    let doublings = [
        2.005_305_470_46,
        1.996_464_799_42,
        0.690_060_980_88,
        0.640_665_989_94,
    ];
    let poles = [1.029_771_685_44, 0.971_925_588_17];
    for method in ["shooting", "galerkin"] {
        let report = respond(&model, &format!("method: {method}, from: 4.2, to: 0.6"));
        assert_eq!(report.ended_early, None, "{method}");
        assert_eq!(end(&report, 2).0, "range_reached", "{method}");
        near(&events(&report, "period_doubling"), &doublings, 1e-8);
        near(&events(&report, "branch_point"), &poles, 1e-8);
    }
}

/// Behind its grazing with a stop of stiffness k the orbit doubles within a distance of the order 1/k: from 1e6 on there is no number in
/// between. The grazing of the linear motion in closed form; the other doubling tends to that of a rigid stop like k^(-1/2).
#[test]
fn a_stiff_stop_doubles_at_its_grazing() {
    let model = |stiffness: f64| {
        format!(
            "
schema: 1
bodies: {{m1: {{inertia: 1 kg}}}}
connections:
  spring: {{ground: m1, stiffness: 1 N/m, damping: 0.1 N s/m}}
  stop: {{ground: m1, stiffness: {stiffness:e} N/m, element: {{type: one_sided, gap: 1 m}}}}
loads: {{m1: {{harmonics: [{{order: 1, amplitude: 0.5}}]}}}}
scaling: {{frequency: 1 rad/s, length: 1 m}}
report: {{units: nondimensional}}
"
        )
    };
    // (1 - w^2)^2 + 0.01 w^2 = 0.25
    let grazing = (0.995 - 0.240_025_f64.sqrt()).sqrt();
    let mut others = Vec::new();
    for stiffness in [1e4, 1e5, 1e6, 1e7] {
        let report = respond(&model(stiffness), "method: shooting, from: 0.4, to: 1.2");
        let found = events(&report, "period_doubling");
        near(&events(&report, "grazing"), &[grazing], 1e-9);
        near(&found[..1], &[grazing], 1e-9);
        assert_eq!(found.len(), 2, "{stiffness:e}: {found:?}");
        let list = table(&report, "events");
        assert_eq!(floats(list, "located"), [1.0; 3], "{stiffness:e}");
        others.push(found[1]);
    }
    // DOP853 restarted at every switch.
    near(&others[..1], &[0.981_386_964_7], 1e-9);
    let ratio = (others[2] - others[1]) / (others[1] - others[0]);
    assert!((ratio * 10_f64.sqrt() - 1.0).abs() < 0.02, "{ratio}");
}
