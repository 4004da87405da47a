//! What the analyses in the time domain refuse, and how they end early.

use crate::time_domain_support::*;
use gearlash::analysis::Control;
use gearlash::report::Table;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

const FOLLOWED: &str = "{type: bifurcation_diagram, from: 0.9, to: 1.1, points: 3, direction: both, transient: 4, periods: 3, extend: 1}";

/// Interrupts after a number of queries.
struct Impatient(AtomicUsize, AtomicBool);

impl Control for Impatient {
    fn is_interrupted(&self) -> bool {
        let left = self.0.load(Ordering::Relaxed);
        if left == 0 {
            self.1.store(true, Ordering::Relaxed);
        } else {
            self.0.store(left - 1, Ordering::Relaxed);
        }
        self.1.load(Ordering::Relaxed)
    }
}

fn main_table_of(tables: &[Table]) -> &Table {
    tables.iter().find(|t| t.name.is_empty()).unwrap()
}

#[test]
fn an_interruption_keeps_what_is_finished() {
    let of = |text: &str, questions| {
        let control = Impatient(AtomicUsize::new(questions), AtomicBool::new(false));
        run_with(PAIR, &format!("  it: {text}"), 1, &control).remove(0)
    };
    let history = of(
        "{type: time_history, at: 0.9, periods: 6, samples_per_period: 10}",
        4,
    );
    assert_eq!(history.ended_early.as_deref(), Some("interrupted"));
    assert_eq!(main_table(&history).rows(), 31);
    let map = of("{type: poincare_map, at: 0.9, transient: 0, periods: 9}", 4);
    assert_eq!(map.ended_early.as_deref(), Some("run 0: interrupted"));
    assert_eq!(main_table(&map).rows(), 3);
    let diagram = of(FOLLOWED, 20);
    assert_eq!(
        diagram.ended_early.as_deref(),
        Some("interrupted after 2 of 6 points")
    );
    assert_eq!(
        (
            main_table(&diagram).rows(),
            diagram.table("summary").unwrap().rows()
        ),
        (6, 2)
    );
    for text in [
        "{type: effective_frequencies, amplitude: [0, 5], points: 100000, mean_displacement: 0}",
        "{type: modes, points: 100000}",
    ] {
        let report = of(text, 30);
        assert!((1..30).contains(&main_table(&report).rows()), "{text}");
        assert_eq!(report.ended_early.as_deref(), Some("interrupted"));
    }
}

#[test]
fn a_divergence_is_reported_with_what_there_is() {
    // Negative damping.
    let model = LINEAR.replace("[[0.1]]", "[[-20]]");
    let history = run(
        &model,
        "{type: time_history, at: 0.1, periods: 9, samples_per_period: 4}",
    );
    let reason = history.ended_early.unwrap();
    assert!(reason.contains("in period"), "{reason}");
    assert!(main_table_of(&history.tables).rows() >= 1);
    let diagram = run(
        &model,
        "{type: bifurcation_diagram, from: 0.1, to: 0.2, points: 3, transient: 0, periods: 9}",
    );
    let reason = diagram.ended_early.unwrap();
    assert!(
        reason.starts_with("run 0 at 1.000000e-1: ") && reason.contains("in period"),
        "{reason}"
    );
    // The values behind the first are tried as well.
    assert_eq!(texts(&diagram.tables[1], "label"), ["undecided"; 3]);
    assert_eq!(diagram.summary["stops"].as_array().unwrap().len(), 3);
}

#[test]
fn mistakes_are_named_with_their_key() {
    let si = format!("{TRAIN}\nreport: {{units: si}}");
    let sweep = "type: bifurcation_diagram, transient: 1, periods: 1, points: 2";
    for (model, analysis, wanted) in [
        (
            LINEAR,
            "{type: time_history, at: -1}".to_string(),
            "analyses.it.at: -1 must be a frequency > 0",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, periods: 0}".into(),
            "analyses.it.periods: 0 must be at least 1",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, samples_per_period: 0}".into(),
            "samples_per_period: 0 must be at least 1",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, periods: 1000000}".into(),
            "1000000 periods of 200 samples are more than 50000000 rows",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, initial: {q: [1, 2]}}".into(),
            "analyses.it.initial.q: 2 values for 1 relative coordinates (spring)",
        ),
        (
            LINEAR,
            "{type: time_history, at: 1, initial: {v: [1 m/s]}}".into(),
            "analyses.it.initial.v.0: `1 m/s` has a unit, but a reduced model is nondimensional",
        ),
        (
            &si,
            "{type: time_history, at: 1 Hz, initial: {q: [1 um, 1 um]}}".into(),
            "analyses.it.initial.q.1: `1 um` is a length",
        ),
        (
            &si,
            "{type: time_history, at: 3}".into(),
            "the bare number 3 is ambiguous in an SI report",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, periods: 0}".into(),
            "analyses.it.periods: 0 must be at least 1",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, periods: 60000000}".into(),
            "60000000 in each of 1 runs are more than 50000000 points",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, initials: []}".into(),
            "analyses.it.initials: an empty list: nothing to run",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, initial: {}, initials: [{}]}".into(),
            "give `initial` for one run or `initials` for several, not both",
        ),
        (
            LINEAR,
            "{type: poincare_map, at: 1, initials: [{}, {q: []}]}".into(),
            "analyses.it.initials.1.q: 0 values for 1 relative coordinates",
        ),
        (
            LINEAR,
            "{type: bifurcation_diagram, from: 1, to: 2, points: 1}".into(),
            "analyses.it.points: 1 must be at least 2",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 1}}"),
            "analyses.it.to: 1 is where the sweep starts",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 0, to: 1}}"),
            "analyses.it.from: 0 must be a frequency > 0",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, at: 1}}"),
            "analyses.it.at: the excitation frequency is the parameter; leave `at` out",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: mesh_2.half_gap, from: 1, to: 2}}"),
            "analyses.it.at: missing: the excitation frequency at which reduced.elements.mesh_2.half_gap is varied",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: half_gap, at: 1, from: 1, to: 2}}"),
            "`half_gap` could be any of 2 numbers of the model (reduced.elements.mesh_1.half_gap, reduced.elements.mesh_2.half_gap)",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: mesh_2.half_gpa, at: 1, from: 1, to: 2}}"),
            "`mesh_2.half_gpa` is neither `frequency` nor a path of the model",
        ),
        (
            PAIR,
            format!("{{{sweep}, parameter: mesh_2.half_gap, at: 1, from: -1, to: 2}}"),
            "half_gap",
        ),
        (
            &si,
            format!("{{{sweep}, parameter: mesh.half_gap, at: 1 Hz, from: 1 N, to: 2 um}}"),
            "analyses.it.from: connections.mesh.element.half_gap",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 0, seed: 1}}}}"),
            "analyses.it.seeds.count: 0 must be at least 1",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, direction: up, seeds: {{count: 1, seed: 1}}}}"),
            "with `seeds` every value is a run of its own; leave `direction` out",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, initial: {{}}, seeds: {{count: 1, seed: 1}}}}"),
            "with `seeds` the initial states are random; leave `initial` out",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 1, seed: 1, box: -1}}}}"),
            "analyses.it.seeds.box: -1 must be >= 0: a half width",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 1, seed: 1, box: {{q: [-1]}}}}}}"),
            "analyses.it.seeds.box.q.0: must be >= 0: a half width",
        ),
        (
            LINEAR,
            format!("{{{sweep}, from: 1, to: 2, seeds: {{count: 1}}}}"),
            "seed",
        ),
    ] {
        let found = refusal(model, &analysis);
        assert!(
            found.contains(wanted),
            "{analysis}\n  found  {found}\n  wanted {wanted}"
        );
    }
}

#[test]
fn the_exact_flow_is_refused_with_the_connection_and_the_reason() {
    let model = LINEAR.replace("type: linear", "type: cubic, cubic: 0.1");
    for kind in [
        "time_history, at: 1",
        "poincare_map, at: 1",
        "bifurcation_diagram, from: 1, to: 2, points: 2",
    ] {
        let found = refusal(&model, &format!("{{type: {kind}, integrator: exact}}"));
        assert!(
            found.contains("integrator") && found.contains("spring"),
            "{found}"
        );
        let report = run(
            &model,
            &format!("{{type: {kind}, integrator: dopri5, periods: 1, transient: 1}}"),
        );
        assert_eq!(report.summary["integrator"], "dopri5");
    }
}
