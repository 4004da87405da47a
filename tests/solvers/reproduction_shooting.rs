//! Shooting with the exact flow against orbits, multipliers and bifurcations of an independent program.

use crate::common::{self, floats, reference};
use gearlash::solve::branch::{Branch, BranchPoint};
use gearlash::solve::continuation::PathEnd;
use gearlash::solve::events::EventKind;
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::system::System;
use nalgebra::DVector;
use num_complex::Complex;
use serde_json::Value;

fn trace(system: &System, range: (f64, f64), marks: &[f64], choice: IntegratorChoice) -> Branch {
    common::shoot(system, range, marks, choice, 0.1)
}

fn marks(data: &Value, nu: i64) -> (Vec<&Value>, Vec<f64>) {
    let all = data["solutions"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|s| !s.is_null());
    let list: Vec<&Value> = all.filter(|s| s["nu"].as_i64() == Some(nu)).collect();
    let mut marks: Vec<f64> = list.iter().map(|s| s["omega"].as_f64().unwrap()).collect();
    marks.dedup();
    (list, marks)
}

fn nearest<'b>(branch: &'b Branch, solution: &Value) -> (&'b BranchPoint, f64) {
    let (omega, u0) = (
        solution["omega"].as_f64().unwrap(),
        DVector::from_vec(floats(&solution["u0"])),
    );
    let marked = branch
        .points
        .iter()
        .filter(|p| p.is_mark && (p.frequency - omega).abs() < 1e-12);
    let gaps = marked.map(|p| (p, (&p.unknowns - &u0).amax()));
    gaps.min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or_else(|| panic!("no mark at {omega}"))
}

fn multiplier_gap(point: &BranchPoint, solution: &Value) -> f64 {
    let expected = solution["multipliers"].as_array().unwrap().iter();
    // Real multipliers are numbers in one file and pairs in the other.
    let number = |m: &Value, k: usize| m[k].as_f64().unwrap();
    let expected = expected.map(|m| match m.as_f64() {
        Some(real) => Complex::new(real, 0.0),
        None => Complex::new(number(m, 0), number(m, 1)),
    });
    let gap = |e: Complex<f64>| {
        point
            .multipliers
            .iter()
            .map(|mu| (mu - e).norm())
            .fold(f64::INFINITY, f64::min)
    };
    expected.map(gap).fold(0.0, f64::max)
}

fn events_gap(branch: &Branch, data: &Value, nu: i64) -> f64 {
    let listed = data["bifurcations"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|b| b["nu"].as_i64() == Some(nu));
    listed
        .map(|b| {
            let kind = match b["kind"].as_str().unwrap() {
                "fold" => EventKind::Fold,
                "pd" => EventKind::PeriodDoubling,
                _ => EventKind::NeimarkSacker,
            };
            let parameter = b["parameter"].as_f64().unwrap();
            let of_kind = branch
                .events
                .iter()
                .filter(|e| e.kind == kind && e.is_located());
            of_kind
                .map(|e| (e.lambda - parameter).abs())
                .fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max)
}

#[test]
fn figure_11_orbits_multipliers_and_bifurcations() {
    let data = reference("fig11_case1");
    let (solutions, marks) = marks(&data, 1);
    let branch = trace(
        &common::system(&data["system"]),
        (2.5, 0.77),
        &marks,
        IntegratorChoice::Exact,
    );
    assert_eq!(branch.end, PathEnd::RangeReached);
    for solution in solutions {
        let (point, gap) = nearest(&branch, solution);
        assert!(gap < 1e-10, "u0 at {}: {gap:e}", solution["omega"]);
        let gap = multiplier_gap(point, solution);
        assert!(gap < 1e-8, "multipliers at {}: {gap:e}", solution["omega"]);
        for (column, key, tolerance) in [
            (0, "q_mean", 1e-10),
            (1, "q_rms", 1e-9),
            (2, "qd_rms", 1e-9),
            (3, "ka", 1e-9),
            (4, "kdc", 1e-9),
            (7, "f_mean", 1e-10),
        ] {
            for (e, expected) in floats(&solution[key]).iter().enumerate() {
                let found = point.recorded[e * common::MEASURES + column];
                assert!(
                    (found - expected).abs() < tolerance,
                    "{key} at {}: {found} {expected}",
                    solution["omega"]
                );
            }
        }
    }
    // The last listed period doubling is given to ten digits only.
    let gap = events_gap(&branch, &data, 1);
    let found: Vec<_> = branch.events.iter().map(|e| (e.kind, e.lambda)).collect();
    assert!(gap < 1e-9, "bifurcations: {gap:e}, {found:?}");
    assert_eq!(
        branch
            .events
            .iter()
            .filter(|e| e.kind.is_bifurcation())
            .count(),
        data["bifurcations"].as_array().unwrap().len()
    );
}

#[test]
fn one_degree_of_freedom_folds() {
    let data = reference("one_dof_backlash");
    let system = common::one_dof(&data);
    let (solutions, marks) = marks(&data, 1);
    let (low, high) = (
        marks.iter().copied().fold(9.0, f64::min),
        marks.iter().copied().fold(0.0, f64::max),
    );
    let branch = trace(
        &system,
        (high + 0.1, low - 0.01),
        &marks,
        IntegratorChoice::Auto,
    );
    assert_eq!(branch.end, PathEnd::RangeReached);
    for solution in solutions {
        let (point, gap) = nearest(&branch, solution);
        assert!(gap < 1e-9, "u0 at {}: {gap:e}", solution["omega"]);
        if !solution["multipliers"].is_null() {
            assert!(multiplier_gap(point, solution) < 1e-7);
        }
    }
    let gap = events_gap(&branch, &data, 1);
    assert!(gap < 1e-8, "folds: {gap:e}");
}

#[test]
fn dopri5_shoots_to_the_same_orbits() {
    let data = reference("fig11_case1");
    let (solutions, _) = marks(&data, 1);
    let system = common::system(&data["system"]);
    let branch = trace(
        &system,
        (2.5, 1.55),
        &[2.2, 2.0, 1.8, 1.7, 1.6],
        IntegratorChoice::Dopri5,
    );
    for solution in solutions
        .iter()
        .filter(|s| s["omega"].as_f64().unwrap() > 1.55)
    {
        let (_, gap) = nearest(&branch, solution);
        // rtol 1e-10 of the integrator, grown by (Phi - I)^-1.
        assert!(gap < 1e-7, "u0 at {}: {gap:e}", solution["omega"]);
    }
}
