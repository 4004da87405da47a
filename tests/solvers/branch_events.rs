//! Events of a branch: none missed between two points, none invented, whatever the length of the steps.

use crate::common::{
    RecordMeasures, backlash, balance, balance_exactly, load, reference, shoot, system,
    trace_options,
};
use gearlash::postprocess::measures::Meter;
use gearlash::solve::branch::Branch;
use gearlash::solve::branch::confirm::{ConfirmOptions, ErrorSpread, confirm};
use gearlash::solve::events::{BifurcationEvent, EventKind, Verdict};
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::solve::newton::NewtonOptions;
use gearlash::solve::shooting::Shooting;
use gearlash::system::System;
use nalgebra::DMatrix;

/// Two coordinates of the paper: omega* = 1 and `second`, half gaps, alternating load 0.25, damping ratio 0.05.
fn pair(second: f64, gaps: [f64; 2]) -> System {
    let x = 0.5 * (second * second - 1.0);
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0 + x, x, x, 1.0 + x]);
    // 2 zeta kappa^(1/2): eigenvectors (1, -1) and (1, 1).
    let (sum, difference) = (0.5 * (second + 1.0), 0.5 * (second - 1.0));
    let root = DMatrix::from_row_slice(2, 2, &[sum, difference, difference, sum]);
    System::new(
        root * 0.1,
        kappa,
        DMatrix::identity(2, 2),
        gaps.into_iter().map(backlash).collect(),
        vec![load(2, 0, 0.5, 0.25), load(2, 1, 0.5, 0.0)],
    )
    .unwrap()
}

/// Every event of the one branch occurs once in the other.
fn contained(one: &Branch, other: &Branch, word: &str) {
    for event in &one.events {
        let is_twin = |e: &&BifurcationEvent| {
            e.kind == event.kind && (e.lambda - event.lambda).abs() < 1e-8 && e.is_located()
        };
        let count = other.events.iter().filter(is_twin).count();
        assert_eq!(count, 1, "{word}: {:?} at {}", event.kind, event.lambda);
    }
}

/// Steps ten times as long lead to the same events.
fn do_not_depend_on_steps(trace: impl Fn(f64) -> Branch, at_least: usize) {
    let (long, short) = (trace(0.1), trace(0.01));
    assert!(2 * long.points.len() < short.points.len());
    assert!(long.events.len() >= at_least, "{}", long.events.len());
    contained(&long, &short, "only with long steps");
    contained(&short, &long, "only with short steps");
}

#[test]
fn do_not_depend_on_steps_by_galerkin() {
    for (second, gaps, at_least) in [(3f64.sqrt(), [1.0, 0.0], 40), (1.36, [1.0, 0.1], 45)] {
        let system = pair(second, gaps);
        let trace = |step| balance_exactly(&system, (2.5, 0.3), 12, &[], step);
        do_not_depend_on_steps(trace, at_least);
    }
}

#[test]
fn do_not_depend_on_steps_by_shooting() {
    let system = pair(3f64.sqrt(), [1.0, 0.1]);
    let trace = |step| shoot(&system, (2.5, 0.77), &[], IntegratorChoice::Exact, step);
    do_not_depend_on_steps(trace, 15);
}

/// In full contact the motion is harmonic: it grazes where its amplitude is the mean compression,
///
///     (1 - omega^2)^2 + (2 zeta omega)^2 = (F_a / F_m)^2
#[test]
fn grazing_where_contact_is_first_lost() {
    let (zeta, ratio) = (0.05, 0.6);
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let loads = vec![load(1, 0, 0.5, 0.5 * ratio)];
    let system = System::new(
        one(2.0 * zeta),
        one(1.0),
        one(1.0),
        vec![backlash(1.0)],
        loads,
    )
    .unwrap();
    // The larger root of x^2 - 2 (1 - 2 zeta^2) x + 1 - ratio^2 = 0, x = omega^2.
    let half: f64 = 1.0 - 2.0 * zeta * zeta;
    let expected = (half + (half * half - 1.0 + ratio * ratio).sqrt()).sqrt();
    let range = (2.0, 1.1);
    for branch in [
        balance_exactly(&system, range, 12, &[], 0.1),
        shoot(&system, range, &[], IntegratorChoice::Exact, 0.1),
    ] {
        let first = branch.events.first().expect("contact is lost");
        let breakpoint = EventKind::Grazing {
            connection: 0,
            breakpoint: 1,
        };
        assert_eq!(first.kind, breakpoint);
        assert_eq!(first.breakpoint, Some(1.0));
        let gap = (first.lambda - expected).abs();
        assert!(gap < 1e-8, "{gap:e}");
        assert!(first.bracket.0 <= expected && expected <= first.bracket.1);
    }
}

/// Two equal pairs side by side: every multiplier stands twice, and all that passes, passes together.
#[test]
fn equal_multipliers_that_pass_together() {
    let single = system(&reference("fig11_case1")["system"]);
    let twice = |m: &DMatrix<f64>| {
        let (rows, columns) = m.shape();
        let mut both = DMatrix::zeros(2 * rows, 2 * columns);
        both.view_mut((0, 0), m.shape()).copy_from(m);
        both.view_mut((rows, columns), m.shape()).copy_from(m);
        both
    };
    let loads = [0, 2].map(|first| [load(4, first, 0.5, 0.25), load(4, first + 1, 0.5, 0.0)]);
    let twin = System::new(
        twice(single.damping()),
        twice(single.stiffness()),
        twice(single.element_map()),
        single
            .mounts()
            .iter()
            .chain(single.mounts())
            .cloned()
            .collect(),
        loads.into_iter().flatten().collect(),
    )
    .unwrap();
    let bifurcations = |system: &System| {
        let branch = balance_exactly(system, (2.5, 1.5), 12, &[], 0.1);
        let events = branch
            .events
            .into_iter()
            .filter(|e| e.kind.is_bifurcation());
        events.collect::<Vec<_>>()
    };
    let (one, both) = (bifurcations(&single), bifurcations(&twin));
    assert!(one.iter().any(|e| e.kind == EventKind::PeriodDoubling));
    assert_eq!(one.len(), both.len(), "{both:?}");
    for (one, both) in one.iter().zip(&both) {
        assert_eq!(one.kind, both.kind);
        assert!(one.is_located() && both.is_located());
        let gap = (one.lambda - both.lambda).abs();
        assert!(gap < 1e-8, "{:?}: {gap:e}", one.kind);
    }
}

/// With few samples the path ripples: its parameter turns more than once about a fold.
#[test]
fn a_fold_lies_beyond_its_neighbours() {
    let system = system(&reference("fig11_case1")["system"]);
    let size = GalerkinOptions {
        harmonics: 12,
        samples: 64,
    };
    let branch = balance(&system, (2.5, 0.77), size, &[], 0.1);
    let folds = branch.events.iter().filter(|e| e.kind == EventKind::Fold);
    let folds: Vec<_> = folds.collect();
    assert!(folds.len() >= 4);
    for fold in folds {
        let (low, high) = fold.bracket;
        let is_inside = low < fold.lambda && fold.lambda < high;
        assert!(!is_inside, "{low} {} {high}", fold.lambda);
    }
}

/// Once the work allowed is used up nothing more is begun: events keep the verdict that they have.
#[test]
fn the_flow_stops_where_the_work_allowed_is_used_up() {
    let (system, range) = (pair(3f64.sqrt(), [1.0, 0.1]), (2.5, 1.8));
    let size = GalerkinOptions {
        harmonics: 12,
        samples: GalerkinOptions::default_samples(12, 1),
    };
    let family = || FrequencyFamily::new(system.clone());
    let tried = |most_work: f64| {
        let mut branch = balance_exactly(&system, range, 12, &[], 0.1);
        let series = Galerkin::new(family(), range.0, size);
        let mut series = series
            .and_then(|p| p.with_exact_quadrature(range.0))
            .unwrap();
        let mut flow = Shooting::new(family(), range.0, IntegratorChoice::Exact).unwrap();
        let options = ConfirmOptions {
            spread: ErrorSpread::Some,
            begins_at_crossing: false,
            steps: 20.0,
            weight: 0.25,
            range,
            resolution: trace_options(&system, range, &[], 0.1).resolution,
            newton: NewtonOptions::default(),
            most_work,
            keep_going: &|| true,
        };
        let meter = Meter::new(size.samples);
        let mut recorder = RecordMeasures { meter };
        let confirmed = confirm(&mut series, &mut flow, &mut branch, &mut recorder, &options);
        let is_tried = |e: &&BifurcationEvent| e.verdict != Verdict::NotTried;
        let count = branch.events.iter().filter(is_tried).count();
        (confirmed.unwrap().is_spent, count, branch.events.len())
    };
    let (is_spent, count, all) = tried(f64::INFINITY);
    assert!(!is_spent && count == all && all >= 3, "{count} of {all}");
    let (is_spent, count, _) = tried(1.0);
    assert!(is_spent && count == 0, "{count}");
}
