//! `verify`: points of a Galerkin branch taken through the exact flow.

use crate::program::Place;
use serde_json::Value;

/// Figure 11 with the keys of its response.
fn figure_11(keys: &str) -> String {
    format!(
        "\
schema: 1
name: figure 11
reduced:
  stiffness: [[2, 1], [1, 2]]
  damping: {{modal_ratio: 0.05}}
  elements: {{mesh_1: {{type: backlash, half_gap: 1}}, mesh_2: {{type: backlash, half_gap: 0.1}}}}
  loads: {{mean: [0.5, 0.5], harmonics: [{{order: 1, cos: [0.25, 0]}}]}}
analyses:
  r: {{type: frequency_response, from: 1.9, to: 1.5, marks: [1.8, 1.7, 1.6], {keys}}}
"
    )
}

/// R.m.s. deformations at a frequency, from an independent program.
fn reference(omega: f64) -> Vec<f64> {
    let path = format!("{}/tests/data/fig11_case1.json", env!("CARGO_MANIFEST_DIR"));
    let data: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let solutions = data["solutions"].as_array().unwrap().iter();
    let mut at = solutions.filter(|s| s["omega"].as_f64() == Some(omega));
    let rms = at.next().unwrap()["q_rms"].as_array().unwrap().iter();
    rms.map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn the_flow_gives_the_reference_and_the_digits_grow_with_the_harmonics() {
    let mut least = Vec::new();
    for harmonics in [5, 12, 40] {
        let keys = format!("harmonics: {harmonics}, quadrature: exact, verify: true");
        let place = Place::with(&figure_11(&keys));
        let ended = place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
        let column = |name: &str| place.column("o/r.verify.csv", name);
        let omega = column("omega");
        assert_eq!(omega, place.column("o/r.csv", "omega"));
        assert!(column("converged").iter().all(|c| *c == 1.0));
        for mark in [1.8, 1.7, 1.6] {
            let row = omega.iter().position(|w| *w == mark).unwrap();
            for (name, expected) in ["rms.mesh_1", "rms.mesh_2"].iter().zip(reference(mark)) {
                let (flow, series) = (column(name)[row], place.column("o/r.csv", name)[row]);
                assert!((flow / expected - 1.0).abs() < 1e-9, "{mark}: {flow}");
                // The digits are those of the worst connection.
                let own = -(series / flow - 1.0).abs().log10();
                assert!(column("digits")[row] <= own + 1e-6);
            }
        }
        let smallest = column("digits").into_iter().fold(f64::INFINITY, f64::min);
        let summary = &place.json("o/r.json")["verify"];
        assert_eq!(summary["points"], omega.len());
        assert_eq!(summary["digits_least"].as_f64(), Some(smallest));
        let said = format!("share at least {smallest:.1} digits");
        assert!(ended.out.contains(&said), "{said}: {}", ended.out);
        least.push(smallest);
    }
    // Coefficients fall like k^-4: 12 harmonics for 5 bring a digit and more, 40 two again.
    assert!(least[0] > 2.0 && least[1] > least[0] + 1.0 && least[2] > least[1] + 1.5);
}

/// Few harmonics place a fold beside the exact one: between the two the flow has no orbit, which is said and is no failure.
#[test]
fn points_beyond_a_fold_of_the_exact_branch_are_told_apart() {
    let model = figure_11("harmonics: 8, max_step: 0.01, verify: true");
    let place = Place::with(&model.replace(
        "from: 1.9, to: 1.5, marks: [1.8, 1.7, 1.6]",
        "from: 0.9, to: 0.6",
    ));
    let ended = place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let column = |name: &str| place.column("o/r.verify.csv", name);
    let (converged, fold) = (column("converged"), column("exact_fold"));
    let (omega, point) = (column("omega"), column("point"));
    let beyond: Vec<usize> = (0..fold.len()).filter(|k| fold[*k].is_finite()).collect();
    assert!(!beyond.is_empty() && beyond.iter().all(|k| converged[*k] == 0.0));
    assert_eq!(
        place.json("o/r.json")["verify"]["beyond_fold"],
        beyond.len()
    );
    assert!(
        ended.out.contains("beyond a fold of the exact branch"),
        "{}",
        ended.out
    );
    // The same folds, on the exact branch itself.
    let exact = Place::with(&model.replace(
        "from: 1.9, to: 1.5, marks: [1.8, 1.7, 1.6], harmonics: 8, max_step: 0.01, verify: true",
        "from: 0.9, to: 0.6, method: shooting",
    ));
    exact.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let events = exact.json("o/r.json")["events"].clone();
    let of_folds = events
        .as_array()
        .unwrap()
        .iter()
        .filter(|e| e["kind"] == "fold");
    let folds: Vec<f64> = of_folds.map(|e| e["omega"].as_f64().unwrap()).collect();
    for k in beyond {
        let gaps = folds.iter().map(|f| (f - fold[k]).abs());
        let gap = gaps.fold(f64::INFINITY, f64::min);
        assert!(gap < 1e-8, "point {} at {}: {gap:e}", point[k], omega[k]);
    }
}

#[test]
fn every_third_point_and_refusals() {
    let place = Place::with(&figure_11("verify: 3"));
    place.run(&["run", "m.yaml", "--out", "o"]).ends_with(0);
    let points = place.column("o/r.verify.csv", "point");
    let expected = (0..place.column("o/r.csv", "point").len()).step_by(3);
    assert_eq!(points, expected.map(|k| k as f64).collect::<Vec<_>>());
    for (keys, part) in [
        ("verify: 0", "every k-th point"),
        ("verify: true, method: shooting", "`verify` confirms points"),
    ] {
        let place = Place::with(&figure_11(keys));
        let ended = place.run(&["run", "m.yaml", "--out", "o"]).ends_with(2);
        ended.says(&["analyses.r.verify", part]);
    }
}
