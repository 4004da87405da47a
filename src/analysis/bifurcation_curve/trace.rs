//! Curves followed both ways from their starts.

use super::plane::Axes;
use super::{BifurcationCurve, start};
use crate::analysis::Setting;
use crate::error::{Error, SolveError};
use crate::interrupt;
use crate::solve::continuation::{CrossingSide, PathEnd};
use crate::solve::curve::{
    Arm, CurveEnd, CurveEvent, CurveKind, CurveOptions, CurvePoint, Defining, Spot, follow,
};
use rayon::prelude::*;

/// A piece of a curve inside the ranges.
#[derive(Debug, Clone)]
pub(super) struct CurvePiece {
    pub points: Vec<CurvePoint>,
    /// Of the points that were located again: whether that led to the same place.
    pub confirmed: Vec<Option<bool>>,
    /// Events with the number of points before them.
    pub events: Vec<(usize, CurveEvent)>,
}

/// Outcome of a start.
pub(super) struct TracedCurve {
    pub kind: Option<CurveKind>,
    pub pieces: Vec<CurvePiece>,
    /// Ends of the two arms: backwards and forwards.
    pub ends: Vec<CurveEnd>,
    /// Reason why there is no curve.
    pub failure: Option<String>,
    pub integrator: &'static str,
}

/// All curves, in the order of their starts.
pub(super) fn all(
    keys: &BifurcationCurve,
    setting: &Setting<'_>,
    axes: &Axes,
    marks: &[f64],
) -> Result<Vec<TracedCurve>, Error> {
    let flag = interrupt::current();
    let starts = keys.start.list();
    let one = |(key, begin): (String, &super::CurveStart)| {
        flag.scope(
            || match start::first(keys, setting, (axes, marks), (&key, begin)) {
                Ok(Ok(first)) => both_ways(keys, setting, (axes, marks), first),
                Ok(Err(reason)) => Ok(lost(format!("{key}: {reason}"))),
                Err(Error::Solve(SolveError::Interrupted)) => {
                    Ok(lost(format!("{key}: interrupted")))
                }
                Err(error) => Err(error),
            },
        )
    };
    starts.into_par_iter().map(one).collect()
}

fn lost(reason: String) -> TracedCurve {
    TracedCurve {
        kind: None,
        pieces: Vec::new(),
        ends: Vec::new(),
        failure: Some(reason),
        integrator: "",
    }
}

fn both_ways(
    keys: &BifurcationCurve,
    setting: &Setting<'_>,
    (axes, marks): (&Axes, &[f64]),
    (mut problem, spot): (Defining<'_>, Spot),
) -> Result<TracedCurve, Error> {
    let options = CurveOptions {
        step: (keys.step, keys.max_step),
        min_step: keys.min_step,
        max_points: keys.max_points,
        marks: marks.iter().map(|m| axes.list[1].share(*m)).collect(),
        margin: keys.margin,
        until: keys.until.iter().map(|until| until.word()).collect(),
    };
    let mut keep_going = |points: usize| {
        let words = format!("{points} points");
        setting.control.progress(setting.name, 0.0, &words);
        !setting.control.is_interrupted()
    };
    let (mut arms, mut is_stopped) = (Vec::<Arm>::new(), false);
    for side in [CrossingSide::Backward, CrossingSide::Forward] {
        let known = arms.first().map_or(Vec::new(), |arm| arm.corners.clone());
        let way = (side, known.as_slice());
        let arm = match follow(&mut problem, &spot, way, &options, &mut keep_going) {
            Ok(Some(arm)) => arm,
            Ok(None) => return Ok(lost("the first point cannot be corrected".into())),
            // The other arm is kept.
            Err(SolveError::Interrupted) => {
                is_stopped = true;
                break;
            }
            Err(error) => return Err(Error::Solve(error)),
        };
        let is_closed = arm.end == CurveEnd::Closed;
        arms.push(arm);
        if is_closed {
            break;
        }
    }
    if arms.is_empty() {
        return Ok(lost("interrupted".into()));
    }
    let mut ends: Vec<CurveEnd> = arms.iter().map(|arm| arm.end.clone()).collect();
    ends.extend(is_stopped.then_some(CurveEnd::Path(PathEnd::Interrupted)));
    let kind = Some(problem.kind);
    let mut pieces = pieces(arms);
    grazings(&mut problem, &mut pieces, &mut keep_going)?;
    if let Some(stride) = keys.confirm_stride() {
        confirm(&mut problem, &mut pieces, stride, &mut keep_going)?;
    }
    let integrator = problem.into_shots().integrator();
    Ok(TracedCurve {
        kind,
        pieces,
        ends,
        failure: None,
        integrator,
    })
}

/// Types of the points of a grazing curve.
fn grazings(
    problem: &mut Defining<'_>,
    pieces: &mut [CurvePiece],
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Result<(), Error> {
    for piece in pieces {
        let count = piece.points.len();
        for point in &mut piece.points {
            if !keep_going(count) {
                return Ok(());
            }
            point.grazing = match problem.grazing(&point.spot) {
                Err(SolveError::Interrupted) => return Ok(()),
                found => found.map_err(Error::Solve)?,
            };
        }
    }
    Ok(())
}

/// Difference, in ranges, between the two places of a confirmed point.
const SAME: f64 = 1e-7;

/// Relocates points at regular intervals, along a branch in the first parameter.
fn confirm(
    problem: &mut Defining<'_>,
    pieces: &mut [CurvePiece],
    stride: usize,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Result<(), Error> {
    for piece in pieces {
        let count = piece.points.len();
        for (k, point) in piece
            .points
            .iter()
            .enumerate()
            .step_by(stride)
            .filter(|(_, p)| !p.is_singular)
        {
            if !keep_going(count) {
                return Ok(());
            }
            let found = match problem.relocated(&point.spot) {
                Err(SolveError::Interrupted) => return Ok(()),
                found => found.map_err(Error::Solve)?,
            };
            piece.confirmed[k] = found.map(|share| (share - point.spot.p[0]).abs() < SAME);
        }
    }
    Ok(())
}

/// Both arms as one curve, cut where it leaves the ranges.
fn pieces(mut arms: Vec<Arm>) -> Vec<CurvePiece> {
    let forward = (arms.len() == 2).then(|| arms.pop()).flatten();
    let Some(mut backward) = arms.pop() else {
        return Vec::new();
    };
    let count = backward.points.len();
    if forward.is_some() {
        backward.points.reverse();
        for (place, event) in &mut backward.events {
            *place = count - *place;
            event.fraction = 1.0 - event.fraction;
        }
        backward.events.reverse();
    }
    let mut whole = CurvePiece {
        points: backward.points,
        confirmed: Vec::new(),
        events: backward.events,
    };
    if let Some(arm) = forward {
        whole.points.extend(arm.points.into_iter().skip(1));
        let later = arm
            .events
            .into_iter()
            .map(|(k, event)| (k + count - 1, event));
        whole.events.extend(later);
    }
    cut(whole)
}

fn cut(whole: CurvePiece) -> Vec<CurvePiece> {
    let mut pieces: Vec<CurvePiece> = Vec::new();
    let mut events = whole.events.into_iter().peekable();
    let mut is_open = false;
    for (k, point) in whole.points.into_iter().enumerate() {
        // Events before this point belong to the piece that leads to it, or to the one that begins with it.
        let is_inside = point.is_inside();
        if is_inside && !is_open {
            pieces.push(CurvePiece {
                points: Vec::new(),
                confirmed: Vec::new(),
                events: Vec::new(),
            });
            is_open = true;
        }
        while let Some((_, event)) = events.next_if(|(place, _)| *place <= k) {
            keep(&mut pieces, is_open, event);
        }
        if !is_inside {
            is_open = false;
            continue;
        }
        if let Some(piece) = pieces.last_mut() {
            piece.points.push(point);
            piece.confirmed.push(None);
        }
    }
    for (_, event) in events {
        keep(&mut pieces, is_open, event);
    }
    pieces.retain(|piece| !piece.points.is_empty());
    pieces
}

fn keep(pieces: &mut [CurvePiece], is_open: bool, event: CurveEvent) {
    let is_inside = event.spot.p.iter().all(|x| (0.0..=1.0).contains(x));
    if let Some(piece) = pieces.last_mut().filter(|_| is_open && is_inside) {
        piece.events.push((piece.points.len(), event));
    }
}
