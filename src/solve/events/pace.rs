//! How far multipliers turn from one place to the next.

use super::Look;
use crate::system::System;
use std::f64::consts::TAU;

/// Multipliers below this modulus turn as they like.
const FAINT: f64 = 0.1;
/// Largest turn between two looks [rad]: sequences of multipliers are then told from those that turn the other way.
const LARGEST: f64 = 1.0;
/// Steps of the power iteration.
const POWERS: usize = 8;
/// Keeps the numbers of coordinates that nothing drives from zero.
const LEAST_SHARE: f64 = 1e-30;

/// Bounds of the natural frequencies and of their damping, in full contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WindowPace {
    states: usize,
    highest: f64,
    damping_ratio: f64,
}

impl WindowPace {
    /// The highest natural frequency is bounded after Collatz and Wielandt; the damping ratio is that of equally damped modes,
    ///
    /// ```text
    /// tr Gam / (2 sum of omega_k) >= tr Gam / (2 (n tr kappa W)^(1/2))
    /// ```
    pub fn of(system: &System) -> WindowPace {
        let n = system.dof();
        let (mut x, mut bound) = (vec![1.0; n], f64::INFINITY);
        let mut y = vec![0.0; n];
        for _ in 0..POWERS {
            y.fill(0.0);
            for e in 0..system.element_count() {
                let row = system.element_map_row(e);
                let force: f64 = row.iter().map(|(j, w)| w.abs() * x[*j]).sum();
                for (i, kappa) in system.stiffness_column(e) {
                    y[*i] += kappa.abs() * force;
                }
            }
            let ratios = y.iter().zip(&x).map(|(y, x)| y / x);
            bound = bound.min(ratios.fold(0.0, f64::max));
            let largest = y.iter().fold(f64::MIN_POSITIVE, |m, y| m.max(*y));
            for (x, y) in x.iter_mut().zip(&y) {
                *x = (y / largest).max(LEAST_SHARE);
            }
        }
        let (mut damping, mut stiffness) = (0.0, 0.0);
        for j in 0..n {
            let column = system.damping_column(j).iter().filter(|(i, _)| *i == j);
            damping += column.map(|(_, gamma)| gamma).sum::<f64>();
        }
        for e in 0..system.element_count() {
            for (i, kappa) in system.stiffness_column(e) {
                let row = system.element_map_row(e).iter().filter(|(j, _)| j == i);
                stiffness += row.map(|(_, w)| kappa * w).sum::<f64>();
            }
        }
        let sum = 2.0 * (n as f64 * stiffness.abs()).sqrt();
        WindowPace {
            states: system.state_size(),
            highest: bound.sqrt(),
            damping_ratio: damping / sum.max(f64::MIN_POSITIVE),
        }
    }

    /// Number of all multipliers.
    pub fn states(&self) -> usize {
        self.states
    }

    /// Whether multipliers that matter may turn too far between two looks.
    pub(crate) fn is_too_fast(&self, a: &Look, b: &Look) -> bool {
        let (long, short) = (TAU / a.omega(), TAU / b.omega());
        let (long, short) = (long.max(short), long.min(short));
        let longest = -FAINT.ln() / (self.damping_ratio * short).max(f64::MIN_POSITIVE);
        self.highest.min(longest) * (long - short) > LARGEST
    }
}
