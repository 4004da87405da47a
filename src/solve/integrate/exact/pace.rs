//! The unit of time of the current contact state.
//!
//! The unit of the series is that of the stiffest contact. While a contact 10^6 times stiffer than its shaft is open, nothing
//! moves that fast: steps of that length would be a thousand times too short.

use super::entries::MatrixEntry;
use super::frequencies::radius;
use crate::system::{LoadKind, System};

/// Ratio of the highest frequency to that of an open train from which steps are measured by contact state; below it one unit
/// serves all.
const STIFF: f64 = 30.0;
/// Largest unit, in units of the series.
const LARGEST: f64 = 1e9;
/// Steps of the power iteration that bounds the frequencies of a contact state.
const POWERS: usize = 6;
/// Keeps the numbers of coordinates that nothing drives from zero.
const LEAST_SHARE: f64 = 1e-30;

/// Length of time that suits the current contact state.
#[derive(Debug, Clone)]
pub(super) struct Pace {
    /// In units of the series.
    pub unit: f64,
    /// Frequency bound of the train with every contact as soft as it gets; bound by damping alone; highest order of the
    /// excitation; all in units of the series.
    slowest: f64,
    damped: f64,
    order: f64,
    /// Excitation with its highest order, and whether contact states differ enough to be told apart.
    driven: f64,
    is_stiff: bool,
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Pace {
    /// For a system whose series have a unit of time.
    pub fn new(system: &System, unit: f64, slowest: f64) -> Pace {
        let loads = system.loads().iter().map(|l| match &l.kind {
            LoadKind::Orders { ratio, .. } => l.series.highest_order().map(|k| k as f64 * ratio),
            _ => l.series.highest_order().map(|k| k as f64),
        });
        let errors = system.mounts().iter().map(|m| {
            let error = m.transmission_error.as_ref();
            error.and_then(|e| e.highest_order()).map(|k| k as f64)
        });
        let order = loads.chain(errors).flatten().reduce(f64::max);
        Pace {
            unit: 1.0,
            slowest,
            damped: unit * radius(&system.damping().abs()),
            order: order.unwrap_or(1.0),
            driven: 0.0,
            is_stiff: false,
            x: vec![1.0; system.dof()],
            y: vec![0.0; system.dof()],
        }
    }

    /// Takes over the excitation frequency, in units of the series.
    pub fn prepare(&mut self, frequency: f64) {
        self.driven = self.order * frequency;
        self.is_stiff = STIFF * self.slowest.max(self.driven) < 1.0;
        self.unit = 1.0;
    }

    /// Takes over the coupling of a contact state, h^2 kappa diag(slope) W.
    ///
    /// ```text
    /// rho(A) <= max_i (A x)_i / x_i  for every x > 0
    /// ```
    pub fn read(&mut self, coupled: &[MatrixEntry]) {
        if !self.is_stiff {
            return;
        }
        self.x.fill(1.0);
        let mut bound = f64::INFINITY;
        for _ in 0..POWERS {
            self.y.fill(0.0);
            for c in coupled {
                self.y[c.row] += c.value.abs() * self.x[c.column];
            }
            let ratios = self.y.iter().zip(&self.x).map(|(y, x)| y / x);
            bound = bound.min(ratios.fold(0.0, f64::max));
            let largest = self.y.iter().fold(f64::MIN_POSITIVE, |m, y| m.max(*y));
            let next = self.x.iter_mut().zip(&self.y);
            next.for_each(|(x, y)| *x = (y / largest).max(LEAST_SHARE));
        }
        let frequency = (self.damped + bound.sqrt()).max(self.driven);
        self.unit = (1.0 / frequency).clamp(1.0, LARGEST);
    }
}
