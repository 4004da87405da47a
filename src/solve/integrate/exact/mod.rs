//! Exact flow of piecewise-affine systems: between two switches the motion is a convergent power series.
//!
//! In a contact region the equation is linear with harmonic forcing, so that the Taylor coefficients of the solution follow
//! from a two-term recursion and the series converges everywhere. Summed to rounding it is the closed form (the exponential of
//! the state with the forcing as an exosystem) without its special cases: free flight, no damping, repeated eigenvalues and
//! resonance are ordinary. Every coordinate is a polynomial on a step, so that crossings are roots of polynomials: counted by
//! the sign changes of the Bernstein form, none is missed and none found twice.

mod forcing;
mod laws;
mod pace;
mod regions;
mod series;
mod variation;

use super::{IntegrationEnd, Integrator, Observer, Segment, Switch};
use crate::error::SolveError;
use crate::interrupt::Watch;
use crate::numeric::bernstein::{Direction, evaluate};
use crate::numeric::periodic::Periodic;
use crate::solve::jumps;
use crate::system::System;
use nalgebra::DMatrix;
use regions::Regions;
use series::{COUNT, Polynomial, Series};
use std::f64::consts::TAU;
use variation::Variation;

/// Exact integration of piecewise-affine systems. One call depends on its arguments only, not on the calls before.
#[derive(Debug, Clone)]
pub struct Exact {
    series: Series,
    regions: Regions,
    variation: Variation,
    max_switches: usize,
    slope: Vec<f64>,
    offset: Vec<f64>,
    /// Phases of the response where a rectangular stiffness variation steps, in [0, 2 pi), ascending.
    kinks: Vec<f64>,
    segment: Vec<Polynomial>,
    deformation: Vec<f64>,
    /// Regions set aside.
    scratch: Vec<usize>,
}

/// What a call moves besides the regions.
struct Motion<'a> {
    system: &'a System,
    phi: Option<&'a mut DMatrix<f64>>,
    observer: &'a mut dyn Observer,
}

impl Exact {
    /// Tables of a system; make a new one when anything but the frequency changes.
    ///
    /// `max_switches`: switches allowed in one response period.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection that is not piecewise affine.
    pub fn new(system: &System, max_switches: usize) -> Result<Exact, SolveError> {
        let laws = laws::read(system)?;
        let (n, e) = (system.dof(), system.element_count());
        let nu = system.subharmonic();
        let mut kinks: Vec<f64> = system
            .mounts()
            .iter()
            .filter_map(|m| m.stiffness_variation.as_ref().filter(|s| !s.is_constant()))
            .flat_map(Periodic::kinks)
            .flat_map(|x| (0..nu).map(move |m| (x + TAU * m as f64) / nu as f64))
            .collect();
        kinks.sort_by(f64::total_cmp);
        let series = Series::new(system, &laws);
        Ok(Exact {
            regions: Regions::new(laws, &series),
            series,
            variation: Variation::new(n),
            max_switches,
            slope: vec![0.0; e],
            offset: vec![0.0; e],
            kinks,
            segment: vec![[0.0; COUNT]; n],
            deformation: vec![0.0; e],
            scratch: vec![0; e],
        })
    }

    fn run(
        &mut self,
        (begin, end): (f64, f64),
        state: &mut [f64],
        mut motion: Motion<'_>,
    ) -> IntegrationEnd {
        let system = motion.system;
        self.series.prepare(system);
        // theta = T / h and tau = Om T.
        let per_theta = system.omega() * self.series.unit;
        let (mut tau, mut switches) = (begin, 0);
        let allowed = self.max_switches * ((end - begin) / TAU).ceil().max(1.0) as usize;
        self.place(system, tau, state);
        let mut is_stale = true;
        let mut watch = Watch::default();
        while tau < end {
            if watch.is_requested() {
                return IntegrationEnd::Interrupted;
            }
            let stop = self.next_stop(tau, end);
            if is_stale || !self.kinks.is_empty() {
                self.stiffen(system, 0.5 * (tau + stop));
            }
            self.series.expand(system, tau, state);
            let mut reach = self.series.reach();
            if motion.phi.is_some() {
                reach = reach.min(variation::REACH * self.series.pace());
            }
            let remaining = (stop - tau) / per_theta;
            let whole = remaining <= reach * (1.0 + 1e-12);
            let step = if whole { remaining } else { reach };
            let crossing = self
                .regions
                .first_crossing(&self.series, (tau, state), step);
            let theta = crossing.map_or(step, |c| c.theta);
            self.series.state(theta, state);
            if !state.iter().all(|x| x.is_finite()) {
                return IntegrationEnd::Diverged;
            }
            let next = match crossing {
                None if whole => stop,
                _ => (tau + theta * per_theta).min(stop),
            };
            self.report(tau, theta * per_theta, theta, motion.observer);
            if let Some(phi) = motion.phi.as_deref_mut() {
                self.variation.advance(&self.series, phi, theta);
            }
            is_stale = crossing.is_some();
            if let Some(c) = crossing {
                self.cross((c.connection, c.direction), next, theta, &mut motion);
                switches += 1;
                if switches > allowed {
                    return IntegrationEnd::TooManySwitches;
                }
            } else if next <= tau {
                return IntegrationEnd::StepTooSmall;
            }
            tau = next;
        }
        self.arrive(tau, state, &mut motion);
        IntegrationEnd::Reached
    }

    /// Regions at an instant; on a breakpoint that to which the connection moves.
    fn place(&mut self, system: &System, tau: f64, state: &[f64]) {
        let q = &state[..system.dof()];
        let phase = system.subharmonic() as f64 * tau;
        for (k, x) in self.deformation.iter_mut().enumerate() {
            let error = system.mounts()[k].transmission_error.as_ref();
            *x = if system.is_tree() {
                q[k]
            } else {
                let row = system.element_map().row(k);
                row.iter().zip(q).map(|(w, q)| w * q).sum()
            };
            *x -= error.map_or(0.0, |e| e.value(phase));
        }
        if self
            .regions
            .place(&self.series, (tau, state), &self.deformation)
        {
            self.stiffen(system, tau);
            self.series.expand(system, tau, state);
            self.regions.leave(&self.series, (tau, state));
        }
    }

    /// Reports the switches of connections that end on a breakpoint and are about to pass it: the next call starts beyond.
    fn arrive(&mut self, tau: f64, state: &[f64], motion: &mut Motion<'_>) {
        let mut after = std::mem::take(&mut self.scratch);
        self.regions.save(&mut after);
        self.place(motion.system, tau, state);
        self.regions.swap(&mut after);
        for (k, region) in after.iter().enumerate() {
            while let Some(direction) = self.regions.towards(k, *region) {
                self.stiffen(motion.system, tau);
                self.series.expand(motion.system, tau, state);
                self.cross((k, direction), tau, 0.0, motion);
            }
        }
        self.scratch = after;
    }

    /// A connection passes a breakpoint at theta of the series, which is tau.
    fn cross(
        &mut self,
        (connection, direction): (usize, Direction),
        tau: f64,
        theta: f64,
        motion: &mut Motion<'_>,
    ) {
        let rate = evaluate(self.series.deformation(connection), theta).1 / self.series.unit;
        let (level, from, to) = self.regions.pass(connection, direction);
        if let Some(phi) = motion.phi.as_deref_mut() {
            let phase = motion.system.subharmonic() as f64 * tau;
            let jump = jumps::size(&motion.system.mounts()[connection], level, rate, phase);
            jumps::saltate(motion.system, connection, jump, rate, phi.as_mut_slice());
        }
        motion.observer.switch(&Switch {
            tau,
            connection,
            level,
            from,
            to,
            velocity: rate,
        });
    }

    /// End of the current stretch of constant stiffness.
    fn next_stop(&self, tau: f64, end: f64) -> f64 {
        if self.kinks.is_empty() {
            return end;
        }
        let turn = (tau / TAU).floor() * TAU;
        let later = |turn: f64| {
            self.kinks
                .iter()
                .map(move |k| turn + k)
                .find(|x| *x > tau + 1e-13)
        };
        later(turn)
            .or_else(|| later(turn + TAU))
            .unwrap_or(end)
            .min(end)
    }

    /// Slopes and offsets of the current regions, stiffness variation included.
    fn stiffen(&mut self, system: &System, tau: f64) {
        for (e, mount) in system.mounts().iter().enumerate() {
            let phase = system.subharmonic() as f64 * tau;
            let variation = mount.stiffness_variation.as_ref();
            let factor = variation.map_or(1.0, |s| s.value(phase));
            (self.slope[e], self.offset[e]) = self.regions.affine(e, factor);
        }
        self.series.set_laws(&self.slope, &self.offset);
    }

    /// Hands the step to the observer, in powers of its own length.
    fn report(&mut self, tau: f64, width: f64, theta: f64, observer: &mut dyn Observer) {
        if width <= 0.0 || !observer.wants_segments() {
            return;
        }
        for (out, block) in self.segment.iter_mut().zip(&self.series.q) {
            let mut power = 1.0;
            for (o, c) in out.iter_mut().zip(block) {
                *o = c * power;
                power *= theta;
            }
        }
        observer.segment(&Segment {
            tau,
            width,
            coefficients: self.segment.as_flattened(),
            count: COUNT,
        });
    }
}

impl Integrator for Exact {
    fn name(&self) -> &'static str {
        "exact"
    }

    fn start(&mut self, system: &System, tau: f64, state: &[f64], observer: &mut dyn Observer) {
        self.series.prepare(system);
        self.place(system, tau, state);
        self.stiffen(system, tau);
        self.series.expand(system, tau, state);
        for connection in 0..system.element_count() {
            let (value, slope) = evaluate(self.series.deformation(connection), 0.0);
            let element = system.mounts()[connection].element.as_ref();
            let begun = (self.regions).begun(&self.series, (tau, state), connection, value);
            let Some((level, to)) = begun.filter(|(level, _)| element.flank(*level) == 0) else {
                continue;
            };
            observer.switch(&Switch {
                tau,
                connection,
                level,
                from: 0,
                to,
                velocity: slope / self.series.unit,
            });
        }
    }

    fn error(&self) -> f64 {
        1e-13
    }

    fn advance(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        let motion = Motion {
            system,
            phi: None,
            observer,
        };
        self.run(tau, state, motion)
    }

    fn advance_with_variation(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        phi: &mut DMatrix<f64>,
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        let motion = Motion {
            system,
            phi: Some(phi),
            observer,
        };
        self.run(tau, state, motion)
    }
}
