//! Points of codimension 2 in a step of a curve.

use super::defining::Spot;
use super::nature::{Codimension, Nature};
use super::passing;
use super::{CurveKind, Defining};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::continuation::{Continuation, PathPoint};

/// A located point of codimension 2, or a turning point.
#[derive(Debug, Clone)]
pub(crate) struct CurveEvent {
    /// Kind.
    pub kind: Codimension,
    /// The place.
    pub spot: Spot,
    /// Position as a fraction of the step.
    pub fraction: f64,
    /// Whether the place is located; elsewhere `spot` is the last point before the event.
    pub is_located: bool,
    /// Of a fold that turns in the second parameter: whether an isolated branch is born there.
    pub is_birth: Option<bool>,
}

/// The end of a step that is a corner of the curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CornerEnd {
    /// It leads away from the corner.
    Origin,
    /// It leads to the corner.
    Point,
}

/// Width of a location, in steps.
const WIDTH: f64 = 1e-13;
/// Fractions of a step at which tests are made that have no value at one of its ends, or that should have changed their sign.
const INSIDE: [f64; 5] = [0.0625, 0.25, 0.5, 0.75, 0.9375];
/// Value at a root relative to those at the ends of the step.
const PLAIN: f64 = 1e-3;
/// Tangent below which a parameter counts as constant: no turning point.
const STILL: f64 = 1e-7;
/// Share of the way to the ends of a bracket at which a parameter is compared with that of its turning point.
const BESIDE: f64 = 0.3;
/// Change of a parameter, in ranges, that is no error of the corrector.
const RESOLVED: f64 = 1e-9;
/// Distance in steps within which turning points belong to a cusp.
const AT_CUSP: f64 = 1e-3;

/// Locates everything in the last step of a path, with what is known of its ends and the tests expected at the second one, in the order of
/// the path.
pub(super) fn in_step(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    ends: (&Nature, &Nature),
    expected: &[f64],
) -> Result<Vec<CurveEvent>, SolveError> {
    let mut list = passing::in_step(problem, path, ends)?;
    let samples = samples(problem, path, ends, expected)?;
    let [a, b] = [path.origin(), path.point()].map(|point| slopes(problem, point));
    let brackets = [0, 1].map(|k| match is_opposite(a[k], b[k]) {
        true => vec![((0.0, a[k]), (1.0, b[k]))],
        false => Vec::new(),
    });
    smooth(problem, path, (&samples, &brackets), &mut list)?;
    Ok(list)
}

/// The same in a step with a corner at one of its ends, where nothing is known but these: passages come or go at the corner alone, and the
/// tangent there is that of the other side, or of the chord.
pub(super) fn beside_corner(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    corner: CornerEnd,
) -> Result<Vec<CurveEvent>, SolveError> {
    let (mut samples, mut points): (Samples, Vec<(f64, PathPoint)>) = (Vec::new(), Vec::new());
    for x in std::iter::once(0.0).chain(INSIDE).chain([1.0]) {
        let point = match x {
            0.0 => Some(path.origin().clone()),
            1.0 => Some(path.point().clone()),
            x => path.at_fraction(problem, x)?,
        };
        let Some(point) = point else { continue };
        let spot = problem.spot(&point.u, point.lambda);
        let nature = problem.nature(&spot)?;
        samples.extend(nature.map(|n| (x, n.tests)));
        points.push((x, point));
    }
    let mut list = Vec::new();
    if samples.len() > 1 {
        let brackets = brackets_up_to(problem, &points, corner);
        smooth(problem, path, (&samples, &brackets), &mut list)?;
    }
    Ok(list)
}

/// Brackets of turning points between points of a step with a corner, with the slopes at their ends: where a parameter has an extremum among
/// the points, and where its slope changes the sign beside the end that is no corner. Next to the corner slopes deceive, because differences
/// reach across it.
fn brackets_up_to(
    problem: &Defining<'_>,
    points: &[(f64, PathPoint)],
    corner: CornerEnd,
) -> [Vec<Bracket>; 2] {
    let place = problem.first_parameter();
    [0, 1].map(|parameter| {
        let value = |k: usize| [points[k].1.u[place], points[k].1.lambda][parameter];
        let slope = |k: usize| slopes(problem, &points[k].1)[parameter];
        let chord = |k: usize| (value(k + 1) - value(k)) / (points[k + 1].0 - points[k].0);
        let mut list = Vec::new();
        for k in 1..points.len() - 1 {
            let (before, behind) = (chord(k - 1), chord(k));
            if !is_opposite(before, behind) {
                continue;
            }
            list.push(match is_opposite(slope(k), behind) {
                true => ((points[k].0, slope(k)), (points[k + 1].0, behind)),
                false => ((points[k - 1].0, before), (points[k].0, slope(k))),
            });
        }
        let (a, b) = match corner {
            CornerEnd::Origin => (points.len() - 2, points.len() - 1),
            CornerEnd::Point => (0, 1),
        };
        let is_known = |list: &[Bracket]| list.iter().any(|l| l.0.0 == points[a].0);
        if is_opposite(slope(a), slope(b)) && !is_known(&list) {
            list.push(((points[a].0, slope(a)), (points[b].0, slope(b))));
        }
        list
    })
}

/// Two fractions of a step between which a slope vanishes, with its values there.
type Bracket = ((f64, f64), (f64, f64));

/// Slopes of both parameters.
fn slopes(problem: &Defining<'_>, point: &PathPoint) -> [f64; 2] {
    [
        point.tangent_u[problem.first_parameter()],
        point.tangent_lambda,
    ]
}

/// Locates roots of the tests between samples, and turning points, and puts all events into the order of the path.
fn smooth(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    (samples, brackets): (&Samples, &[Vec<Bracket>; 2]),
    list: &mut Vec<CurveEvent>,
) -> Result<(), SolveError> {
    let kinds: Vec<Codimension> = samples[0].1.iter().map(|(kind, _)| *kind).collect();
    for (number, kind) in kinds.into_iter().enumerate() {
        let value = |problem: &mut Defining<'_>, point: &PathPoint| {
            let spot = problem.spot(&point.u, point.lambda);
            let nature = problem.nature(&spot)?;
            Ok(nature.map_or(f64::NAN, |n| n.tests[number].1))
        };
        let known = samples.iter().map(|(x, tests)| (*x, tests[number].1));
        let known: Vec<(f64, f64)> = known.filter(|(_, test)| test.is_finite()).collect();
        for pair in known.windows(2).filter(|w| is_opposite(w[0].1, w[1].1)) {
            let found = locate(problem, path, (pair[0], pair[1]), &value)?;
            list.extend(found.filter(StepRoot::is_plain).map(|e| e.into(kind)));
        }
    }
    list.extend(turnings(problem, path, brackets, list)?);
    list.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
    Ok(())
}

/// Values of the tests at fractions of a step.
type Samples = Vec<(f64, Vec<(Codimension, f64)>)>;

/// The tests at the ends of a step, and inside it where one has no value at an end, because differences do not reach across a switch that
/// comes or goes, or where one was on its way to a change of sign: two roots in one step leave none.
fn samples(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    ends: (&Nature, &Nature),
    expected: &[f64],
) -> Result<Samples, SolveError> {
    let is_open = |nature: &Nature| nature.tests.iter().any(|(_, test)| test.is_nan());
    let both = ends.0.tests.iter().zip(&ends.1.tests);
    let mut both = both.map(|((_, a), (_, b))| (*a, *b)).zip(expected);
    let is_missed = both.any(|((a, b), c)| is_opposite(a, *c) && !is_opposite(a, b));
    let mut list = vec![(0.0, ends.0.tests.clone())];
    if is_open(ends.0) != is_open(ends.1) || is_missed {
        for x in INSIDE {
            let Some(point) = path.at_fraction(problem, x)? else {
                continue;
            };
            let spot = problem.spot(&point.u, point.lambda);
            let nature = problem.nature(&spot)?;
            list.extend(nature.map(|n| (x, n.tests)));
        }
    }
    list.push((1.0, ends.1.tests.clone()));
    Ok(list)
}

/// Turning points; of folds, those of both parameters at one place are a cusp.
fn turnings(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    brackets: &[Vec<Bracket>; 2],
    known: &[CurveEvent],
) -> Result<Vec<CurveEvent>, SolveError> {
    let kinds = [Codimension::TurningFirst, Codimension::TurningSecond];
    let mut list: Vec<CurveEvent> = Vec::new();
    for (parameter, kind) in kinds.into_iter().enumerate() {
        for (a, b) in brackets[parameter].iter().copied() {
            if a.1.abs().max(b.1.abs()) < STILL {
                continue;
            }
            let value = |problem: &mut Defining<'_>, point: &PathPoint| {
                Ok(slopes(problem, point)[parameter])
            };
            let found = locate(problem, path, (a, b), &value)?;
            let Some(found) = found.filter(StepRoot::is_plain) else {
                continue;
            };
            if turns(problem, path, (&found, [a.0, b.0]), parameter)? {
                list.push(found.into(kind));
            }
        }
    }
    let is_fold = problem.kind == CurveKind::Fold;
    let is_cusp = |x: f64| {
        let cusps = known.iter().filter(|e| e.kind == Codimension::Cusp);
        cusps.into_iter().any(|e| (x - e.fraction).abs() < AT_CUSP)
    };
    if let ([a, b], true) = (list.as_mut_slice(), is_fold)
        && (a.fraction - b.fraction).abs() < AT_CUSP
    {
        a.kind = Codimension::Cusp;
        list.truncate(1);
    }
    let has_own = |e: &CurveEvent| is_fold && is_cusp(e.fraction);
    list.retain(|e| !has_own(e));
    for event in &mut list {
        if is_fold && event.kind == Codimension::TurningSecond {
            event.is_birth = problem.is_birth(&event.spot)?;
        }
    }
    Ok(list)
}

/// Whether a parameter is on one side of its value at a place everywhere around it in a bracket: tangents alone deceive next to a grazing, where
/// differences reach across it, and so do points further away, which may lie on what looks like a curve there.
fn turns(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    (found, bracket): (&StepRoot, [f64; 2]),
    parameter: usize,
) -> Result<bool, SolveError> {
    let mut rises = [0.0; 2];
    for (rise, end) in rises.iter_mut().zip(bracket) {
        let x = found.fraction + BESIDE * (end - found.fraction);
        let Some(point) = path.at_fraction(problem, x)? else {
            return Ok(true);
        };
        let spot = problem.spot(&point.u, point.lambda);
        *rise = spot.p[parameter] - found.spot.p[parameter];
    }
    let is_told = rises.iter().all(|rise| rise.abs() > RESOLVED);
    Ok(!is_told || rises[0] * rises[1] > 0.0)
}

/// Whether two known numbers have opposite signs.
fn is_opposite(a: f64, b: f64) -> bool {
    a * b < 0.0
}

/// A root in a step.
struct StepRoot {
    fraction: f64,
    spot: Spot,
    value: f64,
    largest: f64,
}

impl StepRoot {
    /// Whether a sign change is a root: a pole, or a jump where a passage comes or goes, changes signs too.
    fn is_plain(&self) -> bool {
        self.value.abs() <= PLAIN * self.largest
    }

    fn into(self, kind: Codimension) -> CurveEvent {
        CurveEvent {
            kind,
            spot: self.spot,
            fraction: self.fraction,
            is_located: true,
            is_birth: None,
        }
    }
}

type TestFunction<'v> = &'v dyn Fn(&mut Defining<'_>, &PathPoint) -> Result<f64, SolveError>;

fn locate(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    (a, b): ((f64, f64), (f64, f64)),
    value: TestFunction<'_>,
) -> Result<Option<StepRoot>, SolveError> {
    let mut at = |x: f64| -> Result<f64, Option<SolveError>> {
        let point = path.at_fraction(problem, x).map_err(Some)?.ok_or(None)?;
        let value = value(problem, &point).map_err(Some)?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(None)
        }
    };
    let root = match roots::bracketed(&mut at, a, b, WIDTH) {
        Ok(found) => found.root,
        Err(Some(error)) => return Err(error),
        Err(None) => return Ok(None),
    };
    let Ok(last) = at(root) else {
        return Ok(None);
    };
    let Some(point) = path.at_fraction(problem, root)? else {
        return Ok(None);
    };
    Ok(Some(StepRoot {
        fraction: root,
        spot: problem.spot(&point.u, point.lambda),
        value: last,
        largest: a.1.abs().max(b.1.abs()),
    }))
}
