//! Amplitudes of single orders: deformations, forces and absolute accelerations.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::solve::orbit::Orbit;
use std::f64::consts::TAU;

/// Samples per revolution of the reference, per wave of the highest order, and per Fourier coefficient of a coordinate.
const SAMPLES: usize = 1024;
const PER_WAVE: f64 = 16.0;
const PER_COEFFICIENT: usize = 8;
/// Largest denominator of an order that is named as a fraction.
const LARGEST_DENOMINATOR: usize = 99;
/// Waves per response period closer to a whole number are whole.
const WHOLE: f64 = 1e-9;

/// `order_K.q.c`, `order_K.f.c`, `order_K.acceleration.BODY`: amplitude of order K of the reference in the deformation and the force of
/// every connection and in the acceleration of every body. Empty where the response period is no whole number of its waves.
#[derive(Debug)]
pub struct OrderAmplitudes {
    /// Orders with their names.
    orders: Vec<(f64, String)>,
}

impl OrderAmplitudes {
    /// For orders of the reference.
    pub fn new(orders: &[f64]) -> OrderAmplitudes {
        let named = orders.iter().map(|order| (*order, name(*order)));
        OrderAmplitudes {
            orders: named.collect(),
        }
    }

    fn samples(&self, at: &Solved<'_>, waves: &[f64], turns: f64) -> usize {
        let coefficients = match at.orbit {
            Orbit::Fourier(orbit) => orbit.coefficients.first().map_or(0, Vec::len),
            Orbit::Segments(_) => 0,
        };
        let highest = waves.iter().copied().fold(1.0, f64::max);
        let least = (SAMPLES * turns as usize).max(PER_COEFFICIENT * coefficients);
        least.max((PER_WAVE * highest) as usize).next_power_of_two()
    }
}

/// `2`, `1/2`, or the number with an underscore for the point.
fn name(order: f64) -> String {
    let is_whole = |q: &usize| (order * *q as f64 - (order * *q as f64).round()).abs() < WHOLE;
    match (1..=LARGEST_DENOMINATOR).find(is_whole) {
        Some(1) => format!("{}", order.round()),
        Some(q) => format!("{}/{q}", (order * q as f64).round()),
        None => order.to_string().replace('.', "_"),
    }
}

/// The state of an orbit at a phase of the response.
fn state(at: &Solved<'_>, tau: f64, out: &mut [f64]) {
    match at.orbit {
        Orbit::Segments(orbit) => orbit.state(tau, out),
        Orbit::Fourier(_) => {
            let n = at.system.dof();
            for i in 0..n {
                let [q, v] = at.orbit.coordinate(i, tau);
                (out[i], out[n + i]) = (q, v);
            }
        }
    }
}

impl Measure for OrderAmplitudes {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let names = units.connections();
        let mut list = Vec::new();
        for (_, order) in &self.orders {
            let of = |kind: &str, name: &String| format!("order_{order}.{kind}.{name}");
            let connections = || names.iter().enumerate();
            list.extend(connections().map(|(k, name)| units.displacement(of("q", name), k)));
            list.extend(connections().map(|(k, name)| units.force(of("f", name), k)));
            list.extend(units.accelerations(&format!("order_{order}.acceleration")));
        }
        list
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        if self.orders.is_empty() {
            return;
        }
        let system = at.system;
        let mounts = system.mounts();
        let turns = (system.subharmonic() * system.revolutions()) as f64;
        let waves: Vec<f64> = self.orders.iter().map(|(order, _)| order * turns).collect();
        let (e, n_b) = (
            mounts.len(),
            at.assembly.anchor.as_ref().map_or(0, |a| a.bodies.len()),
        );
        let width = 2 * e + n_b;
        let mut sums = vec![[0.0; 2]; width * waves.len()];
        let mut scratch = system.scratch();
        let mut now = vec![0.0; system.state_size()];
        let count = self.samples(at, &waves, turns);
        for j in 0..count {
            let tau = TAU * j as f64 / count as f64;
            state(at, tau, &mut now);
            system.respond(tau, &now, &mut scratch);
            let mut values = scratch.deformation.clone();
            values.extend(
                scratch
                    .response
                    .iter()
                    .zip(at.stiffening)
                    .map(|(r, s)| r.f * s),
            );
            let bodies = at
                .assembly
                .body_accelerations(system, tau, &now, &mut scratch);
            values.extend(bodies.unwrap_or_default());
            for (wave, sums) in waves.iter().zip(sums.chunks_exact_mut(width)) {
                let (s, c) = (wave.round() * tau).sin_cos();
                for ([cos, sin], value) in sums.iter_mut().zip(&values) {
                    (*cos, *sin) = (*cos + c * value, *sin + s * value);
                }
            }
        }
        // Impulses and what a series does not remember are not sampled.
        let is_unknown = |k: &usize| {
            let law = &mounts[*k].element;
            let forgets = matches!(at.orbit, Orbit::Fourier(_)) && law.memory_count() > 0;
            forgets || law.least_impact().is_some()
        };
        let unknown: Vec<usize> = (0..e).filter(is_unknown).collect();
        for (wave, sums) in waves.iter().zip(sums.chunks_exact(width)) {
            let is_whole = (wave - wave.round()).abs() < WHOLE * wave.max(1.0) && *wave > 0.5;
            out.extend(sums.iter().enumerate().map(|(place, [cos, sin])| {
                let is_lost = place >= 2 * e && !unknown.is_empty()
                    || place >= e && unknown.contains(&(place - e));
                match is_whole && !is_lost {
                    true => 2.0 / count as f64 * cos.hypot(*sin),
                    false => f64::NAN,
                }
            }));
        }
    }
}
