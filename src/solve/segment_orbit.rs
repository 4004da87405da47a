//! A periodic orbit as stretches of polynomials between switching instants.

use super::integrate::{Observer, Segment, Switch};
use std::f64::consts::TAU;

/// A periodic solution from an integrator, to the integrator's accuracy.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentOrbit {
    /// Om = omega / (nu omega_c).
    pub omega: f64,
    /// nu.
    pub subharmonic: usize,
    /// n, coordinates.
    pub dof: usize,
    /// Stretches in the order of time; they cover [0, 2 pi).
    pub stretches: Vec<Stretch>,
    /// Switches in the order of time.
    pub switches: Vec<Switch>,
}

/// One stretch: see [`Segment`].
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// Phase of the response at its begin.
    pub tau: f64,
    /// Length in tau.
    pub width: f64,
    /// Coefficients of q_i in powers of (tau - begin) / width, coordinate by coordinate.
    pub coefficients: Vec<f64>,
    /// Coefficients a coordinate.
    pub count: usize,
}

impl Stretch {
    /// The same as a borrowed segment.
    pub fn segment(&self) -> Segment<'_> {
        Segment {
            tau: self.tau,
            width: self.width,
            coefficients: &self.coefficients,
            count: self.count,
        }
    }

    /// Coefficients of one coordinate.
    pub fn coordinate(&self, i: usize) -> &[f64] {
        &self.coefficients[i * self.count..(i + 1) * self.count]
    }
}

impl SegmentOrbit {
    /// An orbit without stretches: an observer of the integration over [0, 2 pi] fills it.
    pub fn new(omega: f64, subharmonic: usize, dof: usize) -> SegmentOrbit {
        SegmentOrbit {
            omega,
            subharmonic,
            dof,
            stretches: Vec::new(),
            switches: Vec::new(),
        }
    }

    /// State [q; v] at tau into `state`, 2n values.
    pub fn state(&self, tau: f64, state: &mut [f64]) {
        let tau = tau.rem_euclid(TAU);
        let index = self
            .stretches
            .partition_point(|s| s.tau <= tau)
            .saturating_sub(1);
        if let Some(stretch) = self.stretches.get(index) {
            let x = ((tau - stretch.tau) / stretch.width).clamp(0.0, 1.0);
            stretch.segment().state(x, self.omega, state);
        }
    }
}

impl Observer for SegmentOrbit {
    fn segment(&mut self, segment: &Segment<'_>) {
        self.stretches.push(Stretch {
            tau: segment.tau,
            width: segment.width,
            coefficients: segment.coefficients.to_vec(),
            count: segment.count,
        });
    }

    fn switch(&mut self, switch: &Switch) {
        self.switches.push(*switch);
    }
}
