//! A curve on its way: its settings, and what has been found of it.

use super::CurveKind;
use super::codimension::CurveEvent;
use super::defining::{Defining, Spot};
use super::end::CurveEnd;
use super::grazing::Grazing;
use super::nature::{Codimension, Nature};
use crate::error::SolveError;
use crate::solve::continuation::{Continuation, ContinuationOptions, Crossings, PathPoint};
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
    /// Whether a branch in one parameter does not locate it: the curve has a corner here, at a grazing, or ends at a resonance.
    pub is_singular: bool,
}

/// A part of a curve, one way from its start, points and events in the order of the path.
#[derive(Debug, Clone)]
pub struct Arm {
    /// Points; the first one is the start.
    pub(crate) points: Vec<CurvePoint>,
    /// Events, each with the number of points before it.
    pub(crate) events: Vec<(usize, CurveEvent)>,
    /// Corners that were passed, and the one at which the curve ended.
    pub(crate) corners: Vec<Spot>,
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
/// Settings of paths of which only the planes across them are used.
pub(super) const PATH: ContinuationOptions = ContinuationOptions {
    range: (-2.0, 3.0),
    step: 1e-5,
    min_step: 1e-5,
    max_step: 1.0,
    max_points: 2,
    weight: 1.0,
    newton: NEWTON,
    crossings: Crossings::Exceptional,
};
/// Distance, in ranges, from a border within which a point lies on it.
const ON_BORDER: f64 = 1e-9;
/// Distance, in ranges, of a first point that is met again, and points among which that happens.
const AGAIN: f64 = 1e-7;
const LAST: usize = 24;

/// What a step brings, with its fraction.
pub(super) enum CurveItem {
    Point(CurvePoint),
    Event(CurveEvent),
}

/// How a stretch of a curve is over.
pub(super) enum Way {
    /// The curve ends.
    Over(CurveEnd),
    /// It goes on, with a step that leads away from a corner.
    On(Box<Continuation>),
}

impl CurveOptions {
    /// Settings of a path; `points`: those that the curve has already.
    pub(super) fn of_path(&self, points: usize) -> ContinuationOptions {
        ContinuationOptions {
            range: (-self.margin, 1.0 + self.margin),
            step: self.step.0,
            min_step: self.min_step,
            max_step: self.step.1,
            max_points: self.max_points.saturating_sub(points).max(2),
            weight: 1.0,
            newton: NEWTON,
            crossings: Crossings::Exceptional,
        }
    }
}

impl Arm {
    /// A curve that closes passes its first point again: the mark there is solved once.
    pub(super) fn forget_first_mark(&mut self) {
        let [first, rest @ ..] = self.points.as_mut_slice() else {
            return;
        };
        if self.end != CurveEnd::Closed || first.mark.is_none() {
            return;
        }
        let near = |p: &CurvePoint| (p.spot.p[0] - first.spot.p[0]).abs() < AGAIN;
        let again = rest.iter_mut().rev().take(LAST);
        for point in again.filter(|p| p.mark == first.mark && near(p)) {
            point.mark = None;
        }
    }
}

/// A curve on its way.
pub(super) struct CurveWalker<'a> {
    pub options: &'a CurveOptions,
    pub arm: Arm,
    /// First point of the path.
    pub first: PathPoint,
    /// Corners of the other arm.
    pub known: &'a [Spot],
}

impl CurveWalker<'_> {
    /// Notes points and events; the event that is the last one, which is a point too.
    pub(super) fn note(
        &mut self,
        problem: &mut Defining<'_>,
        items: Vec<CurveItem>,
    ) -> Result<Option<CurveEnd>, SolveError> {
        for item in items {
            let event = match item {
                CurveItem::Point(point) => {
                    self.arm.points.push(point);
                    continue;
                }
                CurveItem::Event(event) => event,
            };
            let number = self.arm.points.len();
            let end = match resonance(problem.kind, event.kind) {
                Some(n) => Some(CurveEnd::Resonance(n)),
                None => self.ends_at(&event).then_some(CurveEnd::Stated(event.kind)),
            };
            if end.is_some() {
                self.arm.points.extend(last(problem, &event)?);
            }
            self.arm.events.push((number, event));
            if end.is_some() {
                return Ok(end);
            }
        }
        Ok(None)
    }

    /// Whether the curve is to end at an event inside the ranges.
    pub(super) fn ends_at(&self, event: &CurveEvent) -> bool {
        let is_inside = event.spot.p.iter().all(|x| (0.0..=1.0).contains(x));
        event.is_located && is_inside && self.options.until.contains(&event.kind.word())
    }

    pub(super) fn mark(&self, share: f64) -> Option<usize> {
        self.options.marks.iter().position(|mark| *mark == share)
    }
}

pub(super) fn point(spot: &Spot, nature: &Nature, mark: Option<usize>) -> CurvePoint {
    CurvePoint {
        spot: spot.clone(),
        theta: nature.theta,
        criticality: nature.criticality,
        mark,
        grazing: None,
        is_singular: false,
    }
}

/// The point at the event that ends a curve. At a resonance there is no normal form of the curve's own kind.
fn last(problem: &mut Defining<'_>, event: &CurveEvent) -> Result<Option<CurvePoint>, SolveError> {
    let nature = problem.nature(&event.spot)?;
    let point = nature.map(|nature| point(&event.spot, &nature, None));
    Ok(
        point.map(|point| match resonance(problem.kind, event.kind) {
            None => point,
            Some(_) => CurvePoint {
                criticality: f64::NAN,
                is_singular: true,
                ..point
            },
        }),
    )
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
