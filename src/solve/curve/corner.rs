//! Corners of a curve of bifurcations, where it meets a grazing and goes on behind it.

use super::CurveKind;
use super::beyond::GrazingSide;
use super::codimension::{self, CornerEnd, CurveEvent};
use super::defining::{Defining, Spot};
use super::end::CurveEnd;
use super::meeting::Meeting;
use super::nature::Codimension;
use super::passing::Counts;
use super::walker::{CurvePoint, CurveWalker, Way, point};
use crate::error::SolveError;
use crate::solve::continuation::{Continuation, PathPoint};

/// Shares of the first step: below the first a step is a sign of a corner, below the second a corner may be near.
const SHORT: (f64, f64) = (2e-3, 5e-2);
/// Distance of an extremum from a breakpoint, in sizes, at which a corner may be near.
const NEAR: f64 = 1e-4;
/// Distance of an extremum from a breakpoint, in sizes, at which a curve that goes on in short steps ends there.
const TOUCHING: f64 = 1e-7;
/// Distance in ranges to a corner that is near.
const AHEAD: f64 = 0.05;
/// Distance of an extremum from its breakpoint, in sizes, at which the end is where the curve has stopped.
const TOUCHED: f64 = 1e-10;
/// Distance of the meeting of a step from its begin, in lengths of the step.
const REACH: f64 = 3.0;
/// Distance, in ranges, of two places that are one: located ones, and others.
const SAME: (f64, f64) = (1e-7, 1e-3);

/// A corner with what is behind it.
struct Corner {
    met: Meeting,
    behind: [PathPoint; 2],
}

impl CurveWalker<'_> {
    /// The way on from the last point of a stretch that has come as near to a grazing as that; `None` where it has not.
    pub(super) fn turn(
        &mut self,
        problem: &mut Defining<'_>,
        (last, passages): (&PathPoint, &Counts),
        near: f64,
    ) -> Result<Option<Way>, SolveError> {
        if matches!(problem.kind, CurveKind::Grazing { .. }) {
            return Ok(None);
        }
        let spot = problem.spot(&last.u, last.lambda);
        let nearest = problem.nearest_touch(&spot)?;
        let Some((gap, connection)) = nearest.filter(|(gap, _)| *gap < near * problem.size) else {
            return Ok(None);
        };
        let end = CurveEnd::MeetsGrazing(connection);
        let Some(met) = problem.meeting(&spot)? else {
            let is_located = gap < TOUCHED * problem.size;
            self.note_meeting(meeting(connection, spot, is_located));
            return Ok(Some(Way::Over(end)));
        };
        if problem.distance(&met, last) > AHEAD {
            self.note_meeting(meeting(connection, met.spot, true));
            return Ok(Some(Way::Over(end)));
        }
        if let Some(corner) = self.corner(problem, &met, passages)? {
            return self.go_round(problem, last, corner).map(Some);
        }
        let over = self.go_to(problem, last, &met)?;
        // The other arm may come from the other side: it ends here, too.
        self.arm.corners.push(met.spot);
        Ok(Some(Way::Over(over.unwrap_or(end))))
    }

    /// The way on where passages of breakpoints have come or gone in the last step.
    pub(super) fn corner_in(
        &mut self,
        problem: &mut Defining<'_>,
        path: &Continuation,
        (events, passages): (&[CurveEvent], &Counts),
    ) -> Result<Option<Way>, SolveError> {
        let met = |e: &CurveEvent| match e.kind {
            Codimension::MeetsGrazing { connection } => Some((e.clone(), connection)),
            _ => None,
        };
        let Some((event, connection)) = events.iter().find_map(met) else {
            return Ok(None);
        };
        let origin = path.origin();
        let [from, to] = [origin, path.point()].map(|p| problem.spot(&p.u, p.lambda));
        for spot in [&event.spot, &from, &to] {
            let Some(met) = problem.meeting_of(spot, Some(connection))? else {
                continue;
            };
            if problem.distance(&met, origin) > REACH * path.chord() {
                continue;
            }
            let Some(corner) = self.corner(problem, &met, passages)? else {
                continue;
            };
            return self.go_round(problem, origin, corner).map(Some);
        }
        Ok(None)
    }

    /// The way on where steps have become short beside a grazing.
    pub(super) fn corner_near(
        &mut self,
        problem: &mut Defining<'_>,
        path: &Continuation,
        passages: &Counts,
    ) -> Result<Option<Way>, SolveError> {
        let (short, step) = (path.chord(), self.options.step.0);
        let is_grazing = matches!(problem.kind, CurveKind::Grazing { .. });
        if is_grazing || short >= SHORT.1 * step || !self.approaches(problem)? {
            return Ok(None);
        }
        let last = path.point();
        if short < SHORT.0 * step
            && let Some(way) = self.turn(problem, (last, passages), TOUCHING)?
        {
            return Ok(Some(way));
        }
        let spot = problem.spot(&last.u, last.lambda);
        let nearest = problem.nearest_touch(&spot)?;
        if nearest.is_none_or(|(gap, _)| gap > NEAR * problem.size) {
            return Ok(None);
        }
        let Some(met) = problem.meeting(&spot)? else {
            return Ok(None);
        };
        let (u, lambda) = problem.way(&met, last);
        let is_ahead = u.dot(&last.tangent_u) + lambda * last.tangent_lambda < 0.0;
        if !is_ahead || problem.distance(&met, last) > AHEAD {
            return Ok(None);
        }
        match self.corner(problem, &met, passages)? {
            Some(corner) => self.go_round(problem, last, corner).map(Some),
            None => Ok(None),
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

    /// What is behind a meeting to which orbits with some passages have come; `None` where nothing is found, or it has been passed.
    fn corner(
        &self,
        problem: &mut Defining<'_>,
        met: &Meeting,
        passages: &Counts,
    ) -> Result<Option<Corner>, SolveError> {
        if self
            .arm
            .corners
            .iter()
            .any(|other| is_same(other, &met.spot))
        {
            return Ok(None);
        }
        let Some(clear) = problem.clear_passages(met)? else {
            return Ok(None);
        };
        let side = match GrazingSide::of(passages, &clear, met.kind) {
            Some(GrazingSide::Clear) => GrazingSide::Touched,
            Some(GrazingSide::Touched) => GrazingSide::Clear,
            None => return Ok(None),
        };
        let behind = problem.behind(met, (side, &clear))?;
        Ok(behind.map(|behind| Corner {
            met: met.clone(),
            behind,
        }))
    }

    /// Follows the curve to a corner and to the first point behind it.
    fn go_round(
        &mut self,
        problem: &mut Defining<'_>,
        last: &PathPoint,
        Corner { met, behind }: Corner,
    ) -> Result<Way, SolveError> {
        if let Some(end) = self.go_to(problem, last, &met)? {
            return Ok(Way::Over(end));
        }
        self.arm.corners.push(met.spot);
        let [from, to] = behind;
        let settings = self.options.of_path(self.arm.points.len());
        let first = self.first.clone();
        let mut path = Continuation::from_step(problem, (from, to), first, settings);
        let events = codimension::beside_corner(problem, &mut path, CornerEnd::Origin)?;
        let items = self.within(problem, &mut path, events)?;
        Ok(match self.note(problem, items)? {
            Some(end) => Way::Over(end),
            None => Way::On(Box::new(path)),
        })
    }

    /// Follows the curve to a meeting; the event that is the last one.
    fn go_to(
        &mut self,
        problem: &mut Defining<'_>,
        last: &PathPoint,
        met: &Meeting,
    ) -> Result<Option<CurveEnd>, SolveError> {
        let lambda = met.spot.p[1];
        let length = problem.distance(met, last);
        if length > 0.0 {
            let back = problem.way(met, last);
            let to = PathPoint {
                tangent_u: -back.0 / length,
                tangent_lambda: -back.1 / length,
                u: problem.unknowns(&met.spot),
                lambda,
                ..last.clone()
            };
            let settings = self.options.of_path(self.arm.points.len());
            let ends = (last.clone(), to);
            let mut path = Continuation::from_step(problem, ends, last.clone(), settings);
            let events = codimension::beside_corner(problem, &mut path, CornerEnd::Point)?;
            let items = self.within(problem, &mut path, events)?;
            if let Some(end) = self.note(problem, items)? {
                return Ok(Some(end));
            }
        }
        let connection = match met.kind {
            CurveKind::Grazing { connection, .. } => connection,
            _ => 0,
        };
        let event = meeting(connection, met.spot.clone(), true);
        let is_known = self.known.iter().any(|other| is_same(other, &met.spot));
        let end = match () {
            () if is_known => Some(CurveEnd::Closed),
            () if self.ends_at(&event) => Some(CurveEnd::Stated(event.kind)),
            () => None,
        };
        if !is_known {
            self.note_meeting(event);
        }
        if let Some(nature) = problem.nature(&met.spot)? {
            self.arm.points.push(CurvePoint {
                criticality: f64::NAN,
                is_singular: true,
                ..point(&met.spot, &nature, self.mark(lambda))
            });
        }
        Ok(end)
    }

    /// Notes a meeting, which may be known, less well, already.
    fn note_meeting(&mut self, event: CurveEvent) {
        let is_known = |(_, other): &&mut (usize, CurveEvent)| {
            let near = match other.is_located && event.is_located {
                true => SAME.0,
                false => SAME.1,
            };
            let gaps = (0..2).map(|k| (other.spot.p[k] - event.spot.p[k]).abs());
            other.kind == event.kind && gaps.fold(0.0, f64::max) < near
        };
        match self.arm.events.iter_mut().find(is_known) {
            Some((_, other)) if other.is_located && !event.is_located => {}
            Some((_, other)) => {
                (other.spot, other.is_located) = (event.spot, event.is_located);
            }
            None => self.arm.events.push((self.arm.points.len(), event)),
        }
    }
}

/// Whether two places are one.
fn is_same(a: &Spot, b: &Spot) -> bool {
    (0..2).all(|k| (a.p[k] - b.p[k]).abs() < SAME.0)
}

/// The event of a meeting.
fn meeting(connection: usize, spot: Spot, is_located: bool) -> CurveEvent {
    CurveEvent {
        kind: Codimension::MeetsGrazing { connection },
        spot,
        fraction: 1.0,
        is_located,
        is_birth: None,
    }
}
