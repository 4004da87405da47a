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
mod decay;
mod deviations;
mod entries;
mod forcing;
mod frequencies;
mod integrator;
mod laws;
mod options;
mod pace;
mod regions;
mod series;
mod variation;

use super::{IntegrationEnd, Observer, Segment, Switch};
use crate::error::SolveError;
use crate::interrupt::Watch;
use crate::numeric::bernstein::{Direction, evaluate};
use crate::numeric::periodic::Periodic;
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::solve::jumps;
use crate::system::System;
use acting::Acting;
use deviations::Deviations;
use integrator::{kinks, not_analytic};
pub(super) use laws::Law;
use nalgebra::DMatrix;
pub use options::SeriesOptions;
use regions::Regions;
use series::{Series, Span};
use std::f64::consts::TAU;
use variation::Variation;

/// Integration by Taylor series. One call depends on its arguments only, not on the calls before.
#[derive(Debug, Clone)]
pub struct Exact {
    series: Series,
    regions: Regions,
    acting: Acting,
    variation: Variation,
    deviations: Deviations,
    options: SeriesOptions,
    name: &'static str,
    /// Steps of the last call, and how many a call may take.
    effort: usize,
    allowance: usize,
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
}

/// Steps allowed per unit of time of the series, the reciprocal of the highest frequency.
const STEPS_PER_UNIT: f64 = 50.0 / TAU;

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
    /// [`SolveError::Unsupported`] names the connection that has no series.
    pub fn new(system: &System, max_switches: usize) -> Result<Exact, SolveError> {
        let options = SeriesOptions {
            max_switches,
            ..SeriesOptions::default()
        };
        Exact::with(system, options)
    }

    /// The same with options.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] names the connection that has no series.
    pub fn with(system: &System, options: SeriesOptions) -> Result<Exact, SolveError> {
        let laws = laws::read(system)?;
        let (n, e) = (system.dof(), system.element_count());
        let series = Series::new(system, &laws, &options);
        let is_closed_form = laws.iter().zip(system.mounts()).all(|(law, mount)| {
            let varies = (mount.stiffness_variation.iter()).any(Periodic::varies_smoothly);
            law.is_affine() && !varies
        });
        Ok(Exact {
            kinks: kinks(system, &laws),
            corners: Vec::new(),
            acting: Acting::new(system, &laws),
            regions: Regions::new(laws, &series),
            series,
            variation: Variation::new(n),
            deviations: Deviations::default(),
            options,
            name: if is_closed_form { "exact" } else { "series" },
            effort: 0,
            allowance: usize::MAX,
            slope: vec![0.0; e],
            offset: vec![0.0; e],
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
        self.prepare(system);
        // theta = T / h and tau = Om T.
        let per_theta = system.omega() * self.series.unit;
        let (mut tau, mut switches) = (begin, 0);
        let turns = ((end - begin) / TAU).ceil().max(1.0) as usize;
        let allowed = self.options.max_switches.saturating_mul(turns);
        self.place(system, tau, state);
        let mut is_stale = true;
        let mut watch = Watch::default();
        let nominal = STEPS_PER_UNIT * (end - begin) / per_theta;
        let most = (self.options.spare_steps)
            .saturating_mul(turns)
            .saturating_add(nominal as usize);
        let most = match self.name {
            "exact" => most,
            _ => most.min(self.allowance),
        };
        self.effort = 0;
        // Switches have a limit of their own.
        for _ in 0..allowed.saturating_add(most) {
            if watch.is_requested() {
                return IntegrationEnd::Interrupted;
            }
            if self.effort >= most {
                break;
            }
            if tau >= end {
                self.arrive(tau, state, &mut motion);
                return IntegrationEnd::Reached;
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
            if is_stale || !self.kinks.is_empty() {
                self.stiffen(system, span.middle);
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
            if crossing.is_none() && next <= tau {
                return self.stuck(system, tau);
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
            is_stale = crossing.is_some();
            self.effort += usize::from(crossing.is_none());
            if let Some(c) = crossing {
                self.cross((c.connection, c.direction), next, theta, &mut motion);
                switches += 1;
                if switches > allowed {
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

    /// The series of a step and, where it is asked for, of the deviations from it; the largest theta at which they hold.
    fn expand(&mut self, span: Span, state: &[f64], motion: &Motion<'_>) -> f64 {
        let system = motion.system;
        let Exact {
            series,
            acting,
            regions,
            deviations,
            options,
            ..
        } = self;
        series.expand(system, (acting, regions), span, state);
        let reach = series.reach(acting);
        match &motion.phi {
            None => reach,
            Some(_) if acting.list.is_empty() => reach.min(variation::REACH * series.pace()),
            Some(phi) => {
                acting.differentiate(|k| regions.piece(k), series.count);
                let own = deviations.expand(system, (series, acting), phi, options.tolerance);
                reach.min(own)
            }
        }
    }

    /// Takes the transition matrix along to theta.
    fn transfer(&mut self, theta: f64, motion: &mut Motion<'_>) {
        let Some(phi) = motion.phi.as_deref_mut() else {
            return;
        };
        if self.acting.list.is_empty() {
            self.variation.advance(&self.series, phi, theta);
        } else {
            self.deviations.evaluate(phi, theta, self.series.unit);
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

    /// Regions at an instant; on a breakpoint that to which the connection moves.
    fn place(&mut self, system: &System, tau: f64, state: &[f64]) {
        let q = &state[..system.dof()];
        let phase = system.moment(tau).phase;
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
            self.open_series(system, tau, state);
            self.regions.leave(&self.series, (tau, state));
        }
    }

    /// The series of the motion at an instant, in the regions at hand.
    fn open_series(&mut self, system: &System, tau: f64, state: &[f64]) {
        self.stiffen(system, tau);
        let span = Span::at(tau);
        let forces = (&mut self.acting, &self.regions);
        self.series.expand(system, forces, span, state);
    }

    /// Reports the switches of connections that end on a breakpoint and are about to pass it: the next call starts beyond.
    fn arrive(&mut self, tau: f64, state: &[f64], motion: &mut Motion<'_>) {
        let mut after = std::mem::take(&mut self.scratch);
        self.regions.save(&mut after);
        self.place(motion.system, tau, state);
        self.regions.swap(&mut after);
        for (k, region) in after.iter().enumerate() {
            while let Some(direction) = self.regions.towards(k, *region) {
                self.open_series(motion.system, tau, state);
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
            let phase = motion.system.moment(tau).phase;
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
    fn stiffen(&mut self, system: &System, tau: f64) {
        let phase = system.moment(tau).phase;
        self.acting.list.clear();
        for (e, mount) in system.mounts().iter().enumerate() {
            let variation = mount.stiffness_variation.as_ref();
            let factor = variation.map_or(1.0, |s| s.value(phase));
            let line = self.acting.admit(e, self.regions.piece(e), factor);
            (self.slope[e], self.offset[e]) = line.unwrap_or((0.0, 0.0));
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
