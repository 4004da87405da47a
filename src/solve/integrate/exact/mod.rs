//! Exact flow of piecewise-affine systems: between two switches the motion is a convergent power series.
//!
//! In a contact region the equation is linear with harmonic forcing, so that the Taylor coefficients of the solution follow
//! from a two-term recursion and the series converges everywhere. Summed to rounding it is the closed form (the exponential of
//! the state with the forcing as an exosystem) without its special cases: free flight, no damping, repeated eigenvalues and
//! resonance are ordinary. Every coordinate is a polynomial on a step, so that crossings are roots of polynomials: counted by
//! the sign changes of the Bernstein form, none is missed and none found twice.

mod laws;
mod series;

use super::{IntegrationEnd, Integrator, Observer, Segment, Switch};
use crate::error::SolveError;
use crate::numeric::bernstein::RootFinder;
use crate::numeric::periodic::Periodic;
use crate::solve::affine::AffineLaw;
use crate::solve::jumps;
use crate::system::System;
pub use laws::needs;
use nalgebra::DMatrix;
use series::{COUNT, Series, VARIATION_REACH};
use std::f64::consts::TAU;

/// Degree of the head of a deformation's polynomial in the quick test for crossings.
const HULL_DEGREE: usize = 7;

/// Exact integration of piecewise-affine systems.
#[derive(Debug, Clone)]
pub struct Exact {
    laws: Vec<AffineLaw>,
    series: Series,
    finder: RootFinder,
    max_switches: usize,
    region: Vec<usize>,
    /// Breakpoint on which a connection stands: it does not fire there.
    surface: Vec<Option<f64>>,
    slope: Vec<f64>,
    offset: Vec<f64>,
    /// Phases of the response where a rectangular stiffness variation steps, in [0, 2 pi), ascending.
    kinks: Vec<f64>,
    polynomial: Vec<f64>,
    inside: Vec<f64>,
    segment: Vec<f64>,
    column: Vec<f64>,
}

/// The first crossing on a step.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    theta: f64,
    connection: usize,
    level: f64,
    upwards: bool,
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
        Ok(Exact {
            series: Series::new(system, &laws),
            laws,
            finder: RootFinder::new(),
            max_switches,
            region: vec![0; e],
            surface: vec![None; e],
            slope: vec![0.0; e],
            offset: vec![0.0; e],
            kinks,
            polynomial: vec![0.0; COUNT],
            inside: Vec::new(),
            segment: vec![0.0; n * COUNT],
            column: vec![0.0; 2 * n],
        })
    }

    fn run(
        &mut self,
        system: &System,
        (begin, end): (f64, f64),
        state: &mut [f64],
        mut phi: Option<&mut DMatrix<f64>>,
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        self.series.prepare(system);
        // theta = T / h and tau = Om T.
        let per_tau = 1.0 / (system.omega() * self.series.unit);
        let (mut tau, mut switches) = (begin, 0);
        let allowed = self.max_switches * ((end - begin) / TAU).ceil().max(1.0) as usize;
        self.enter(system, tau, state);
        while tau < end {
            let stop = self.next_stop(tau, end);
            self.stiffen(system, 0.5 * (tau + stop));
            self.series.force(system, tau);
            self.series.expand(state);
            let mut reach = self.series.reach();
            if phi.is_some() {
                reach = reach.min(VARIATION_REACH);
            }
            let remaining = (stop - tau) * per_tau;
            let whole = remaining <= reach * (1.0 + 1e-12);
            let step = if whole { remaining } else { reach };
            let crossing = self.first_crossing(step);
            let theta = crossing.map_or(step, |c| c.theta);
            self.series.state(theta, state);
            if !state.iter().all(|x| x.is_finite()) {
                return IntegrationEnd::Diverged;
            }
            let next = if crossing.is_none() && whole {
                stop
            } else {
                (tau + theta / per_tau).min(stop)
            };
            self.report(tau, theta / per_tau, theta, observer);
            self.surface.fill(None);
            let passage = crossing.map(|c| (c, self.rate(c.connection, theta)));
            if let Some((c, rate)) = passage {
                self.cross(c, next, rate, observer);
                switches += 1;
                if switches > allowed {
                    return IntegrationEnd::TooManySwitches;
                }
            } else if next <= tau {
                return IntegrationEnd::StepTooSmall;
            }
            if let Some(phi) = phi.as_deref_mut() {
                // The slopes are still those of the step: `cross` changes the region only.
                self.vary(phi, theta);
                if let Some((c, rate)) = passage {
                    let phase = system.subharmonic() as f64 * next;
                    let jump = jumps::size(&system.mounts()[c.connection], c.level, rate, phase);
                    jumps::saltate(system, c.connection, jump, rate, phi.as_mut_slice());
                }
            }
            tau = next;
        }
        IntegrationEnd::Reached
    }

    /// Regions at the begin, from the deformations and, on a breakpoint, from the direction of motion.
    fn enter(&mut self, system: &System, tau: f64, state: &[f64]) {
        self.stiffen(system, tau);
        self.series.force(system, tau);
        self.series.expand(state);
        for (e, law) in self.laws.iter().enumerate() {
            // Value and rate do not depend on the region.
            let (x, rate) = (
                self.series.deformation[e * COUNT],
                self.series.deformation[e * COUNT + 1],
            );
            self.region[e] = law.region(x, rate);
            self.surface[e] = law.breakpoints.iter().copied().find(|b| x == *b);
        }
    }

    /// End of the current stretch of constant stiffness.
    fn next_stop(&self, tau: f64, end: f64) -> f64 {
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
        for (e, (law, mount)) in self.laws.iter().zip(system.mounts()).enumerate() {
            let s = mount
                .stiffness_variation
                .as_ref()
                .map_or(1.0, |s| s.value(system.subharmonic() as f64 * tau));
            self.slope[e] = s * law.slopes[self.region[e]];
            self.offset[e] = s * law.offsets[self.region[e]];
        }
        self.series.set_laws(&self.slope, &self.offset);
    }

    /// The earliest crossing of any connection within theta in (0, step].
    fn first_crossing(&mut self, step: f64) -> Option<Crossing> {
        let mut first: Option<Crossing> = None;
        for e in 0..self.laws.len() {
            if self.laws[e].breakpoints.is_empty() {
                continue;
            }
            let horizon = first.map_or(step, |c| c.theta);
            if let Some(found) = self.crossing_of(e, horizon) {
                first = Some(found);
            }
        }
        first
    }

    /// The first crossing of one connection within a horizon.
    fn crossing_of(&mut self, e: usize, horizon: f64) -> Option<Crossing> {
        let (low, high) = self.laws[e].borders(self.region[e]);
        let mut power = 1.0;
        for (p, c) in self
            .polynomial
            .iter_mut()
            .zip(&self.series.deformation[e * COUNT..(e + 1) * COUNT])
        {
            *p = c * power;
            power *= horizon;
        }
        let surface = self.surface[e];
        let (least, largest) = self.finder.hull(&self.polynomial, HULL_DEGREE);
        let mut best: Option<Crossing> = None;
        for (level, upwards) in [(low, false), (high, true)] {
            let is_far = if upwards {
                largest < level
            } else {
                least > level
            };
            if !level.is_finite() || (is_far && surface != Some(level)) {
                continue;
            }
            let x = if surface == Some(level) {
                self.leave(upwards)
            } else {
                self.pass(level, upwards)
            };
            if let Some(x) = x {
                let theta = x * horizon;
                if best.is_none_or(|b| theta < b.theta) {
                    best = Some(Crossing {
                        theta,
                        connection: e,
                        level,
                        upwards,
                    });
                }
            }
        }
        best
    }

    /// First root of the polynomial minus a level that it leaves behind; 0 when it is already beyond and moves on.
    fn pass(&mut self, level: f64, upwards: bool) -> Option<f64> {
        let first = self.polynomial[0];
        let beyond = if upwards {
            first - level
        } else {
            level - first
        };
        let outwards = if upwards {
            self.polynomial[1]
        } else {
            -self.polynomial[1]
        };
        if beyond >= 0.0 && outwards > 0.0 {
            // Rounding carried it across together with another connection's switch.
            return Some(0.0);
        }
        self.polynomial[0] = if beyond > 0.0 { level } else { first };
        let root = if self.polynomial[0] == level {
            self.polynomial[0] = first;
            return self.leave(upwards);
        } else {
            self.polynomial[0] -= level;
            self.finder.first_root(&self.polynomial)
        };
        self.polynomial[0] = first;
        root
    }

    /// The same from a start on the level itself: the root at 0 is divided out.
    fn leave(&mut self, upwards: bool) -> Option<f64> {
        let sign = if upwards { -1.0 } else { 1.0 };
        // inside(x) = sign (p(x) - level) / x is positive while the connection stays in its region.
        let mut inside = std::mem::take(&mut self.inside);
        inside.clear();
        inside.extend(self.polynomial[1..].iter().map(|c| sign * c));
        let left = self.departure(&inside);
        self.inside = inside;
        left
    }

    /// First root at which a polynomial that is positive inside becomes negative; 0 when it starts negative and stays so.
    fn departure(&mut self, inside: &[f64]) -> Option<f64> {
        let scale = inside.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
        let leading = inside
            .iter()
            .copied()
            .find(|c| c.abs() > 1e-14 * scale)
            .unwrap_or(0.0);
        let root = self.finder.first_root(inside);
        if leading >= 0.0 {
            return root;
        }
        // It turns back into the region at the root; without one it leaves at once.
        match root {
            None => Some(0.0),
            Some(entry) => self.finder.first_root_after(inside, entry * (1.0 + 1e-12)),
        }
    }

    fn rate(&self, e: usize, theta: f64) -> f64 {
        let block = &self.series.deformation[e * COUNT..(e + 1) * COUNT];
        crate::numeric::bernstein::evaluate(block, theta).1 / self.series.unit
    }

    fn cross(&mut self, c: Crossing, tau: f64, velocity: f64, observer: &mut dyn Observer) {
        let law = &self.laws[c.connection];
        let before = self.region[c.connection];
        let after = if c.upwards { before + 1 } else { before - 1 };
        self.region[c.connection] = after;
        self.surface[c.connection] = Some(c.level);
        let (from, to) = (law.flanks[before], law.flanks[after]);
        observer.switch(&Switch {
            tau,
            connection: c.connection,
            level: c.level,
            from,
            to,
            velocity,
        });
    }

    /// Hands the step to the observer, in powers of its own length.
    fn report(&mut self, tau: f64, width: f64, theta: f64, observer: &mut dyn Observer) {
        if width <= 0.0 || !observer.wants_segments() {
            return;
        }
        for (out, block) in self
            .segment
            .chunks_exact_mut(COUNT)
            .zip(self.series.q.chunks_exact(COUNT))
        {
            let mut power = 1.0;
            for (o, c) in out.iter_mut().zip(block) {
                *o = c * power;
                power *= theta;
            }
        }
        observer.segment(&Segment {
            tau,
            width,
            coefficients: &self.segment,
            count: COUNT,
        });
    }

    fn vary(&mut self, phi: &mut DMatrix<f64>, theta: f64) {
        for mut column in phi.column_iter_mut() {
            self.column
                .iter_mut()
                .zip(column.iter())
                .for_each(|(c, p)| *c = *p);
            self.series.vary(&mut self.column, theta);
            column
                .iter_mut()
                .zip(&self.column)
                .for_each(|(p, c)| *p = *c);
        }
    }
}

impl Integrator for Exact {
    fn name(&self) -> &'static str {
        "exact"
    }

    fn advance(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        self.run(system, tau, state, None, observer)
    }

    fn advance_with_variation(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        phi: &mut DMatrix<f64>,
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        self.run(system, tau, state, Some(phi), observer)
    }
}
