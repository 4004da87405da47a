//! Dormand and Prince's Runge-Kutta method of order 5(4), for every system.

use super::IntegrationEnd;
use crate::system::{Scratch, System};

/// Error control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dopri5Options {
    /// Error allowed relative to the state.
    pub relative: f64,
    /// Error allowed besides.
    pub absolute: f64,
    /// Steps at most in one call.
    pub max_steps: usize,
}

impl Default for Dopri5Options {
    fn default() -> Self {
        Dopri5Options {
            relative: 1e-9,
            absolute: 1e-11,
            max_steps: 10_000_000,
        }
    }
}

/// The scheme as data: nodes, stage weights, difference between the two solutions.
const NODES: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
const STAGES: [&[f64]; 7] = [
    &[],
    &[0.2],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
    ],
    &[
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
    ],
    &[
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];
const ERROR: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// Integrator with its buffers and its last step length.
#[derive(Debug, Clone)]
pub struct Dopri5 {
    options: Dopri5Options,
    rates: [Vec<f64>; 7],
    trial: Vec<f64>,
    scratch: Scratch,
    /// Last successful step in omega_c t.
    step: f64,
}

impl Dopri5 {
    /// Buffers for a system.
    pub fn new(system: &System, options: Dopri5Options) -> Dopri5 {
        let size = 2 * system.dof();
        let rates = std::array::from_fn(|_| vec![0.0; size]);
        Dopri5 {
            options,
            rates,
            trial: vec![0.0; size],
            scratch: system.scratch(),
            step: 0.0,
        }
    }

    /// Advances `state` = [q; v] from one phase tau of the response to another.
    ///
    /// dq/dT = v, dv/dT = Q - Gam v - kappa f, T = tau / Om.
    pub fn advance(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
    ) -> IntegrationEnd {
        let om = system.omega();
        let (mut t, end) = (tau.0 / om, tau.1 / om);
        if self.step <= 0.0 {
            self.step = 0.01 * std::f64::consts::TAU / (1.0 + system.stiffness().amax()).sqrt();
        }
        self.rate(system, t, state, 0);
        for _ in 0..self.options.max_steps {
            let remaining = end - t;
            let is_last = self.step >= remaining * (1.0 - 1e-12);
            let h = if is_last { remaining } else { self.step };
            let error = self.attempt(system, t, h, state);
            if !error.is_finite() && state.iter().any(|x| !x.is_finite()) {
                return IntegrationEnd::Diverged;
            }
            let factor = if error.is_finite() {
                (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, 5.0)
            } else {
                0.2
            };
            if error <= 1.0 {
                t += h;
                state.copy_from_slice(&self.trial);
                // First same as last: the seventh rate belongs to the new state.
                self.rates.swap(0, 6);
                if is_last {
                    return IntegrationEnd::Reached;
                }
                self.step = h * factor;
            } else {
                self.step = h * factor.min(0.9);
                if self.step <= 4.0 * f64::EPSILON * t.abs() {
                    return IntegrationEnd::StepTooSmall;
                }
            }
        }
        IntegrationEnd::MaxSteps
    }

    /// One step into `trial`; the error relative to what is allowed.
    fn attempt(&mut self, system: &System, t: f64, h: f64, state: &[f64]) -> f64 {
        for stage in 1..7 {
            for (k, x) in state.iter().enumerate() {
                let sum: f64 = STAGES[stage]
                    .iter()
                    .zip(&self.rates)
                    .map(|(w, r)| w * r[k])
                    .sum();
                self.trial[k] = x + h * sum;
            }
            let trial = std::mem::take(&mut self.trial);
            self.rate(system, t + NODES[stage] * h, &trial, stage);
            self.trial = trial;
        }
        let Dopri5Options {
            relative, absolute, ..
        } = self.options;
        let mut sum = 0.0;
        for (k, x) in state.iter().enumerate() {
            let error: f64 = ERROR.iter().zip(&self.rates).map(|(w, r)| w * r[k]).sum();
            let allowed = absolute + relative * x.abs().max(self.trial[k].abs());
            sum += (h * error / allowed).powi(2);
        }
        (sum / state.len() as f64).sqrt()
    }

    fn rate(&mut self, system: &System, t: f64, state: &[f64], stage: usize) {
        let n = system.dof();
        let (positions, velocities) = self.rates[stage].split_at_mut(n);
        positions.copy_from_slice(&state[n..]);
        system.acceleration(system.omega() * t, state, &mut self.scratch, velocities);
    }
}
