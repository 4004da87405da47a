//! The flow's own branch followed through an interval in which the events leave something open.

use super::chain::Located;
use super::events::SAME;
use super::flow::{FlowPoint, dot};
use super::{Confirmer, Station};
use crate::error::SolveError;
use crate::solve::branch::{Begin, Branch, BranchPoint, Recorder, TraceOptions, trace};
use crate::solve::continuation::{ContinuationOptions, CrossingSide, Crossings};
use crate::solve::events::{BESIDE_CROSSING, BifurcationEvent, Verdict};
use crate::solve::family::Family;
use crate::solve::orbit::Orbit;
use crate::solve::residual::PeriodicResidual;
use crate::system::System;
use nalgebra::DVector;

/// Steps of the flow's branch to one of the series': at first, and where events are not located in them.
const FINER: [f64; 2] = [6.0, 30.0];
/// Points at most, over that number.
const MOST_POINTS: f64 = 20.0;
/// Distance from the beginning, over the length of the interval, at which the path has gone astray.
const ASTRAY: f64 = 3.0;

/// Distance of two events of one kind and parameter, in the arclength, up to which they are one: that of the places of a branch point
/// that two searches find.
const SAME_PLACE: f64 = 1e-5;

/// Largest distance of the path from the end of the interval where it passes beside it, over the length of the interval: beyond it
/// the path has gone over to another branch.
const BESIDE: f64 = 0.02;

/// The end of a path.
pub(super) struct Arrival {
    /// Direction in which it is passed.
    pub along: DVector<f64>,
    /// The place.
    pub to: DVector<f64>,
    /// Largest distance of the path from it where it passes beside it,
    pub within: f64,
    /// and in lengths of the last step.
    pub share: f64,
}

/// Ends the path where it arrives, or goes astray.
pub(super) struct ArrivalWatch {
    weight: f64,
    arrival: Option<Arrival>,
    /// Place and distance from it at which the path has gone astray.
    astray: Option<(DVector<f64>, f64)>,
    /// The point before.
    last: DVector<f64>,
    pub has_arrived: bool,
}

impl ArrivalWatch {
    /// At the begin of a path.
    pub fn new(
        weight: f64,
        from: DVector<f64>,
        arrival: Option<Arrival>,
        astray: Option<(DVector<f64>, f64)>,
    ) -> ArrivalWatch {
        ArrivalWatch {
            weight,
            arrival,
            astray,
            last: from,
            has_arrived: false,
        }
    }

    fn distance(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let gap = a - b;
        dot(self.weight, &gap, &gap).sqrt()
    }

    /// Whether the last step passes the end.
    fn passes(&self, x: &DVector<f64>) -> bool {
        let Some(Arrival {
            along,
            to,
            within,
            share,
        }) = &self.arrival
        else {
            return false;
        };
        let behind = dot(self.weight, &(x - to), along);
        let before = dot(self.weight, &(&self.last - to), along);
        if !(before < 0.0 && behind >= 0.0) {
            return false;
        }
        let there = &self.last + (x - &self.last) * (before / (before - behind));
        self.distance(&there, to) <= within + share * self.distance(x, &self.last)
    }
}

impl Recorder for ArrivalWatch {
    fn record(&mut self, _: f64, _: &System, _: &Orbit, _: &mut Vec<f64>) {}

    fn accept(&mut self, point: &BranchPoint) -> bool {
        let x = point.unknowns.clone().push(point.lambda);
        self.has_arrived = self.passes(&x);
        let is_astray = |(from, far): &(DVector<f64>, f64)| self.distance(&x, from) > *far;
        let goes_on = !self.has_arrived && !self.astray.as_ref().is_some_and(is_astray);
        self.last = x;
        goes_on
    }
}

impl<F: Family> Confirmer<'_, F> {
    /// Follows the flow's branch from one point of the series to another and adopts its events; whether it arrived and located
    /// them all.
    pub(super) fn retrace(&mut self, a: usize, b: usize) -> Result<bool, SolveError> {
        let orbit = |k: usize| self.stations[k].as_ref().and_then(Station::orbit);
        let (Some(from), Some(to)) = (orbit(a).cloned(), orbit(b).cloned()) else {
            return Ok(false);
        };
        for finer in FINER {
            let Some(events) = self.followed(&from, &to, finer)? else {
                continue;
            };
            if events.iter().all(|e| e.point.is_some()) {
                for event in events {
                    self.adopt(event, (a, b))?;
                }
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Events of the flow's branch from one orbit to another, followed in a fraction of the steps of the series; `None` where it leads
    /// elsewhere.
    fn followed(
        &mut self,
        from: &FlowPoint,
        to: &FlowPoint,
        finer: f64,
    ) -> Result<Option<Vec<BifurcationEvent>>, SolveError> {
        let length = self.flow.distance(&from.x, &to.x);
        if length <= SAME {
            // Two points of the series lead to one orbit.
            return Ok(None);
        }
        let range = self.options.range;
        let ahead = (to.lambda() - from.lambda()) * (range.1 - range.0);
        let sides = match ahead >= 0.0 {
            true => [CrossingSide::Forward, CrossingSide::Backward],
            false => [CrossingSide::Backward, CrossingSide::Forward],
        };
        let options = self.trace_options(length / finer, (MOST_POINTS * finer) as usize);
        for side in sides {
            let arrival = Arrival {
                along: &to.x - &from.x,
                to: to.x.clone(),
                within: BESIDE * length,
                share: 0.0,
            };
            let astray = (from.x.clone(), ASTRAY * length);
            let (weight, begin) = (self.options.weight, from.x.clone());
            let mut watch = ArrivalWatch::new(weight, begin, Some(arrival), Some(astray));
            let start = Begin::Inside(from.state(), from.lambda(), side);
            let branch = self.traced(start, &options, &mut watch)?;
            if let Some(branch) = branch.filter(|_| watch.has_arrived) {
                return Ok(Some(branch.events));
            }
        }
        Ok(None)
    }

    /// The flow's branch from a start, in the steps that are left; `None` where there is none.
    pub(super) fn traced(
        &mut self,
        start: Begin,
        options: &TraceOptions,
        watch: &mut ArrivalWatch,
    ) -> Result<Option<Branch>, SolveError> {
        self.flow.shooting.allow(self.steps_left);
        let traced = trace(self.flow.shooting, start, options, watch);
        self.steps_left = self.flow.shooting.allow(usize::MAX);
        match traced {
            Err(SolveError::NoSystem { .. }) => Ok(None),
            traced => Ok(traced?.ok()),
        }
    }

    /// Takes an event of the flow's branch over: for one of the series that was not confirmed, or as one that the series lacks.
    fn adopt(&mut self, event: BifurcationEvent, (a, b): (usize, usize)) -> Result<(), SolveError> {
        let Some(point) = &event.point else {
            return Ok(());
        };
        let x = point.u.clone().push(point.lambda);
        let (step, fraction) = self.position(&x, a);
        if self.options.begins_at_crossing && step == 0 && fraction < BESIDE_CROSSING {
            // The crossing itself.
            return Ok(());
        }
        let ends = [self.place(a), self.place(b)].map(|end| self.flow.distance(&x, end));
        let length = self.flow.distance(self.place(a), self.place(b));
        // The last step of the path may reach beyond the interval.
        if ends[0].max(ends[1]) > length * (1.0 + SAME) && (step < a || step >= b) {
            return Ok(());
        }
        let near = |e: &BifurcationEvent| (e.lambda - event.lambda).abs();
        let events = &self.branch.events;
        let is_known = |l: &Located| {
            let known = &events[l.event];
            known.kind == event.kind
                && near(known) <= SAME * event.lambda.abs().max(SAME)
                && self.flow.distance(&l.x, &x) <= SAME_PLACE
        };
        if self.located.iter().any(is_known) {
            return Ok(());
        }
        let is_open = |e: &BifurcationEvent| {
            e.kind == event.kind
                && e.verdict != Verdict::Confirmed
                && (a..=b).contains(&e.after_point)
        };
        let open = (0..events.len()).filter(|k| is_open(&events[*k]));
        let open = open.min_by(|p, q| near(&events[*p]).total_cmp(&near(&events[*q])));
        let number = open.unwrap_or(events.len());
        self.located.push(Located { event: number, x });
        if let Some(known) = open {
            let known = &mut self.branch.events[known];
            known.verdict = Verdict::Confirmed;
            (known.lambda, known.bracket) = (event.lambda, event.bracket);
            (known.unstable, known.multiplicity) = (event.unstable, event.multiplicity);
            (known.after_point, known.fraction) = (step, fraction);
            return Ok(());
        }
        let recorded = self.recorded(&event)?;
        self.branch.events.push(BifurcationEvent {
            method_lambda: f64::NAN,
            verdict: Verdict::Confirmed,
            after_point: step,
            fraction,
            point: None,
            recorded,
            ..event
        });
        Ok(())
    }

    /// How the flow's branch is followed in steps of a length.
    pub(super) fn trace_options(&self, step: f64, max_points: usize) -> TraceOptions {
        TraceOptions {
            continuation: ContinuationOptions {
                range: self.options.range,
                step,
                min_step: 1e-6 * step,
                max_step: step,
                max_points,
                weight: self.options.weight,
                newton: self.options.newton,
                crossings: Crossings::Expected,
            },
            marks: Vec::new(),
            stability: true,
            known: None,
            resolution: self.options.resolution,
            bounds: Vec::new(),
        }
    }

    /// Values of the recorder at an event of the flow; none where it was not located.
    pub(super) fn recorded(&mut self, event: &BifurcationEvent) -> Result<Vec<f64>, SolveError> {
        let mut recorded = Vec::new();
        if let Some(point) = &event.point {
            let orbit = self.flow.shooting.orbit(&point.u, point.lambda)?;
            let system = self.flow.shooting.system_at(point.lambda)?;
            self.recorder
                .record(point.lambda, system, &orbit, &mut recorded);
        }
        Ok(recorded)
    }
}
