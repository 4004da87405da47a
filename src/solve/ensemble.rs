//! Many trajectories of one system at once: states at phase 0 after every period of the excitation.

use super::integrate::{IntegrationEnd, Integrator, IntegratorOptions, choose};
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
    /// [q; v], 2n values.
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
    state: Vec<f64>,
}

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
            state: vec![0.0; system.state_size()],
        })
    }

    /// Name of the integrator: `exact`, `series` or `dopri5`.
    pub fn name(&self) -> &'static str {
        self.integrator.name()
    }

    /// Follows every start, 2n values each, for a number of periods of the excitation at most, and shows `visit` its state after each;
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
        let starts = starts.chunks_exact(self.state.len()).enumerate();
        let ends = starts.map(|(trajectory, start)| {
            self.state.copy_from_slice(start);
            self.follow(system, trajectory, periods, visit)
        });
        ends.collect()
    }

    fn follow(
        &mut self,
        system: &System,
        trajectory: usize,
        periods: usize,
        visit: &mut dyn FnMut(Visit<'_>) -> Next,
    ) -> IntegrationEnd {
        let span = (0.0, TAU / system.subharmonic() as f64);
        for period in 1..=periods {
            if interrupt::is_requested() {
                return IntegrationEnd::Interrupted;
            }
            let state = &mut self.state;
            let end = self.integrator.advance(system, span, state, &mut ());
            if end != IntegrationEnd::Reached {
                return end;
            }
            let next = visit(Visit {
                trajectory,
                period,
                state,
            });
            if next == Next::Stop {
                break;
            }
        }
        IntegrationEnd::Reached
    }
}
