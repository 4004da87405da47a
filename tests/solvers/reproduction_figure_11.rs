//! Figure 11 of Rook & Singh (1995), case 1, zeta = 0.05, against periodic solutions and bifurcations that an independent
//! program computed (event-driven Taylor series, r.m.s. good to 1e-10).

use crate::common;
use crate::common::{MEASURES, floats, reference};
use gearlash::solve::branch::{Branch, BranchPoint, Stability};
use gearlash::solve::continuation::PathEnd;
use gearlash::solve::events::EventKind;
use num_complex::Complex;
use serde_json::Value;

fn solutions(data: &Value) -> Vec<&Value> {
    data["solutions"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|s| !s.is_null())
        .collect()
}

fn trace(data: &Value, harmonics: usize) -> Branch {
    let mut marks: Vec<f64> = solutions(data)
        .iter()
        .map(|s| s["omega"].as_f64().unwrap())
        .collect();
    marks.dedup();
    common::trace(
        &common::system(&data["system"]),
        (2.5, 0.77),
        harmonics,
        None,
        &marks,
    )
}

/// The point solved at the solution's frequency with the nearest r.m.s., and the relative error of its r.m.s.
fn nearest<'b>(branch: &'b Branch, solution: &Value) -> (&'b BranchPoint, f64) {
    let (omega, rms) = (
        solution["omega"].as_f64().unwrap(),
        floats(&solution["q_rms"]),
    );
    let error = |p: &BranchPoint| {
        (0..2)
            .map(|e| (p.recorded[e * MEASURES + 1] / rms[e] - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let marked = branch
        .points
        .iter()
        .filter(|p| p.is_mark && (p.frequency - omega).abs() < 1e-12);
    marked
        .map(|p| (p, error(p)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .expect("every mark is solved")
}

#[test]
fn rms_of_every_solution() {
    let data = reference("fig11_case1");
    // Measured: 8.4e-6 with 40 harmonics, 1.2e-5 with 12; the tolerances are the aims of the project.
    for (harmonics, tolerance) in [(40, 2e-5), (12, 5e-4)] {
        let branch = trace(&data, harmonics);
        assert_eq!(branch.end, PathEnd::RangeReached);
        for solution in solutions(&data) {
            let (_, error) = nearest(&branch, solution);
            assert!(
                error < tolerance,
                "{harmonics} harmonics, omega {}: {error:e}",
                solution["omega"]
            );
        }
    }
}

#[test]
fn measures_multipliers_and_stability() {
    let data = reference("fig11_case1");
    let branch = trace(&data, 40);
    for solution in solutions(&data) {
        let (point, _) = nearest(&branch, solution);
        let omega = &solution["omega"];
        for (column, key, tolerance) in [
            (0, "q_mean", 5e-5),
            (2, "qd_rms", 5e-5),
            (3, "ka", 5e-5),
            (4, "kdc", 5e-5),
            (7, "f_mean", 1e-9),
        ] {
            let expected = floats(&solution[key]);
            for (e, expected) in expected.iter().enumerate() {
                let found = point.recorded[e * MEASURES + column];
                assert!(
                    (found - expected).abs() < tolerance,
                    "{key} at {omega}: {found} is not {expected}"
                );
            }
        }
        let (plus, minus) = (
            floats(&solution["contact_plus"]),
            floats(&solution["contact_minus"]),
        );
        let impacts: f64 = (0..2).map(|e| point.recorded[e * MEASURES + 6]).sum();
        assert_eq!(
            2.0 * impacts,
            solution["nevents"].as_f64().unwrap(),
            "switches at {omega}"
        );
        for e in 0..2 {
            let ratio = point.recorded[e * MEASURES + 5];
            assert!(
                (ratio - plus[e] - minus[e]).abs() < 1e-4,
                "contact ratio at {omega}: {ratio}"
            );
        }
        for pair in solution["multipliers"].as_array().unwrap() {
            let expected = Complex::new(pair[0].as_f64().unwrap(), pair[1].as_f64().unwrap());
            let gap = point
                .multipliers
                .iter()
                .map(|mu| (mu - expected).norm())
                .fold(f64::INFINITY, f64::min);
            // The aim is 1e-2; a pair that has just met on the real axis (omega = 2) is sensitive like a square root.
            assert!(
                gap < 1e-3,
                "multiplier {expected} at {omega}: off by {gap:e}"
            );
        }
        assert_eq!(
            point.stability == Stability::Stable,
            solution["stable"].as_bool().unwrap(),
            "stability at {omega}"
        );
    }
}

#[test]
fn every_bifurcation_is_located() {
    let data = reference("fig11_case1");
    let branch = trace(&data, 40);
    let kind = |word: &str| match word {
        "fold" => EventKind::Fold,
        "pd" => EventKind::PeriodDoubling,
        "ns" => EventKind::NeimarkSacker,
        other => panic!("{other}"),
    };
    let listed = data["bifurcations"].as_array().unwrap();
    for bifurcation in listed {
        let (kind, parameter) = (
            kind(bifurcation["kind"].as_str().unwrap()),
            bifurcation["parameter"].as_f64().unwrap(),
        );
        let events = branch
            .events
            .iter()
            .filter(|e| e.kind == kind && e.is_located());
        let gap = events
            .map(|e| (e.lambda - parameter).abs())
            .fold(f64::INFINITY, f64::min);
        assert!(gap < 1e-4, "{kind:?} at {parameter}: nearest {gap:e} away");
    }
    let bifurcations = branch.events.iter().filter(|e| e.kind.is_bifurcation());
    assert_eq!(bifurcations.count(), listed.len(), "no phantoms");
    for event in branch.events.iter().filter(|e| e.kind != EventKind::Fold) {
        assert!(event.bracket.0 <= event.lambda && event.lambda <= event.bracket.1);
        assert!(event.bracket.1 - event.bracket.0 < 1e-8);
    }
}
