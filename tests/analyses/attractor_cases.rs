//! Labels of motions that look like another kind of attractor for a long time.

use crate::time_domain_support::*;

/// Two meshes, W = I; damping given as a ratio.
fn pair(kappa: [f64; 2], zeta: f64, gaps: [f64; 2], amplitude: f64) -> String {
    let [a, b] = kappa;
    format!(
        "
schema: 1
reduced:
  stiffness: [[{a}, {b}], [{b}, {a}]]
  damping: {{modal_ratio: {zeta}}}
  elements: {{m1: {{type: backlash, half_gap: {}}}, m2: {{type: backlash, half_gap: {}}}}}
  loads: {{mean: [0.5, 0.5], harmonics: [{{order: 1, cos: [{amplitude}, 0], sin: [0, 0]}}]}}
",
        gaps[0], gaps[1]
    )
}

const HEAVY: [f64; 2] = [1.418_012_5, 0.418_012_5];

fn labels(model: &str, analysis: &str) -> Vec<(f64, String)> {
    let report = run(model, analysis);
    let summary = report.table("summary").unwrap();
    let labels = texts(summary, "label").to_vec();
    let values = match summary.columns[0].name.as_str() {
        "parameter" => floats(summary, "parameter").to_vec(),
        _ => vec![0.0; labels.len()],
    };
    values.into_iter().zip(labels).collect()
}

/// Beyond the end of a cascade: period 112 at 0.282342 (points repeat after 112 periods and no fewer, to 1e-6); weak chaos at 0.282335
/// and 0.28235 (largest exponent 1e-4, second one -0.04, no period up to 1024). An invariant circle is impossible.
#[test]
fn long_periods_and_weak_chaos_are_not_quasi_periodic() {
    let model = pair([2.0, 1.0], 0.05, [1.0, 1.0], 0.25);
    let list = labels(
        &model,
        "{type: bifurcation_diagram, at: 0.2, parameter: reduced.loads.harmonics.0.cos.0, from: 0.282335, to: 0.28235, \
         points: 16, transient: 1000, periods: 400}",
    );
    assert!(
        list.iter().all(|(_, label)| label != "quasi-periodic"),
        "{list:?}"
    );
    assert!((list[7].0 - 0.282342).abs() < 1e-12);
    assert!(
        ["period 112", "undecided"].contains(&list[7].1.as_str()),
        "{list:?}"
    );
    for k in [0, 15] {
        assert!(
            ["chaotic", "undecided"].contains(&list[k].1.as_str()),
            "{list:?}"
        );
    }
}

/// Period 7 is the only attractor: 24 random starts end there within 20 000 periods.
#[test]
fn transients_in_a_window_end_at_its_period() {
    let model = pair(HEAVY, 0.0285, [1.0, 1.0], 0.23);
    for seed in [1, 2] {
        let list = labels(
            &model,
            &format!(
                "{{type: bifurcation_diagram, at: 1.2, parameter: reduced.loads.harmonics.0.cos.0, from: 0.235, to: 0.241, \
                 points: 4, seeds: {{count: 12, seed: {seed}, box: 2.0}}}}"
            ),
        );
        let count = list.iter().filter(|(_, label)| label == "period 7").count();
        let wrong = list
            .iter()
            .find(|(_, label)| !["period 7", "undecided"].contains(&label.as_str()));
        assert_eq!(wrong, None);
        assert!(count >= 46, "{count} of {}", list.len());
    }
}

/// Contact is never lost, so that the system is linear: period 1, and the free part exp(-zeta T) cos T falls slowly.
#[test]
fn slow_decay_is_no_period() {
    for damping in ["2.0e-6", "2.0e-7", "2.0e-8"] {
        let model = format!(
            "
schema: 1
reduced:
  stiffness: [[1]]
  damping: {{matrix: [[{damping}]]}}
  elements: {{m: {{type: backlash, half_gap: 1.0}}}}
  loads: {{mean: [3.0], harmonics: [{{order: 1, cos: [0.5], sin: [0]}}]}}
"
        );
        for at in [2.0, 3.0, 0.5, 1.7, 2.618] {
            for lyapunov in [true, false] {
                let list = labels(
                    &model,
                    &format!(
                        "{{type: poincare_map, at: {at}, initial: {{q: [4.2], v: [0.3]}}, lyapunov: {lyapunov}}}"
                    ),
                );
                assert_eq!(list[0].1, "period 1", "{damping} {at}");
            }
        }
    }
}

/// Invariant curves known from collocation: of one and of two loops, with strong and with weak attraction, smooth and with kinks.
#[test]
fn tori_are_quasi_periodic() {
    for amplitude in [0.183, 0.19, 0.196] {
        let model = pair(HEAVY, 0.0285, [1.0, 1.0], amplitude);
        let list = labels(
            &model,
            "{type: poincare_map, at: 1.2, transient: 500, periods: 300}",
        );
        assert_eq!(list[0].1, "quasi-periodic", "{amplitude}");
    }
    let model = pair([2.0, 1.0], 0.05, [1.0, 0.1], 0.25);
    for (at, point) in [
        (1.03, "{q: [0.5, 1], v: [0.3, 0.3]}"),
        (1.02, "{q: [0.5, 1], v: [0.3, 0.3]}"),
    ] {
        let analysis = format!(
            "{{type: poincare_map, at: {at}, transient: 500, periods: 300, initial: {point}}}"
        );
        assert_eq!(labels(&model, &analysis)[0].1, "quasi-periodic", "{at}");
    }
}

/// Spirals so slow that their records look like curves: towards period 62 for 4000 periods, towards period 32 for 1500; beside doublings
/// at multipliers of -0.9988, -0.9974 (period 1) and -1.0028 (period 2). By an independent integration over 40 000 periods.
#[test]
fn slow_spirals_are_not_quasi_periodic() {
    for (at, amplitude, period) in [
        (1.125, 0.42, 62),
        (1.575, 0.21, 32),
        (1.95, 0.33, 1),
        (1.95, 0.48, 1),
        (1.8, 0.165, 2),
    ] {
        let model = pair([2.0, 1.0], 0.05, [1.0, 0.1], amplitude);
        let analysis = format!("{{type: poincare_map, at: {at}, transient: 200, periods: 120}}");
        let label = labels(&model, &analysis)[0].1.clone();
        let own = format!("period {period}");
        assert!(label == own || label == "undecided", "{at}: {label}");
    }
}

/// A sweep in chaos enters a window, the motion is caught later: from 0.2255 on every motion ends at period 14 within 60 000 periods.
#[test]
fn a_sweep_takes_no_chaotic_transient_for_an_attractor() {
    let model = pair(HEAVY, 0.0285, [1.0, 1.0], 0.22);
    let diagram = "{type: bifurcation_diagram, at: 1.2, parameter: reduced.loads.harmonics.0.cos.0, from: 0.224, to: 0.229, points: 16,
        transient: 500, periods: 150}";
    let found = labels(&model, diagram);
    assert_eq!(found[0].1, "chaotic");
    for (value, label) in found.iter().filter(|(value, _)| *value > 0.2255) {
        assert!(
            label == "period 14" || label == "undecided",
            "{value}: {label}"
        );
    }
    assert_eq!(found[9].1, "period 14");
}

/// The limits are keys.
#[test]
fn the_longest_period_and_the_extension_are_chosen() {
    let model = pair(HEAVY, 0.0285, [1.0, 1.0], 0.24);
    let label = |keys: &str| {
        let analysis =
            format!("{{type: poincare_map, at: 1.2, transient: 600, periods: 200{keys}}}");
        labels(&model, &analysis)[0].1.clone()
    };
    assert_eq!(label(""), "period 7");
    assert_eq!(label(", longest_period: 6, extend: 1"), "undecided");
    for (key, message) in [
        ("extend: 0", "0 must be at least 1"),
        ("longest_period: 0", "from 1 to"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let analysis = format!("  a: {{type: poincare_map, at: 1.2, {key}}}");
        let error = load(&model, &analysis, folder.path()).err().unwrap();
        assert!(error.contains(message), "{error}");
    }
}
