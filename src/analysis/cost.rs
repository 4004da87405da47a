//! What an analysis takes, estimated before it runs: memory from sizes, time from counts of operations and what one of them
//! takes on a usual machine. The estimates are right within a factor of a few; they are there to find what is orders of
//! magnitude beyond.

use super::{Fault, Setting};
use crate::machine;
use crate::postprocess::effective_stiffness::frequencies_at_rest;
use crate::solve::equilibrium::equilibrium;
use crate::solve::galerkin;
use crate::system::System;
use serde::Serialize;
use std::f64::consts::TAU;

/// Memory and time of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Cost {
    /// Bytes while it runs.
    pub bytes: f64,
    /// Seconds on one processor.
    pub seconds: f64,
    /// The key of the analysis that decides about the memory.
    #[serde(skip)]
    pub memory_key: &'static str,
    /// The key that decides about the time.
    #[serde(skip)]
    pub time_key: &'static str,
}

/// Seconds from which a run is announced.
const LONG: f64 = 60.0;
/// Bytes from which it is.
const LARGE: f64 = 2e9;
/// Bytes of a cell of a table, with its text on the page and in the file.
const CELL: f64 = 150.0;
/// Floating-point operations per second of dense linear algebra.
const OPERATIONS: f64 = 6e9;
/// Matrices of the size of the Jacobian that are alive at once: linearisations of the path, the point and the start, their factors (measured).
const MATRICES: f64 = 7.0;
/// Linear systems per point of a branch.
const SYSTEMS: f64 = 8.0;
/// Periods integrated per point of a branch of the shooting method, events and measures included.
const SHOTS: f64 = 20.0;
/// Longest step of an integrator times the highest frequency.
const REACH: f64 = 1.4;
/// Seconds per step of an integrator, and per entry of the matrices in it.
const STEP: f64 = 4e-7;
const ENTRY: f64 = 2e-8;

impl Cost {
    /// Of a table.
    pub fn table(rows: f64, columns: f64, key: &'static str) -> Cost {
        Cost {
            bytes: rows * columns * CELL,
            memory_key: key,
            ..Cost::default()
        }
    }

    /// Adds the time.
    pub fn lasting(self, seconds: f64, key: &'static str) -> Cost {
        Cost {
            seconds,
            time_key: key,
            ..self
        }
    }

    /// Both, one after the other; the larger one decides.
    pub fn and(self, other: Cost) -> Cost {
        let [more_memory, more_time] = [other.bytes > self.bytes, other.seconds > self.seconds];
        Cost {
            bytes: self.bytes + other.bytes,
            seconds: self.seconds + other.seconds,
            memory_key: if more_memory {
                other.memory_key
            } else {
                self.memory_key
            },
            time_key: if more_time {
                other.time_key
            } else {
                self.time_key
            },
        }
    }

    /// Error of a run that needs more memory than is available.
    pub fn refusal(&self, memory: Option<u64>) -> Option<Fault> {
        let most = memory.filter(|most| self.bytes > *most as f64)?;
        let message = format!(
            "needs about {} of memory ({:.0} bytes), more than the {} available; reduce `{}`",
            machine::bytes(self.bytes),
            self.bytes,
            machine::bytes(most as f64),
            self.memory_key
        );
        Some(Fault::new(self.memory_key, message))
    }

    /// Warnings of a run with large cost.
    pub fn warnings(&self) -> Vec<String> {
        let mut list = Vec::new();
        if self.seconds > LONG {
            list.push(format!(
                "estimated time about {}; reduce `{}`, or set --time-limit",
                machine::duration(self.seconds),
                self.time_key
            ));
        }
        if self.bytes > LARGE {
            list.push(format!(
                "estimated memory about {}; reduce `{}`",
                machine::bytes(self.bytes),
                self.memory_key
            ));
        }
        list
    }
}

/// Cost of integrating one excitation period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    /// Steps of the integrator.
    pub steps: f64,
    /// Highest frequency over that of the excitation.
    pub stiffness: f64,
    /// Seconds.
    pub plain: f64,
    /// Seconds, the transition matrix included.
    pub varied: f64,
}

impl Period {
    /// At a frequency of the reference over omega_c.
    pub fn of(setting: &Setting<'_>, frequency: f64) -> Period {
        let system = &setting.assembly.system;
        let rates = system.damping().diagonal();
        let natural = natural_frequencies(setting);
        let fastest = natural
            .iter()
            .chain(rates.iter())
            .fold(1.0_f64, |w, x| w.max(x.abs()));
        let stiffness = fastest / frequency;
        let steps = system.revolutions() as f64 * (4.0 + TAU * stiffness / REACH);
        let plain = steps * (STEP + ENTRY * entries(system));
        Period {
            steps,
            stiffness,
            plain,
            varied: plain * (1.0 + 2.0 * system.dof() as f64),
        }
    }
}

/// Natural frequencies over omega_c at rest, where most of a period is spent: a stop that is open there is touched for short
/// times only, in which the flow takes its own steps. In full contact where there is no rest.
fn natural_frequencies(setting: &Setting<'_>) -> Vec<f64> {
    let (assembly, names) = (setting.assembly, &setting.assembly.connections);
    let rest = equilibrium(&assembly.system).ok();
    let at_rest = rest.and_then(|rest| frequencies_at_rest(&assembly.system, &rest, names).ok());
    at_rest.unwrap_or_else(|| assembly.natural_frequencies.iter().copied().collect())
}

/// Entries of the matrices of the equation of motion.
fn entries(system: &System) -> f64 {
    let damping: usize = (0..system.dof())
        .map(|j| system.damping_column(j).len())
        .sum();
    let rows = (0..system.element_count())
        .map(|e| system.stiffness_column(e).len() + system.element_map_row(e).len());
    (damping + rows.sum::<usize>()) as f64
}

/// Cost of points of the Galerkin method.
pub fn galerkin(system: &System, harmonics: f64, samples: f64, points: f64) -> Cost {
    let (entries, products) = galerkin::effort(system);
    let coefficients = 2.0 * harmonics + 1.0;
    let connections = system.element_count() as f64;
    let matrix = entries * coefficients * coefficients;
    let sampled = samples * (8.0 + 3.0 * connections);
    let hill = 2.0 * coefficients * coefficients;
    let elimination = 2.0 * products * coefficients.powi(3) / OPERATIONS;
    let evaluation = 1e-9 * (4.0 * matrix + connections * samples * 30.0);
    Cost {
        bytes: 8.0 * (MATRICES * matrix + sampled + hill),
        seconds: points * SYSTEMS * (elimination + evaluation),
        memory_key: "harmonics",
        time_key: "harmonics",
    }
}

/// Cost of points of the shooting method.
pub fn shooting(period: Period, subharmonic: f64, points: f64) -> Cost {
    Cost::default().lasting(points * SHOTS * subharmonic * period.varied, "max_points")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_part_decides() {
        let rows = Cost::table(1e9, 10.0, "points").lasting(1.0, "points");
        let matrix = Cost {
            bytes: 1e3,
            seconds: 1e6,
            memory_key: "harmonics",
            time_key: "harmonics",
        };
        let both = matrix.and(rows);
        assert_eq!((both.memory_key, both.time_key), ("points", "harmonics"));
        assert_eq!(both.refusal(Some(u64::MAX)), None);
        assert_eq!(both.refusal(None), None);
        let fault = both.refusal(Some(1_000_000)).unwrap();
        assert_eq!(fault.key, "points");
        assert!(
            fault
                .message
                .contains("1.5 TB of memory (1500000001000 bytes)"),
            "{}",
            fault.message
        );
        assert_eq!(both.warnings().len(), 2);
    }
}
