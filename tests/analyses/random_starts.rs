//! Random starts: coexisting solutions and branches that no other branch leads to, against references and method by method.

use crate::common::{floats as numbers, reference};
use crate::response_support::marked;
use crate::time_domain_support::{PAIR, Quiet, floats, main_table, refusal, run, run_with, texts};
use gearlash::report::Report;
use serde_json::Value;

/// One mesh: damping ratio, mean and alternating load.
fn one(zeta: f64, mean: f64, cos: f64) -> String {
    format!(
        "
schema: 1
reduced:
  stiffness: [[1]]
  damping: {{modal_ratio: {zeta}}}
  elements: {{mesh: {{type: backlash, half_gap: 1}}}}
  loads: {{mean: [{mean}], harmonics: [{{order: 1, cos: [{cos}]}}]}}
"
    )
}

fn respond(model: &str, keys: &str) -> Report {
    let report = run(model, &format!("{{type: frequency_response, {keys}}}"));
    assert_eq!(report.ended_early, None);
    report
}

/// R.m.s. values and stability at a value of the parameter, by falling r.m.s. of the last connection.
fn solutions(report: &Report, value: f64, meshes: &[&str]) -> Vec<(Vec<f64>, bool)> {
    let table = main_table(report);
    let (place, stable) = (floats(table, "parameter"), floats(table, "stable"));
    let rms: Vec<Vec<f64>> = meshes
        .iter()
        .map(|m| floats(table, &format!("rms.{m}")))
        .collect();
    let rows = marked(table).into_iter().filter(|row| place[*row] == value);
    let one = |row: usize| (rms.iter().map(|r| r[row]).collect(), stable[row] == 1.0);
    let mut list: Vec<(Vec<f64>, bool)> = rows.map(one).collect();
    list.sort_by(|a, b| b.0[0].total_cmp(&a.0[0]));
    // The two ways along a branch begin at the same point.
    list.dedup_by(|a, b| (a.0[0] / b.0[0] - 1.0).abs() < 1e-6);
    list
}

/// The same of a reference.
fn expected(data: &Value, omega: f64) -> Vec<(Vec<f64>, bool)> {
    let all = data["solutions"].as_array().unwrap().iter();
    let here = all.filter(|s| s["omega"].as_f64() == Some(omega));
    let one = |s: &Value| (numbers(&s["q_rms"]), s["stable"].as_bool().unwrap());
    let mut list: Vec<(Vec<f64>, bool)> = here.map(one).collect();
    list.sort_by(|a, b| b.0[0].total_cmp(&a.0[0]));
    list
}

fn compare(found: &[(Vec<f64>, bool)], expected: &[(Vec<f64>, bool)], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    for ((found, is_stable), (expected, other)) in found.iter().zip(expected) {
        assert_eq!(is_stable, other);
        for (x, y) in found.iter().zip(expected) {
            assert!((x / y - 1.0).abs() < tolerance, "{x} {y}");
        }
    }
}

#[test]
fn all_solutions_at_one_frequency() {
    // Two stable solutions and an unstable one, on three pieces of a branch whose folds lie outside the range.
    let data = reference("one_dof_backlash");
    let model = one(0.05, 0.1, 0.05);
    for (method, tolerance) in [
        ("galerkin, harmonics: 40, quadrature: exact", 1e-6),
        ("shooting", 1e-8),
    ] {
        let starts = "starts: {count: 20, seed: 1, at: 0.6}";
        let report = respond(
            &model,
            &format!("from: 0.55, to: 0.65, {starts}, method: {method}"),
        );
        let wanted = expected(&data, 0.6);
        assert_eq!(wanted.iter().filter(|s| s.1).count(), 2);
        compare(&solutions(&report, 0.6, &["mesh"]), &wanted, tolerance);
        let search = &report.summary["starts"][0];
        assert_eq!(search["solutions"], 3);
        assert_eq!(search["known"], 1);
        assert_eq!(search["followed"], 2);
        let branches = report.table("branches").unwrap();
        let kinds = [
            "start",
            "random_start",
            "random_start",
            "random_start",
            "random_start",
        ];
        assert_eq!(texts(branches, "kind"), kinds);
        let origin = report.summary["branches"][1]["origin"].as_str().unwrap();
        assert!(
            origin.contains("start ") && origin.contains("= 0.600000"),
            "{origin}"
        );
        assert!(
            report.caption.contains("led to 3 different solutions"),
            "{}",
            report.caption
        );
    }
}

#[test]
fn unstable_solutions_of_the_pair() {
    let data = reference("fig11_case1");
    let starts = "starts: {count: 40, seed: 1, at: [0.9]}";
    let report = respond(
        PAIR,
        &format!("from: 0.91, to: 0.89, {starts}, method: shooting"),
    );
    let found = solutions(&report, 0.9, &["mesh_1", "mesh_2"]);
    compare(&found, &expected(&data, 0.9), 1e-8);
}

#[test]
fn isolated_branches_close() {
    // A subharmonic of order 3, which no branch of period 1 leads to.
    let model = one(0.01, 0.3, 0.3);
    let keys = "from: 2.6, to: 1.4, subharmonic: 3, starts: {count: 10, seed: 1, at: [1.8, 2.0]}";
    let size = "harmonics: 15, quadrature: exact";
    let [galerkin, shooting] =
        [size, "method: shooting"].map(|method| respond(&model, &format!("{keys}, {method}")));
    for report in [&galerkin, &shooting] {
        let branches = report.table("branches").unwrap();
        assert_eq!(texts(branches, "end"), ["range_reached", "closed"]);
        assert_eq!(floats(branches, "subharmonic"), [3.0, 3.0]);
        let [first, second] = [0, 1].map(|k| &report.summary["starts"][k]);
        assert_eq!(first["followed"], 1);
        assert!(first["shorter_period"].as_u64() >= Some(1));
        assert_eq!(second["followed"], 0);
        assert_eq!(second["known"], second["solutions"]);
    }
    for omega in [1.8, 2.0] {
        let [a, b] = [&galerkin, &shooting].map(|r| solutions(r, omega, &["mesh"]));
        assert!(a.len() >= 3);
        compare(&a, &b, 1e-7);
    }
}

#[test]
fn other_parameters_and_the_same_bits_on_any_number_of_threads() {
    let analysis = "{type: parameter_response, at: 0.6, parameter: modal_ratio, from: 0.05, to: 0.08, \
                    starts: {count: 10, seed: 3}}";
    let analyses = format!("  it: {analysis}\n  again: {analysis}");
    let model = one(0.05, 0.1, 0.05);
    let rms = |jobs| -> Vec<Vec<f64>> {
        let reports = run_with(&model, &analyses, jobs, &Quiet);
        let one = |r: &Report| floats(main_table(r), "rms.mesh");
        reports.iter().map(one).collect()
    };
    let once = rms(1);
    assert_eq!(once[0], once[1]);
    assert_eq!(once, rms(2));
    let report = run(&model, analysis);
    assert_eq!(report.ended_early, None);
    assert_eq!(report.summary["starts"][0]["solutions"], 3);
    let wanted = expected(&reference("one_dof_backlash"), 0.6);
    compare(&solutions(&report, 0.05, &["mesh"]), &wanted, 1e-4);
}

#[test]
fn mistakes() {
    for (keys, wanted) in [
        ("starts: {count: 0, seed: 1}", "starts.count"),
        ("starts: {count: 5}", "seed"),
        ("starts: {count: 5, seed: 1, box: -1}", "starts.box"),
        (
            "starts: {count: 5, seed: 1, at: 3}",
            "starts.at: 3 lies outside",
        ),
        (
            "starts: {count: 5, seed: 1, at: [1.5, 0.5]}",
            "starts.at.1: 0.5 lies outside",
        ),
        ("starts: {count: 5, seed: 1, boxes: 2}", "boxes"),
        (
            "starts: {count: 5, seed: 1}, method: integration",
            "attractors",
        ),
    ] {
        let message = refusal(
            PAIR,
            &format!("{{type: frequency_response, from: 2, to: 1, {keys}}}"),
        );
        assert!(message.contains(wanted), "{keys}: {message}");
    }
}
