//! Changes of stability along branches: none passed over, none without its event, wherever the branch begins and however long its
//! steps are.

use crate::time_domain_support::{PAIR, floats, run, texts};
use gearlash::report::Report;

/// Located events of a kind, ascending.
fn located(report: &Report, kind: &str) -> Vec<f64> {
    let events = report.table("events").unwrap();
    let rows = texts(events, "kind")
        .into_iter()
        .zip(floats(events, "omega"));
    let rows = rows.zip(floats(events, "located"));
    let mut list: Vec<f64> = rows
        .filter(|((word, _), located)| word == kind && *located == 1.0)
        .map(|((_, omega), _)| omega)
        .collect();
    list.sort_by(f64::total_cmp);
    list
}

fn multiplicities(report: &Report, kind: &str) -> Vec<f64> {
    let events = report.table("events").unwrap();
    let rows = texts(events, "kind")
        .into_iter()
        .zip(floats(events, "multiplicity"));
    rows.filter(|(word, _)| word == kind)
        .map(|(_, m)| m)
        .collect()
}

fn agree(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?}, not {expected:?}");
    for (x, y) in found.iter().zip(expected) {
        assert!((x - y).abs() < tolerance, "{x}, not {y}");
    }
}

/// Every change of the number of unstable multipliers between two points has an event in the same step, or, for folds and branch
/// points of truncated series, in a neighbouring one; nothing is unresolved.
fn are_explained(report: &Report) {
    let points = report.table("").unwrap();
    let multipliers = report.table("multipliers").unwrap();
    let count = (1..).map_while(|k| {
        multipliers.column(&format!("re.{k}"))?;
        let (re, im) = (
            floats(multipliers, &format!("re.{k}")),
            floats(multipliers, &format!("im.{k}")),
        );
        let outside = re.iter().zip(&im).map(|(x, y)| x.hypot(*y) > 1.0 + 1e-9);
        Some(outside.map(usize::from).collect::<Vec<usize>>())
    });
    let lists: Vec<_> = count.collect();
    let counts: Vec<usize> = (0..points.rows())
        .map(|r| lists.iter().map(|l| l[r]).sum())
        .collect();
    let events = report.table("events").unwrap();
    let (kinds, after) = (texts(events, "kind"), floats(events, "after_point"));
    let of = floats(events, "branch");
    assert!(!kinds.contains(&"unresolved".to_string()), "{kinds:?}");
    let (branch, point) = (floats(points, "branch"), floats(points, "point"));
    let stable = floats(points, "stable");
    for r in 1..counts.len() {
        assert!(stable[r].is_nan() || (stable[r] == 1.0) == (counts[r] == 0));
        if branch[r] != branch[r - 1] || counts[r] == counts[r - 1] {
            continue;
        }
        let explains = |k: usize| {
            let gap = (after[k] - point[r - 1]).abs();
            of[k] == branch[r]
                && match kinds[k].as_str() {
                    "grazing" => false,
                    "fold" | "branch_point" => gap <= 1.0,
                    _ => gap == 0.0,
                }
        };
        let has_event = (0..kinds.len()).any(explains);
        let omega = floats(points, "omega")[r];
        assert!(
            has_event,
            "{} to {} before {omega}",
            counts[r - 1],
            counts[r]
        );
    }
}

/// q'' + 0.1 q' + f(q), half gap 1, a number of copies side by side.
fn oscillators(count: usize, mean: f64, cos: f64) -> String {
    let rows = |x: f64| {
        let row = |i: usize| {
            let entries: Vec<_> = (0..count)
                .map(|j| if i == j { x } else { 0.0 }.to_string())
                .collect();
            format!("[{}]", entries.join(", "))
        };
        let rows: Vec<_> = (0..count).map(row).collect();
        format!("[{}]", rows.join(", "))
    };
    let each = |x: f64| format!("{:?}", vec![x; count]);
    let elements: Vec<_> = (0..count)
        .map(|k| format!("g{k}: {{type: backlash, half_gap: 1.0}}"))
        .collect();
    format!(
        "
schema: 1
reduced:
  stiffness: {}
  damping: {{matrix: {}}}
  elements: {{{}}}
  loads: {{mean: {}, harmonics: [{{order: 1, cos: {}, sin: {}}}]}}
",
        rows(1.0),
        rows(0.1),
        elements.join(", "),
        each(mean),
        each(cos),
        each(0.0)
    )
}

/// The half-period map of one oscillator has a multiplier -1 at 0.46691817563.
#[test]
fn equal_parts_lose_their_symmetry_together() {
    for count in 1..=3 {
        let model = oscillators(count, 0.0, 1.2);
        let report = run(
            &model,
            "{type: frequency_response, from: 1.05, to: 0.44, method: shooting}",
        );
        agree(&located(&report, "branch_point"), &[0.46691817563], 1e-9);
        assert_eq!(multiplicities(&report, "branch_point"), [count as f64]);
        are_explained(&report);
    }
}

/// P(u) = u with det(P' - 1) = 0 of one oscillator.
#[test]
fn equal_parts_turn_together() {
    for count in 1..=3 {
        let model = oscillators(count, 0.1, 0.2);
        let report = run(
            &model,
            "{type: frequency_response, from: 1.5, to: 0.52, method: shooting}",
        );
        let folds = [0.5437441630824, 0.7387601708075];
        agree(&located(&report, "fold"), &folds, 1e-8);
        assert_eq!(multiplicities(&report, "fold"), [count as f64; 2]);
        assert!(located(&report, "branch_point").is_empty());
        are_explained(&report);
    }
}

/// What leaves a branch point of two equal parts: one of them alone, the other alone, both in the same sense, both in opposite
/// senses, each towards either side.
#[test]
fn every_way_out_of_equal_parts_is_followed() {
    let report = run(
        &oscillators(2, 0.0, 1.2),
        "{type: frequency_response, from: 0.6, to: 0.45, method: shooting, branches: {depth: 1}}",
    );
    let branches = report.table("branches").unwrap();
    let kinds = texts(branches, "kind");
    assert_eq!(
        kinds.iter().filter(|k| *k == "branch_point").count(),
        8,
        "{kinds:?}"
    );
    // Means of the two deformations behind the first step: zero where a part stays symmetric.
    let points = report.table("").unwrap();
    let (branch, point) = (floats(points, "branch"), floats(points, "point"));
    let means = [floats(points, "mean.g0"), floats(points, "mean.g1")];
    let mut seen = Vec::new();
    for row in (0..branch.len()).filter(|r| branch[*r] > 0.0 && point[*r] == 1.0) {
        let sign = |x: f64| if x.abs() < 1e-7 { 0 } else { x.signum() as i32 };
        seen.push([sign(means[0][row]), sign(means[1][row])]);
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 8, "{seen:?}");
}

/// The two meshes of a linear train, in permanent contact, with opposed stiffness variations.
const OPPOSED: &str = "
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.01}
  elements:
    m1: {type: backlash, half_gap: 0.1, stiffness_variation: {harmonics: [{order: ORDER, amplitude: 0.06, phase: 0}]}}
    m2: {type: backlash, half_gap: 0.1, stiffness_variation: {harmonics: [{order: ORDER, amplitude: 0.06, phase: 3.141592653589793}]}}
  loads: {mean: [3, 3], harmonics: [{order: ORDER, cos: [0.02, 0], sin: [0, 0]}]}
";

/// Borders by the monodromy matrix (DOP853, rtol 1e-13). With the excitation written as an order of a slower one, the same
/// happens at the same mesh frequency.
#[test]
fn combination_resonance_wherever_the_range_begins() {
    let borders = [2.701231464073, 2.762312298464];
    for (order, from, to) in [
        (1, 4.0, 2.0),
        (1, 4.02, 2.0),
        (1, 4.05, 2.0),
        (1, 2.1, 4.02),
        (2, 4.02, 2.0),
        (3, 4.02, 2.4),
    ] {
        let model = OPPOSED.replace("ORDER", &order.to_string());
        let (from, to) = (from / f64::from(order), to / f64::from(order));
        let report = run(
            &model,
            &format!("{{type: frequency_response, from: {from}, to: {to}}}"),
        );
        let at: Vec<f64> = borders.iter().map(|x| x / f64::from(order)).collect();
        agree(&located(&report, "neimark_sacker"), &at, 2e-6);
        are_explained(&report);
    }
}

/// A gear pair in permanent contact is Mathieu's equation; borders by the monodromy matrix (DOP853, rtol 1e-13).
#[test]
fn narrow_tongue_whatever_the_steps() {
    let model = "
schema: 1
bodies: {A: {inertia: 1.0e-3 kg m^2}, B: {inertia: 1.0e-3 kg m^2}}
connections:
  mesh:
    gear: {A: 50 mm, B: 50 mm}
    stiffness: 2e8 N/m
    element: {type: backlash, half_gap: 50 um}
    stiffness_variation: {harmonics: [{order: 1, amplitude: 0.06}]}
    transmission_error: {harmonics: [{order: 1, amplitude: 1 um}]}
damping: {modal_ratio: 0.01}
loads: {A: {mean: 500}, B: {mean: 500}}
report: {units: nondimensional}
";
    for (range, steps) in [
        ("from: 2.5, to: 1.5", ""),
        ("from: 1.5, to: 2.5", ""),
        ("from: 2.5, to: 1.5", ", max_step: 0.5, step: 0.3"),
        ("from: 2.43, to: 1.5", ""),
    ] {
        let report = run(
            model,
            &format!("{{type: frequency_response, {range}{steps}}}"),
        );
        let borders = [1.977428271849, 2.022146981070];
        agree(&located(&report, "period_doubling"), &borders, 2e-6);
        are_explained(&report);
    }
}

/// The reverse-idler pair, gaps 1 and 0.5; period doublings of the exact flow at 0.562873700 and 0.558685053, orbit at 0.561
/// stable. A truncated series of 20 harmonics places them within 6e-4, one of 12 has neither: the flow has the last word.
#[test]
fn a_mark_does_not_contradict_the_events() {
    let model = "
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {mesh_1: {type: backlash, half_gap: 1.0}, mesh_2: {type: backlash, half_gap: 0.5}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 1, cos: [0.25, 0], sin: [0, 0]}]}
";
    for (harmonics, marks) in [
        (20, "[]"),
        (20, "[0.561]"),
        (20, "[0.5628, 0.5595]"),
        (12, "[]"),
    ] {
        let report = run(
            model,
            &format!(
                "{{type: frequency_response, from: 0.7, to: 0.5, harmonics: {harmonics}, marks: {marks}}}"
            ),
        );
        let inside = |x: &f64| *x > 0.5575 && *x < 0.57;
        let found: Vec<f64> = located(&report, "period_doubling")
            .into_iter()
            .filter(inside)
            .collect();
        agree(&found, &[0.558685053, 0.5628737], 1e-8);
        are_explained(&report);
    }
}

/// A load of order 2 at half the frequency is one of order 1: multipliers are squares, period doublings become branch points
/// (1.4155210436, 1.4158618271 and 1.4227635682 by an independent exact flow).
#[test]
fn order_two_at_half_the_frequency() {
    let model = "
schema: 1
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {modal_ratio: 0.05}
  elements: {mesh_1: {type: backlash, half_gap: 1.0}, mesh_2: {type: backlash, half_gap: 0.1}}
  loads: {mean: [0.5, 0.5], harmonics: [{order: 2, cos: [0.25, 0], sin: [0, 0]}]}
";
    let report = run(
        model,
        "{type: frequency_response, from: 1.25, to: 0.45, method: shooting}",
    );
    let inside = |x: &f64| *x > 0.7055 && *x < 0.7125;
    let found: Vec<f64> = located(&report, "branch_point")
        .into_iter()
        .filter(inside)
        .collect();
    let expected = [0.7077605218063, 0.7079309135534, 0.7113817840818];
    agree(&found, &expected, 1e-8);
    are_explained(&report);
}

/// Two multipliers pass +1 at 0.975807187 (own assembly from five bodies, DOP853 restarted at switches).
#[test]
fn planets_lose_their_symmetry() {
    let mesh = |gear: &str, k: &str, error: &str| {
        format!(
            "{{{gear}, stiffness: {k}, element: {{type: backlash, half_gap: 60 um}}, transmission_error: {{harmonics: [{{order: 1, amplitude: {error}}}]}}}}"
        )
    };
    let mut connections = String::new();
    for k in 1..=3 {
        let sun = mesh(
            &format!("gear: {{sun: 35.24 mm, planet_{k}: 28.192 mm}}"),
            "6.9e8 N/m",
            "3 um",
        );
        let ring = mesh(
            &format!("internal_gear: {{planet_{k}: 28.192 mm, ring: 91.624 mm}}"),
            "7.6e8 N/m",
            "2 um",
        );
        connections += &format!("  s_{k}: {sun}\n  r_{k}: {ring}\n");
    }
    let model = format!(
        "
schema: 1
bodies:
  sun: {{inertia: 8.5e-4 kg m^2}}
  planet_1: {{inertia: 3.5e-4 kg m^2}}
  planet_2: {{inertia: 3.5e-4 kg m^2}}
  planet_3: {{inertia: 3.5e-4 kg m^2}}
  ring: {{inertia: 2.5e-2 kg m^2}}
connections:
{connections}
damping: {{modal_ratio: 0.03}}
loads:
  sun: {{mean: 150 N m}}
  ring: {{mean: 390 N m}}
scaling: {{length: 10 um}}
report: {{units: nondimensional}}
"
    );
    let report = run(
        &model,
        "{type: frequency_response, from: 1.4, to: 0.94, method: shooting, max_step: 0.05, marks: [1.0, 0.95]}",
    );
    let inside = |x: &f64| *x > 0.95 && *x < 1.05;
    let found: Vec<f64> = located(&report, "branch_point")
        .into_iter()
        .filter(inside)
        .collect();
    agree(&found, &[0.975807187], 1e-8);
    are_explained(&report);
}

#[test]
fn a_resolution_that_is_none_is_refused() {
    let refused = crate::time_domain_support::refusal(
        &oscillators(1, 0.0, 1.0),
        "{type: frequency_response, from: 2, to: 1, stability_resolution: 0}",
    );
    assert!(refused.contains("stability_resolution"), "{refused}");
}

/// A load of order 2 at half the frequency is the load of order 1: harmonics that nobody gave reach as far.
#[test]
fn the_order_of_a_load_does_not_change_what_resolves_it() {
    let respond = |order: usize| {
        let model = PAIR.replace("order: 1", &format!("order: {order}"));
        let ends = [2.0, 1.6].map(|x| x / order as f64);
        let keys = format!(
            "from: {}, to: {}, marks: [{}]",
            ends[0],
            ends[1],
            1.8 / order as f64
        );
        let report = run(
            &model,
            &format!("{{type: frequency_response, confirm: none, {keys}}}"),
        );
        let points = report.table("").unwrap();
        let row = floats(points, "mark")
            .iter()
            .position(|m| *m == 1.0)
            .unwrap();
        ["rms.mesh_1", "rms.mesh_2", "max.mesh_2"].map(|name| floats(points, name)[row])
    };
    for (first, second) in respond(1).iter().zip(respond(2)) {
        assert!((first - second).abs() < 1e-9 * first, "{first} {second}");
    }
}

/// Multipliers at a mark are those of the orbit at its frequency, where the branch is steep too; 1.4254 lies 1.1e-4 before a fold.
#[test]
fn multipliers_beside_a_fold_belong_to_their_own_frequency() {
    let respond = |method: &str| {
        let keys = format!("from: 2.0, to: 1.38, marks: [1.4254], method: {method}");
        let report = run(PAIR, &format!("{{type: frequency_response, {keys}}}"));
        let points = report.table("").unwrap();
        let moduli = floats(points, "multiplier_modulus");
        let rows = floats(points, "mark").into_iter().zip(moduli);
        let marked = rows.filter(|(mark, _)| *mark == 1.0).map(|(_, mu)| mu);
        marked.collect::<Vec<f64>>()
    };
    let (series, flow) = (respond("galerkin, confirm: all"), respond("shooting"));
    assert_eq!((series.len(), flow.len()), (3, 3));
    // The middle arm has its fold too near by.
    for k in [0, 2] {
        let gap = (series[k] - flow[k]).abs();
        assert!(gap < 1e-6 * flow[k], "{series:?} {flow:?}");
    }
}
