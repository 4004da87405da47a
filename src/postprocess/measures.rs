//! What is reported of every connection along an orbit.

use super::connection::{Measures, is_clearance};
use super::contacts::Contacts;
use super::{effective_stiffness, segment_measures};
use crate::element::ResponseSeries;
use crate::numeric::fourier::Fourier;
use crate::numeric::periodic::Periodic;
use crate::numeric::{roots, trigonometric};
use crate::solve::galerkin::jumps::{self, Edge};
use crate::solve::galerkin::march;
use crate::solve::orbit::{Deformation, FourierOrbit, Orbit};
use crate::system::{Mount, System};
use std::f64::consts::TAU;

/// Computes measures; owns its buffers.
#[derive(Debug)]
pub struct Meter {
    fourier: Fourier,
    phase: Vec<f64>,
    deformation: Vec<f64>,
    rate: Vec<f64>,
    force: Vec<f64>,
    slope: Vec<f64>,
    damping: Vec<f64>,
    coefficients: Vec<f64>,
    force_coefficients: Vec<f64>,
    edges: Vec<Edge>,
    /// What a stiffness that steps between two samples adds to the mean square of the force.
    step_square: f64,
}

impl Meter {
    /// Buffers for a number of samples per response period.
    pub fn new(samples: usize) -> Meter {
        let buffer = || vec![0.0; samples];
        Meter {
            fourier: Fourier::new(samples),
            phase: buffer(),
            deformation: buffer(),
            rate: buffer(),
            force: buffer(),
            slope: buffer(),
            damping: buffer(),
            coefficients: Vec::new(),
            force_coefficients: Vec::new(),
            edges: Vec::new(),
            step_square: 0.0,
        }
    }

    /// Measures of every connection.
    pub fn measure(&mut self, system: &System, orbit: &Orbit) -> Vec<Measures> {
        match orbit {
            Orbit::Segments(orbit) => segment_measures::measure(system, orbit),
            Orbit::Fourier(orbit) => {
                let (nu, samples) = (orbit.subharmonic as f64, self.phase.len());
                let phase = |j: usize| nu * TAU * j as f64 / samples as f64;
                self.phase
                    .iter_mut()
                    .enumerate()
                    .for_each(|(j, x)| *x = phase(j));
                (0..system.element_count())
                    .map(|e| self.connection(system, orbit, e))
                    .collect()
            }
        }
    }

    /// Measures of every connection of which contacts alone are read: nothing else need be known.
    pub fn contacts(&mut self, system: &System, orbit: &Orbit) -> Vec<Measures> {
        match orbit {
            Orbit::Segments(orbit) => segment_measures::contacts(system, orbit),
            Orbit::Fourier(_) => self.measure(system, orbit),
        }
    }

    fn connection(&mut self, system: &System, orbit: &FourierOrbit, e: usize) -> Measures {
        let deformation = orbit.deformation(system, e);
        self.sample(system, orbit, e, &deformation);
        let extrema = deformation.extrema();
        let values = || extrema.iter().map(|x| x.1);
        let (a, c) = (&self.coefficients, &self.force_coefficients);
        let scale = self.deformation.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let crossings = orbit.crossings(system, e, &extrema);
        let mean_of = |series: &[f64]| series.iter().sum::<f64>() / series.len() as f64;
        let force_mean = c[0];
        let square = |f: &f64| (f - force_mean).powi(2);
        let squares: Vec<f64> = self.force.iter().map(square).collect();
        let jumps = self.edges.iter();
        let jumps = jumps.map(|e| e.shift / TAU * (square(&e.after) - square(&e.before)));
        let jumps = jumps.sum::<f64>() + self.step_square;
        let variance = (mean_of(&squares) + jumps).max(0.0);
        let [beyond, beyond_rate] = squares_beyond(&system.mounts()[e], orbit);
        let mean_square = trigonometric::mean_square(a) + beyond;
        let derivative_square = trigonometric::mean_square_of_derivative(a) + beyond_rate;
        let at_steps = forces_at_steps(&system.mounts()[e], orbit, &deformation);
        let revolutions = nu_of(orbit) * system.revolutions() as f64;
        let extreme = |sign: f64| {
            let force = |tau: f64| sign * force_at(system, orbit, e, &deformation, tau);
            let largest = self.largest_force(&system.mounts()[e], sign, &force, &extrema);
            at_steps.iter().map(|f| sign * f).fold(largest, f64::max)
        };
        Measures {
            mean: a[0],
            rms: mean_square.sqrt(),
            min: values().fold(f64::INFINITY, f64::min).min(a[0]),
            max: values().fold(f64::NEG_INFINITY, f64::max).max(a[0]),
            rms_velocity: orbit.omega * derivative_square.sqrt(),
            effective_stiffness: effective_stiffness::alternating(a, c, scale),
            effective_stiffness_dc: effective_stiffness::direct(a[0], force_mean, scale),
            mean_slope: mean_of(&self.slope),
            mean_damping: mean_of(&self.damping),
            contacts: Contacts::new(system, e, &crossings, a[0], revolutions),
            force_mean,
            force_min: -extreme(-1.0),
            force_max: extreme(1.0),
            force_std: variance.sqrt(),
            pulls: self.pulls(system, e),
            loss: self.loss(revolutions),
        }
    }

    /// Work per excitation period: the Fourier coefficients of force and rate.
    fn loss(&self, revolutions: f64) -> f64 {
        let mut slope = vec![0.0; self.coefficients.len()];
        trigonometric::differentiate(&self.coefficients, &mut slope);
        let products = slope.iter().zip(&self.force_coefficients).skip(1);
        0.5 * products.map(|(v, f)| v * f).sum::<f64>() * TAU / revolutions
    }

    /// Samples of deformation, rate, force and slope; coefficients of deformation and force.
    fn sample(
        &mut self,
        system: &System,
        orbit: &FourierOrbit,
        e: usize,
        deformation: &Deformation<'_>,
    ) {
        let length = deformation.coefficients.len();
        let mount = &system.mounts()[e];
        self.coefficients.resize(length, 0.0);
        self.force_coefficients.resize(length, 0.0);
        self.coefficients.copy_from_slice(&deformation.coefficients);
        self.fourier
            .to_samples(&self.coefficients, &mut self.deformation);
        let mut derivative = vec![0.0; length];
        trigonometric::differentiate(&self.coefficients, &mut derivative);
        derivative.iter_mut().for_each(|d| *d *= orbit.omega);
        self.fourier.to_samples(&derivative, &mut self.rate);
        if let Some(error) = &mount.transmission_error {
            let (nu, frequency) = (orbit.subharmonic, system.excitation_frequency());
            let slopes = error.derivative_weights(nu, self.phase.len());
            for (j, phase) in self.phase.iter().enumerate() {
                self.deformation[j] -= error.value(*phase);
                self.rate[j] -= frequency * slopes[j];
            }
            self.coefficients = deformation.series();
        }
        let out = ResponseSeries {
            f: &mut self.force,
            df_dq: &mut self.slope,
            df_dv: &mut self.damping,
        };
        if mount.element.memory_count() == 0 {
            mount
                .element
                .eval_many(&self.deformation, &self.rate, &self.phase, out);
        } else {
            let series = deformation.series();
            let tracks = march::tracks(system, e, &series, &march::at_rest(system));
            let samples = out.f.len();
            for j in 0..samples {
                let tau = TAU * j as f64 / samples as f64;
                let motion = [self.deformation[j], self.rate[j], self.phase[j]];
                let here = march::response(&tracks, system, tau, motion);
                (out.f[j], out.df_dq[j], out.df_dv[j]) = (here.f, here.df_dq, here.df_dv);
            }
        }
        self.vary(mount, orbit.subharmonic);
        self.fourier
            .to_coefficients(&self.force, &mut self.force_coefficients);
        let (x, at) = (&self.deformation, |tau| deformation.at(tau));
        let rates = (orbit.omega, nu_of(orbit));
        jumps::edges(mount, x, at, rates, &mut self.edges);
        jumps::correct(&self.edges, &mut self.force_coefficients);
    }

    /// Multiplies the samples by the stiffness variation; steps become weights of the samples next to them.
    fn vary(&mut self, mount: &Mount, nu: usize) {
        self.step_square = 0.0;
        let Some(variation) = &mount.stiffness_variation else {
            return;
        };
        let count = self.force.len();
        let weights = variation.weights(nu, count, |s| s);
        if matches!(variation, Periodic::Rectangular { .. }) {
            let squares = variation.weights(nu, count, |s| s * s);
            for (force, (s, square)) in self.force.iter().zip(weights.iter().zip(&squares)) {
                self.step_square += (square - s * s) * force.powi(2) / count as f64;
            }
        }
        for (j, s) in weights.iter().enumerate() {
            self.force[j] *= s;
            self.slope[j] *= s;
            self.damping[j] *= s;
        }
    }

    /// Largest of sign times the force: the largest sample, refined between its neighbours, and the values at the extrema of
    /// the deformation. `force`: sign times the force at tau.
    fn largest_force(
        &self,
        mount: &Mount,
        sign: f64,
        force: &dyn Fn(f64) -> f64,
        extrema: &[(f64, f64)],
    ) -> f64 {
        let sampled = self.force.iter().map(|f| sign * f).enumerate();
        let (best, largest) =
            sampled.fold(
                (0, f64::NEG_INFINITY),
                |m, (j, f)| {
                    if f > m.1 { (j, f) } else { m }
                },
            );
        if mount.element.memory_count() > 0 {
            return largest;
        }
        let at_extrema = extrema.iter().map(|x| force(x.0)).fold(largest, f64::max);
        if !mount.element.depends_on_velocity() && mount.stiffness_variation.is_none() {
            return at_extrema;
        }
        let cell = TAU / self.force.len() as f64;
        let around = ((best as f64 - 1.0) * cell, (best as f64 + 1.0) * cell);
        at_extrema.max(force(roots::maximum(force, around)))
    }

    /// Whether the force points away from the flank somewhere: 1 + beta v < 0.
    fn pulls(&self, system: &System, e: usize) -> bool {
        let element = &system.mounts()[e].element;
        is_clearance(element.as_ref())
            && element.depends_on_velocity()
            && self
                .deformation
                .iter()
                .zip(&self.force)
                .any(|(x, f)| f64::from(element.flank(*x)) * f < 0.0)
    }
}

/// Mean squares that a transmission error adds to a deformation and its derivative beyond the orbit's harmonics.
fn squares_beyond(mount: &Mount, orbit: &FourierOrbit) -> [f64; 2] {
    let Some(error) = &mount.transmission_error else {
        return [0.0; 2];
    };
    let nu = orbit.subharmonic;
    let [square, derivative] = error.squares_above(orbit.harmonics() / nu);
    [square, derivative * (nu * nu) as f64]
}

fn nu_of(orbit: &FourierOrbit) -> f64 {
    orbit.subharmonic as f64
}

fn force_at(
    system: &System,
    orbit: &FourierOrbit,
    e: usize,
    deformation: &Deformation<'_>,
    tau: f64,
) -> f64 {
    let mount = &system.mounts()[e];
    let phase = nu_of(orbit) * tau;
    let [x, slope] = deformation.at(tau);
    mount.respond(x, orbit.omega * slope, phase).f
}

/// Forces on both sides of every step of a rectangular stiffness variation.
fn forces_at_steps(mount: &Mount, orbit: &FourierOrbit, deformation: &Deformation<'_>) -> Vec<f64> {
    let Some(variation @ Periodic::Rectangular { high, low, .. }) = &mount.stiffness_variation
    else {
        return Vec::new();
    };
    let pieces = variation.pieces();
    let nu = nu_of(orbit);
    let copies = (0..orbit.subharmonic).flat_map(|m| pieces.iter().map(move |p| (m, p.begin)));
    let forces = copies.flat_map(|(m, begin)| {
        let tau = (begin + TAU * m as f64) / nu;
        let [x, slope] = deformation.at(tau);
        let force = mount.element.eval(x, orbit.omega * slope, nu * tau).f;
        [high * force, low * force]
    });
    forces.collect()
}
