//! Dormand and Prince's method as an integrator.

use super::Dopri5;
use crate::solve::integrate::{FlowObserver, IntegrationEnd, Integrator};
use crate::solve::jumps;
use crate::system::System;
use nalgebra::DMatrix;

impl Integrator for Dopri5 {
    fn name(&self) -> &'static str {
        "dopri5"
    }

    fn start(&mut self, system: &System, tau: f64, state: &[f64], observer: &mut dyn FlowObserver) {
        self.stepper.load(state, None);
        self.begin(system, tau);
        self.regions
            .report_begun(system, &self.stepper.instant(tau), observer);
    }

    fn error(&self) -> f64 {
        10.0 * self.options.relative
    }

    fn effort(&self) -> usize {
        self.work.attempts
    }

    fn allow(&mut self, steps: usize) {
        self.allowance = steps;
    }

    fn advance(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd {
        self.run(system, tau, state, None, observer)
    }

    fn advance_with_variation(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        phi: &mut DMatrix<f64>,
        observer: &mut dyn FlowObserver,
    ) -> IntegrationEnd {
        if jumps::refuse_hidden(system).is_err() {
            phi.fill(f64::NAN);
            return self.run(system, tau, state, None, observer);
        }
        self.run(system, tau, state, Some(phi), observer)
    }
}
