//! Laws with memory in the exact quadrature: their stretches as jumps of slope and offset, and what their memories add.

use super::{ExactQuadrature, add_jump};
use crate::element::automaton::Automaton;
use crate::solve::galerkin::march::{self, MarchStretch};
use crate::system::System;
use num_complex::Complex;
use std::f64::consts::TAU;

impl ExactQuadrature {
    /// Coefficients of slope and offset of a law with memory, and of what its memories add.
    pub(super) fn follow(&mut self, e: usize) {
        self.slope.fill(Complex::default());
        self.offset.fill(Complex::default());
        self.edges.clear();
        self.march.prepare(&self.a);
        for (automaton, given) in &self.automata[e] {
            for s in self.march.follow(automaton, &self.a, *given) {
                add_stretch(&mut self.slope, s, s.slope);
                add_stretch(&mut self.offset, s, s.offset);
                let Some(tau) = s.set_at.filter(|_| s.gain != 0.0) else {
                    continue;
                };
                let known = self.memories.iter().position(|m| m.0 == tau);
                let index = known.unwrap_or_else(|| {
                    self.memories.push((tau, vec![0.0; self.c.len()]));
                    self.memories.len() - 1
                });
                add_real(&mut self.memories[index].1, s, s.gain);
            }
        }
        for spectrum in [&mut self.slope, &mut self.offset] {
            for (k, z) in spectrum.iter_mut().enumerate().skip(1) {
                *z *= Complex::new(0.0, -1.0 / (TAU * k as f64));
            }
        }
    }

    /// A memory set at an extremum changes with the deformation there.
    pub(super) fn add_memories(&mut self) {
        for (tau, force) in &self.memories {
            for (row, f) in force.iter().enumerate() {
                self.hill[(row, 0)] += f;
            }
            for k in 1..=self.harmonics {
                let (sin, cos) = (k as f64 * tau).sin_cos();
                for (row, f) in force.iter().enumerate() {
                    self.hill[(row, 2 * k - 1)] += f * sin;
                    self.hill[(row, 2 * k)] += f * cos;
                }
            }
        }
    }
}

/// Automata of the laws with memory, with what they remember at rest.
pub(super) fn automata(system: &System) -> Vec<Vec<(Automaton, f64)>> {
    if system.memory_count() == 0 {
        return vec![Vec::new(); system.element_count()];
    }
    let given = march::at_rest(system);
    let of = |e: usize| {
        let element = &system.mounts()[e].element;
        if element.memory_count() == 0 {
            return Vec::new();
        }
        let mut places = system.memory_of(e);
        let with = |a: Automaton| {
            let place = a.has_memory.then(|| places.next()).flatten();
            let z = place.map_or(0.0, |m| given[m]);
            (a, z)
        };
        let automata = element.automata().unwrap_or_default();
        automata.into_iter().map(with).collect()
    };
    (0..system.element_count()).map(of).collect()
}

/// Adds the mean and the jumps of a value on a stretch: coefficients before the division by i k.
fn add_stretch(spectrum: &mut [Complex<f64>], s: &MarchStretch, value: f64) {
    spectrum[0] += value * (s.end - s.begin) / TAU;
    add_jump(spectrum, s.begin, value);
    add_jump(spectrum, s.end, -value);
}

/// Adds the coefficients mean, sin 1, cos 1, .. of a value on a stretch.
fn add_real(out: &mut [f64], s: &MarchStretch, value: f64) {
    out[0] += value * (s.end - s.begin) / TAU;
    for (k, pair) in out[1..].chunks_exact_mut(2).enumerate() {
        let k = (k + 1) as f64;
        let factor = value / (0.5 * TAU * k);
        let ((s0, c0), (s1, c1)) = ((k * s.begin).sin_cos(), (k * s.end).sin_cos());
        pair[0] += factor * (c0 - c1);
        pair[1] += factor * (s1 - s0);
    }
}
