//! Many trajectories of one system at once: states at phase 0 after every period of the excitation.
//!
//! Where the system allows it several trajectories are in flight together ([`Flight`]): as soon as one ends, the next start takes its
//! place. Elsewhere they follow one after the other. The states are the same, to the bit.

use super::integrate::{Flight, IntegrationEnd, Integrator, IntegratorOptions, Status, choose};
use crate::error::SolveError;
use crate::interrupt;
use crate::system::System;
use std::f64::consts::TAU;

/// A state at phase 0.
#[derive(Debug, Clone, Copy)]
pub struct Visit<'a> {
    /// Number of the trajectory, as its start was given.
    pub trajectory: usize,
    /// Periods completed, from 1.
    pub period: usize,
    /// [q; v; z].
    pub state: &'a [f64],
}

/// Whether a trajectory goes on after a visit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// For another period.
    GoOn,
    /// Enough is known.
    Stop,
}

/// Integrates trajectories of one system; use one per thread.
///
/// A trajectory depends on its start alone, to the bit: not on the other starts, not on their number or order.
pub struct Ensemble {
    integrator: Box<dyn Integrator + Send>,
    size: usize,
}

/// Starts from which on trajectories fly together.
const FEWEST: usize = 3;

impl Ensemble {
    /// For a system; make a new one when anything but its frequency changes.
    ///
    /// # Errors
    /// [`SolveError::Unsupported`] when the system does not admit the integrator.
    pub fn new(
        system: &System,
        options: impl Into<IntegratorOptions>,
    ) -> Result<Ensemble, SolveError> {
        Ok(Ensemble {
            integrator: choose(system, options)?,
            size: system.state_size(),
        })
    }

    /// Name of the integrator: `exact`, `series` or `dopri5`.
    pub fn name(&self) -> &'static str {
        self.integrator.name()
    }

    /// The integrator, for what trajectories have to do alone.
    pub fn integrator(&mut self) -> &mut dyn Integrator {
        self.integrator.as_mut()
    }

    /// Follows every start, a state each, for a number of periods of the excitation at most, and shows `visit` its state after each;
    /// how each trajectory ended, in the order of the starts.
    ///
    /// Visits of one trajectory come in order; those of several mix.
    pub fn run(
        &mut self,
        system: &System,
        starts: &[f64],
        periods: usize,
        visit: &mut dyn FnMut(Visit<'_>) -> Next,
    ) -> Vec<IntegrationEnd> {
        let count = starts.len() / self.size;
        let flight = (count >= FEWEST).then(|| self.integrator.flight(system));
        let mut tour = Tour {
            ensemble: self,
            system,
            periods,
            visit,
            ends: vec![IntegrationEnd::Reached; count],
        };
        match flight.flatten() {
            Some(flight) => tour.fly(starts, flight),
            None => tour.walk(starts),
        }
        tour.ends
    }
}

/// All trajectories of a call.
struct Tour<'a> {
    ensemble: &'a mut Ensemble,
    system: &'a System,
    periods: usize,
    visit: &'a mut dyn FnMut(Visit<'_>) -> Next,
    ends: Vec<IntegrationEnd>,
}

/// A trajectory at the begin of a period.
#[derive(Clone)]
struct Passenger {
    trajectory: usize,
    /// Periods completed.
    period: usize,
    state: Vec<f64>,
}

impl Tour<'_> {
    /// One after the other.
    fn walk(&mut self, starts: &[f64]) {
        for (trajectory, start) in starts.chunks_exact(self.ensemble.size).enumerate() {
            let mut passenger = Passenger {
                trajectory,
                period: 0,
                state: start.to_vec(),
            };
            while passenger.period < self.periods && self.alone(&mut passenger) {}
        }
    }

    /// Several together.
    fn fly(&mut self, starts: &[f64], mut flight: Box<dyn Flight>) {
        let places = flight.places();
        let mut queue = starts.chunks_exact(self.ensemble.size).enumerate();
        let mut seats: Vec<Option<Passenger>> = vec![None; places];
        let mut status = vec![Status::Arrived; places];
        loop {
            let mut is_empty = true;
            for (place, seat) in seats.iter_mut().enumerate() {
                let mut flies = status[place] == Status::Flying && seat.is_some();
                if let Some(passenger) = seat.as_mut().filter(|_| !flies) {
                    let goes_on = match status[place] {
                        Status::Lost => self.alone(passenger),
                        _ => {
                            flight.state(place, &mut passenger.state);
                            self.show(passenger)
                        }
                    };
                    flies = goes_on && self.board(flight.as_mut(), (place, passenger));
                }
                while !flies {
                    let Some((trajectory, start)) = queue.next() else {
                        *seat = None;
                        break;
                    };
                    let passenger = seat.get_or_insert_with(|| Passenger {
                        trajectory,
                        period: 0,
                        state: start.to_vec(),
                    });
                    (passenger.trajectory, passenger.period) = (trajectory, 0);
                    passenger.state.copy_from_slice(start);
                    flies = self.board(flight.as_mut(), (place, passenger));
                }
                is_empty &= !flies;
            }
            if is_empty {
                return;
            }
            if interrupt::is_requested() {
                for passenger in seats.iter().flatten() {
                    self.ends[passenger.trajectory] = IntegrationEnd::Interrupted;
                }
                queue.for_each(|(k, _)| self.ends[k] = IntegrationEnd::Interrupted);
                return;
            }
            flight.step(&mut status);
        }
    }

    /// Puts a trajectory into its place, after what it has to do alone; whether it flies.
    fn board(
        &mut self,
        flight: &mut dyn Flight,
        (place, passenger): (usize, &mut Passenger),
    ) -> bool {
        while passenger.period < self.periods {
            if flight.start(place, &passenger.state) {
                return true;
            }
            if !self.alone(passenger) {
                break;
            }
        }
        false
    }

    /// A period by the integrator; whether the trajectory goes on.
    fn alone(&mut self, passenger: &mut Passenger) -> bool {
        if interrupt::is_requested() {
            self.ends[passenger.trajectory] = IntegrationEnd::Interrupted;
            return false;
        }
        let span = (0.0, TAU / self.system.subharmonic() as f64);
        let integrator = &mut self.ensemble.integrator;
        let end = integrator.advance(self.system, span, &mut passenger.state, &mut ());
        if end != IntegrationEnd::Reached {
            self.ends[passenger.trajectory] = end;
            return false;
        }
        self.show(passenger)
    }

    /// Shows a state at the end of a period; whether the trajectory goes on.
    fn show(&mut self, passenger: &mut Passenger) -> bool {
        passenger.period += 1;
        let next = (self.visit)(Visit {
            trajectory: passenger.trajectory,
            period: passenger.period,
            state: &passenger.state,
        });
        next == Next::GoOn
    }
}
