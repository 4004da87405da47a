//! A curve followed one way from a first point.

use super::CurveKind;
use super::chord::{Chord, reverses};
use super::codimension::{self, CurveEvent};
use super::defining::{Defining, Spot};
use super::end::CurveEnd;
use super::nature::Nature;
use super::passing::Counts;
use super::walker::{Arm, CurveOptions, CurveWalker, Way, point};
use crate::error::SolveError;
use crate::solve::continuation::{
    Advance, Continuation, CrossingSide, PathEnd, PathPoint, Started,
};
use nalgebra::DVector;

/// Distance of an extremum from a breakpoint, in sizes of the state, at which a curve that has ended ends there.
const TOUCHED: f64 = 1e-3;
/// Unfolding of a branch point, in sizes, above which its orbit does not close: far above rounding.
const UNFOLDED: f64 = 1e-10;

/// Follows a curve one way, up to a corner that the other arm has passed; `keep_going` is asked before every step. `None` where the first
/// point cannot be corrected.
///
/// # Errors
/// Contradictory options, or errors of the problem.
pub(crate) fn follow(
    problem: &mut Defining<'_>,
    start: &Spot,
    (side, known): (CrossingSide, &[Spot]),
    options: &CurveOptions,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Result<Option<Arm>, SolveError> {
    problem.follow_borders(start)?;
    let Some(mut path) = begun(problem, start, side, options)? else {
        return Ok(None);
    };
    let mut walker = CurveWalker {
        options,
        arm: Arm {
            points: Vec::new(),
            events: Vec::new(),
            corners: Vec::new(),
            end: CurveEnd::Path(PathEnd::MaxPoints),
        },
        first: path.point().clone(),
        known,
    };
    let end = loop {
        match walker.walk(problem, &mut path, keep_going) {
            Ok(Way::On(next)) => path = next,
            Ok(Way::Over(end)) => break end,
            Err(SolveError::NoSystem { reason }) => match walker.arm.points.last() {
                Some(last) if !last.is_inside() => break CurveEnd::LeftRange,
                _ => break CurveEnd::NoModel(reason),
            },
            Err(SolveError::Interrupted) => break CurveEnd::Path(PathEnd::Interrupted),
            Err(error) => return Err(error),
        }
    };
    walker.arm.end = end;
    walker.arm.forget_first_mark();
    Ok(Some(walker.arm))
}

/// A path at a first point, at its second parameter or, where the curve leads straight across that, at its first one.
fn begun(
    problem: &mut Defining<'_>,
    start: &Spot,
    side: CrossingSide,
    options: &CurveOptions,
) -> Result<Option<Box<Continuation>>, SolveError> {
    let (begin, settings) = ((problem.unknowns(start), start.p[1]), options.of_path(0));
    let started = Continuation::start_at(problem, begin.clone(), side, settings)?;
    if let Started::Path(path) = started {
        return Ok(Some(path));
    }
    let mut along = DVector::zeros(begin.0.len());
    along[problem.first_parameter()] = match side {
        CrossingSide::Forward => 1.0,
        CrossingSide::Backward => -1.0,
    };
    Ok(
        match Continuation::start_across(problem, begin, (along, 0.0), settings)? {
            Started::Path(path) => Some(path),
            Started::Failed(_) => None,
        },
    )
}

impl CurveWalker<'_> {
    fn walk(
        &mut self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        keep_going: &mut dyn FnMut(usize) -> bool,
    ) -> Result<Way, SolveError> {
        let first = path.point().clone();
        let spot = problem.spot(&first.u, first.lambda);
        problem.follow_borders(&spot)?;
        let Some(mut nature) = problem.nature(&spot)? else {
            return Ok(Way::Over(CurveEnd::Path(PathEnd::Unbounded)));
        };
        if is_unfolded(problem, &spot) {
            return Ok(Way::Over(CurveEnd::Unfolded));
        }
        let mark = self.mark(first.lambda);
        self.arm.points.push(point(&spot, &nature, mark));
        let mut slopes: Vec<f64> = Vec::new();
        loop {
            if !keep_going(self.arm.points.len()) {
                return Ok(Way::Over(CurveEnd::Path(PathEnd::Interrupted)));
            }
            problem.missing = None;
            let behind = Chord::of(path);
            let end = match path.advance(problem)? {
                Advance::Point(_) => None,
                Advance::End(end) => Some(end),
            };
            let passages = nature.passages.counts();
            if let Some(end) = end {
                return self.lost(problem, end, (path.point(), &passages));
            }
            if reverses(&behind, path)
                && let Some(way) = self.turn(problem, (path.origin(), &passages), TOUCHED)?
            {
                return Ok(way);
            }
            let last = path.point().clone();
            let spot = problem.spot(&last.u, last.lambda);
            if is_unfolded(problem, &spot) {
                return Ok(Way::Over(CurveEnd::Unfolded));
            }
            let Some(next) = problem.nature(&spot)? else {
                return Ok(Way::Over(CurveEnd::Path(PathEnd::Unbounded)));
            };
            let length = path.chord();
            let tests = nature.tests.iter().zip(&slopes);
            let expected: Vec<f64> = tests.map(|((_, a), slope)| a + slope * length).collect();
            let events = codimension::in_step(problem, path, (&nature, &next), &expected)?;
            let both = nature.tests.iter().zip(&next.tests);
            slopes = both.map(|((_, a), (_, b))| (b - a) / length).collect();
            if let Some(way) = self.corner_in(problem, path, (&events, &passages))? {
                return Ok(way);
            }
            let is_over = self.step(problem, path, events, (&next, &spot))?;
            if let Some(end) = is_over {
                return Ok(Way::Over(end));
            }
            if let Some(way) = self.corner_near(problem, path, &next.passages.counts())? {
                return Ok(way);
            }
            problem.follow_borders(&spot)?;
            // Seen with the borders of the next step.
            nature = problem.nature(&spot)?.unwrap_or(next);
        }
    }

    /// What becomes of a curve whose path has ended.
    fn lost(
        &mut self,
        problem: &mut Defining<'_>,
        end: PathEnd,
        (last, passages): (&PathPoint, &Counts),
    ) -> Result<Way, SolveError> {
        let is_lost = matches!(
            end,
            PathEnd::StepTooSmall { .. } | PathEnd::Creeping | PathEnd::Looped
        );
        let missing = problem.missing.take().filter(|_| is_lost);
        if is_lost && let Some(way) = self.turn(problem, (last, passages), TOUCHED)? {
            return Ok(way);
        }
        let is_outside = self.arm.points.last().is_some_and(|p| !p.is_inside());
        Ok(Way::Over(match missing {
            _ if is_lost && is_outside => CurveEnd::LeftRange,
            Some(reason) => CurveEnd::NoModel(reason),
            None => ended(end),
        }))
    }

    /// Notes what a step brought; why it was the last one.
    fn step(
        &mut self,
        problem: &mut Defining<'_>,
        path: &mut Continuation,
        events: Vec<CurveEvent>,
        (nature, spot): (&Nature, &Spot),
    ) -> Result<Option<CurveEnd>, SolveError> {
        let items = self.within(problem, path, events)?;
        if let Some(end) = self.note(problem, items)? {
            return Ok(Some(end));
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
}

/// Whether the orbit of a branch point does not close: what is found there is the point of an unfolding.
fn is_unfolded(problem: &Defining<'_>, spot: &Spot) -> bool {
    problem.kind == CurveKind::BranchPoint && spot.extra.abs() > UNFOLDED
}

fn ended(end: PathEnd) -> CurveEnd {
    match end {
        PathEnd::RangeReached | PathEnd::ReturnedToStart => CurveEnd::LeftRange,
        PathEnd::Closed => CurveEnd::Closed,
        end => CurveEnd::Path(end),
    }
}
