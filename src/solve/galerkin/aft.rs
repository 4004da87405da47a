//! Alternating frequency/time: deformations to samples, laws over the samples, forces and slopes back to coefficients.

use super::connection::{add_column, add_diagonal, add_force, add_jacobian, gather};
use super::evolve::Evolve;
use super::exact::ExactQuadrature;
use super::hill::{self, Hill};
use super::jumps::{self, Edge};
use super::march;
use crate::element::evolving::Evolving;
use crate::element::{Response, ResponseSeries};
use crate::numeric::fourier::Fourier;
use crate::numeric::periodic::Periodic;
use crate::numeric::trigonometric;
use crate::solve::residual::Linearisation;
use crate::system::System;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// Excitation tables and buffers of one connection's samples.
pub struct Sampling {
    fourier: Fourier,
    /// Phase of the excitation at each sample.
    phase: Vec<f64>,
    /// Transmission error and its derivative with respect to the phase, by connection.
    error: Vec<Option<[Vec<f64>; 2]>>,
    /// Stiffness variation, by connection.
    variation: Vec<Option<Vec<f64>>>,
    /// Connections that need no samples: f = slope (W q - e) + offset, always.
    affine: Vec<Option<AffineParts>>,
    deformation: Vec<f64>,
    rate: Vec<f64>,
    force: Vec<f64>,
    slope: Vec<f64>,
    damping: Vec<f64>,
    /// Coefficients: deformation, its derivative, force; slope up to 2H.
    a: Vec<f64>,
    da: Vec<f64>,
    c: Vec<f64>,
    g: Vec<f64>,
    filler: Hill,
    hill: DMatrix<f64>,
    hill_rate: DMatrix<f64>,
    /// Jumps of the force at hand.
    edges: Vec<Edge>,
    /// Laws with memory, which are integrated in closed form.
    memories: Option<ExactQuadrature>,
    /// Memories that have a rate, and what all memories are at rest.
    evolve: Evolve,
    at_rest: Vec<f64>,
}

/// A law without breakpoints and rates, with constant stiffness.
struct AffineParts {
    slope: f64,
    offset: f64,
    /// Coefficients of the transmission error; empty without one.
    error: Vec<f64>,
}

impl Sampling {
    /// Samples per response period.
    pub fn samples(&self) -> usize {
        self.fourier.samples()
    }

    /// Buffers for a number of harmonics of tau and of samples per response period.
    pub fn new(system: &System, harmonics: usize, samples: usize) -> Sampling {
        let c = 2 * harmonics + 1;
        let buffer = || vec![0.0; samples];
        Sampling {
            fourier: Fourier::new(samples),
            phase: (0..samples)
                .map(|j| TAU * (system.subharmonic() * j) as f64 / samples as f64)
                .collect(),
            error: Vec::new(),
            variation: Vec::new(),
            affine: Vec::new(),
            deformation: buffer(),
            rate: buffer(),
            force: buffer(),
            slope: buffer(),
            damping: buffer(),
            a: vec![0.0; c],
            da: vec![0.0; c],
            c: vec![0.0; c],
            g: vec![0.0; 4 * harmonics + 1],
            filler: Hill::new(harmonics),
            hill: DMatrix::zeros(c, c),
            hill_rate: DMatrix::zeros(c, c),
            edges: Vec::new(),
            memories: None,
            evolve: Evolve::default(),
            at_rest: Vec::new(),
        }
    }

    /// Samples the transmission errors and stiffness variations of a system; steps become weights of the samples next to them.
    pub fn prepare(&mut self, system: &System) {
        let (phase, nu) = (&self.phase, system.subharmonic());
        let mounts = system.mounts().iter();
        let errors = mounts.clone().map(|m| m.transmission_error.as_ref());
        let sampled = |e: &Periodic| {
            let values = phase.iter().map(|x| e.value(*x)).collect();
            [values, e.derivative_weights(nu, phase.len())]
        };
        self.error = errors.map(|e| e.map(sampled)).collect();
        let variations = mounts.map(|m| m.stiffness_variation.as_ref());
        let weights = |s: &Periodic| s.weights(nu, phase.len(), |s| s);
        self.variation = variations.map(|s| s.map(weights)).collect();
        if system.memory_count() > 0 {
            self.memories = ExactQuadrature::of_memories(system, self.c.len() / 2).ok();
            self.at_rest = march::at_rest(system);
        }
        let count = system.element_count();
        self.affine = (0..count).map(|e| self.affine(system, e)).collect();
    }

    fn affine(&self, system: &System, e: usize) -> Option<AffineParts> {
        let mount = &system.mounts()[e];
        let law = &mount.element;
        let is_affine = law.is_piecewise_affine() && law.breakpoints().is_empty();
        if !is_affine || law.depends_on_velocity() || mount.stiffness_variation.is_some() {
            return None;
        }
        let Response { f, df_dq, .. } = law.eval(0.0, 0.0, 0.0);
        let mut error = Vec::new();
        if let Some(series) = &mount.transmission_error {
            error.resize(self.a.len(), 0.0);
            series.coefficients(system.subharmonic(), &mut error);
        }
        Some(AffineParts {
            slope: df_dq,
            offset: f,
            error,
        })
    }

    /// Adds (I (x) kappa) c to the residual, its Jacobian (12) and its derivative with respect to omega.
    pub(crate) fn add_forces(
        &mut self,
        system: &System,
        u: &DVector<f64>,
        out: &mut Linearisation,
    ) {
        for e in 0..system.element_count() {
            if let Some(law) = system.mounts()[e].element.evolving() {
                self.add_evolving(system, (e, law), u, out);
                continue;
            }
            if let Some(memories) = self.memories.as_mut().filter(|_| remembers(system, e)) {
                memories.add_force_of(system, e, u, out);
                continue;
            }
            gather(system, e, u, self.c.len(), &mut self.a);
            if let Some(affine) = &self.affine[e] {
                affine.respond(&self.a, &mut self.c);
                add_force(system, e, &self.c, out);
                add_diagonal(system, e, affine.slope, self.c.len(), out);
                continue;
            }
            self.sample(e);
            let is_rate_dependent = self.respond(system, e);
            self.find_jumps(system, e);
            self.fourier.to_coefficients(&self.force, &mut self.c);
            jumps::correct(&self.edges, &mut self.c);
            add_force(system, e, &self.c, out);
            let slope = self.slope[0];
            let is_constant = self.edges.is_empty() && self.slope.iter().all(|s| *s == slope);
            if is_constant && !is_rate_dependent {
                add_diagonal(system, e, slope, self.c.len(), out);
                continue;
            }
            self.fourier.to_coefficients(&self.slope, &mut self.g);
            self.filler.fill(&self.g, &mut self.hill);
            jumps::add_slopes(&self.edges, &mut self.hill);
            if is_rate_dependent {
                self.add_damping(system, e, out);
            }
            add_jacobian(system, e, &self.hill, out);
        }
    }

    /// The same for a law whose memory has a rate: every sample depends on the motion of the whole period.
    fn add_evolving(
        &mut self,
        system: &System,
        (e, law): (usize, &dyn Evolving),
        u: &DVector<f64>,
        out: &mut Linearisation,
    ) {
        let size = self.c.len();
        gather(system, e, u, size, &mut self.a);
        let mount = &system.mounts()[e];
        let (omega, nu) = (system.omega(), system.subharmonic() as f64);
        let frequency = system.excitation_frequency();
        let a = &self.a;
        let motion = |tau: f64| {
            let [x, slope, _] = trigonometric::evaluate(a, tau);
            let [x, v] = mount.deformation([x, omega * slope], nu * tau, frequency);
            [x, v, nu * tau]
        };
        let given = system.memory_of(e).next().map_or(0.0, |m| self.at_rest[m]);
        self.evolve
            .follow(law, (self.force.len(), omega), given, &motion);
        self.evolve.differentiate(size, omega);
        self.evolve.respond(law, omega, &motion, &mut self.force);
        let weight = |j: usize| self.variation[e].as_ref().map_or(1.0, |s| s[j]);
        let weighted = self.force.iter_mut().enumerate();
        weighted.for_each(|(j, f)| *f *= weight(j));
        self.fourier.to_coefficients(&self.force, &mut self.c);
        add_force(system, e, &self.c, out);
        for k in 0..=size {
            let column = self.evolve.partials.iter().skip(k).step_by(size + 1);
            for (j, (slope, d)) in self.slope.iter_mut().zip(column).enumerate() {
                *slope = weight(j) * d;
            }
            self.fourier.to_coefficients(&self.slope, &mut self.c);
            match k < size {
                true => self.hill.column_mut(k).copy_from_slice(&self.c),
                false => self.c.iter_mut().for_each(|c| *c /= frequency),
            }
        }
        add_column(system, e, &self.c, &mut out.dr_dlambda);
        add_jacobian(system, e, &self.hill, out);
    }

    /// Samples of the deformation W q - e.
    fn sample(&mut self, e: usize) {
        self.fourier.to_samples(&self.a, &mut self.deformation);
        if let Some([error, _]) = &self.error[e] {
            self.deformation
                .iter_mut()
                .zip(error)
                .for_each(|(x, e)| *x -= e);
        }
    }

    /// Force, slope and damping at every sample; whether the damping counts.
    fn respond(&mut self, system: &System, e: usize) -> bool {
        let mount = &system.mounts()[e];
        let is_rate_dependent = mount.element.depends_on_velocity();
        if is_rate_dependent {
            let om = system.omega();
            trigonometric::differentiate(&self.a, &mut self.da);
            self.da.iter_mut().for_each(|a| *a *= om);
            self.fourier.to_samples(&self.da, &mut self.rate);
            if let Some([_, slope]) = &self.error[e] {
                let frequency = system.excitation_frequency();
                self.rate
                    .iter_mut()
                    .zip(slope)
                    .for_each(|(v, e)| *v -= frequency * e);
            }
        }
        let out = ResponseSeries {
            f: &mut self.force,
            df_dq: &mut self.slope,
            df_dv: &mut self.damping,
        };
        mount
            .element
            .eval_many(&self.deformation, &self.rate, &self.phase, out);
        if let Some(variation) = &self.variation[e] {
            for (j, s) in variation.iter().enumerate() {
                self.force[j] *= s;
                self.slope[j] *= s;
                self.damping[j] *= s;
            }
        }
        is_rate_dependent
    }

    /// Where the force jumps between two samples.
    fn find_jumps(&mut self, system: &System, e: usize) {
        let mount = &system.mounts()[e];
        let (a, nu) = (&self.a, system.subharmonic() as f64);
        let at = |tau: f64| {
            let [mut x, mut slope, _] = trigonometric::evaluate(a, tau);
            if let Some(error) = &mount.transmission_error {
                x -= error.value(nu * tau);
                slope -= nu * error.derivative(nu * tau);
            }
            [x, slope]
        };
        let rates = (system.omega(), nu);
        jumps::edges(mount, &self.deformation, at, rates, &mut self.edges);
    }

    /// F+ diag(df/dv) F D, and the part of dR/domega that comes through the velocity: v is proportional to Om.
    fn add_damping(&mut self, system: &System, e: usize, out: &mut Linearisation) {
        self.fourier.to_coefficients(&self.damping, &mut self.g);
        self.filler.fill(&self.g, &mut self.hill_rate);
        hill::add_differentiated(&self.hill_rate, system.omega(), &mut self.hill);
        let frequency = system.excitation_frequency();
        self.rate
            .iter_mut()
            .zip(&self.damping)
            .for_each(|(v, d)| *v *= d / frequency);
        self.fourier.to_coefficients(&self.rate, &mut self.c);
        add_column(system, e, &self.c, &mut out.dr_dlambda);
    }
}

fn remembers(system: &System, e: usize) -> bool {
    system.mounts()[e].element.memory_count() > 0
}

impl AffineParts {
    /// c = slope (a - e) + offset.
    fn respond(&self, a: &[f64], c: &mut [f64]) {
        for (c, a) in c.iter_mut().zip(a) {
            *c = self.slope * a;
        }
        for (c, e) in c.iter_mut().zip(&self.error) {
            *c -= self.slope * e;
        }
        c[0] += self.offset;
    }
}
