//! The flow at places of a plane of two parameters.

use crate::element::PiecewiseLinear;
use crate::error::SolveError;
use crate::solve::family::equal_parts;
use crate::solve::integrate::{
    FlowObserver, IntegrationEnd, Integrator, IntegratorChoice, Switch, choose,
};
use crate::solve::{floquet, jumps, uninterrupted};
use crate::system::System;
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Systems over two parameters, each as a share of its range.
pub(crate) trait Plane {
    /// The system, its frequency included.
    ///
    /// # Errors
    /// There is none at this place.
    fn system(&mut self, p: [f64; 2]) -> Result<System, SolveError>;

    /// Which of the parameters is the excitation frequency, where nothing else depends on it.
    fn frequency(&self) -> Option<usize>;

    /// The frequency of the reference at a place.
    fn reference_frequency(&self, p: [f64; 2]) -> f64;
}

/// Systems kept with their integrators: one and its neighbours in both parameters.
const KEPT: usize = 5;

struct SystemSlot {
    key: [f64; 2],
    system: System,
    integrator: Box<dyn Integrator + Send>,
    /// The same without the law of one connection.
    free: Option<Free>,
}

/// A flow without the law of one connection.
struct Free {
    connection: usize,
    system: System,
    integrator: Box<dyn Integrator + Send>,
}

/// Phase before a touching of a stop within which the stop is left out: what lies beyond its level there is the motion without it.
const WITHOUT: f64 = 0.1;

/// Maps over the response period.
pub(crate) struct Shots<'a> {
    plane: Box<dyn Plane + 'a>,
    choice: IntegratorChoice,
    slots: Vec<SystemSlot>,
    next: usize,
    size: usize,
    /// Coordinates and rates: what is behind them in the state is remembered.
    motion: usize,
    /// Period of the orbits, in tau.
    period: f64,
}

/// Passages of breakpoints in a period: connection, breakpoint counted from below, phase, rate.
#[derive(Debug, Clone, Default)]
pub(crate) struct Passages(pub Vec<(usize, usize, f64, f64)>);

struct Counting<'a> {
    breakpoints: &'a [Vec<f64>],
    found: &'a mut Passages,
}

impl FlowObserver for Counting<'_> {
    fn wants_segments(&self) -> bool {
        false
    }

    fn switch(&mut self, switch: &Switch) {
        let levels = self.breakpoints[switch.connection].iter().enumerate();
        let gap = |level: &f64| (level - switch.level).abs();
        let nearest = levels.min_by(|a, b| gap(a.1).total_cmp(&gap(b.1)));
        let level = nearest.map_or(0, |(k, _)| k);
        (self.found.0).push((switch.connection, level, switch.tau, switch.velocity));
    }
}

impl<'a> Shots<'a> {
    /// The flow of a plane, which must exist at a place.
    ///
    /// # Errors
    /// The system cannot be made, the integrator cannot take it, or a law has hidden jumps.
    pub fn new(
        mut plane: Box<dyn Plane + 'a>,
        place: [f64; 2],
        choice: IntegratorChoice,
    ) -> Result<Shots<'a>, SolveError> {
        let system = plane.system(place)?;
        jumps::refuse_hidden(&system)?;
        let (size, motion) = (system.state_size(), 2 * system.dof());
        let mut shots = Shots {
            plane,
            choice,
            slots: Vec::new(),
            next: 0,
            size,
            motion,
            period: TAU,
        };
        shots.slot(place)?;
        Ok(shots)
    }

    /// Values in a state.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Period of the orbits, in tau: a part of the response period where they repeat themselves before it is over.
    pub fn period(&self) -> f64 {
        self.period
    }

    /// Sets how often orbits repeat themselves in the response period.
    pub(crate) fn set_repeats(&mut self, repeats: usize) {
        self.period = TAU / repeats as f64;
    }

    /// How often the orbit of a state repeats itself in the response period.
    ///
    /// # Errors
    /// There is no system at this place, or an interruption.
    pub fn repeats(&mut self, p: [f64; 2], u: &[f64]) -> Result<usize, SolveError> {
        let most = self.system(p)?.repetitions();
        equal_parts(most, u, |span, end| self.map(p, (0.0, span), (end, None)))
    }

    /// The system at a place.
    ///
    /// # Errors
    /// There is none.
    pub fn system(&mut self, p: [f64; 2]) -> Result<&System, SolveError> {
        let slot = self.slot(p)?;
        Ok(&self.slots[slot].system)
    }

    /// Integrator.
    pub fn integrator(&self) -> &'static str {
        let slot = self.slots.first();
        slot.map_or("", |slot| slot.integrator.name())
    }

    /// P(u) over a part of the response period into `state`, which holds u, and Phi into `phi`; false where there is no image.
    /// A number that is remembered and never changes in a whole period is data: its row of Phi is 0, not 1.
    ///
    /// # Errors
    /// There is no system at this place, or an interruption.
    pub fn map(
        &mut self,
        p: [f64; 2],
        span: (f64, f64),
        (state, phi): (&mut [f64], Option<&mut DMatrix<f64>>),
    ) -> Result<bool, SolveError> {
        self.observed(p, span, (state, phi), &mut ())
    }

    /// The same over the period of the orbits, with the passages of breakpoints.
    ///
    /// # Errors
    /// As above.
    pub fn whole(
        &mut self,
        p: [f64; 2],
        state: &mut [f64],
        phi: Option<&mut DMatrix<f64>>,
    ) -> Result<Option<Passages>, SolveError> {
        let breakpoints = self.system(p)?.breakpoints();
        let mut found = Passages::default();
        let mut counting = Counting {
            breakpoints: &breakpoints,
            found: &mut found,
        };
        let span = (0.0, self.period);
        let is_whole = self.observed(p, span, (state, phi), &mut counting)?;
        Ok(is_whole.then_some(found))
    }

    /// As above, with an observer.
    ///
    /// # Errors
    /// As above.
    pub fn observed(
        &mut self,
        p: [f64; 2],
        span: (f64, f64),
        (state, phi): (&mut [f64], Option<&mut DMatrix<f64>>),
        observer: &mut dyn FlowObserver,
    ) -> Result<bool, SolveError> {
        let slot = self.slot(p)?;
        let (motion, period) = (self.motion, self.period);
        let SystemSlot {
            system, integrator, ..
        } = &mut self.slots[slot];
        let end = match phi {
            None => integrator.advance(system, span, state, observer),
            Some(phi) => {
                phi.fill_with_identity();
                let end = integrator.advance_with_variation(system, span, state, phi, observer);
                if span.1 - span.0 >= period {
                    let kept: Vec<usize> = floquet::kept(phi, motion).collect();
                    kept.into_iter().for_each(|row| phi[(row, row)] = 0.0);
                }
                end
            }
        };
        uninterrupted()?;
        Ok(end == IntegrationEnd::Reached && state.iter().all(|x| x.is_finite()))
    }

    /// The state at a phase at which a connection touches a breakpoint, or nearly does, with its transition matrix from phase 0. A stop is
    /// left out just before: beyond its level the motion is that without it, smooth, and not the one that it throws back.
    ///
    /// # Errors
    /// As above.
    pub fn approach(
        &mut self,
        p: [f64; 2],
        (connection, tau): (usize, f64),
        (state, mut phi): (&mut [f64], Option<&mut DMatrix<f64>>),
    ) -> Result<bool, SolveError> {
        let slot = self.slot(p)?;
        let law = &self.slots[slot].system.mounts()[connection].element;
        let begin = match law.least_impact() {
            Some(_) => (tau - WITHOUT).max(0.0),
            None => tau,
        };
        if let Some(phi) = phi.as_deref_mut() {
            phi.fill_with_identity();
        }
        if begin > 0.0 && !self.map(p, (0.0, begin), (&mut *state, phi.as_deref_mut()))? {
            return Ok(false);
        }
        if begin >= tau {
            return Ok(true);
        }
        let Free {
            system, integrator, ..
        } = self.free(slot, connection)?;
        let span = (begin, tau);
        let end = match phi {
            None => integrator.advance(system, span, state, &mut ()),
            Some(phi) => {
                let mut last = DMatrix::identity(phi.nrows(), phi.ncols());
                let end =
                    integrator.advance_with_variation(system, span, state, &mut last, &mut ());
                *phi = last * &*phi;
                end
            }
        };
        uninterrupted()?;
        Ok(end == IntegrationEnd::Reached && state.iter().all(|x| x.is_finite()))
    }

    /// The flow of a slot without the law of a connection.
    fn free(&mut self, slot: usize, connection: usize) -> Result<&mut Free, SolveError> {
        let SystemSlot { system, free, .. } = &mut self.slots[slot];
        let known = free.take().filter(|f| f.connection == connection);
        let made = match known {
            Some(known) => known,
            None => {
                let open = PiecewiseLinear {
                    breakpoints: Vec::new(),
                    slopes: vec![0.0],
                };
                let system = system.with_law(connection, Box::new(open));
                let integrator = choose(&system, self.choice)?;
                Free {
                    connection,
                    system,
                    integrator,
                }
            }
        };
        Ok(free.insert(made))
    }

    fn slot(&mut self, p: [f64; 2]) -> Result<usize, SolveError> {
        let mut key = p;
        if let Some(k) = self.plane.frequency() {
            key[k] = 0.0;
        }
        let known = self.slots.iter().position(|slot| slot.key == key);
        let k = match known {
            Some(k) => k,
            None => {
                let system = self.plane.system(p)?;
                let integrator = choose(&system, self.choice)?;
                let slot = SystemSlot {
                    key,
                    system,
                    integrator,
                    free: None,
                };
                if self.slots.len() < KEPT {
                    self.slots.push(slot);
                    self.slots.len() - 1
                } else {
                    let k = self.next;
                    self.next = (k + 1) % KEPT;
                    self.slots[k] = slot;
                    k
                }
            }
        };
        let frequency = self.plane.reference_frequency(p);
        self.slots[k].system.set_reference_frequency(frequency);
        if let Some(free) = &mut self.slots[k].free {
            free.system.set_reference_frequency(frequency);
        }
        Ok(k)
    }
}
