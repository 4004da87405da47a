//! The path follower on problems without vibration: circles, folds, branch points, corners.

use gearlash::error::SolveError;
use gearlash::solve::continuation::{
    Advance, Continuation, ContinuationOptions, Crossings, PathEnd, PathPoint, Started,
};
use gearlash::solve::newton::{NewtonOptions, NewtonStatus};
use gearlash::solve::residual::{Linearisation, Residual};
use nalgebra::DVector;

/// One equation r(u, lambda) = 0 with its two derivatives.
struct Scalar(fn(f64, f64) -> [f64; 3]);

impl Residual for Scalar {
    fn dim(&self) -> usize {
        1
    }

    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let [r, by_u, by_lambda] = (self.0)(u[0], lambda);
        (
            out.r[0],
            out.dr_du[(0, 0)],
            out.dr_dlambda[0],
            out.magnitude,
        ) = (r, by_u, by_lambda, 1.0);
        Ok(())
    }
}

fn options(from: f64, to: f64) -> ContinuationOptions {
    ContinuationOptions {
        range: (from, to),
        step: 0.02,
        min_step: 1e-8,
        max_step: 0.1,
        max_points: 2000,
        weight: 1.0,
        newton: NewtonOptions::default(),
        crossings: Crossings::Expected,
    }
}

fn follow(problem: &mut Scalar, u: f64, options: ContinuationOptions) -> (Vec<PathPoint>, PathEnd) {
    let (points, end, _) = follow_counting(problem, u, options);
    (points, end)
}

/// Also returns the number of refused steps.
fn follow_counting(
    problem: &mut Scalar,
    u: f64,
    options: ContinuationOptions,
) -> (Vec<PathPoint>, PathEnd, usize) {
    let start = Continuation::start(problem, DVector::from_element(1, u), options).unwrap();
    let Started::Path(mut path) = start else {
        panic!("no start")
    };
    let mut points = vec![path.point().clone()];
    loop {
        match path.advance(problem).unwrap() {
            Advance::Point(point) => points.push(point.clone()),
            Advance::End(end) => return (points, end, path.rejections()),
        }
    }
}

/// lambda = u - u^3 / 3: folds at u = -1 and 1.
fn cubic(u: f64, lambda: f64) -> [f64; 3] {
    [u - u * u * u / 3.0 - lambda, 1.0 - u * u, -1.0]
}

#[test]
fn passes_folds_and_ends_exactly_at_the_range() {
    let (points, end) = follow(&mut Scalar(cubic), -2.5, options(2.708333, -3.0));
    assert_eq!(end, PathEnd::RangeReached);
    let last = points.last().unwrap();
    assert_eq!(last.lambda, -3.0);
    let folds = points
        .windows(2)
        .filter(|w| w[0].tangent_lambda * w[1].tangent_lambda < 0.0)
        .count();
    assert_eq!(folds, 2);
    for p in &points {
        assert!(cubic(p.u[0], p.lambda)[0].abs() < 1e-10);
        let length = p.tangent_u[0].powi(2) + p.tangent_lambda.powi(2);
        assert!((length - 1.0).abs() < 1e-12);
    }
    // A fold is no branch point: the orientation stays.
    assert!(
        points
            .windows(2)
            .all(|w| w[0].orientation == w[1].orientation)
    );
}

#[test]
fn says_that_it_returned_to_the_start() {
    // From the middle sheet towards larger lambda: the path turns at 2/3 and comes back.
    let (points, end) = follow(&mut Scalar(cubic), 0.0, options(0.0, 3.0));
    assert_eq!(end, PathEnd::ReturnedToStart);
    assert_eq!(points.last().unwrap().lambda, 0.0);
    assert!((points.last().unwrap().u[0] - 3.0_f64.sqrt()).abs() < 1e-9);
}

#[test]
fn closes_a_circle() {
    let circle = |u: f64, lambda: f64| [u * u + lambda * lambda - 1.0, 2.0 * u, 2.0 * lambda];
    let mut settings = options(0.0, 5.0);
    settings.range = (0.0, 5.0);
    // The circle leaves the range at its start: lambda falls below 0.
    let (_, end) = follow(&mut Scalar(circle), 1.0, settings);
    assert_eq!(end, PathEnd::ReturnedToStart);
    let shifted = |u: f64, lambda: f64| {
        let x = lambda - 1.5;
        [u * u + x * x - 1.0, 2.0 * u, 2.0 * x]
    };
    let start = DVector::from_element(1, 1.0);
    let mut problem = Scalar(shifted);
    let mut settings = options(1.5, 3.0);
    settings.range = (1.5, 3.0);
    let Started::Path(mut path) = Continuation::start(&mut problem, start, settings).unwrap()
    else {
        panic!()
    };
    let mut ends = Vec::new();
    while let Advance::Point(point) = path.advance(&mut problem).unwrap() {
        ends.push(point.lambda);
    }
    assert_eq!(
        *ends.last().unwrap(),
        1.5,
        "half a circle, back to the start of the range"
    );
}

#[test]
fn notices_a_branch_point() {
    // u (u - lambda + 1) = 0: the branch u = 0 is crossed at lambda = 1.
    let pitchfork = |u: f64, lambda: f64| [u * (u - lambda + 1.0), 2.0 * u - lambda + 1.0, -u];
    let (points, end) = follow(&mut Scalar(pitchfork), 0.0, options(0.0, 2.0));
    assert_eq!(end, PathEnd::RangeReached);
    let changes = points
        .windows(2)
        .filter(|w| w[0].orientation != w[1].orientation)
        .count();
    assert_eq!(changes, 1);
}

#[test]
fn a_path_that_stops_says_why() {
    // sqrt(1 - lambda) - u has no solution beyond lambda = 1, and no fold there.
    let edge = |u: f64, lambda: f64| {
        let root = (1.0 - lambda).sqrt();
        [root - u, -1.0, -0.5 / root]
    };
    let (points, end) = follow(&mut Scalar(edge), 1.0, options(0.0, 2.0));
    assert!(matches!(end, PathEnd::StepTooSmall { .. }), "{end:?}");
    assert!(points.last().unwrap().lambda > 0.99);
    let none = |u: f64, _: f64| [u * u + 1.0, 2.0 * u, 0.0];
    let start = Continuation::start(
        &mut Scalar(none),
        DVector::from_element(1, 1.0),
        options(0.0, 1.0),
    )
    .unwrap();
    let Started::Failed(outcome) = start else {
        panic!()
    };
    assert_ne!(outcome.status, NewtonStatus::Converged);
}

#[test]
fn contradictory_options_are_refused() {
    let mut bad = options(0.0, 1.0);
    bad.step = 1.0;
    let error = Continuation::start(&mut Scalar(cubic), DVector::zeros(1), bad)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("step = 1: must be between min_step and max_step"),
        "{error}"
    );
    assert!(options(1.0, 1.0).validate().is_err());
}

#[test]
fn marks_are_solved_on_both_sides_of_a_fold() {
    let mut problem = Scalar(cubic);
    let start = Continuation::start(
        &mut problem,
        DVector::from_element(1, 0.0),
        options(0.0, 3.0),
    )
    .unwrap();
    let Started::Path(mut path) = start else {
        panic!()
    };
    while let Advance::Point(point) = path.advance(&mut problem).unwrap() {
        if point.tangent_lambda < 0.0 {
            break;
        }
    }
    // The last step passed the fold at (1, 2/3): a value just below is met before and after it.
    let probe = |path: &mut Continuation, problem: &mut Scalar, x: f64| {
        path.at_fraction(problem, x).unwrap().unwrap().lambda
    };
    let (mut top, mut best) = (0.0, f64::NEG_INFINITY);
    for k in 1..100 {
        let lambda = probe(&mut path, &mut problem, 0.01 * f64::from(k));
        if lambda > best {
            (top, best) = (0.01 * f64::from(k), lambda);
        }
    }
    let target = 0.5 * (best + path.origin().lambda.max(path.point().lambda));
    let before = path
        .at_lambda(&mut problem, target, (0.0, top))
        .unwrap()
        .unwrap();
    let after = path
        .at_lambda(&mut problem, target, (top, 1.0))
        .unwrap()
        .unwrap();
    assert_eq!((before.1.lambda, after.1.lambda), (target, target));
    assert!(before.1.u[0] < after.1.u[0] && before.0 < after.0);
}

#[test]
fn leaves_a_corner_at_which_it_turns_back() {
    // lambda = 3 |u - 1|: no step forwards from the left arm reaches the right one, which lies behind its planes.
    let corner = |u: f64, lambda: f64| {
        let x = u - 1.0;
        [3.0 * x.abs() - lambda, 3.0 * x.signum(), -1.0]
    };
    let (points, end, refused) = follow_counting(&mut Scalar(corner), 0.0, options(3.0, -1.0));
    assert_eq!(end, PathEnd::ReturnedToStart);
    // One bisection from 0.1 down to 1e-8.
    assert!(refused < 30, "{refused}");
    let last = points.last().unwrap();
    assert!((last.u[0] - 2.0).abs() < 1e-9, "{}", last.u[0]);
    assert!(
        points
            .windows(2)
            .all(|w| w[0].u[0] < w[1].u[0] && w[0].orientation == w[1].orientation)
    );
    let lowest = points.iter().map(|p| p.lambda).fold(3.0, f64::min);
    assert!(lowest < 1e-7, "{lowest}");
}

#[test]
fn passes_a_corner() {
    // u = 0.6 |lambda - 1|: a turn of 1.08 rad, approached in shorter steps.
    let corner = |u: f64, lambda: f64| {
        let x = lambda - 1.0;
        [u - 0.6 * x.abs(), 1.0, -0.6 * x.signum()]
    };
    let (_, end, refused) = follow_counting(&mut Scalar(corner), 0.6, options(0.0, 2.0));
    assert_eq!(end, PathEnd::RangeReached);
    assert!(refused <= 20, "{refused}");
}

#[test]
fn a_path_that_comes_back_onto_itself_ends() {
    // A line leads onto a circle that it touches; the circle does not lead back to the start.
    let lasso = |u: f64, lambda: f64| {
        let (x, y) = (lambda - 1.5, u - 1.0);
        match x < 0.0 && u < 2e-3 {
            true => [u, 1.0, 0.0],
            false => [1.0 - x * x - y * y, -2.0 * y, -2.0 * x],
        }
    };
    let (points, end) = follow(&mut Scalar(lasso), 0.0, options(0.0, 5.0));
    assert_eq!(end, PathEnd::Looped);
    assert!(points.len() < 150, "{}", points.len());
    let round = points.iter().filter(|p| p.u[0] > 1.9).count();
    assert!(round > 5, "{round}");
}

/// A steep map of u - 0.3 sin(lambda), whose corrector converges from within about 1e-5, and whose derivative by lambda is off by a
/// hundredth, as difference quotients over long unstable periods are.
fn steep(u: f64, lambda: f64) -> [f64; 3] {
    const STEEP: f64 = 1e5;
    let (gap, rise) = (u - 0.3 * lambda.sin(), -0.3 * lambda.cos());
    let slope = STEEP + 2.0 * STEEP * STEEP * gap;
    [
        STEEP * gap + STEEP * STEEP * gap * gap,
        slope,
        1.01 * slope * rise,
    ]
}

#[test]
fn points_tell_where_the_path_leads_if_tangents_are_poor() {
    let (points, end) = follow(&mut Scalar(steep), 0.0, options(0.0, 1.0));
    assert_eq!(end, PathEnd::RangeReached);
    // Along the tangents, off by 2.7e-3, steps would have to stay below 0.004.
    assert!(points.len() < 220, "{}", points.len());
    for p in &points {
        assert!((p.u[0] - 0.3 * p.lambda.sin()).abs() < 1e-12);
    }
}

/// u lambda = 1e-5: two branches that face each other across a gap, far narrower than a step.
#[test]
fn a_path_stays_on_its_own_side_of_a_gap() {
    let hyperbola = |u: f64, lambda: f64| [u * lambda - 1e-5, lambda, u];
    let along = |crossings: Crossings| {
        let settings = ContinuationOptions {
            max_points: 60,
            crossings,
            ..options(0.5, -1.0)
        };
        follow(&mut Scalar(hyperbola), 2e-5, settings).0
    };
    let own = along(Crossings::Exceptional);
    assert!(own.iter().all(|p| p.lambda > 0.0 && p.u[0] > 0.0));
    assert!(own.last().unwrap().u[0] > 0.5, "{own:?}");
    // Where crossings are expected, the gap is taken for one.
    let across = along(Crossings::Expected);
    assert!(across.iter().any(|p| p.lambda < 0.0));
}
