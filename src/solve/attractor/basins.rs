//! At which attractor each of many starts ends.
//!
//! Attractors are found from the starts themselves. A start ends at a known one as soon as it lies in its trap (an ellipsoid from
//! which nothing returns); where the attractor is not a periodic orbit, as soon as a whole record lies among the points of the known
//! one. What ends at none is judged like any other record and, if there is evidence, is an attractor of its own.

use super::cycle::Cycle;
use super::map::Map;
use super::trap::Trap;
use super::{Label, LabelOptions, Lengths, MapSize, RecordStop, attractor};
use crate::solve::integrate::IntegrationEnd;

/// Limits of the motion from a start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Patience {
    /// Periods before the search for new attractors.
    pub transient: usize,
    /// Periods of a record.
    pub periods: usize,
    /// Periods at most.
    pub limit: usize,
    /// Settings of labels.
    pub labels: LabelOptions,
}

/// An attractor at which starts end.
#[derive(Debug, Clone)]
pub(crate) struct SettledMotion {
    /// Kind.
    pub label: Label,
    /// Its points in the order of time: all of a periodic orbit, a record of the others.
    pub points: Vec<f64>,
    size: usize,
    cycle: Option<Cycle>,
    trap: Option<Trap>,
    /// Distance within which a point belongs to the record of an attractor that is not a periodic orbit.
    reach: f64,
    scale: Vec<f64>,
}

/// End of a start.
#[derive(Debug, Clone)]
pub(crate) enum Fate {
    /// At a known attractor.
    Known(usize),
    /// At one that is not among the known ones.
    New(Box<SettledMotion>),
    /// Nowhere within the limit, or there is not enough evidence.
    Undecided,
    /// The motion could not be followed.
    Stopped(RecordStop),
}

/// Points kept of an attractor that is not a periodic orbit.
const KEPT: usize = 2000;
/// Share of the distances between the halves of a record that are usual: the rest are rarely visited places.
const USUAL: f64 = 0.98;
/// Share of the points of a record that must lie among those of a known attractor: rarely visited places are missing in short records, but
/// the points of another attractor are none of its own.
const AMONG: f64 = 0.8;
/// How far apart the points of two records of one attractor may lie, in distances between the halves of one record.
const APART: f64 = 3.0;
/// Largest distance between points of the same orbit, relative to the scale.
const SAME: f64 = 1e-6;

/// Follows a start until it ends somewhere, from the state after a number of periods of its transient. `state` ends as the last one.
pub(crate) fn fate(
    map: &mut dyn Map,
    (state, mut gone): (&mut [f64], usize),
    known: &[SettledMotion],
    patience: Patience,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Fate {
    let mut block = patience.transient - gone;
    loop {
        for _ in 0..block {
            if let Some(k) = trapped(known, state) {
                return Fate::Known(k);
            }
            gone += 1;
            if let Some(stop) = step(map, state, (gone, &mut *keep_going)) {
                return Fate::Stopped(stop);
            }
        }
        let is_last = 2 * (gone + patience.periods) > patience.limit;
        let length = match is_last {
            true => patience.limit.saturating_sub(gone).max(patience.periods),
            false => patience.periods,
        };
        match judged(map, state, known, (length, patience, is_last), keep_going) {
            Fate::Undecided if !is_last => block = gone + patience.periods,
            fate => return fate,
        }
        // The record was looked at on a copy of the state: it is part of what follows.
        block = block.min(patience.limit - gone);
    }
}

/// Number of the known attractor in whose trap a state lies.
pub(crate) fn trapped(known: &[SettledMotion], state: &[f64]) -> Option<usize> {
    known.iter().position(|a| a.traps(state))
}

/// One period; why it could not be followed.
fn step(
    map: &mut dyn Map,
    state: &mut [f64],
    (period, keep_going): (usize, &mut dyn FnMut(usize) -> bool),
) -> Option<RecordStop> {
    if !keep_going(period) {
        return Some(RecordStop::Interrupted);
    }
    match map.advance(state) {
        IntegrationEnd::Reached if state.iter().all(|x| x.is_finite()) => None,
        IntegrationEnd::Reached => Some(RecordStop::Failed(IntegrationEnd::Diverged, period)),
        end => Some(RecordStop::of(end, period)),
    }
}

/// What a record from a state says; a periodic orbit always, the rest where the record is the last one.
fn judged(
    map: &mut dyn Map,
    state: &[f64],
    known: &[SettledMotion],
    (length, patience, is_last): (usize, Patience, bool),
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Fate {
    if let Some(fate) = among(map, state, known, patience.periods, keep_going) {
        return fate;
    }
    let mut end = state.to_vec();
    let size = MapSize {
        transient: 0,
        periods: length,
        exponents: Lengths::wanted(map.has_variation()),
    };
    let labels = LabelOptions {
        extend: 1,
        ..patience.labels
    };
    let found = attractor(map, &mut end, size, labels, keep_going);
    if let Some(stop) = found.record.stop {
        return Fate::Stopped(stop);
    }
    let settled = match (found.label, found.cycle) {
        (Label::Undecided, _) => return Fate::Undecided,
        (Label::Period(_), Some(cycle)) => SettledMotion::orbit(map, cycle),
        (label, _) if is_last || matches!(label, Label::Period(_)) => {
            SettledMotion::record(map.size(), label, &found.record.points)
        }
        _ => return Fate::Undecided,
    };
    match known.iter().position(|other| other.is_same(&settled)) {
        Some(k) => Fate::Known(k),
        None => Fate::New(Box::new(settled)),
    }
}

/// The known attractor among whose points a record lies, if it is not a periodic orbit.
fn among(
    map: &mut dyn Map,
    state: &[f64],
    known: &[SettledMotion],
    periods: usize,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Option<Fate> {
    if known.iter().all(|a| a.cycle.is_some()) {
        return None;
    }
    let mut end = state.to_vec();
    let mut points = Vec::with_capacity(periods * end.len());
    for k in 1..=periods {
        if let Some(stop) = step(map, &mut end, (k, &mut *keep_going)) {
            return Some(Fate::Stopped(stop));
        }
        points.extend_from_slice(&end);
    }
    let of = |a: &SettledMotion| a.cycle.is_none() && a.surrounds(&points) >= AMONG;
    known.iter().position(of).map(Fate::Known)
}

impl SettledMotion {
    /// A periodic orbit, from its smallest point on.
    fn orbit(map: &mut dyn Map, cycle: Cycle) -> SettledMotion {
        let size = map.size();
        let cycle = cycle.beginning_smallest(map);
        SettledMotion {
            label: Label::Period(cycle.period),
            points: cycle.points.clone(),
            size,
            trap: Trap::around(map, &cycle),
            reach: SAME,
            scale: scale(&cycle.points, size),
            cycle: Some(cycle),
        }
    }

    /// Something else, as a record shows it.
    fn record(size: usize, label: Label, points: &[f64]) -> SettledMotion {
        let count = points.len() / size;
        let period = match label {
            Label::Period(n) => n,
            _ => count.min(KEPT),
        };
        let points = &points[(count - period) * size..];
        let mut settled = SettledMotion {
            label,
            points: points.to_vec(),
            size,
            cycle: None,
            trap: None,
            reach: SAME,
            scale: scale(points, size),
        };
        if !matches!(label, Label::Period(_)) {
            // Every other point against the rest.
            let odd = points.chunks_exact(size).skip(1).step_by(2);
            let even: Vec<f64> = (points.chunks_exact(size).step_by(2).flatten())
                .copied()
                .collect();
            let mut gaps: Vec<f64> = odd.map(|p| settled.nearest(&even, p)).collect();
            gaps.sort_by(f64::total_cmp);
            let rank = (gaps.len() as f64 * USUAL) as usize;
            settled.reach = APART * gaps.get(rank).or(gaps.last()).copied().unwrap_or(0.0);
        }
        settled
    }

    /// Whether a state cannot leave it any more.
    pub(crate) fn traps(&self, state: &[f64]) -> bool {
        self.trap.as_ref().is_some_and(|trap| trap.holds(state))
    }

    /// The share of points that lie near its own.
    fn surrounds(&self, points: &[f64]) -> f64 {
        let count = points.len() / self.size;
        let near = points.chunks_exact(self.size);
        let near = near.filter(|p| self.nearest(&self.points, p) <= self.reach);
        near.count() as f64 / count.max(1) as f64
    }

    /// Distance of a point from the nearest of others, in the scale of the attractor.
    fn nearest(&self, others: &[f64], point: &[f64]) -> f64 {
        let gap = |other: &[f64]| {
            let parts = other.iter().zip(point).zip(&self.scale);
            parts.fold(0.0_f64, |m, ((a, b), s)| m.max((a - b).abs() / s))
        };
        let gaps = others.chunks_exact(self.size).map(gap);
        gaps.fold(f64::INFINITY, f64::min)
    }

    /// Whether two are one.
    pub(crate) fn is_same(&self, other: &SettledMotion) -> bool {
        match (self.label, other.label) {
            (Label::Period(a), Label::Period(b)) => a == b && self.surrounds(&other.points) == 1.0,
            (Label::Period(_), _) | (_, Label::Period(_)) => false,
            _ => self.surrounds(&other.points) >= AMONG && other.surrounds(&self.points) >= AMONG,
        }
    }

    /// Period and points of a periodic orbit.
    pub fn cycle(&self) -> Option<&Cycle> {
        self.cycle.as_ref()
    }
}

/// Largest modulus of every coordinate, at least a thousandth of the largest of all.
fn scale(points: &[f64], size: usize) -> Vec<f64> {
    let mut scale = vec![0.0_f64; size];
    for point in points.chunks_exact(size) {
        for (s, x) in scale.iter_mut().zip(point) {
            *s = s.max(x.abs());
        }
    }
    let largest = scale.iter().fold(f64::MIN_POSITIVE, |m, s| m.max(*s));
    scale.iter().map(|s| s.max(1e-3 * largest)).collect()
}
