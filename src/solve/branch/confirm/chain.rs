//! The number of unstable multipliers along a branch, as the flow counts it, against the events.

use super::flow::FlowPoint;
use super::{Branch, Confirmer, Stability, Station};
use crate::error::SolveError;
use crate::solve::events::{BifurcationEvent, EventKind, Verdict};
use crate::solve::family::Family;
use nalgebra::DVector;

/// Steps on either side in which the place of an event is sought.
const BESIDE: usize = 3;
/// Points of one interval that are taken through the flow to narrow a change of the count down.
const MOST: usize = 64;

/// A place of the branch at which the flow counted: points, and bifurcations with two counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ChainItem {
    /// Number of the point before it and the share of the step behind that.
    pub at: f64,
    /// Unstable multipliers just before.
    pub before: usize,
    /// Unstable multipliers just after.
    pub after: usize,
}

/// A confirmed event.
#[derive(Debug, Clone)]
pub(super) struct Located {
    /// Number among the events.
    pub event: usize,
    /// State and parameter on the flow's branch.
    pub x: DVector<f64>,
}

impl<F: Family> Confirmer<'_, F> {
    /// Step of the branch that holds a place, and the share of the step before it; sought beside a step.
    pub(super) fn position(&self, x: &DVector<f64>, near: usize) -> (usize, f64) {
        let last = self.states.len().saturating_sub(2);
        let steps = near.saturating_sub(BESIDE)..=(near + BESIDE).min(last);
        let mut best = (f64::INFINITY, near.min(last), 0.0);
        for k in steps {
            let (from, to) = (self.place(k), self.place(k + 1));
            let along = to - from;
            let length = self.flow.dot(&along, &along);
            let share = self.flow.dot(&(x - from), &along) / length.max(f64::MIN_POSITIVE);
            let share = share.clamp(0.0, 1.0);
            let gap = self.flow.distance(x, &(from + &along * share));
            if gap < best.0 {
                best = (gap, k, share);
            }
        }
        (best.1, best.2)
    }

    /// Looks where the counts contradict the events, and follows the flow's branch there; where no cause is found, an event says
    /// so.
    pub(super) fn explain(&mut self) -> Result<(), SolveError> {
        self.settle();
        for (a, b) in self.contradictions() {
            if self.is_quick() && b - a > 1 && b - a <= MOST {
                for k in a..=b {
                    self.station(k)?;
                }
            }
        }
        self.settle();
        let mut open = Vec::new();
        if self.is_quick() {
            open.extend(self.contradictions());
            open.extend(self.unseen_touches());
            open.extend(self.restless());
        }
        open.sort_unstable();
        open.dedup();
        for (a, b) in open {
            if !self.goes_on() {
                break;
            }
            if self.retrace(a, b)? {
                self.explained.push((a, b));
            }
        }
        if self.is_quick() {
            self.follow_open()?;
        }
        self.settle();
        let explained = std::mem::take(&mut self.explained);
        let mut left = self.contradictions();
        self.set_refuted_aside(&explained, &left);
        left.retain(|step| !explained.contains(step));
        for step in left {
            self.leave_open(step);
        }
        // What an earlier look took over, and the flow's branch does not have.
        self.branch
            .events
            .retain(|e| e.verdict != Verdict::Refuted || e.method_lambda.is_finite());
        self.branch.events.sort_by(|a, b| {
            let steps = a.after_point.cmp(&b.after_point);
            steps.then(a.fraction.total_cmp(&b.fraction))
        });
        Ok(())
    }

    /// Puts the confirmed events into the steps of the flow's branch that hold them.
    fn settle(&mut self) {
        self.crossings.clear();
        self.crossings.extend_from_slice(&self.followed);
        for k in 0..self.located.len() {
            let Located { event, x } = &self.located[k];
            let (event, first) = (*event, self.branch.events[*event].after_point);
            let (step, fraction) = self.position(x, first);
            let event = &mut self.branch.events[event];
            (event.after_point, event.fraction) = (step, fraction);
            if let (true, Some((before, after))) = (event.kind.is_bifurcation(), event.unstable) {
                self.crossings.push(ChainItem {
                    at: step as f64 + fraction,
                    before,
                    after,
                });
            }
        }
    }

    /// Steps through which the flow's branch was followed, or of which the flow knows both ends and its counts contradict nothing, hold
    /// no events but the flow's: nothing is unresolved there, and what the flow does not confirm does not exist.
    fn set_refuted_aside(&mut self, explained: &[(usize, usize)], open: &[(usize, usize)]) {
        let holds =
            |list: &[(usize, usize)], k: usize| list.iter().any(|(a, b)| (*a..*b).contains(&k));
        let known = |k: usize| {
            let station = self.stations.get(k).and_then(Option::as_ref);
            station.is_some_and(|s| s.orbit().is_some())
        };
        let is_settled = |k: usize| known(k) && known(k + 1) && !holds(open, k);
        // Without a look into the step two events that the search has missed would cancel.
        let is_seen = self.is_quick();
        let is_over = |e: &BifurcationEvent| {
            let is_seen = is_seen && e.kind.is_bifurcation() || e.kind == EventKind::Unresolved;
            holds(explained, e.after_point) || is_seen && is_settled(e.after_point)
        };
        let is_in_question =
            |e: &BifurcationEvent| e.kind == EventKind::Unresolved || e.verdict == Verdict::Refuted;
        let mut events = std::mem::take(&mut self.branch.events);
        let over = events.extract_if(.., |e| is_in_question(e) && is_over(e));
        let refuted = over.filter(|e| e.verdict == Verdict::Refuted && e.method_lambda.is_finite());
        self.branch.refuted.extend(refuted);
        self.branch.events = events;
    }

    /// Where the stability of both points around is unknown, the counts of the series contradict nothing.
    pub(super) fn withdraw(&mut self) {
        let Branch { points, events, .. } = &mut *self.branch;
        let is_unknown = |k: usize| {
            let point = points.get(k);
            point.is_none_or(|p| p.stability == Stability::Unknown)
        };
        events.retain(|e| {
            let is_own = e.kind == EventKind::Unresolved && e.method_lambda.is_finite();
            !(is_own && is_unknown(e.after_point) && is_unknown(e.after_point + 1))
        });
    }

    /// An event for a change of the count between two points that nothing explains, unless there is one.
    fn leave_open(&mut self, (a, b): (usize, usize)) {
        let events = &mut self.branch.events;
        let is_open = |e: &BifurcationEvent| {
            e.kind == EventKind::Unresolved && (a..b).contains(&e.after_point)
        };
        if events.iter().any(is_open) {
            return;
        }
        let ends = [a, b].map(|k| self.branch.points[k].lambda);
        let count = |k: usize| {
            let orbit = self.stations[k].as_ref().and_then(Station::orbit);
            orbit.map(FlowPoint::unstable)
        };
        events.push(BifurcationEvent {
            kind: EventKind::Unresolved,
            lambda: 0.5 * (ends[0] + ends[1]),
            method_lambda: f64::NAN,
            verdict: Verdict::NotTried,
            bracket: (ends[0].min(ends[1]), ends[0].max(ends[1])),
            multiplicity: 1,
            unstable: count(a).zip(count(b)),
            after_point: a,
            fraction: 0.5,
            point: None,
            breakpoint: None,
            doubt: 0.0,
            recorded: Vec::new(),
        });
    }

    /// Intervals of points between which the flow's count changes for no confirmed event.
    pub(super) fn contradictions(&self) -> Vec<(usize, usize)> {
        let mut items = self.crossings.clone();
        for (k, station) in self.stations.iter().enumerate() {
            let orbit = station.as_ref().and_then(Station::orbit);
            let is_crossing = k == 0 && self.options.begins_at_crossing;
            if let Some(orbit) = orbit.filter(|p| p.is_decided() && !is_crossing) {
                let count = orbit.unstable();
                items.push(ChainItem {
                    at: k as f64,
                    before: count,
                    after: count,
                });
            }
        }
        items.sort_by(|a, b| a.at.total_cmp(&b.at));
        let last = self.states.len() - 1;
        let pairs = items.windows(2).filter(|w| w[0].after != w[1].before);
        let mut list: Vec<(usize, usize)> = pairs
            .map(|w| {
                let (a, b) = (w[0].at.floor() as usize, w[1].at.ceil() as usize);
                (a, b.max(a + 1).min(last))
            })
            .collect();
        list.dedup();
        list
    }

    /// Steps between whose ends the number of contacts of the flow changes otherwise than by the grazings confirmed there.
    fn unseen_touches(&self) -> Vec<(usize, usize)> {
        let orbit = |k: usize| self.stations[k].as_ref().and_then(Station::orbit);
        let mut list = Vec::new();
        for k in 1..self.states.len() {
            let (Some(a), Some(b)) = (orbit(k - 1), orbit(k)) else {
                continue;
            };
            for connection in 0..a.switches.len().max(b.switches.len()) {
                let count = |s: &[usize]| s.get(connection).copied().unwrap_or(0);
                let change = count(&a.switches).abs_diff(count(&b.switches));
                let touches = self.branch.events.iter().filter(|e| {
                    let is_here = matches!(e.kind, EventKind::Grazing { connection: c, .. } if c == connection);
                    is_here && e.verdict == Verdict::Confirmed && e.after_point == k - 1
                });
                let touches = touches.count();
                if change > 2 * touches || !(change / 2 + touches).is_multiple_of(2) {
                    list.push((k - 1, k));
                    break;
                }
            }
        }
        list
    }
}
