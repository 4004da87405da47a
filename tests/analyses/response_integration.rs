//! Method `integration` of responses: the attractor followed and summarised in the columns of a branch.

use crate::time_domain_support::*;
use gearlash::analysis::Control;
use gearlash::report::{CurveStyle, Report, Table};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A linear response has one attractor: r.m.s. and mean in closed form.
#[test]
fn a_linear_oscillator_meets_its_closed_form() {
    let report = run(
        LINEAR,
        "{type: frequency_response, method: integration, from: 0.6, to: 1.4, points: 9, marks: [0.8, 0.95], \
         transient: 80, periods: 8}",
    );
    let table = main_table(&report);
    // 0.8 is one of the nine values, 0.95 comes between two of them.
    let omega = floats(table, "omega");
    let wanted = [0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.1, 1.2, 1.3, 1.4];
    assert_eq!(omega.len(), wanted.len());
    for (found, wanted) in omega.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-15);
    }
    let marks = floats(table, "mark");
    assert_eq!(marks, [0., 0., 1., 0., 1., 0., 0., 0., 0., 0.]);
    assert_eq!((omega[2], omega[4]), (0.8, 0.95));
    for (omega, rms) in omega.iter().zip(floats(table, "rms.spring")) {
        let det = (1.0 - omega * omega).powi(2) + (0.1 * omega).powi(2);
        let wanted = 0.3 / det.sqrt() / 2f64.sqrt();
        // What is left of the transient after 80 periods: exp(-0.05 * 80 * 2 pi / 1.4) of the start.
        assert!((rms - wanted).abs() < 1e-7, "{omega}: {rms} {wanted}");
    }
    assert!(
        floats(table, "mean.spring")
            .iter()
            .all(|m| (m - 0.5).abs() < 1e-7)
    );
    for empty in ["stable", "multiplier_modulus", "residual"] {
        assert!(floats(table, empty).iter().all(|x| x.is_nan()), "{empty}");
    }
    // Iterates of the Poincaré map.
    assert!(floats(table, "iterations").iter().all(|x| *x == 88.0));
    assert_eq!(table.columns.last().unwrap().name, "label");
    assert!(texts(table, "label").iter().all(|l| l == "period 1"));
    let branch = &report.summary["branches"][0];
    assert_eq!(
        (&branch["integrator"], &branch["end"]["reason"]),
        (&"exact".into(), &"range_reached".into())
    );
    assert!(report.table("multipliers").is_none());
    assert_eq!(report.ended_early, None);
}

fn rows_of(table: &Table, method: &str) -> Vec<usize> {
    let methods = texts(table, "method");
    (0..methods.len())
        .filter(|k| methods[*k] == method)
        .collect()
}

/// Where the attractor has period 1 it is the orbit of shooting, measure by measure.
#[test]
fn attractors_of_period_1_are_the_orbits_of_shooting() {
    let report = run(
        PAIR,
        "{type: frequency_response, methods: [galerkin, shooting, integration], from: 2.4, to: 1.28, points: 3, \
         marks: [2.2, 2.0, 1.3], harmonics: 20, orbits: marks}",
    );
    let table = main_table(&report);
    let (omega, mark) = (floats(table, "omega"), floats(table, "mark"));
    let labels = texts(table, "label");
    let [galerkin, shooting, integration] =
        ["galerkin", "shooting", "integration"].map(|m| rows_of(table, m));
    assert_eq!(integration.len(), 6);
    assert!(
        galerkin
            .iter()
            .chain(&shooting)
            .all(|r| labels[*r].is_empty())
    );
    let at = |rows: &[usize], w: f64| {
        *rows
            .iter()
            .find(|r| omega[**r] == w && mark[**r] == 1.0)
            .unwrap()
    };
    let measured = table
        .columns
        .iter()
        .map(|c| c.name.as_str())
        .filter(|n| n.contains(".mesh_") || n.starts_with("effective_frequency"));
    for name in measured {
        let column = floats(table, name);
        for w in [2.2, 2.0, 1.3] {
            let (a, b) = (column[at(&integration, w)], column[at(&shooting, w)]);
            assert_eq!(labels[at(&integration, w)], "period 1");
            // Points repeat to 1e-6 by the definition of the label; 200 periods leave far less of the transient.
            assert!(
                (a - b).abs() < 1e-8 * (1.0 + b.abs()),
                "{name} at {w}: {a} {b}"
            );
            let c = column[at(&galerkin, w)];
            // 20 harmonics of a response with kinks; forces and slopes converge one order slower than displacements.
            assert!(
                (a - c).abs() < 2e-3 * (1.0 + c.abs()),
                "{name} at {w}: {a} {c}"
            );
        }
    }
    // Orbits of three marks by each of three methods.
    let orbits = report.table("orbits").unwrap();
    assert_eq!(orbits.rows(), 9 * 256);
    let (tau, q) = (floats(orbits, "tau"), floats(orbits, "q.mesh_1"));
    assert_eq!(tau[6 * 256], 0.0);
    for k in 0..3 * 256 {
        assert!((q[6 * 256 + k] - q[3 * 256 + k]).abs() < 1e-7, "{k}");
    }
    // Multipliers belong to the two methods that have them.
    let multipliers = report.table("multipliers").unwrap();
    assert_eq!(multipliers.rows(), galerkin.len() + shooting.len());
    let curves = &report.figure.as_ref().unwrap().panels[0].curves;
    assert_eq!(curves[2].style, CurveStyle::Dots);
    assert_eq!(curves[2].label, "integration");
}

/// Means over the periods of the attractor: a period-2 attractor is measured over both of its periods.
#[test]
fn doubled_and_chaotic_attractors_say_so() {
    // Case 1, b1 = b2 = 1 at omega = 0.2: a period-doubling cascade in the alternating load, which ends near 0.2825.
    let of = |amplitude: f64| {
        let model = PAIR
            .replace("half_gap: 0.1", "half_gap: 1.0")
            .replace("cos: [0.25, 0]", &format!("cos: [{amplitude}, 0]"));
        run(
            &model,
            "{type: frequency_response, methods: [integration], from: 0.2, to: 0.2001, points: 2, transient: 400, \
             periods: 200, orbits: true}",
        )
    };
    let doubled = of(0.279);
    let table = main_table(&doubled);
    assert_eq!(texts(table, "label")[0], "period 2");
    // One orbit of two excitation periods: impacts counted per excitation period, in halves.
    assert_eq!(doubled.table("orbits").unwrap().rows(), 2 * 256);
    let impacts = floats(table, "impacts.mesh_1")[0];
    assert!((2.0 * impacts).fract() == 0.0 && impacts > 0.0, "{impacts}");
    let chaotic = of(0.29);
    let table = main_table(&chaotic);
    assert_eq!(texts(table, "label"), ["chaotic", "chaotic"]);
    // What is not periodic has no orbit.
    assert_eq!(chaotic.table("orbits").unwrap().rows(), 0);
    let (min, mean, max) = ["min.mesh_1", "mean.mesh_1", "max.mesh_1"]
        .map(|name| floats(table, name)[0])
        .into();
    assert!(min < mean && mean < max);
}

#[test]
fn impact_damping_runs_on_the_series_flow_and_si_reports_have_units() {
    let model = format!(
        "{}\nreport: {{units: si}}",
        TRAIN.replace(
            "half_gap: 20 um",
            "half_gap: 20 um, impact_damping: 0.5 s/m"
        )
    );
    let report = run(
        &model,
        "{type: frequency_response, method: integration, from: 2 kHz, to: 1900 Hz, points: 2, transient: 200, periods: 5}",
    );
    assert_eq!(report.summary["branches"][0]["integrator"], "series");
    let table = main_table(&report);
    assert_eq!(texts(table, "label"), ["period 1", "period 1"]);
    let hertz = floats(table, "frequency_hz");
    assert!((hertz[0] - 2000.0).abs() < 1e-9 && (hertz[1] - 1900.0).abs() < 1e-9);
    assert_eq!(table.column("rms.mesh").unwrap().unit, "m");
}

/// Interrupts at the given question.
struct Impatient(AtomicUsize);

impl Control for Impatient {
    fn is_interrupted(&self) -> bool {
        self.0
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| {
                Some(n.saturating_sub(1))
            })
            == Ok(0)
    }
}

#[test]
fn an_interruption_and_a_divergence_keep_what_is_finished() {
    let text = "  it: {type: frequency_response, method: integration, from: 0.9, to: 1.1, points: 5, transient: 10, \
                periods: 10, extend: 1}";
    let control = Impatient(AtomicUsize::new(50));
    let report = run_with(PAIR, text, 1, &control).remove(0);
    let message = report.ended_early.clone().unwrap();
    assert!(
        message.starts_with("interrupted at omega/omega_c = "),
        "{message}"
    );
    assert_eq!(
        report.summary["branches"][0]["end"]["reason"],
        "interrupted"
    );
    let rows = main_table(&report).rows();
    assert!((1..5).contains(&rows), "{rows}");
    // Negative damping.
    let model = LINEAR.replace("[[0.1]]", "[[-20]]");
    let report = run(
        &model,
        "{type: frequency_response, methods: [integration], from: 0.1, to: 0.2, transient: 0, periods: 9}",
    );
    let end = &report.summary["branches"][0]["end"];
    assert_eq!(end["reason"], "integration_failed");
    let message = report.ended_early.unwrap();
    assert!(
        message.contains("in period") && message.ends_with("before the first point"),
        "{message}"
    );
}

#[test]
fn mistakes_are_named_with_their_key() {
    let start = "type: frequency_response, from: 2, to: 1";
    for (keys, wanted) in [
        (
            "points: 50",
            "analyses.it.points: `points` belongs to the method `integration`, which is not selected",
        ),
        (
            "methods: [galerkin, shooting], transient: 5",
            "analyses.it.transient: `transient` belongs to",
        ),
        (
            "method: shooting, periods: 5",
            "analyses.it.periods: `periods` belongs to",
        ),
        (
            "method: integration, points: 1",
            "analyses.it.points: 1 must be at least 2",
        ),
        (
            "method: integration, periods: 0",
            "analyses.it.periods: 0 must be at least 1",
        ),
        (
            "method: integration, marks: [3]",
            "analyses.it.marks.0: 3 lies outside the range from 2 to 1",
        ),
        (
            "method: integration, point: 5",
            "analyses.it.point: unknown key `point`; did you mean `points`?",
        ),
        (
            "method: integrating",
            "analyses.it.method: `integrating` is not known here; did you mean `integration`?",
        ),
    ] {
        let message = refusal(PAIR, &format!("{{{start}, {keys}}}"));
        assert!(message.contains(wanted), "{keys}: {message}");
    }
    let model = PAIR.replace("half_gap: 0.1", "half_gap: 0.1, impact_damping: 0.1");
    let message = refusal(
        &model,
        &format!("{{{start}, method: integration, integrator: exact}}"),
    );
    assert!(
        message.contains("analyses.it.integrator: mesh_2: "),
        "{message}"
    );
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let text = "  a: {type: frequency_response, method: integration, from: 2.0, to: 1.0, points: 4, transient: 20}\n  \
                b: {type: frequency_response, methods: [shooting, integration], from: 2.0, to: 1.9, points: 3}";
    let tables = |jobs| -> Vec<String> {
        let reports = run_with(PAIR, text, jobs, &Quiet);
        reports
            .iter()
            .map(|r: &Report| format!("{:?}", r.tables))
            .collect()
    };
    assert_eq!(tables(1), tables(2));
}
