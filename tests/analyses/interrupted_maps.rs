//! Curves, tori and maps that are interrupted keep what they have, and the reason.

use crate::bifurcation_curves::QA;
use crate::time_domain_support::*;
use crate::tori::FIGURE_5;
use gearlash::analysis::Control;
use gearlash::interrupt::Interrupt;
use gearlash::report::Report;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Raises the flag that reaches every loop, as a signal and a time limit do, after a number of reports of progress with a word.
struct After {
    told: AtomicUsize,
    patience: usize,
    word: &'static str,
    flag: Interrupt,
}

impl Control for After {
    fn is_interrupted(&self) -> bool {
        self.flag.is_requested()
    }

    fn progress(&self, _: &str, _: f64, words: &str) {
        let is_meant = words.contains(self.word);
        if is_meant && self.told.fetch_add(1, Ordering::Relaxed) >= self.patience {
            self.flag.request();
        }
    }

    fn interrupt(&self) -> Interrupt {
        self.flag.clone()
    }

    fn reason(&self) -> Option<String> {
        Some("the time limit was reached".into())
    }
}

fn interrupted(model: &str, analysis: &str, (word, patience): (&'static str, usize)) -> Report {
    let control = After {
        told: AtomicUsize::new(0),
        patience,
        word,
        flag: Interrupt::default(),
    };
    let report = run_with(model, &format!("  it: {analysis}"), 1, &control).remove(0);
    assert!(control.flag.is_requested(), "it was over before");
    let reason = report.ended_early.clone().unwrap();
    assert!(reason.contains("the time limit was reached"), "{reason}");
    report
}

#[test]
fn a_curve_keeps_its_points() {
    let analysis = format!(
        "{{type: bifurcation_curve, parameters: [frequency, {QA}], ranges: [[0.8, 2.4], [0.03, 0.6]], \
         start: {{kind: grazing, connection: mesh_1, at: {{frequency: 1.470385331711, {QA}: 0.224}}}}}}"
    );
    let whole = main_table(&run(PAIR, &analysis)).rows();
    let mut before = 0;
    for patience in [6, 20, 45] {
        let report = interrupted(PAIR, &analysis, ("points", patience));
        let rows = main_table(&report).rows();
        assert!(
            rows >= before && rows > patience / 2 && rows < whole,
            "{patience}: {rows}"
        );
        let ends = report.summary["curves"][0]["ends"].to_string();
        assert!(ends.contains("interrupted"), "{ends}");
        before = rows;
    }
}

#[test]
fn tori_keep_their_points_and_measures() {
    let analysis = format!(
        "{{type: torus, at: 1.2, parameter: {QA}, start: {{attractor: {{value: 0.1795}}}}, from: 0.1795, to: 0.19, max_step: 0.02, transient: 400}}"
    );
    let report = interrupted(FIGURE_5, &analysis, ("tori", 5));
    let table = main_table(&report);
    assert!(table.rows() > 2 && table.rows() < 40, "{}", table.rows());
    assert!(
        floats(table, "rms.mesh_1")
            .iter()
            .all(|x| *x > 0.4 && *x < 0.5)
    );
    assert_eq!(report.summary["ends"][0]["reason"], "interrupted");
}

#[test]
fn a_map_keeps_its_cells() {
    let analysis = format!(
        "{{type: regime_map, parameters: {{frequency: {{from: 1.0, to: 2.0, points: 8}}, {QA}: {{from: 0.1, to: 0.3, points: 8}}}}, transient: 20, periods: 20}}"
    );
    let report = interrupted(PAIR, &analysis, ("cell", 30));
    let rows = main_table(&report).rows();
    assert!(rows > 10 && rows < 128, "{rows}");
    assert!(
        floats(main_table(&report), "impacts.mesh_2")
            .iter()
            .all(|x| !x.is_nan())
    );
}
