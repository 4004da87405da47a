//! Dormand and Prince's Runge-Kutta method of order 5(4), for every system.
//!
//! A step sees each law in one region only: beyond the region a law is continued along its tangent, so that a trial step is
//! smooth even where it overshoots. Where the deformation, a quintic polynomial on the step, passes a breakpoint, the step
//! is repeated up to the breakpoint. Kinks of loads, stiffness variation and transmission error end a step likewise.

mod integrator;
mod memories;
mod pieces;
mod regions;
mod stepper;

use super::{FlowObserver, IntegrationEnd, Segment};
use crate::interrupt::Watch;
use crate::system::System;
use nalgebra::DMatrix;
use pieces::Pieces;
use regions::{COUNT, StepPassage, SteppedRegions};
use std::f64::consts::TAU;
use stepper::{Stepper, hermite};

/// Error control and limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dopri5Options {
    /// Error of a step allowed relative to each coordinate and velocity, and to the largest entry of Phi.
    pub relative: f64,
    /// Error allowed besides.
    pub absolute: f64,
    /// Longest step in omega_c t.
    pub max_step: f64,
    /// Steps at most in one call, rejected ones included.
    pub max_steps: usize,
    /// Switches at most in one call, for every turn of tau it covers, at least one turn.
    pub max_switches: usize,
    /// A coordinate or velocity beyond this has diverged.
    pub bound: f64,
}

impl Default for Dopri5Options {
    fn default() -> Self {
        Dopri5Options {
            relative: 1e-10,
            absolute: 1e-12,
            max_step: f64::INFINITY,
            max_steps: 10_000_000,
            max_switches: 100_000,
            bound: 1e12,
        }
    }
}

/// Gustafsson's step control with the constants of Hairer, Norsett & Wanner's DOPRI5.
const SAFETY: f64 = 0.9;
const MEMORY: f64 = 0.04;
const EXPONENT: f64 = 0.2 - 0.75 * MEMORY;
const SHRINK: f64 = 0.2;
const GROW: f64 = 10.0;

/// Repetitions of a step that is to land on a breakpoint; two or three are enough unless it is grazed.
const LANDINGS: usize = 16;

/// Rounds in which sliders enter regions at one instant.
const MOST_AT_ONCE: usize = 8;

/// Shortest and longest trial step that shows which way a connection leaves the breakpoint on which it starts, in units of the
/// fastest time scale.
const SHORTEST_PROBE: f64 = 1e-9;
const LONGEST_PROBE: f64 = 0.1;

/// Integrator with its buffers. One call depends on its arguments only, not on the calls before.
///
/// Where the force jumps at a breakpoint the state lands on it and Phi gets its saltation matrix; a joint that comes to rest there
/// ends the call with [`IntegrationEnd::Sticks`]. A law whose kinks or jumps depend on its own velocity or phase is
/// integrated through them under error control.
#[derive(Debug, Clone)]
pub struct Dopri5 {
    options: Dopri5Options,
    stepper: Stepper,
    regions: SteppedRegions,
    pieces: Pieces,
    /// Next step in omega_c t, as error control has it.
    step: f64,
    last_error: f64,
    was_rejected: bool,
    allowance: usize,
    work: StepWork,
}

/// Cost of the last call.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StepWork {
    /// Steps accepted.
    pub steps: usize,
    /// Trial steps, those that locate breakpoints included; six evaluations each.
    pub attempts: usize,
    /// Breakpoints passed.
    pub switches: usize,
}

impl Dopri5 {
    /// Buffers for a system.
    pub fn new(system: &System, options: Dopri5Options) -> Dopri5 {
        Dopri5 {
            options,
            stepper: Stepper::new(system),
            regions: SteppedRegions::default(),
            pieces: Pieces::default(),
            step: 0.0,
            last_error: 0.0,
            was_rejected: false,
            allowance: usize::MAX,
            work: StepWork::default(),
        }
    }

    /// Cost of the last call.
    pub fn work(&self) -> StepWork {
        self.work
    }

    /// dq/dT = v, dv/dT = Q - Gam v - kappa f, T = tau / Om.
    fn integrate(
        &mut self,
        system: &System,
        tau: (f64, f64),
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd {
        let om = system.omega();
        let (mut t, end) = (tau.0 / om, tau.1 / om);
        if !(end - t).is_finite() || !self.is_bounded() {
            return IntegrationEnd::Diverged;
        }
        let turns = ((tau.1 - tau.0) / TAU).max(1.0);
        let switches = turns * self.options.max_switches as f64;
        self.begin(system, tau.0);
        let mut watch = Watch::default();
        while t < end {
            if watch.is_requested() {
                return IntegrationEnd::Interrupted;
            }
            if self.work.attempts >= self.options.max_steps.min(self.allowance) {
                return IntegrationEnd::MaxSteps;
            }
            let target = end.min(self.pieces.end() / om);
            let tried = self.length(target - t);
            let error = self.attempt(system, t, tried);
            if error.is_nan() || error > 1.0 {
                self.reject(tried, error);
                if self.step <= 4.0 * f64::EPSILON * t.abs().max(end.abs()) {
                    return IntegrationEnd::StepTooSmall;
                }
                continue;
            }
            self.adapt(tried, error);
            let (h, passage) = self.locate(system, t, tried);
            let begin = t;
            t = if h == target - t { target } else { t + h };
            self.complete(system, (begin, t), passage, observer);
            if !self.is_bounded() {
                return IntegrationEnd::Diverged;
            }
            if let Some(connection) = self.regions.sticks {
                return IntegrationEnd::Sticks(connection);
            }
            if self.work.switches as f64 > switches {
                return IntegrationEnd::TooManySwitches;
            }
        }
        IntegrationEnd::Reached
    }

    /// Regions, rates and step at the start of a call.
    fn begin(&mut self, system: &System, tau: f64) {
        self.pieces.start(system, tau);
        self.stepper.place(system, self.pieces.clamp(tau));
        let deformation = self.stepper.deformation(system, self.pieces.clamp(tau));
        self.regions.start(system, deformation);
        self.refresh(system, tau, &mut ());
        let fastest = (1.0 + system.stiffness().amax()).sqrt();
        self.probe(system, tau, 1.0 / fastest);
        self.regions.begin(1.0 / fastest);
        self.work = StepWork::default();
        (self.step, self.last_error) = (self.options.relative.powf(0.2) / fastest, 1e-4);
        self.was_rejected = false;
    }

    /// Places connections that start on a breakpoint with a rate that does not decide: trial steps, each twice as long as the one before, show which way they leave.
    fn probe(&mut self, system: &System, tau: f64, unit: f64) {
        let om = system.omega();
        let mut waiting = self.regions.undecided(&self.stepper.instant(tau));
        let longest = (LONGEST_PROBE * unit).min((self.pieces.end() - tau) / om);
        if waiting.is_empty() {
            return;
        }
        let mut h = SHORTEST_PROBE * unit;
        while !waiting.is_empty() && h <= longest {
            self.attempt(system, tau / om, h);
            let at = self.stepper.trial_instant(tau + om * h);
            self.regions.place_leaving(&mut waiting, &at);
            self.stepper
                .refresh(system, &self.regions, &self.pieces, tau / om);
            h *= 2.0;
        }
    }

    /// Rates after a change of region or stretch, which may bring on further changes.
    fn refresh(&mut self, system: &System, tau: f64, observer: &mut dyn FlowObserver) {
        let Dopri5 {
            stepper,
            regions,
            pieces,
            ..
        } = self;
        stepper.refresh(system, regions, pieces, tau / system.omega());
        if regions.settle(system, pieces, &stepper.instant(tau), None, observer) {
            stepper.saltate(system, regions);
            stepper.refresh(system, regions, pieces, tau / system.omega());
        }
        self.settle_memories(system, tau, None, observer);
    }

    /// Moves sliders on their guards, one after the other where several do at one instant.
    fn settle_memories(
        &mut self,
        system: &System,
        tau: f64,
        mut landed: Option<StepPassage>,
        observer: &mut dyn FlowObserver,
    ) {
        let Dopri5 {
            stepper,
            regions,
            pieces,
            ..
        } = self;
        if stepper.memories.is_empty() {
            return;
        }
        for _ in 0..MOST_AT_ONCE {
            stepper.hand_over(system);
            if !stepper.settle_memories(system, tau, landed.take(), observer) {
                break;
            }
            stepper.hand_over(system);
            stepper.refresh(system, regions, pieces, tau / system.omega());
        }
    }

    fn attempt(&mut self, system: &System, t: f64, h: f64) -> f64 {
        self.work.attempts += 1;
        let Dopri5 {
            options,
            stepper,
            regions,
            pieces,
            ..
        } = self;
        stepper.attempt(system, regions, pieces, (t, h), options)
    }

    /// The next step: not past the end of the stretch, and no sliver left before it.
    fn length(&self, room: f64) -> f64 {
        let longest = self.options.max_step.min(self.pieces.longest_step);
        let step = self.step.min(longest);
        if step >= room {
            room
        } else if step > 0.5 * room {
            0.5 * room
        } else {
            step
        }
    }

    fn reject(&mut self, h: f64, error: f64) {
        let factor = if error.is_finite() {
            (SAFETY * error.powf(-EXPONENT)).clamp(SHRINK, SAFETY)
        } else {
            SHRINK
        };
        self.step = h * factor;
        self.was_rejected = true;
    }

    fn adapt(&mut self, h: f64, error: f64) {
        let factor = SAFETY * error.max(1e-10).powf(-EXPONENT) * self.last_error.powf(MEMORY);
        let most = if self.was_rejected { 1.0 } else { GROW };
        let next = h * factor.clamp(SHRINK, most);
        // A step cut short by the end of its stretch is no reason for short steps behind it.
        self.step = if h < self.step {
            self.step.max(next)
        } else {
            next
        };
        self.last_error = error.max(1e-4);
        self.was_rejected = false;
    }

    /// The step that ends on the first breakpoint within the step just tried, or that one.
    fn locate(&mut self, system: &System, t: f64, tried: f64) -> (f64, Option<StepPassage>) {
        self.stepper.interpolate(tried);
        let om = system.omega();
        let taus = [t, t + tried].map(|t| self.pieces.clamp(om * t));
        let error = |k: usize, c: &mut [f64; COUNT]| transmission_error(system, k, taus, tried, c);
        let begin = (om * t, &self.stepper.state()[..2 * system.dof()]);
        let coefficients = &self.stepper.coefficients;
        let passage = self
            .regions
            .first_passage(system, begin, coefficients, error);
        let sliders = self.stepper.first_passage(system, tried, error);
        let both = [passage, sliders].into_iter().flatten();
        let Some(passage) = both.min_by(|a, b| a.x.total_cmp(&b.x)) else {
            return (tried, None);
        };
        let (h, landed) = self.land(system, t, tried, &passage);
        self.stepper.interpolate(h);
        (h, landed.then_some(passage))
    }

    /// Repeats the step until it ends on the breakpoint: Newton's method in the length of the step, within a bracket.
    ///
    /// Where the polynomial and the repeated step disagree about a graze, the step ends before the breakpoint without
    /// landing.
    fn land(&mut self, system: &System, t: f64, tried: f64, passage: &StepPassage) -> (f64, bool) {
        let (mut low, mut high) = (0.0, tried);
        let mut h = passage.x * tried;
        for _ in 0..LANDINGS {
            self.attempt(system, t, h);
            let tau = system.omega() * (t + h);
            let at = self.stepper.trial_instant(tau);
            let (distance, rate, tolerance) = match passage.slider {
                None => self.regions.beyond(passage, &at),
                Some(_) => self.stepper.memories.beyond(system, passage, &at),
            };
            if distance.abs() <= tolerance {
                return (h, true);
            }
            if distance > 0.0 {
                high = h;
            } else {
                low = h;
            }
            let newton = h - distance / rate;
            let next = if newton > low && newton < high {
                newton
            } else {
                0.5 * (low + high)
            };
            // Time resolves no more.
            if next == h || high - low <= 2.0 * f64::EPSILON * t.abs() {
                return (h, true);
            }
            h = next;
        }
        let stands = t + low == t;
        let h = if stands && high < tried { high } else { low };
        self.attempt(system, t, h);
        (h, stands)
    }

    /// Accepts the step between two times and whatever happens at its end.
    fn complete(
        &mut self,
        system: &System,
        (begin, end): (f64, f64),
        passage: Option<StepPassage>,
        observer: &mut dyn FlowObserver,
    ) {
        let om = system.omega();
        if end > begin {
            self.work.steps += 1;
            observer.segment(&Segment {
                tau: om * begin,
                width: om * (end - begin),
                coefficients: &self.stepper.coefficients,
                count: COUNT,
            });
        }
        let Dopri5 {
            stepper,
            regions,
            pieces,
            ..
        } = self;
        let at = stepper.trial_instant(om * end);
        let mut has_changed = regions.settle(system, pieces, &at, passage, observer);
        stepper.accept();
        stepper.saltate(system, regions);
        if end >= pieces.end() / om {
            pieces.advance(system);
            has_changed = true;
        }
        if let Some(passage) = passage.filter(|p| p.slider.is_some()) {
            self.settle_memories(system, om * end, Some(passage), observer);
        }
        if has_changed {
            self.refresh(system, om * end, observer);
        }
        self.work.switches = self.regions.switches + self.stepper.memories.switches;
    }

    fn is_bounded(&self) -> bool {
        let mut state = self.stepper.state().iter();
        state.all(|x| x.abs() <= self.options.bound)
    }

    fn run(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        phi: Option<&mut DMatrix<f64>>,
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd {
        self.stepper.load(state, phi.as_deref());
        let end = self.integrate(system, tau, observer);
        self.stepper.hand_over(system);
        self.stepper.store(state, phi);
        end
    }
}

/// What a transmission error adds to the deformation on a step between two phases: -e as a quintic polynomial.
fn transmission_error(system: &System, k: usize, taus: [f64; 2], h: f64, c: &mut [f64; COUNT]) {
    let Some(error) = &system.mounts()[k].transmission_error else {
        return;
    };
    let moments = taus.map(|tau| system.moment(tau));
    let [begin, end] = moments.map(|at| -error.value(at.phase));
    let slopes = moments.map(|at| [-at.frequency * error.derivative(at.phase), -at.bend(error)]);
    hermite(c, begin, end - begin, slopes, h);
}
