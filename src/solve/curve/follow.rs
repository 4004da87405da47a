//! A curve followed one way from a first point.

use super::CurveKind;
use super::chord::{Chord, reverses};
use super::codimension::{self, CurveEvent};
use super::defining::{Defining, Spot};
use super::end::CurveEnd;
use super::grazing::Grazing;
use super::nature::{Codimension, Nature};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::continuation::{
    Advance, Continuation, ContinuationOptions, CrossingSide, PathEnd, PathPoint, Started,
};
use crate::solve::newton::NewtonOptions;

/// Settings.
#[derive(Debug, Clone)]
pub(crate) struct CurveOptions {
    /// First and largest step, in ranges of the parameters and sizes of the state.
    pub step: (f64, f64),
    /// Smallest step.
    pub min_step: f64,
    /// Limit of points per branch.
    pub max_points: usize,
    /// Words of the events at which a curve ends.
    pub until: Vec<&'static str>,
    /// Shares of the second parameter that are solved exactly at every passage.
    pub marks: Vec<f64>,
    /// Distance beyond the ranges over which a curve is followed, because it may return; in ranges.
    pub margin: f64,
}

/// A point of a curve.
#[derive(Debug, Clone)]
pub(crate) struct CurvePoint {
    /// The place.
    pub spot: Spot,
    /// Angle of the critical multiplier; the phase of a touch.
    pub theta: f64,
    /// Coefficient of the normal form; NaN where it is not known.
    pub criticality: f64,
    /// Number of the mark that it was solved at.
    pub mark: Option<usize>,
    /// Type of a grazing, where requested.
    pub grazing: Option<Grazing>,
}

/// A part of a curve, one way from its start, points and events in the order of the path.
#[derive(Debug, Clone)]
pub struct Arm {
    /// Points; the first one is the start.
    pub(crate) points: Vec<CurvePoint>,
    /// Events, each with the number of points before it.
    pub(crate) events: Vec<(usize, CurveEvent)>,
    /// Reason of the end.
    pub(crate) end: CurveEnd,
}

/// Corrector: the exact flow is good to 1e-14, the differences to 1e-9.
pub(super) const NEWTON: NewtonOptions = NewtonOptions {
    tolerance: 2e-13,
    step_tolerance: 1e-10,
    max_iterations: 16,
    min_damping: 1.0 / 64.0,
};
/// Distance, in ranges, from a border within which a point lies on it.
const ON_BORDER: f64 = 1e-9;
/// Share of the first step below which a step is a sign of a corner.
const SHORT: f64 = 2e-3;
/// Distance of an extremum from a breakpoint, in sizes of the state, at which a curve ends there: while it goes on, and where it has ended.
const TOUCHING: (f64, f64) = (1e-7, 1e-3);
/// The same at which the end is where the curve has stopped.
const TOUCHED: f64 = 1e-10;
/// Unfolding of a branch point, in sizes, above which its orbit does not close: far above rounding.
const UNFOLDED: f64 = 1e-10;
/// Width of a location, in steps.
const WIDTH: f64 = 1e-13;

/// What a step brings, with its fraction.
enum Item {
    Point(CurvePoint),
    Event(CurveEvent),
}

/// Follows a curve one way; `keep_going` is asked before every step. `None` where the first point cannot be corrected.
///
/// # Errors
/// Contradictory options, or errors of the problem.
pub(crate) fn follow(
    problem: &mut Defining<'_>,
    start: &Spot,
    side: CrossingSide,
    options: &CurveOptions,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Result<Option<Arm>, SolveError> {
    problem.follow_borders(start)?;
    let settings = ContinuationOptions {
        range: (-options.margin, 1.0 + options.margin),
        step: options.step.0,
        min_step: options.min_step,
        max_step: options.step.1,
        max_points: options.max_points,
        weight: 1.0,
        newton: NEWTON,
    };
    let begin = (problem.unknowns(start), start.p[1]);
    let mut path = match Continuation::start_at(problem, begin, side, settings)? {
        Started::Path(path) => path,
        Started::Failed(_) => return Ok(None),
    };
    let mut walker = Walker {
        options,
        arm: Arm {
            points: Vec::new(),
            events: Vec::new(),
            end: CurveEnd::Path(PathEnd::MaxPoints),
        },
    };
    let end = match walker.walk(problem, &mut path, keep_going) {
        Err(SolveError::NoSystem { reason }) => match walker.arm.points.last() {
            Some(last) if !last.is_inside() => CurveEnd::LeftRange,
            _ => CurveEnd::NoModel(reason),
        },
        Err(SolveError::Interrupted) => CurveEnd::Path(PathEnd::Interrupted),
        end => end?,
    };
    walker.arm.end = end;
    Ok(Some(walker.arm))
}

struct Walker<'a> {
    options: &'a CurveOptions,
    arm: Arm,
}

impl Walker<'_> {
    fn walk(
        &mut self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        keep_going: &mut dyn FnMut(usize) -> bool,
    ) -> Result<CurveEnd, SolveError> {
        let first = path.point().clone();
        let spot = problem.spot(&first.u, first.lambda);
        problem.follow_borders(&spot)?;
        let Some(mut nature) = problem.nature(&spot)? else {
            return Ok(CurveEnd::Path(PathEnd::Unbounded));
        };
        if is_unfolded(problem, &spot) {
            return Ok(CurveEnd::Unfolded);
        }
        let mark = self.mark(first.lambda);
        self.arm.points.push(point(&spot, &nature, mark));
        let mut slopes: Vec<f64> = Vec::new();
        loop {
            if !keep_going(self.arm.points.len()) {
                return Ok(CurveEnd::Path(PathEnd::Interrupted));
            }
            problem.missing = None;
            let behind = Chord::of(path);
            let end = match path.advance(problem)? {
                Advance::Point(_) => None,
                Advance::End(end) => Some(end),
            };
            if let Some(end) = end {
                let is_lost = matches!(
                    end,
                    PathEnd::StepTooSmall { .. } | PathEnd::Creeping | PathEnd::Looped
                );
                let touch = match is_lost {
                    true => self.touch(problem, TOUCHING.1)?,
                    false => None,
                };
                let is_outside = self.arm.points.last().is_some_and(|p| !p.is_inside());
                let missing = problem.missing.take().filter(|_| is_lost);
                return Ok(match (touch, missing) {
                    (Some(touch), _) => touch,
                    (None, _) if is_lost && is_outside => CurveEnd::LeftRange,
                    (None, Some(reason)) => CurveEnd::NoModel(reason),
                    (None, None) => ended(end),
                });
            }
            if reverses(&behind, path)
                && let Some(end) = self.touch(problem, TOUCHING.1)?
            {
                return Ok(end);
            }
            let last = path.point().clone();
            let spot = problem.spot(&last.u, last.lambda);
            if is_unfolded(problem, &spot) {
                return Ok(CurveEnd::Unfolded);
            }
            let Some(next) = problem.nature(&spot)? else {
                return Ok(CurveEnd::Path(PathEnd::Unbounded));
            };
            let length = path.chord();
            let tests = nature.tests.iter().zip(&slopes);
            let expected: Vec<f64> = tests.map(|((_, a), slope)| a + slope * length).collect();
            let events = codimension::in_step(problem, path, (&nature, &next), &expected)?;
            let both = nature.tests.iter().zip(&next.tests);
            slopes = both.map(|((_, a), (_, b))| (b - a) / length).collect();
            let is_over = self.step(problem, path, events, (&next, &spot))?;
            if let Some(end) = is_over {
                return Ok(end);
            }
            if path.chord() < SHORT * self.options.step.0
                && self.approaches(problem)?
                && let Some(end) = self.touch(problem, TOUCHING.0)?
            {
                return Ok(end);
            }
            problem.follow_borders(&spot)?;
            // Seen with the borders of the next step.
            nature = problem.nature(&spot)?.unwrap_or(next);
        }
    }

    /// Whether the last point is nearer to a touching than the first one: a curve that begins at its end leaves that.
    fn approaches(&self, problem: &mut Defining<'_>) -> Result<bool, SolveError> {
        let [first, .., last] = self.arm.points.as_slice() else {
            return Ok(true);
        };
        let mut gap = |point: &CurvePoint| {
            let nearest = problem.nearest_touch(&point.spot)?;
            Ok::<f64, SolveError>(nearest.map_or(f64::INFINITY, |(gap, _)| gap))
        };
        Ok(gap(last)? < gap(first)?)
    }

    /// The end of a curve of bifurcations at a grazing, where its last point is that near to one; with the event.
    fn touch(
        &mut self,
        problem: &mut Defining<'_>,
        near: f64,
    ) -> Result<Option<CurveEnd>, SolveError> {
        let last = self.arm.points.last().map(|p| p.spot.clone());
        let Some(spot) = last.filter(|_| !matches!(problem.kind, CurveKind::Grazing { .. })) else {
            return Ok(None);
        };
        let nearest = problem.nearest_touch(&spot)?;
        let Some((gap, connection)) = nearest.filter(|(gap, _)| *gap < near * problem.size) else {
            return Ok(None);
        };
        let kind = Codimension::MeetsGrazing { connection };
        let met = problem.meeting(&spot)?;
        let is_located = met.is_some() || gap < TOUCHED * problem.size;
        let spot = met.unwrap_or(spot);
        let is_known = |(_, event): &&mut (usize, CurveEvent)| {
            let gaps = event.spot.p.iter().zip(&spot.p).map(|(a, b)| (a - b).abs());
            event.kind == kind && gaps.fold(0.0, f64::max) < 1e-3
        };
        match self.arm.events.iter_mut().find(is_known) {
            Some((_, event)) if event.is_located && !is_located => {}
            Some((_, event)) => (event.spot, event.is_located) = (spot, is_located),
            None => {
                let event = CurveEvent {
                    kind,
                    spot,
                    fraction: 1.0,
                    is_located,
                    is_birth: None,
                };
                self.arm.events.push((self.arm.points.len(), event));
            }
        }
        Ok(Some(CurveEnd::MeetsGrazing(connection)))
    }

    /// Notes what a step brought; why it was the last one.
    fn step(
        &mut self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        events: Vec<CurveEvent>,
        (nature, spot): (&Nature, &Spot),
    ) -> Result<Option<CurveEnd>, SolveError> {
        let mut turns: Vec<f64> = (events.iter())
            .filter(|e| matches!(e.kind, Codimension::TurningSecond | Codimension::Cusp))
            .map(|e| e.fraction)
            .collect();
        turns.insert(0, 0.0);
        turns.push(1.0);
        let mut items: Vec<(f64, Item)> = Vec::new();
        for arc in turns.windows(2) {
            self.marks_in(problem, path, (arc[0], arc[1]), &mut items)?;
        }
        self.first_borders(problem, path, &mut items)?;
        items.extend(events.into_iter().map(|e| (e.fraction, Item::Event(e))));
        items.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, item) in items {
            match item {
                Item::Point(point) => self.arm.points.push(point),
                Item::Event(event) => {
                    let number = self.arm.points.len();
                    let resonance = resonance(problem.kind, event.kind);
                    let is_stated = self.ends_at(&event);
                    let kind = event.kind;
                    self.arm.events.push((number, event));
                    if let Some(n) = resonance {
                        return Ok(Some(CurveEnd::Resonance(n)));
                    }
                    if is_stated {
                        return Ok(Some(CurveEnd::Stated(kind)));
                    }
                }
            }
        }
        let last = self.arm.points.last().map(|p| p.spot.p);
        if last != Some(spot.p) {
            let mark = self.mark(spot.p[1]);
            self.arm.points.push(point(spot, nature, mark));
        }
        let margin = self.options.margin;
        let is_beyond = |x: f64| !(-margin..=1.0 + margin).contains(&x);
        Ok(is_beyond(spot.p[0]).then_some(CurveEnd::LeftRange))
    }

    /// Whether the curve is to end at an event inside the ranges.
    fn ends_at(&self, event: &CurveEvent) -> bool {
        let is_inside = event.spot.p.iter().all(|x| (0.0..=1.0).contains(x));
        event.is_located && is_inside && self.options.until.contains(&event.kind.word())
    }

    /// Marks and borders of the second parameter between two fractions between which it does not turn.
    fn marks_in(
        &self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        (low, high): (f64, f64),
        items: &mut Vec<(f64, Item)>,
    ) -> Result<(), SolveError> {
        let mut end = |x: f64| match x {
            0.0 => Ok(Some(path.origin().lambda)),
            1.0 => Ok(Some(path.point().lambda)),
            x => Ok(path.at_fraction(problem, x)?.map(|p| p.lambda)),
        };
        let (Some(a), Some(b)) = (end(low)?, end(high)?) else {
            return Ok(());
        };
        let borders = [(0.0, None), (1.0, None)];
        let marks = self.options.marks.iter().enumerate();
        let marks = marks.map(|(k, share)| (*share, Some(k)));
        for (target, mark) in marks.chain(borders) {
            let is_passed = (a - target) * (b - target) < 0.0;
            let is_new = items.iter().all(|(_, item)| match item {
                Item::Point(p) => p.spot.p[1] != target,
                Item::Event(_) => true,
            });
            if !is_passed || (mark.is_none() && !is_new) {
                continue;
            }
            if let Some((fraction, found)) = path.at_lambda(problem, target, (low, high))? {
                let at = at(problem, &found, mark)?;
                items.extend(at.map(|point| (fraction, Item::Point(point))));
            }
        }
        Ok(())
    }

    /// Points on the borders of the first parameter.
    fn first_borders(
        &self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        items: &mut Vec<(f64, Item)>,
    ) -> Result<(), SolveError> {
        let place = problem.first_parameter();
        for border in [0.0, 1.0] {
            let (a, b) = (
                path.origin().u[place] - border,
                path.point().u[place] - border,
            );
            let is_passed = a * b < 0.0;
            if !is_passed {
                continue;
            }
            let value = |x: f64| {
                let point = path.at_fraction(problem, x).map_err(Some)?.ok_or(None)?;
                Ok(point.u[place] - border)
            };
            let root = match roots::bracketed(value, (0.0, a), (1.0, b), WIDTH) {
                Ok(found) => found.root,
                Err(Some(error)) => return Err(error),
                Err(None) => continue,
            };
            if let Some(found) = path.at_fraction(problem, root)? {
                let at = at(problem, &found, None)?;
                items.extend(at.map(|point| (root, Item::Point(point))));
            }
        }
        Ok(())
    }

    fn mark(&self, share: f64) -> Option<usize> {
        self.options.marks.iter().position(|mark| *mark == share)
    }
}

/// Whether the orbit of a branch point does not close: what is found there is the point of an unfolding.
fn is_unfolded(problem: &Defining<'_>, spot: &Spot) -> bool {
    problem.kind == CurveKind::BranchPoint && spot.extra.abs() > UNFOLDED
}

fn point(spot: &Spot, nature: &Nature, mark: Option<usize>) -> CurvePoint {
    CurvePoint {
        spot: spot.clone(),
        theta: nature.theta,
        criticality: nature.criticality,
        mark,
        grazing: None,
    }
}

/// A point of the path with its data.
fn at(
    problem: &mut Defining<'_>,
    found: &PathPoint,
    mark: Option<usize>,
) -> Result<Option<CurvePoint>, SolveError> {
    let spot = problem.spot(&found.u, found.lambda);
    let nature = problem.nature(&spot)?;
    Ok(nature.map(|nature| point(&spot, &nature, mark)))
}

fn ended(end: PathEnd) -> CurveEnd {
    match end {
        PathEnd::RangeReached | PathEnd::ReturnedToStart => CurveEnd::LeftRange,
        PathEnd::Closed => CurveEnd::Closed,
        end => CurveEnd::Path(end),
    }
}

/// The resonance at which a Neimark-Sacker curve ends.
fn resonance(kind: CurveKind, event: Codimension) -> Option<u8> {
    match (kind, event) {
        (CurveKind::NeimarkSacker, Codimension::Resonance(n)) if n < 3 => Some(n),
        _ => None,
    }
}

impl CurvePoint {
    /// Whether it lies in the ranges.
    pub fn is_inside(&self) -> bool {
        let is_inside = |x: &f64| (-ON_BORDER..=1.0 + ON_BORDER).contains(x);
        self.spot.p.iter().all(is_inside)
    }
}
