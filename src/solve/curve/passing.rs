//! Places in a step of a curve at which passages of breakpoints come or go: an extremum touches there.

use super::Defining;
use super::codimension::CurveEvent;
use super::defining::Spot;
use super::nature::{Codimension, Nature};
use crate::error::SolveError;
use crate::solve::continuation::Continuation;

/// Passages of every breakpoint: connection, breakpoint, number.
pub(super) type Counts = Vec<(usize, usize, usize)>;

/// Width of a location, in steps.
const WIDTH: f64 = 3e-13;
/// Places of a bracket that are tried one after the other: beside a corner the corrector fails at some of them.
const SHARES: [f64; 4] = [0.5, 0.25, 0.75, 0.0625];
/// Shortenings of a bracket.
const SHORTENINGS: usize = 100;
/// Changes in one step.
const MOST: usize = 8;
/// Distance of a place from the middle of its bracket, in lengths of the bracket.
const BESIDE: f64 = 1.5;

/// A change of the passages inside a step.
struct StepChange {
    low: f64,
    high: f64,
    behind: Counts,
}

/// All changes in the last step of a path, in its order.
pub(super) fn in_step(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    ends: (&Nature, &Nature),
) -> Result<Vec<CurveEvent>, SolveError> {
    let (mut from, to) = (ends.0.passages.counts(), ends.1.passages.counts());
    let (mut begin, mut list) = (0.0, Vec::new());
    while from != to && list.len() < MOST {
        let change = bracketed(problem, path, (begin, &from), &to)?;
        list.extend(event(problem, path, (&change, &from))?);
        (begin, from) = (change.high, change.behind);
    }
    Ok(list)
}

/// The first change behind a fraction at which the passages are known.
fn bracketed(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    (begin, from): (f64, &Counts),
    to: &Counts,
) -> Result<StepChange, SolveError> {
    let mut change = StepChange {
        low: begin,
        high: 1.0,
        behind: to.clone(),
    };
    for _ in 0..SHORTENINGS {
        let width = change.high - change.low;
        if width <= WIDTH {
            break;
        }
        let mut found = None;
        for x in SHARES.map(|share| change.low + share * width) {
            found = counts(problem, path, x)?.map(|counts| (x, counts));
            if found.is_some() {
                break;
            }
        }
        match found {
            None => break,
            Some((x, counts)) if counts == *from => change.low = x,
            Some((x, counts)) => (change.high, change.behind) = (x, counts),
        }
    }
    Ok(change)
}

fn counts(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    fraction: f64,
) -> Result<Option<Counts>, SolveError> {
    let Some(spot) = spot(problem, path, fraction)? else {
        return Ok(None);
    };
    let nature = problem.nature(&spot)?;
    Ok(nature.map(|nature| nature.passages.counts()))
}

fn spot(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    fraction: f64,
) -> Result<Option<Spot>, SolveError> {
    let point = match fraction {
        0.0 => Some(path.origin().clone()),
        1.0 => Some(path.point().clone()),
        fraction => path.at_fraction(problem, fraction)?,
    };
    Ok(point.map(|p| problem.spot(&p.u, p.lambda)))
}

/// The event of a change. Where the corrector does not reach its place, that is found on the grazing curve, or it stays unknown.
fn event(
    problem: &mut Defining<'_>,
    path: &mut Continuation,
    (change, from): (&StepChange, &Counts),
) -> Result<Option<CurveEvent>, SolveError> {
    let Some(mut place) = spot(problem, path, change.low)? else {
        return Ok(None);
    };
    let mut is_located = change.high - change.low <= WIDTH;
    if !is_located && let Some(end) = spot(problem, path, change.high)? {
        let found = [problem.meeting(&place)?, problem.meeting(&end)?];
        let found = found.into_iter().flatten().map(|met| met.spot);
        let mut found = found.filter(|found| is_between(&found.p, (&place.p, &end.p)));
        if let Some(found) = found.next() {
            (place, is_located) = (found, true);
        }
    }
    let changed = |list: &Counts, other: &Counts| {
        let mut fresh = list.iter().filter(|c| !other.contains(c));
        fresh.next().map(|c| c.0)
    };
    let connection = changed(&change.behind, from).or_else(|| changed(from, &change.behind));
    Ok(Some(CurveEvent {
        kind: Codimension::MeetsGrazing {
            connection: connection.unwrap_or(0),
        },
        spot: place,
        fraction: change.low,
        is_located,
        is_birth: None,
    }))
}

/// Whether a place belongs to the bracket between two others.
fn is_between(p: &[f64; 2], (a, b): (&[f64; 2], &[f64; 2])) -> bool {
    let length = (0..2).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
    (0..2).all(|k| (p[k] - 0.5 * (a[k] + b[k])).abs() <= BESIDE * length)
}
