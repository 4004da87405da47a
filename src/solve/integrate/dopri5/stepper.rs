//! One step of the scheme, of the state and of the variational equation.

use super::Dopri5Options;
use super::memories::Memories;
use super::pieces::Pieces;
use super::regions::{COUNT, StepInstant, StepPassage, SteppedRegions, add_deformation};
use crate::solve::integrate::FlowObserver;
use crate::solve::jumps;
use crate::system::{Scratch, System};
use nalgebra::DMatrix;

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

/// Values with their rates at the seven stages.
#[derive(Debug, Clone)]
struct Stages {
    value: Vec<f64>,
    rates: [Vec<f64>; 7],
    /// Weighted sum of the rates times the step: the trial less the value.
    increment: Vec<f64>,
    trial: Vec<f64>,
}

impl Stages {
    fn new(size: usize) -> Stages {
        Stages {
            value: vec![0.0; size],
            rates: std::array::from_fn(|_| vec![0.0; size]),
            increment: vec![0.0; size],
            trial: vec![0.0; size],
        }
    }

    fn combine(&mut self, weights: &[f64], h: f64) {
        self.increment.fill(0.0);
        for (weight, rates) in weights.iter().zip(&self.rates) {
            let weight = h * weight;
            for (d, r) in self.increment.iter_mut().zip(rates) {
                *d += weight * r;
            }
        }
    }

    fn set_trial(&mut self, stage: usize, h: f64) {
        self.combine(STAGES[stage], h);
        for ((t, x), d) in self.trial.iter_mut().zip(&self.value).zip(&self.increment) {
            *t = x + d;
        }
    }

    fn error(&self, k: usize, h: f64) -> f64 {
        let sum: f64 = ERROR.iter().zip(&self.rates).map(|(w, r)| w * r[k]).sum();
        h * sum
    }

    /// First same as last: the seventh rate belongs to the new value.
    fn accept(&mut self) {
        self.value.copy_from_slice(&self.trial);
        self.rates.swap(0, 6);
    }
}

/// The state, Phi and the buffers of a step.
#[derive(Debug, Clone)]
pub(super) struct Stepper {
    state: Stages,
    variation: Stages,
    has_variation: bool,
    dq: DMatrix<f64>,
    dv: DMatrix<f64>,
    scratch: Scratch,
    pub(super) memories: Memories,
    dof: usize,
    /// Coefficients of q and of the memories on the step, in powers of x.
    pub(super) coefficients: Vec<f64>,
}

impl Stepper {
    pub(super) fn new(system: &System) -> Stepper {
        let n = system.dof();
        Stepper {
            state: Stages::new(system.state_size()),
            variation: Stages::new(0),
            has_variation: false,
            dq: DMatrix::zeros(n, n),
            dv: DMatrix::zeros(n, n),
            scratch: system.scratch(),
            memories: Memories::new(system),
            dof: n,
            coefficients: vec![0.0; (n + system.memory_count()) * COUNT],
        }
    }

    /// Takes over a state, and Phi on request.
    pub(super) fn load(&mut self, state: &[f64], phi: Option<&DMatrix<f64>>) {
        self.state.value.copy_from_slice(state);
        self.has_variation = phi.is_some();
        if let Some(phi) = phi {
            if self.variation.value.len() != phi.len() {
                self.variation = Stages::new(phi.len());
            }
            self.variation.value.copy_from_slice(phi.as_slice());
        }
    }

    /// Hands the state and Phi back.
    pub(super) fn store(&self, state: &mut [f64], phi: Option<&mut DMatrix<f64>>) {
        state.copy_from_slice(&self.state.value);
        if let Some(phi) = phi {
            phi.as_mut_slice().copy_from_slice(&self.variation.value);
        }
    }

    /// The accepted state.
    pub(super) fn state(&self) -> &[f64] {
        &self.state.value
    }

    /// Deformations of the accepted state.
    pub(super) fn deformation(&mut self, system: &System, tau: f64) -> &[f64] {
        system.respond(tau, &self.state.value, &mut self.scratch);
        &self.scratch.deformation
    }

    /// The accepted state with its rates; `scratch` must belong to it.
    pub(super) fn instant(&self, tau: f64) -> StepInstant<'_> {
        self.instant_of(tau, &self.state.value, 0)
    }

    /// The trial state with its rates.
    pub(super) fn trial_instant(&self, tau: f64) -> StepInstant<'_> {
        self.instant_of(tau, &self.state.trial, 6)
    }

    fn instant_of<'a>(&'a self, tau: f64, state: &'a [f64], stage: usize) -> StepInstant<'a> {
        StepInstant {
            tau,
            state,
            acceleration: &self.state.rates[stage][self.dof..2 * self.dof],
            scratch: &self.scratch,
        }
    }

    /// Rates of the accepted state in its regions.
    pub(super) fn refresh(
        &mut self,
        system: &System,
        regions: &SteppedRegions,
        pieces: &Pieces,
        t: f64,
    ) {
        self.state.trial.copy_from_slice(&self.state.value);
        self.variation.trial.copy_from_slice(&self.variation.value);
        self.rate(system, regions, pieces, t, 0);
    }

    /// One step into the trial values; the error relative to what is allowed.
    pub(super) fn attempt(
        &mut self,
        system: &System,
        regions: &SteppedRegions,
        pieces: &Pieces,
        (t, h): (f64, f64),
        options: &Dopri5Options,
    ) -> f64 {
        for (stage, node) in NODES.iter().enumerate().skip(1) {
            self.state.set_trial(stage, h);
            if self.has_variation {
                self.variation.set_trial(stage, h);
            }
            self.rate(system, regions, pieces, t + node * h, stage);
        }
        let Dopri5Options {
            relative, absolute, ..
        } = *options;
        let mut sum = 0.0;
        let values = self.state.value.iter().zip(&self.state.trial);
        for (k, (x, trial)) in values.enumerate() {
            let allowed = absolute + relative * x.abs().max(trial.abs());
            sum += (self.state.error(k, h) / allowed).powi(2);
        }
        let error = (sum / self.state.value.len() as f64).sqrt();
        if !self.has_variation {
            return error;
        }
        let largest = self
            .variation
            .trial
            .iter()
            .fold(0.0_f64, |m, x| m.max(x.abs()));
        let allowed = absolute + relative * largest;
        (0..self.variation.value.len()).fold(error, |worst, k| {
            let e = (self.variation.error(k, h) / allowed).abs();
            if e > worst || e.is_nan() { e } else { worst }
        })
    }

    /// The trial values become the accepted ones.
    pub(super) fn accept(&mut self) {
        self.state.accept();
        if self.has_variation {
            self.variation.accept();
        }
    }

    /// Gives the jumps of forces just passed to Phi.
    pub(super) fn saltate(&mut self, system: &System, regions: &mut SteppedRegions) {
        for jump in regions.jumps.iter_mut().flat_map(|list| list.drain(..)) {
            if self.has_variation {
                let phi = &mut self.variation.value;
                jumps::saltate(system, jump.connection, jump.size, jump.rate, phi);
            }
        }
    }

    fn rate(
        &mut self,
        system: &System,
        regions: &SteppedRegions,
        pieces: &Pieces,
        t: f64,
        stage: usize,
    ) {
        let n = system.dof();
        let tau = pieces.clamp(system.omega() * t);
        let windows = Some(regions.windows());
        let trial = &self.state.trial;
        let (motion, memories) = self.state.rates[stage].split_at_mut(2 * n);
        let (positions, velocities) = motion.split_at_mut(n);
        positions.copy_from_slice(&trial[n..2 * n]);
        system.respond_within(windows, tau, trial, &mut self.scratch);
        if !self.memories.is_empty() {
            let (phase, scratch) = (system.moment(tau).phase, &mut self.scratch);
            let out = (scratch, memories);
            self.memories.respond(system, phase, &trial[2 * n..], out);
        }
        system.accelerate(tau, trial, &self.scratch, velocities);
        if self.has_variation {
            self.rate_of_variation(system, tau, stage);
        }
    }

    /// Phi' = A Phi (18)
    fn rate_of_variation(&mut self, system: &System, tau: f64, stage: usize) {
        let (n, size) = (system.dof(), system.state_size());
        system.acceleration_partials(&self.scratch, &mut self.dq, &mut self.dv);
        let columns = self.variation.trial.chunks_exact(size);
        let rates = self.variation.rates[stage].chunks_exact_mut(size);
        for (phi, rate) in columns.zip(rates) {
            let (q, v) = (&phi[..n], &phi[n..2 * n]);
            let (dq, dv) = rate.split_at_mut(n);
            dq.copy_from_slice(v);
            dv.fill(0.0);
            for j in 0..n {
                let (by_q, by_v) = (self.dq.column(j), self.dv.column(j));
                let partials = by_q.iter().zip(by_v.iter());
                for (r, (by_q, by_v)) in dv.iter_mut().zip(partials) {
                    *r += by_q * q[j] + by_v * v[j];
                }
            }
            for at in self.memories.influences() {
                let (e, z) = (at.connection, phi[2 * n + at.memory]);
                let row = system.element_map_row(e).iter();
                let [x, rate] = row.fold([0.0; 2], |[x, r], (j, w)| [x + w * q[*j], r + w * v[*j]]);
                let [by_q, by_v, by_z] = at.rate_by;
                dv[n + at.memory] = by_q * x + by_v * rate + by_z * z;
                let variation = system.mounts()[e].stiffness_variation.as_ref();
                let factor = variation.map_or(1.0, |s| s.value(system.moment(tau).phase));
                for (i, kappa) in system.stiffness_column(e) {
                    dv[*i] -= kappa * factor * at.force_by * z;
                }
            }
        }
    }

    /// Takes over memories that follow their deformations at the accepted state, and their rows of Phi.
    pub(super) fn hand_over(&mut self, system: &System) {
        for (e, m, offset) in self.memories.following() {
            self.state.value[2 * self.dof + m] = self.scratch.deformation[e] + offset;
            follow(system, (e, m), &mut self.variation.value);
        }
    }

    /// The first guard that a slider passes on the step just tried; `error`: of the transmission errors, in powers of x.
    pub(super) fn first_passage(
        &self,
        system: &System,
        h: f64,
        error: impl Fn(usize, &mut [f64; COUNT]),
    ) -> Option<StepPassage> {
        let n = self.dof;
        let deformation = |e: usize| {
            let mut sum = [0.0; COUNT];
            error(e, &mut sum);
            add_deformation(&mut sum, system, e, &self.coefficients);
            sum
        };
        (self.memories).first_passage((&self.state.value, n, h), deformation)
    }

    /// Moves sliders on their guards at the accepted state; whether any has moved.
    pub(super) fn settle_memories(
        &mut self,
        system: &System,
        tau: f64,
        landed: Option<StepPassage>,
        observer: &mut dyn FlowObserver,
    ) -> bool {
        let at = StepInstant {
            tau,
            state: &self.state.value,
            acceleration: &self.state.rates[0][self.dof..2 * self.dof],
            scratch: &self.scratch,
        };
        self.memories.settle(system, &at, landed, observer)
    }

    /// Moves the memories of the accepted state to what their deformations allow, and finds the regions of their laws; the rows of Phi of
    /// memories that were moved follow their deformations.
    pub(super) fn place(&mut self, system: &System, tau: f64) {
        if self.memories.is_empty() {
            return;
        }
        let n = self.dof;
        system.respond(tau, &self.state.value[..2 * n], &mut self.scratch);
        let memory = &mut self.state.value[2 * n..];
        let before = memory.to_vec();
        let deformation = &self.scratch.deformation;
        self.memories.start(system, deformation, memory);
        for e in 0..system.element_count() {
            for m in system.memory_of(e).filter(|m| before[*m] != memory[*m]) {
                follow(system, (e, m), &mut self.variation.value);
            }
        }
    }

    /// Quintic polynomials through q, v and a at both ends of the step just tried.
    pub(super) fn interpolate(&mut self, h: f64) {
        let n = self.dof;
        let (first, last) = (&self.state.rates[0], &self.state.rates[6]);
        let (motion, memories) = self.coefficients.split_at_mut(n * COUNT);
        let values = (&self.state.value[2 * n..], &self.state.increment[2 * n..]);
        Memories::interpolate(memories, values, (&first[2 * n..], &last[2 * n..]), h);
        for (i, c) in motion.chunks_exact_mut(COUNT).enumerate() {
            let rise = self.state.increment[i];
            let ends = [[first[i], first[n + i]], [last[i], last[n + i]]];
            hermite(c, self.state.value[i], rise, ends, h);
        }
    }
}

/// The row of Phi of a memory that is its connection's deformation.
fn follow(system: &System, (connection, memory): (usize, usize), phi: &mut [f64]) {
    let row = 2 * system.dof() + memory;
    for phi in phi.chunks_exact_mut(system.state_size()) {
        let map = system.element_map_row(connection).iter();
        phi[row] = map.map(|(j, w)| w * phi[*j]).sum();
    }
}

/// Coefficients of the quintic with value, rise, and [slope, second derivative] at both ends of a step h.
pub(super) fn hermite(c: &mut [f64], value: f64, rise: f64, ends: [[f64; 2]; 2], h: f64) {
    let [[v0, a0], [v1, a1]] = ends;
    let (v0, v1) = (h * v0, h * v1);
    let (a0, a1) = (0.5 * h * h * a0, 0.5 * h * h * a1);
    (c[0], c[1], c[2]) = (value, v0, a0);
    c[3] = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 3.0 * a0 + a1;
    c[4] = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 3.0 * a0 - 2.0 * a1;
    c[5] = 6.0 * rise - 3.0 * (v0 + v1) - a0 + a1;
}
