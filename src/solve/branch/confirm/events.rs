//! Verdicts: every event located again, and judged by the counts on both sides of it.

use super::Confirmer;
use super::chain::Located;
use super::flow::{Care, ConfirmingPlane, FlowPoint};
use super::root::{ConfirmedRoot, Test, locate};
use crate::error::SolveError;
use crate::numeric::interpolation;
use crate::solve::events::{EventKind, Verdict, beyond_one};
use crate::solve::family::Family;
use crate::solve::residual::Extent;
use nalgebra::DVector;

/// Share of the tangent with which the direction of the branch in states is taken.
const NUDGE: f64 = 1e-4;
/// First distance from the event, as a share of the step around it.
const STRIDE: f64 = 0.05;
/// Distance from a branch point at which its multipliers are looked at, as a share of the step around it; others are twice as far.
const AROUND: f64 = 4e-3;
/// Share of that distance by which a branch point may move.
const NEAR: f64 = 0.1;
/// Events of one kind this near to each other, in the arclength, are one.
pub(super) const SAME: f64 = 1e-7;
/// Distances of the two sides from an event: shares of the distance to the next event, or of the step.
const SIDES: [f64; 3] = [0.2, 1e-2, 3e-4];

/// An event of the series that the flow has too.
struct SharedEvent {
    /// Number among the events.
    event: usize,
    plane: ConfirmingPlane,
    root: ConfirmedRoot,
    /// Length of the step around it.
    step: f64,
}

impl<F: Family> Confirmer<'_, F> {
    /// Locates every event on the flow's own branch, counts on both sides, and says so in the events.
    pub(super) fn confirm_events(&mut self) -> Result<(), SolveError> {
        let mut found: Vec<SharedEvent> = Vec::new();
        for event in 0..self.branch.events.len() {
            if !self.goes_on() || self.branch.events[event].point.is_none() {
                continue;
            }
            // At an onset of slip the flow has one-sided branches, on one of which the memory is data: it has nothing to locate.
            if matches!(self.branch.events[event].kind, EventKind::SlipOnset { .. }) {
                continue;
            }
            self.branch.events[event].verdict = Verdict::Refuted;
            if let Some(mut one) = self.locate(event)? {
                self.sharpen(&mut one)?;
                found.push(one);
            }
        }
        let found = self.without_doubles(found);
        for k in 0..found.len() {
            let kind = self.branch.events[found[k].event].kind;
            let counts = match kind.is_bifurcation() {
                true => self.counts(&found, k)?,
                false => Some((0, 0)),
            };
            let Some(counts) = counts else { continue };
            self.accept(&found[k], counts)?;
        }
        Ok(())
    }

    fn locate(&mut self, event: usize) -> Result<Option<SharedEvent>, SolveError> {
        let found = &self.branch.events[event];
        let Some(point) = found.point.clone() else {
            return Ok(None);
        };
        let extent = match found.kind {
            EventKind::NeimarkSacker => Extent::Stability,
            _ => Extent::Motion,
        };
        let survey = self.series.survey(&point.u, point.lambda, extent)?;
        let Some(test) = Test::of(found, &survey) else {
            return Ok(None);
        };
        let (first, count) = (found.after_point, self.states.len());
        let last = (first + 1).min(count - 1);
        let here = self.state(&point.u, point.lambda)?;
        let ahead = self.state(
            &(&point.u + &point.tangent_u * NUDGE),
            point.lambda + NUDGE * point.tangent_lambda,
        )?;
        let direction = ahead - &here;
        let flow = &mut self.flow;
        let step = flow.distance(&self.states[first], &self.states[last]);
        let around = [first.saturating_sub(1), (last + 1).min(count - 1)];
        let far = around.map(|k| flow.distance(&self.states[k], &here));
        let reach = 2.0 * far[0].max(far[1]).max(step);
        let Some(plane) = flow.across(here, direction)? else {
            return Ok(None);
        };
        let root = locate(flow, &plane, test, (STRIDE * step, reach))?;
        Ok(root.map(|root| SharedEvent {
            event,
            plane,
            root,
            step,
        }))
    }

    /// Moves a branch point to where the multipliers around say that it is: at the branch point itself the corrector is singular.
    fn sharpen(&mut self, found: &mut SharedEvent) -> Result<(), SolveError> {
        let event = &self.branch.events[found.event];
        // Of a part of the period the eigenvalue that passes may be another root of 1: the corrector is regular then, however near to 1 a
        // further one lies.
        let orbit = &found.root.point;
        let passing = orbit.multipliers.iter().map(|mu| (mu - 1.0).norm());
        let is_singular = orbit.from_singular <= passing.fold(f64::INFINITY, f64::min);
        if event.kind != EventKind::BranchPoint || !is_singular {
            return Ok(());
        }
        let (multiplicity, center, distance) =
            (event.multiplicity, found.root.s, AROUND * found.step);
        let nodes = [-2.0, -1.0, 1.0, 2.0].map(|k| center + k * distance);
        let (mut values, mut orbits) = ([0.0; 4], Vec::with_capacity(4));
        for (value, node) in values.iter_mut().zip(nodes) {
            let guess = &found.root.point.x + &found.plane.tangent * (node - center);
            let Some(orbit) = self.flow.at(&found.plane, node, guess, Care::Rough)? else {
                return Ok(());
            };
            *value = beyond_one(&orbit.multipliers, multiplicity);
            orbits.push((node, orbit));
        }
        if !(values[0] * values[3] < 0.0 && values[1] * values[2] < 0.0) {
            return Ok(());
        }
        let s = interpolation::root(&nodes, &values);
        if (s - center).abs() > NEAR * distance {
            return Ok(());
        }
        let mut shares = [0.0; 4];
        interpolation::weights(&nodes, s, &mut shares);
        let root = &mut found.root;
        root.s = s;
        root.point.x.fill(0.0);
        for (share, (_, orbit)) in shares.iter().zip(&orbits) {
            root.point.x.axpy(*share, &orbit.x, 1.0);
        }
        let at = root.point.lambda();
        root.bracket = (root.bracket.0.min(at), root.bracket.1.max(at));
        root.seen.extend(orbits);
        Ok(())
    }

    /// State at phase 0 of an orbit of the series, with its parameter.
    fn state(&mut self, u: &DVector<f64>, lambda: f64) -> Result<DVector<f64>, SolveError> {
        let n = self.states[0].len() - 1;
        let mut x = DVector::zeros(n + 1);
        let orbit = self.series.orbit(u, lambda)?;
        orbit.state(0.0, &mut x.as_mut_slice()[..n]);
        x[n] = lambda;
        Ok(x)
    }

    /// Two events of the series that lead to one of the flow: the nearer one is it.
    fn without_doubles(&self, found: Vec<SharedEvent>) -> Vec<SharedEvent> {
        let kind = |f: &SharedEvent| self.branch.events[f.event].kind;
        let mut kept: Vec<SharedEvent> = Vec::new();
        for one in found {
            let is_same = |other: &SharedEvent| {
                kind(other) == kind(&one)
                    && self.flow.distance(&other.root.point.x, &one.root.point.x) < SAME
            };
            match kept.iter().position(is_same) {
                None => kept.push(one),
                Some(k) if one.root.s.abs() < kept[k].root.s.abs() => kept[k] = one,
                Some(_) => {}
            }
        }
        kept
    }

    /// Unstable multipliers of the flow before and after a bifurcation; `None` where they do not change as its kind says.
    fn counts(
        &mut self,
        found: &[SharedEvent],
        k: usize,
    ) -> Result<Option<(usize, usize)>, SolveError> {
        let event = &self.branch.events[found[k].event];
        let (kind, multiplicity) = (event.kind, event.multiplicity);
        let SharedEvent {
            plane, root, step, ..
        } = &found[k];
        let others = found
            .iter()
            .enumerate()
            .filter(|(j, f)| *j != k && self.branch.events[f.event].kind.is_bifurcation());
        let room = others
            .map(|(_, f)| self.flow.distance(&f.root.point.x, &root.point.x))
            .fold(*step, f64::min);
        let passing = match kind {
            EventKind::NeimarkSacker => 2 * multiplicity,
            _ => multiplicity,
        };
        // Counts that are right, on both sides.
        let judge = |before: &FlowPoint, after: &FlowPoint| {
            let counts = (before.unstable(), after.unstable());
            let at = root.point.lambda();
            let turns = (before.lambda() - at) * (after.lambda() - at) > 0.0;
            let is_right_turn = match kind {
                EventKind::Fold => turns,
                EventKind::BranchPoint => !turns,
                _ => true,
            };
            let is_right = counts.0.abs_diff(counts.1) == passing && is_right_turn;
            is_right.then_some(counts)
        };
        let within = SIDES[0] * room;
        if let (Some(before), Some(after)) = (root.beside(-1.0, within), root.beside(1.0, within))
            && before.is_decided()
            && after.is_decided()
            && let Some(counts) = judge(before, after)
        {
            return Ok(Some(counts));
        }
        for share in SIDES {
            let mut sides = [None, None];
            for (side, sign) in sides.iter_mut().zip([-1.0, 1.0]) {
                let gap = sign * share * room;
                let guess = &root.point.x + &plane.tangent * gap;
                *side = self.flow.at(plane, root.s + gap, guess, Care::Rough)?;
            }
            if let [Some(before), Some(after)] = &sides
                && let Some(counts) = judge(before, after)
            {
                return Ok(Some(counts));
            }
        }
        Ok(None)
    }

    /// Notes a confirmed event, and solves the ends of the step that holds it.
    fn accept(&mut self, found: &SharedEvent, counts: (usize, usize)) -> Result<(), SolveError> {
        let event = &mut self.branch.events[found.event];
        event.verdict = Verdict::Confirmed;
        event.lambda = found.root.point.lambda();
        if event.kind != EventKind::Fold {
            event.bracket = found.root.bracket;
        }
        let is_bifurcation = event.kind.is_bifurcation();
        if is_bifurcation {
            event.unstable = Some(counts);
        }
        let first = event.after_point;
        let x = found.root.point.x.clone();
        let (step, _) = self.position(&x, first);
        self.located.push(Located {
            event: found.event,
            x,
        });
        if is_bifurcation {
            self.station(step)?;
            self.station((step + 1).min(self.states.len() - 1))?;
        }
        Ok(())
    }
}
