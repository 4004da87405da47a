//! Equal parts that do not act on each other pass folds together: a branch of m of them has the events of one, m-fold, whatever the steps.
//! For even m the determinant of the corrector changes its sign at such a fold.

use crate::common::{backlash, load, shoot};
use gearlash::solve::continuation::PathEnd;
use gearlash::solve::events::EventKind;
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::system::System;
use nalgebra::DMatrix;

/// Accuracy of events, relative: of folds at which the corrector is singular.
const SAME: f64 = 1e-8;

/// m meshes with clearance side by side.
fn parts(m: usize, damping: f64, (mean, cos): (f64, f64)) -> System {
    let unit = DMatrix::identity(m, m);
    let mounts = (0..m).map(|_| backlash(1.0)).collect();
    let loads = (0..m).map(|i| load(m, i, mean, cos)).collect();
    System::new(&unit * damping, unit.clone(), unit, mounts, loads).unwrap()
}

/// Kind, parameter and multiplicity of the bifurcations.
fn bifurcations(system: &System, range: (f64, f64), step: f64) -> Vec<(EventKind, f64, usize)> {
    let branch = shoot(system, range, &[], IntegratorChoice::Exact, step);
    assert_eq!(branch.end, PathEnd::RangeReached, "steps of {step}");
    let events = branch.events.iter().filter(|e| e.kind.is_bifurcation());
    events
        .map(|e| {
            assert!(e.is_located(), "steps of {step}: {e:?}");
            (e.kind, e.lambda, e.multiplicity)
        })
        .collect()
}

#[test]
fn equal_parts_turn_together() {
    for (damping, load, range) in [
        (0.06409, (0.33346, 0.15443), (2.3447, 0.4476)),
        (0.1, (0.25, 0.3), (2.2, 0.5)),
    ] {
        let one = bifurcations(&parts(1, damping, load), range, 0.02);
        assert!(one.len() >= 3, "{one:?}");
        for m in [2, 4] {
            let system = parts(m, damping, load);
            for step in [0.05, 0.065, 0.08, 0.11] {
                let all = bifurcations(&system, range, step);
                let is_same = |(a, b): (&(EventKind, f64, usize), &(EventKind, f64, usize))| {
                    a.0 == b.0 && b.2 == m && (a.1 - b.1).abs() < SAME * a.1
                };
                let are_same = one.len() == all.len() && one.iter().zip(&all).all(is_same);
                assert!(
                    are_same,
                    "{m} parts, steps of {step}: {all:?}, one alone {one:?}"
                );
            }
        }
    }
}
