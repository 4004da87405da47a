//! The flow's own branch followed through an interval in which the events leave something open.

use super::events::SAME;
use super::flow::FlowPoint;
use super::{Confirmer, Station};
use crate::error::SolveError;
use crate::solve::branch::{Begin, BranchPoint, Recorder, TraceOptions, trace};
use crate::solve::continuation::{ContinuationOptions, Side};
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

/// Largest distance of the path from the end of the interval where it passes beside it, over the length of the interval: beyond it
/// the path has gone over to another branch.
const BESIDE: f64 = 0.02;

/// Ends the path where it passes the end of the interval.
struct Watch {
    weight: f64,
    from: DVector<f64>,
    to: DVector<f64>,
    length: f64,
    /// The point before.
    last: DVector<f64>,
    has_arrived: bool,
}

impl Watch {
    fn dot(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let n = a.len() - 1;
        self.weight * a.rows(0, n).dot(&b.rows(0, n)) + a[n] * b[n]
    }

    fn distance(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let gap = a - b;
        self.dot(&gap, &gap).sqrt()
    }

    /// Distance of the end of the interval from the last step, where that passes it.
    fn passing(&self, x: &DVector<f64>) -> Option<f64> {
        let along = &self.to - &self.from;
        let behind = self.dot(&(x - &self.to), &along);
        let before = self.dot(&(&self.last - &self.to), &along);
        (before < 0.0 && behind >= 0.0).then(|| {
            let share = before / (before - behind);
            let there = &self.last + (x - &self.last) * share;
            self.distance(&there, &self.to)
        })
    }
}

impl Recorder for Watch {
    fn record(&mut self, _: f64, _: &System, _: &Orbit, _: &mut Vec<f64>) {}

    fn accept(&mut self, point: &BranchPoint) -> bool {
        let mut x = point.unknowns.clone().insert_row(point.unknowns.len(), 0.0);
        x[point.unknowns.len()] = point.lambda;
        let passing = self.passing(&x);
        self.has_arrived = passing.is_some_and(|gap| gap <= BESIDE * self.length);
        let is_near = self.distance(&x, &self.from) <= ASTRAY * self.length;
        self.last = x;
        !self.has_arrived && is_near
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
            true => [Side::Forward, Side::Backward],
            false => [Side::Backward, Side::Forward],
        };
        let step = length / finer;
        let options = TraceOptions {
            continuation: ContinuationOptions {
                range,
                step,
                min_step: 1e-6 * step,
                max_step: step,
                max_points: (MOST_POINTS * finer) as usize,
                weight: self.options.weight,
                newton: self.options.newton,
            },
            marks: Vec::new(),
            stability: true,
            known: None,
            resolution: self.options.resolution,
            bounds: Vec::new(),
        };
        for side in sides {
            let mut watch = Watch {
                weight: self.options.weight,
                from: from.x.clone(),
                to: to.x.clone(),
                length,
                last: from.x.clone(),
                has_arrived: false,
            };
            let start = Begin::Inside(from.state(), from.lambda(), side);
            let branch = match trace(self.flow.shooting, start, &options, &mut watch) {
                Err(SolveError::NoSystem { .. }) => continue,
                traced => traced?,
            };
            if let (true, Ok(branch)) = (watch.has_arrived, branch) {
                return Ok(Some(branch.events));
            }
        }
        Ok(None)
    }

    /// Takes an event of the flow's branch over: for one of the series that was not confirmed, or as one that the series lacks.
    fn adopt(&mut self, event: BifurcationEvent, (a, b): (usize, usize)) -> Result<(), SolveError> {
        let Some(point) = &event.point else {
            return Ok(());
        };
        let n = point.u.len();
        let mut x = point.u.clone().insert_row(n, 0.0);
        x[n] = point.lambda;
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
        let alike = |e: &&mut BifurcationEvent| e.kind == event.kind;
        let same = self.branch.events.iter().filter(|e| e.kind == event.kind);
        let is_known = |e: &BifurcationEvent| {
            e.verdict == Verdict::Confirmed && near(e) <= SAME * event.lambda.abs().max(SAME)
        };
        if same.into_iter().any(is_known) {
            return Ok(());
        }
        let open = self
            .branch
            .events
            .iter_mut()
            .filter(alike)
            .filter(|e| e.verdict != Verdict::Confirmed && (a..=b).contains(&e.after_point));
        if let Some(known) = open.min_by(|p, q| near(p).total_cmp(&near(q))) {
            known.verdict = Verdict::Confirmed;
            (known.lambda, known.bracket) = (event.lambda, event.bracket);
            (known.after_point, known.fraction) = (step, fraction);
            return Ok(());
        }
        let mut recorded = Vec::new();
        let orbit = self.flow.shooting.orbit(&point.u, point.lambda)?;
        let system = self.flow.shooting.system_at(point.lambda)?;
        self.recorder
            .record(point.lambda, system, &orbit, &mut recorded);
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
}
