//! Stretches of a branch that its events leave open, taken over from the flow's own branch.
//!
//! The flow's branch is followed from a point at which both methods agree to another one, past everything that is open. Its points
//! and those of the series are matched in order; its events and counts are those of the stretch.

use super::align::align;
use super::chain::ChainItem;
use super::flow::{Care, FlowPoint};
use super::retrace::{Arrival, ArrivalWatch};
use super::{Confirmer, POOR, SAME_ORBIT, Station, difference};
use crate::error::SolveError;
use crate::solve::branch::{Begin, Branch, BranchPoint};
use crate::solve::continuation::{CrossingSide, PathEnd};
use crate::solve::events::{BifurcationEvent, EventKind, Verdict, is_outside};
use crate::solve::family::Family;
use nalgebra::DVector;

/// Points of the series on either side of what is open, beyond which a stretch begins and ends; farther ones are tried where the
/// flow's branch leads elsewhere.
const MARGINS: [usize; 4] = [2, 8, 32, usize::MAX];
/// Steps of the flow's branch to one of the series'.
const FINER: f64 = 4.0;
/// Points at most, over that number, and besides.
const MOST_POINTS: (f64, usize) = (10.0, 200);
/// Distance of the path from its end where it passes beside it, in lengths of its last step.
const BESIDE: f64 = 0.1;
/// Points of the series between an event of its own and the place at which the flow has it.
const NEAR: usize = 4;
/// Difference of the parameter, relative to it, up to which folds of both are one however short the steps are around them.
const SAME_FOLD: f64 = 1e-3;

/// The flow's branch through a stretch.
struct Path {
    /// States with parameters.
    x: Vec<DVector<f64>>,
    points: Vec<BranchPoint>,
    events: Vec<BifurcationEvent>,
    /// Places of the points of the series, in vertices.
    places: Vec<f64>,
}

impl Path {
    /// Place of an event.
    fn place(event: &BifurcationEvent) -> f64 {
        event.after_point as f64 + event.fraction
    }

    /// Unstable multipliers at a place, from the point before and the events in between.
    fn count(&self, place: f64) -> usize {
        let k = (place.floor() as usize).min(self.points.len() - 1);
        let point = &self.points[k];
        let count = point.multipliers.iter().filter(|mu| is_outside(**mu));
        let passed = self
            .events
            .iter()
            .filter(|e| e.after_point == k && Path::place(e) < place);
        let last = passed.filter_map(|e| e.unstable).next_back();
        last.map_or(count.count(), |(_, behind)| behind)
    }

    /// The point of the series before a place, and the share of its step.
    fn step(&self, place: f64) -> (usize, f64) {
        let last = self.places.len() - 2;
        let behind = self.places.partition_point(|p| *p <= place);
        let k = behind.saturating_sub(1).min(last);
        let (from, to) = (self.places[k], self.places[k + 1]);
        let share = (place - from) / (to - from).max(f64::MIN_POSITIVE);
        (k, share.clamp(0.0, 1.0))
    }

    /// Multipliers of the vertex nearest to a place with the same count.
    fn nearest(&self, place: f64) -> FlowPoint {
        let count = self.count(place);
        let counted = |k: &usize| self.count(*k as f64) == count;
        let apart = |k: &usize| (*k as f64 - place).abs();
        let alike = (0..self.points.len()).filter(counted);
        let k = alike.min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let k = k.unwrap_or(place.round() as usize);
        FlowPoint {
            x: self.x[k].clone(),
            multipliers: self.points[k].multipliers.clone(),
            switches: Vec::new(),
            iterations: 0,
            from_singular: f64::NAN,
        }
    }
}

impl<F: Family> Confirmer<'_, F> {
    /// Follows the flow's branch past everything that is left open.
    pub(super) fn follow_open(&mut self) -> Result<(), SolveError> {
        let mut done = 0;
        for open in self.open() {
            if open.1 <= done {
                continue;
            }
            let mut tried = None;
            for margin in MARGINS {
                if !self.goes_on() {
                    return Ok(());
                }
                let stretch = self.around(open, margin);
                if stretch.is_none() || stretch == tried {
                    continue;
                }
                tried = stretch;
                let Some((a, b)) = stretch else { continue };
                if let Some(path) = self.path(a, b)? {
                    self.take_over((a, b), &path)?;
                    done = b;
                    break;
                }
            }
        }
        Ok(())
    }

    /// Steps that hold changes of the count without a cause, events that the flow does not confirm, or points without an orbit.
    fn open(&self) -> Vec<(usize, usize)> {
        let last = self.states.len() - 1;
        let is_explained = |k: usize| self.explained.iter().any(|(a, b)| (*a..*b).contains(&k));
        let mut list = self.contradictions();
        let doubtful = |e: &&BifurcationEvent| match e.kind {
            EventKind::Unresolved => !is_explained(e.after_point),
            EventKind::SlipOnset { .. } => false,
            _ => e.verdict == Verdict::Refuted,
        };
        let events = self.branch.events.iter().filter(doubtful);
        list.extend(events.map(|e| (e.after_point, (e.after_point + 1).min(last))));
        for (k, station) in self.stations.iter().enumerate() {
            if station.as_ref().is_some_and(|s| s.orbit().is_none()) {
                list.push((k.saturating_sub(1), (k + 1).min(last)));
            }
        }
        list.sort_unstable();
        list
    }

    /// The stretch around steps, at whose ends both methods agree.
    fn around(&self, (from, to): (usize, usize), margin: usize) -> Option<(usize, usize)> {
        let last = self.states.len() - 1;
        let first = usize::from(self.options.begins_at_crossing);
        let begin = from.saturating_sub(margin).max(first);
        let end = to.saturating_add(margin).min(last);
        let a = (first..=begin).rev().find(|k| self.is_sure(*k));
        let a = a.or_else(|| (first..from.max(first)).find(|k| self.is_sure(*k)))?;
        let b = (end..=last).find(|k| self.is_sure(*k)).unwrap_or(last);
        (a < b).then_some((a, b))
    }

    /// Whether both methods agree at a point, away from folds.
    fn is_sure(&self, k: usize) -> bool {
        let Some(station) = &self.stations[k] else {
            return false;
        };
        let orbit = station.orbit().filter(|p| p.is_decided());
        station.is_same
            && !station.is_nearest_own
            && orbit.is_some()
            && !self.is_steep(&self.direction(k))
    }

    /// The flow's branch from one point of the series to another; `None` where it does not lead there.
    fn path(&mut self, a: usize, b: usize) -> Result<Option<Path>, SolveError> {
        let orbit = |k: usize| self.stations[k].as_ref().and_then(Station::orbit);
        let Some(from) = orbit(a).cloned() else {
            return Ok(None);
        };
        let is_border = b + 1 == self.states.len();
        let to = orbit(b).filter(|_| self.is_sure(b)).cloned();
        if to.is_none() && !is_border {
            return Ok(None);
        }
        let steps = self.states[a..=b].windows(2);
        let length: f64 = steps.map(|w| self.flow.distance(&w[0], &w[1])).sum();
        let count = (b - a) as f64;
        let most = (MOST_POINTS.0 * FINER * count) as usize + MOST_POINTS.1;
        let options = self.trace_options(length / (count * FINER), most);
        let (from_end, to_end) = self.options.range;
        let ahead = self.direction(a)[from.x.len() - 1] * (to_end - from_end);
        let side = match ahead >= 0.0 {
            true => CrossingSide::Forward,
            false => CrossingSide::Backward,
        };
        let arrival = to.map(|to| Arrival {
            along: self.direction(b),
            to: to.x,
            within: 0.0,
            share: BESIDE,
        });
        let mut watch = ArrivalWatch::new(self.options.weight, from.x.clone(), arrival, None);
        let start = Begin::Inside(from.state(), from.lambda(), side);
        let Some(branch) = self.traced(start, &options, &mut watch)? else {
            return Ok(None);
        };
        let is_there = match branch.end {
            PathEnd::RangeReached | PathEnd::ReturnedToStart => is_border,
            _ => watch.has_arrived,
        };
        Ok(is_there.then(|| self.matched(branch, (a, b))))
    }

    /// The flow's orbit at the parameter of a point, where it is the one of the series.
    fn level(&self, k: usize) -> Option<&FlowPoint> {
        let station = self.stations[k].as_ref();
        let station = station.filter(|s| s.is_same && !s.is_nearest_own);
        station.and_then(|s| s.level.as_ref())
    }

    fn matched(&self, branch: Branch, (a, b): (usize, usize)) -> Path {
        let x = |p: &BranchPoint| p.unknowns.clone().push(p.lambda);
        let vertices: Vec<DVector<f64>> = branch.points.iter().map(x).collect();
        let dot = |p: &DVector<f64>, q: &DVector<f64>| self.flow.dot(p, q);
        let rows: Vec<DVector<f64>> = (a..=b)
            .map(|k| self.level(k).map_or(&self.states[k], |p| &p.x).clone())
            .collect();
        let places = align(&rows, &vertices, &dot);
        Path {
            x: vertices,
            points: branch.points,
            events: branch.events,
            places,
        }
    }

    /// The flow's events and counts take the place of what was known of a stretch.
    fn take_over(&mut self, (a, b): (usize, usize), path: &Path) -> Result<(), SolveError> {
        let is_here = |e: &BifurcationEvent| (a..b).contains(&e.after_point);
        // At an onset of slip the flow has nothing to locate.
        let is_told = |e: &BifurcationEvent| {
            !matches!(e.kind, EventKind::Unresolved | EventKind::SlipOnset { .. })
        };
        let events = &self.branch.events;
        self.located.retain(|l| !is_here(&events[l.event]));
        self.followed
            .retain(|item| item.at < a as f64 || item.at > b as f64);
        let end = path.places[b - a];
        let shown: Vec<&BifurcationEvent> = path
            .events
            .iter()
            .filter(|e| is_told(e) && Path::place(e) <= end)
            .collect();
        let known: Vec<usize> = (0..events.len())
            .filter(|k| is_here(&events[*k]) && is_told(&events[*k]))
            .collect();
        let pairs = self.pairs((&shown, &known), (a, path));
        for k in &known {
            self.branch.events[*k].verdict = Verdict::Refuted;
        }
        for (event, known) in shown.iter().zip(pairs) {
            let (step, fraction) = path.step(Path::place(event));
            self.put(event, known, (a + step, fraction))?;
        }
        for k in a + 1..b {
            self.resettle(k, path.places[k - a], path)?;
        }
        self.explained.push((a, b));
        Ok(())
    }

    /// The known event that each one of the flow's is: of its kind and near, those of the series first, then nearest parameters first.
    fn pairs(
        &self,
        (shown, known): (&[&BifurcationEvent], &[usize]),
        (a, path): (usize, &Path),
    ) -> Vec<Option<usize>> {
        let mut gaps = Vec::new();
        for (i, event) in shown.iter().enumerate() {
            let step = a + path.step(Path::place(event)).0;
            for k in known {
                let other = &self.branch.events[*k];
                let gap = (other.lambda - event.lambda).abs();
                let is_near = other.after_point.abs_diff(step) <= NEAR
                    || event.kind == EventKind::Fold && gap <= SAME_FOLD * event.lambda.abs();
                if other.kind == event.kind && is_near {
                    gaps.push((other.method_lambda.is_nan(), gap, i, *k));
                }
            }
        }
        gaps.sort_by(|p, q| p.0.cmp(&q.0).then(p.1.total_cmp(&q.1)));
        let (mut pairs, mut taken) = (vec![None; shown.len()], Vec::new());
        for (_, _, i, k) in gaps {
            if pairs[i].is_none() && !taken.contains(&k) {
                pairs[i] = Some(k);
                taken.push(k);
            }
        }
        pairs
    }

    /// An event of the flow at its place among the points of the series.
    fn put(
        &mut self,
        event: &BifurcationEvent,
        known: Option<usize>,
        (after_point, fraction): (usize, f64),
    ) -> Result<(), SolveError> {
        if let (true, Some((before, after))) = (event.kind.is_bifurcation(), event.unstable) {
            self.followed.push(ChainItem {
                at: after_point as f64 + fraction,
                before,
                after,
            });
        }
        let verdict = match event.point {
            Some(_) => Verdict::Confirmed,
            None => Verdict::NotTried,
        };
        if let Some(known) = known {
            let known = &mut self.branch.events[known];
            (known.verdict, known.unstable) = (verdict, event.unstable);
            (known.lambda, known.bracket) = (event.lambda, event.bracket);
            (known.after_point, known.fraction) = (after_point, fraction);
            known.multiplicity = event.multiplicity;
            return Ok(());
        }
        let recorded = self.recorded(event)?;
        self.branch.events.push(BifurcationEvent {
            method_lambda: f64::NAN,
            verdict,
            after_point,
            fraction,
            point: None,
            recorded,
            ..event.clone()
        });
        Ok(())
    }

    /// The flow's orbit beside a point of the series: across its own branch, on the arm to which the point belongs.
    fn resettle(&mut self, k: usize, place: f64, path: &Path) -> Result<(), SolveError> {
        let j = (place.floor() as usize).min(path.x.len() - 2);
        let along = &path.x[j + 1] - &path.x[j];
        let guess = &path.x[j] + &along * (place - j as f64);
        let length = self.flow.distance(&path.x[j], &path.x[j + 1]);
        let count = path.count(place);
        if let Some(level) = self.level(k)
            && level.unstable() == count
            && self.flow.distance(&level.x, &guess) <= BESIDE * length
        {
            return Ok(());
        }
        let plane = self.flow.across(guess.clone(), along)?;
        let solved = match plane {
            Some(plane) => self.flow.at(&plane, 0.0, guess.clone(), Care::Rough)?,
            None => None,
        };
        let is_own =
            |p: &FlowPoint| p.unstable() == count && self.flow.distance(&p.x, &guess) <= length;
        let orbit = solved.filter(is_own).unwrap_or_else(|| path.nearest(place));
        let x = &self.states[k];
        let size = self.flow.dot(x, x).sqrt();
        let gap = self.flow.distance(x, &orbit.x) / size;
        let own = &self.branch.points[k].multipliers;
        let multiplier_error = difference(own, &orbit.multipliers);
        let level = self.stations[k].take().filter(|s| s.is_same);
        let level = level.and_then(|s| s.level);
        let level = level.filter(|p| p.unstable() == count);
        self.stations[k] = Some(Station {
            is_same: level.is_some(),
            level,
            nearest: Some(orbit),
            is_nearest_own: true,
            // Its place along the flow's branch is known, however far away that is.
            gap: gap.clamp(POOR, SAME_ORBIT),
            multiplier_error,
        });
        Ok(())
    }
}
