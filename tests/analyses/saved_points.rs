//! Responses that begin at points saved by other runs.

use crate::bifurcation_curves::{ONE, QA};
use crate::time_domain_support::*;
use gearlash::report::Report;
use std::path::PathBuf;

/// A response with its orbits in a folder of results, and as a report; they go with the folder.
fn kept(analysis: &str) -> (tempfile::TempDir, PathBuf, Report) {
    let folder = tempfile::tempdir().unwrap();
    let study = load(ONE, &format!("  fr: {analysis}"), folder.path()).unwrap();
    let settings = gearlash::study::RunSettings {
        out: folder.path().join("out"),
        figures: vec![],
        jobs: 1,
    };
    study.run(&settings, &Quiet).unwrap();
    (folder, settings.out, run(ONE, analysis))
}

/// Values of a column at a mark, ascending, those of two arms through one point once.
fn at_mark(report: &Report, mark: f64, column: &str) -> Vec<f64> {
    let table = main_table(report);
    let (omega, values) = (floats(table, "omega"), floats(table, column));
    let rows = omega.iter().zip(values).filter(|(w, _)| **w == mark);
    let mut list: Vec<f64> = rows.map(|(_, x)| x).collect();
    list.sort_by(f64::total_cmp);
    list.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    list
}

#[test]
fn a_response_goes_on_from_a_saved_point() {
    let (_folder, out, whole) = kept(
        "{type: frequency_response, method: shooting, from: 1.2, to: 0.5, marks: [0.7, 0.65], orbits: marks}",
    );
    let table = main_table(&whole);
    let is_unstable = floats(table, "stable")
        .into_iter()
        .zip(floats(table, "omega"))
        .position(|(stable, omega)| stable == 0.0 && omega == 0.65);
    let point = is_unstable.expect("an unstable orbit between two folds");
    let start = |method: &str, more: &str| {
        format!(
            "{{type: frequency_response, method: {method}, harmonics: 30, from: 1.2, to: 0.5, marks: [0.7, 0.65], {more} \
             start: {{results: \"{}\", analysis: fr, point: {point}}}}}",
            out.display()
        )
    };
    let wanted = at_mark(&whole, 0.65, "rms.m");
    assert_eq!(wanted.len(), 3, "{wanted:?}");
    for (method, near) in [("shooting", 1e-9), ("galerkin", 1e-5)] {
        let report = run(ONE, &start(method, ""));
        assert_eq!(report.ended_early, None);
        let found = at_mark(&report, 0.65, "rms.m");
        assert_eq!(found.len(), 3, "{method}: {found:?}");
        for (a, b) in found.iter().zip(&wanted) {
            assert!((a - b).abs() < near, "{method}: {a} {b}");
        }
        let kinds = texts(report.table("branches").unwrap(), "kind");
        assert_eq!(kinds, ["saved_point", "saved_point"]);
    }
    // The same point as the beginning of a response in another number.
    let report = run(
        ONE,
        &format!(
            "{{type: parameter_response, method: shooting, parameter: {QA}, at: 0.65, from: 0.1, to: 0.3, marks: [0.2], \
             start: {{results: \"{}\", analysis: fr, point: {point}}}}}",
            out.display()
        ),
    );
    let rms = floats(main_table(&report), "rms.m");
    assert!(
        rms.iter().any(|x| (x - wanted[1]).abs() < 1e-9),
        "{rms:?} {wanted:?}"
    );
    let outside = start("shooting", "")
        .replace("to: 0.5", "to: 0.9")
        .replace("0.7, 0.65", "1");
    let lost = refusal(ONE, &outside);
    assert!(lost.contains("lies outside the range"), "{lost}");
    let absent = refusal(
        ONE,
        &start("shooting", "").replace("analysis: fr", "analysis: no"),
    );
    assert!(absent.contains("there is no file"), "{absent}");
}

/// A motion by integration begins in the saved state.
#[test]
fn an_integration_begins_in_a_saved_state() {
    let (_folder, out, whole) = kept(
        "{type: frequency_response, method: shooting, from: 1.2, to: 0.5, marks: [0.85], orbits: marks}",
    );
    let table = main_table(&whole);
    let all: Vec<(f64, f64, f64)> = (floats(table, "omega").into_iter())
        .zip(floats(table, "stable"))
        .zip(floats(table, "rms.m"))
        .map(|((w, s), x)| (w, s, x))
        .collect();
    for (point, (_, _, rms)) in all
        .iter()
        .enumerate()
        .filter(|(_, (w, s, _))| *w == 0.85 && *s == 1.0)
    {
        let analysis = format!(
            "{{type: frequency_response, method: integration, at: 0.85, points: 1, \
             start: {{results: \"{}\", analysis: fr, point: {point}}}}}",
            out.display()
        );
        let found = floats(main_table(&run(ONE, &analysis)), "rms.m");
        assert!((found[0] - rms).abs() < 1e-8, "{found:?} {rms}");
    }
}
