//! Series flow: between two switches the motion is a Taylor series, whatever is analytic there.
//!
//! Where every force is a constant multiple of its deformation the equation is linear with harmonic forcing, so that the
//! coefficients follow from a two-term recursion and the series converges everywhere. Summed to rounding it is the closed form
//! (the exponential of the state with the forcing as an exosystem) without its special cases: free flight, no damping, repeated
//! eigenvalues and resonance are ordinary. Other forces (a stiffness that varies, impact damping, formulas) make their own
//! series beside that of the motion, order by order; the decay of the last terms gives the step. Every coordinate is a
//! polynomial on a step, so that crossings are roots of polynomials: counted by the sign changes of the Bernstein form, none is
//! missed and none found twice.

mod acting;
mod bounces;
mod cells;
mod contacts;
mod decay;
mod deviations;
mod entries;
mod forcing;
mod frequencies;
mod hidden;
mod holding;
mod impacts;
mod impulse;
mod integrator;
mod lanes;
mod laws;
mod memory;
mod options;
mod pace;
mod part;
mod passing;
mod rebound;
mod recursion;
mod regions;
mod resting;
mod series;
mod sliding;
mod strain;
mod tables;
mod variation;

use super::{FlowObserver, IntegrationEnd, Segment};
use crate::error::SolveError;
use crate::interrupt::Watch;
use crate::numeric::periodic::Periodic;
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::system::System;
use acting::Acting;
use deviations::Deviations;
use integrator::{kinks, not_analytic};
pub(super) use laws::Law;
use nalgebra::DMatrix;
pub use options::SeriesOptions;
use regions::Regions;
use series::{MotionSeries, Span};
use std::f64::consts::TAU;
use strain::Labour;
use variation::VariationWorkspace;

/// Integration by Taylor series. One call depends on its arguments only, not on the calls before.
#[derive(Debug, Clone)]
pub struct Exact {
    series: MotionSeries,
    regions: Regions,
    acting: Acting,
    variation: VariationWorkspace,
    deviations: Deviations,
    options: SeriesOptions,
    name: &'static str,
    /// Steps of the last call that no switch ended, those that one ended, and how many of the former a call may take.
    effort: usize,
    switches: usize,
    allowance: usize,
    labour: Labour,
    bounces: bounces::BounceCounter,
    slope: Vec<f64>,
    offset: Vec<f64>,
    /// Phases of the response where an excitation or a law has a corner, in [0, 2 pi), ascending.
    kinks: Vec<f64>,
    /// Times along a course of speed at which an excitation has a corner.
    corners: Vec<f64>,
    segment: Vec<Polynomial>,
    deformation: Vec<f64>,
    /// Regions set aside.
    scratch: Vec<usize>,
    /// What the laws remember, before it was moved to what their deformations allow.
    recalled: Vec<f64>,
    impacts: impacts::Buffers,
}

/// Steps allowed per unit of time of the series, the reciprocal of the highest frequency.
const STEPS_PER_UNIT: f64 = 50.0 / TAU;

/// Rounding of a deformation in units of what it is made of.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Steps up to this length, in units of time of the series, join switches at one instant.
const SAME_INSTANT: f64 = 1e-13;

/// What a call moves besides the regions.
struct MovedState<'a> {
    system: &'a System,
    phi: Option<&'a mut DMatrix<f64>>,
    observer: &'a mut dyn FlowObserver,
}

impl Exact {
    /// Tables of a system; make a new one when anything but the frequency changes.
    ///
    /// `max_switches`: switches allowed in one response period.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection that has no series.
    pub fn new(system: &System, max_switches: usize) -> Result<Exact, SolveError> {
        let options = SeriesOptions {
            max_switches,
            ..SeriesOptions::default()
        };
        Exact::with(system, options)
    }

    /// As above, with options.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection that has no series.
    pub fn with(system: &System, options: SeriesOptions) -> Result<Exact, SolveError> {
        let laws = laws::read(system)?;
        let (n, m, e) = (system.dof(), system.memory_count(), system.element_count());
        let series = MotionSeries::new(system, &laws, &options);
        let is_closed_form = laws.iter().all(|part| {
            let variation = system.mounts()[part.connection]
                .stiffness_variation
                .as_ref();
            part.law.is_affine() && !variation.is_some_and(Periodic::varies_smoothly)
        });
        Ok(Exact {
            kinks: kinks(system, &laws),
            corners: Vec::new(),
            acting: Acting::new(system, &laws),
            scratch: vec![0; laws.len()],
            regions: Regions::new(laws, &series),
            series,
            variation: VariationWorkspace::new(n, m),
            deviations: Deviations::default(),
            options,
            name: if is_closed_form { "exact" } else { "series" },
            effort: 0,
            switches: 0,
            allowance: usize::MAX,
            labour: Labour::default(),
            bounces: bounces::BounceCounter::default(),
            slope: vec![0.0; e],
            offset: vec![0.0; e],
            segment: vec![[0.0; COUNT]; n + m],
            deformation: vec![0.0; e],
            recalled: vec![0.0; m],
            impacts: impacts::Buffers::new(n),
        })
    }

    fn run(
        &mut self,
        span: (f64, f64),
        state: &mut [f64],
        motion: MovedState<'_>,
    ) -> IntegrationEnd {
        let system = motion.system;
        self.prepare(system);
        let end = self.march(span, state, motion);
        let turn = match system.course() {
            None => TAU / system.subharmonic() as f64,
            Some(_) => TAU / system.moment(0.5 * (span.0 + span.1)).frequency,
        };
        let stiffest = || self.regions.stiffest(system);
        (self.labour).close(self.effort, span.1 - span.0, turn, stiffest);
        let unit = system.omega() * self.series.unit * self.series.pace();
        self.bounces.close(unit / turn);
        end
    }

    fn march(
        &mut self,
        (begin, end): (f64, f64),
        state: &mut [f64],
        mut motion: MovedState<'_>,
    ) -> IntegrationEnd {
        let system = motion.system;
        let (state, memory) = state.split_at_mut(2 * system.dof());
        // theta = T / h and tau = Om T.
        let per_theta = system.omega() * self.series.unit;
        let mut tau = begin;
        let turns = ((end - begin) / TAU).ceil().max(1.0) as usize;
        let allowed = self.options.max_switches.saturating_mul(turns);
        self.bounces.open(turns);
        let placed = self.place(system, tau, state, memory);
        if let Err(end) = placed.and_then(|()| self.begin(tau, state, memory, &mut motion)) {
            return end;
        }
        let mut is_stale = true;
        let mut watch = Watch::default();
        let nominal = STEPS_PER_UNIT * (end - begin) / per_theta;
        let most = (self.options.spare_steps)
            .saturating_mul(turns)
            .saturating_add(nominal as usize);
        let most = most.min(self.allowance);
        (self.effort, self.switches) = (0, 0);
        // Switches have a limit of their own.
        let bounces = bounces::BounceCounter::most().saturating_mul(turns);
        for _ in 0..allowed.saturating_add(most).saturating_add(bounces) {
            if watch.is_requested() {
                return IntegrationEnd::Interrupted;
            }
            if self.effort >= most {
                break;
            }
            if tau >= end {
                let arrived = self.arrive(tau, state, memory, &mut motion);
                return arrived.err().unwrap_or(IntegrationEnd::Reached);
            }
            let stop = match system.course() {
                None => self.next_stop(tau, end),
                Some(_) => self.next_corner(system, tau, end),
            };
            let span = Span {
                tau,
                middle: 0.5 * (tau + stop),
                remaining: (stop - tau) / per_theta,
                least: match motion.phi {
                    Some(_) => variation::terms((stop - tau) / per_theta),
                    None => 0,
                },
            };
            let is_due = is_stale || !self.kinks.is_empty();
            if is_due && let Err(end) = self.stiffen(system, span.middle) {
                return end;
            }
            let reach = self.expand(span, state, &motion);
            if let Some(fault) = self.fault(system, tau) {
                return fault;
            }
            let whole = span.remaining <= reach * (1.0 + 1e-12);
            let step = if whole { span.remaining } else { reach };
            let crossing = self
                .regions
                .first_crossing(&self.series, (tau, state), step);
            let theta = crossing.map_or(step, |c| c.theta);
            let next = match crossing {
                None if whole => stop,
                _ => (tau + theta * per_theta).min(stop),
            };
            if crossing.is_none() {
                if next <= tau {
                    return self.stuck(system, tau);
                }
                if !whole {
                    let count = self.series.count;
                    let culprit = || self.acting.steepest(count).map(|c| c.0);
                    self.labour.add(step * per_theta, culprit);
                }
            }
            self.series.state(theta, state);
            let bound = match self.acting.list.is_empty() {
                true => f64::MAX,
                false => self.options.bound,
            };
            if !state.iter().all(|x| x.abs() <= bound) {
                return IntegrationEnd::Diverged;
            }
            self.report(tau, theta * per_theta, theta, motion.observer);
            self.transfer(theta, &mut motion);
            self.regions.evolve(theta);
            is_stale = crossing.is_some();
            self.effort += usize::from(crossing.is_none());
            if self.regions.has_contacts() {
                self.regions.fly(&self.series, theta, state);
            }
            if let Some(c) = crossing {
                match self.cross(&c, next, state, &mut motion) {
                    Ok(counts) => self.switches += usize::from(counts),
                    Err(end) => return end,
                }
                if self.switches > allowed {
                    return IntegrationEnd::TooManySwitches;
                }
            }
            tau = next;
        }
        IntegrationEnd::MaxSteps
    }

    /// Refreshes what depends on the frequency.
    fn prepare(&mut self, system: &System) {
        if self.series.prepare(system) {
            let revolutions = system.revolutions() as f64;
            let frequency = system.highest_frequency();
            self.acting
                .prepare(frequency, self.series.unit, revolutions);
            self.corners = system.corners();
        }
    }

    /// The series of a step and, on request, of the deviations from it; the largest theta at which they hold.
    fn expand(&mut self, span: Span, state: &[f64], motion: &MovedState<'_>) -> f64 {
        let system = motion.system;
        let Exact {
            series,
            acting,
            regions,
            deviations,
            ..
        } = self;
        series.expand(system, (acting, regions), span, state);
        regions.take_courses(acting);
        let reach = series.reach(acting);
        let step = reach.min(span.remaining);
        let reach = (acting.come_back(|k| regions.piece(k), series.count, step)).unwrap_or(reach);
        match &motion.phi {
            None => reach,
            Some(_) if acting.list.is_empty() => reach.min(variation::REACH * series.pace()),
            Some(phi) => {
                acting.differentiate(|k| regions.piece(k), series.count);
                let own = deviations.expand(system, (series, acting, regions), phi);
                reach.min(own)
            }
        }
    }

    /// Takes the transition matrix along to theta.
    fn transfer(&mut self, theta: f64, motion: &mut MovedState<'_>) {
        let Some(phi) = motion.phi.as_deref_mut() else {
            return;
        };
        if self.acting.list.is_empty() {
            self.variation.advance(&self.series, phi, theta);
        } else {
            let parts = (&self.acting, &self.regions);
            let at = (motion.system.dof(), theta, self.series.unit);
            self.deviations.evaluate(phi, parts, at);
        }
    }

    /// Why the step has no series, if it has none.
    fn fault(&self, system: &System, tau: f64) -> Option<IntegrationEnd> {
        let fault = self.acting.fault(self.series.count)?;
        Some(not_analytic(system, tau, fault))
    }

    /// Why the step has no length.
    fn stuck(&self, system: &System, tau: f64) -> IntegrationEnd {
        let steepest = self.acting.steepest(self.series.count);
        steepest.map_or(IntegrationEnd::StepTooSmall, |c| {
            not_analytic(system, tau, c)
        })
    }

    /// End of the current stretch of constant stiffness.
    fn next_stop(&self, tau: f64, end: f64) -> f64 {
        if self.kinks.is_empty() {
            return end;
        }
        let turn = (tau / TAU).floor() * TAU;
        let later = |turn: f64| {
            let first = self.kinks.partition_point(|k| turn + k <= tau + 1e-13);
            self.kinks.get(first).map(|k| turn + k)
        };
        later(turn)
            .or_else(|| later(turn + TAU))
            .unwrap_or(end)
            .min(end)
    }

    /// End of the current stretch along a course of speed.
    fn next_corner(&self, system: &System, tau: f64, end: f64) -> f64 {
        let first = self.corners.partition_point(|t| *t <= tau);
        let stop = self.corners.get(first).map_or(end, |t| t.min(end));
        system.next_kink(&self.kinks, tau, stop).unwrap_or(stop)
    }

    /// Slopes and offsets of the current regions with the stiffness at a phase; which connections act by series.
    fn stiffen(&mut self, system: &System, tau: f64) -> Result<(), IntegrationEnd> {
        let phase = system.moment(tau).phase;
        self.acting.list.clear();
        self.slope.fill(0.0);
        self.offset.fill(0.0);
        for part in 0..self.regions.parts().len() {
            let e = self.acting.connection(part);
            let variation = system.mounts()[e].stiffness_variation.as_ref();
            let factor = variation.map_or(1.0, |s| s.value(phase));
            let line = self.acting.admit(part, self.regions.piece(part), factor);
            if let Some((slope, offset)) = line {
                self.slope[e] += slope;
                self.offset[e] += offset;
            }
        }
        self.series.set_laws(&self.slope, &self.offset);
        match self.regions.has_automata() {
            true => self.bind(system, phase),
            false => Ok(()),
        }
    }

    /// Hands the step to the observer, in powers of its own length.
    fn report(&mut self, tau: f64, width: f64, theta: f64, observer: &mut dyn FlowObserver) {
        if width <= 0.0 || !observer.wants_segments() {
            return;
        }
        let scaled = |out: &mut Polynomial, block: &Polynomial| {
            let mut power = 1.0;
            for (o, c) in out.iter_mut().zip(block) {
                *o = c * power;
                power *= theta;
            }
        };
        let n = self.series.q.len();
        for (out, block) in self.segment.iter_mut().zip(&self.series.q) {
            scaled(out, block);
        }
        for (k, part) in self.regions.parts().iter().enumerate() {
            let Some(m) = part.memory else {
                continue;
            };
            let out = &mut self.segment[n + m];
            if part.evolves() {
                scaled(out, &part.course);
                continue;
            }
            match self.regions.follows(k) {
                Some(offset) => {
                    scaled(out, self.series.deformation(part.connection));
                    out[0] += offset;
                }
                None => {
                    *out = [0.0; COUNT];
                    out[0] = part.z;
                }
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
