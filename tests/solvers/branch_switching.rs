//! Other branches from the crossings of a known one: twice the period at a period doubling, both arms of a pitchfork.

use crate::common::{
    MEASURES, RecordMeasures, balance, balance_exactly, load, reference, shoot, system,
    trace_options,
};
use gearlash::element::Cubic;
use gearlash::postprocess::measures::Meter;
use gearlash::solve::branch::{self, Begin, Branch};
use gearlash::solve::continuation::{CrossingSide, Heading, PathEnd, PathPoint};
use gearlash::solve::events::EventKind;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::solve::place::Place;
use gearlash::solve::residual::PeriodicResidual;
use gearlash::solve::shooting::Shooting;
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;

const RANGE: (f64, f64) = (2.5, 1.3);
const HARMONICS: usize = 24;

/// Located events of a kind, in the order of the branch.
fn located(branch: &Branch, kind: EventKind) -> Vec<PathPoint> {
    let of_kind = branch.events.iter().filter(|e| e.kind == kind);
    of_kind.filter_map(|e| e.point.clone()).collect()
}

/// The branch that leaves a crossing, with the places of all known ones.
fn leave(
    problem: &mut dyn PeriodicResidual,
    crossing: &PathPoint,
    side: CrossingSide,
    known: Vec<Place>,
    (range, marks): ((f64, f64), &[f64]),
) -> Branch {
    let lambda = crossing.lambda;
    let base = problem.system_at(lambda).unwrap().clone();
    let mut options = trace_options(&base, range, marks, 0.1);
    options.known = Some(known);
    let meter = Meter::new(2048);
    let begin = Begin::Crossing(Box::new(crossing.clone()), (side, Heading::ONLY));
    branch::trace(problem, begin, &options, &mut RecordMeasures { meter })
        .unwrap()
        .unwrap()
}

/// The doubled branch from the first period doubling of figure 11, and the places of all of them.
fn doubled(
    primary: &Branch,
    single: &mut dyn PeriodicResidual,
    double: &mut dyn PeriodicResidual,
    marks: &[f64],
) -> (Branch, PathPoint) {
    let crossings = located(primary, EventKind::PeriodDoubling);
    assert_eq!(crossings.len(), 4);
    let place = |p: &PathPoint| Place::of(single, &p.u, p.lambda).unwrap();
    let known: Vec<Place> = crossings.iter().map(place).collect();
    let mut first = crossings[0].clone();
    first.u = double.in_doubled_period(&first.u);
    first.tangent_u = double.in_doubled_period(&first.tangent_u);
    let branch = leave(double, &first, CrossingSide::Forward, known, (RANGE, marks));
    // It returns onto the primary branch at the second one.
    assert_eq!(branch.end, PathEnd::Joined { known: Some(1) });
    (branch, crossings[0].clone())
}

/// The multipliers over two periods are the squares of those over one, and the first point is the event.
fn begins_at(branch: &Branch, crossing: &PathPoint, single: &mut dyn PeriodicResidual) {
    let first = &branch.points[0];
    assert_eq!(first.lambda, crossing.lambda);
    let squares = single.multipliers(&crossing.u, crossing.lambda).unwrap();
    for square in squares.iter().map(|mu| mu * mu) {
        let gaps = first.multipliers.iter().map(|mu| (mu - square).norm());
        let gap = gaps.fold(f64::INFINITY, f64::min);
        assert!(gap < 1e-9, "{square}: {gap:e}");
    }
}

#[test]
fn doubled_branch_by_galerkin_and_by_shooting() {
    let one = system(&reference("fig11_case1")["system"]);
    let mut two = one.clone();
    two.set_subharmonic(2);
    let marks = [1.85, 1.75, 1.65, 1.55, 1.45];

    let size = |nu: usize| GalerkinOptions {
        harmonics: HARMONICS,
        samples: 1024 * nu,
    };
    let galerkin = |system: &System, nu: usize| {
        let family = FrequencyFamily::new(system.clone());
        let problem = Galerkin::new(family, RANGE.0, size(nu)).unwrap();
        problem.with_exact_quadrature(RANGE.0).unwrap()
    };
    let (mut single, mut double) = (galerkin(&one, 1), galerkin(&two, 2));
    let primary = balance_exactly(&one, RANGE, HARMONICS, &[], 0.1);
    let (balanced, crossing) = doubled(&primary, &mut single, &mut double, &marks);
    begins_at(&balanced, &crossing, &mut single);
    // Harmonics of the response frequency that are odd are of half order: exactly none at the event, many behind it.
    let half_orders = |u: &[f64]| {
        let blocks = u.chunks_exact(4 * HARMONICS + 1);
        let odd = blocks.flat_map(|b| {
            (1..b.len())
                .filter(|k| k.div_ceil(2) % 2 == 1)
                .map(|k| b[k])
        });
        odd.fold(0.0_f64, |largest, x| largest.max(x.abs()))
    };
    assert_eq!(half_orders(balanced.points[0].unknowns.as_slice()), 0.0);
    assert!(half_orders(balanced.points[20].unknowns.as_slice()) > 1e-2);

    let shooting = |system: &System| {
        let family = FrequencyFamily::new(system.clone());
        Shooting::new(family, RANGE.0, IntegratorChoice::Exact).unwrap()
    };
    let (mut single, mut double) = (shooting(&one), shooting(&two));
    let primary = shoot(&one, RANGE, &[], IntegratorChoice::Exact, 0.1);
    let (shot, crossing) = doubled(&primary, &mut single, &mut double, &marks);
    begins_at(&shot, &crossing, &mut single);

    let mut compared = 0;
    for mark in marks {
        let at_mark = |branch: &Branch| -> Vec<[f64; 2]> {
            let points = branch.points.iter();
            let points = points.filter(|p| p.is_mark && (p.lambda - mark).abs() < 1e-12);
            points
                .map(|p| [p.recorded[1], p.recorded[MEASURES + 1]])
                .collect()
        };
        let (galerkin, shooting) = (at_mark(&balanced), at_mark(&shot));
        assert_eq!(galerkin.len(), shooting.len(), "solutions at {mark}");
        for (g, s) in galerkin.iter().zip(&shooting) {
            for e in 0..2 {
                // The truncation of the series: figure 11's own solutions are good to 1e-5 with this many harmonics.
                assert!((g[e] / s[e] - 1.0).abs() < 1e-4, "{mark}: {g:?} {s:?}");
            }
            compared += 1;
        }
    }
    assert!(compared >= marks.len());
}

/// q'' + 0.1 q' + q + q^3 = 3 cos(omega T): the motion with q(tau + pi) = -q(tau) loses its symmetry between two pitchforks.
fn symmetric() -> System {
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let mounts = vec![Mount::new(Box::new(Cubic { cubic: 1.0 }))];
    System::new(
        one(0.1),
        one(1.0),
        one(1.0),
        mounts,
        vec![load(1, 0, 0.0, 3.0)],
    )
    .unwrap()
}

#[test]
fn both_arms_of_a_pitchfork_are_mirror_images() {
    let (system, range, mark) = (symmetric(), (0.3, 0.6), 0.48);
    let size = GalerkinOptions {
        harmonics: 12,
        samples: 1024,
    };
    let primary = balance(&system, range, size, &[], 0.1);
    let crossings = located(&primary, EventKind::BranchPoint);
    assert_eq!(crossings.len(), 2);
    let family = FrequencyFamily::new(system.clone());
    let mut problem = Galerkin::new(family, range.0, size).unwrap();
    let place = |p: &PathPoint| Place::of(&mut problem, &p.u, p.lambda).unwrap();
    let known: Vec<Place> = crossings.iter().map(place).collect();
    let arms = [CrossingSide::Forward, CrossingSide::Backward].map(|side| {
        let arm = leave(
            &mut problem,
            &crossings[0],
            side,
            known.clone(),
            (range, &[mark]),
        );
        assert_eq!(arm.end, PathEnd::Joined { known: Some(1) }, "{side:?}");
        let solved: Vec<_> = arm.points.into_iter().filter(|p| p.is_mark).collect();
        assert_eq!(solved.len(), 1);
        solved[0].unknowns.clone()
    });
    // q(tau + pi) = -q(tau) keeps harmonics of odd order and turns the mean and those of even order round.
    for (k, (forward, backward)) in arms[0].iter().zip(&arms[1]).enumerate() {
        let sign = if k.div_ceil(2) % 2 == 1 { 1.0 } else { -1.0 };
        let gap = (forward - sign * backward).abs();
        assert!(gap < 1e-8, "coefficient {k}: {gap:e}");
    }
    assert!(arms[0][0].abs() > 1e-2, "mean {}", arms[0][0]);
}
