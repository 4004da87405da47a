//! A periodic orbit as stretches of polynomials between switching instants.

use super::integrate::{FlowObserver, Segment, Switch, SwitchKind};
use crate::numeric::bernstein::{self, evaluate};
use crate::numeric::periodic::Periodic;
use crate::numeric::roots::newton_bracketed;
use crate::system::System;
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
    pub(crate) stretches: Vec<Stretch>,
    /// Switches in the order of time.
    pub switches: Vec<Switch>,
}

/// One stretch: see [`Segment`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stretch {
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

/// Phases this close are one.
const SAME_INSTANT: f64 = 1e-9;

/// Cells of a stretch in which an extremum is sought where a transmission error forbids the roots of polynomials: of a table.
const CELLS: usize = 16;
/// The same for harmonics: as many for the motion alone, which turns once or twice within a stretch,
const FEWEST_CELLS: usize = 4;
/// and this many per wave of the highest order.
const CELLS_PER_WAVE: f64 = 8.0;

/// Deformation of one connection on one stretch: W q - e, W q a polynomial in x = (tau - begin) / width.
#[derive(Debug, Clone)]
pub(crate) struct StretchDeformation<'a> {
    stretch: &'a Stretch,
    polynomial: Vec<f64>,
    error: Option<&'a Periodic>,
    nu: f64,
}

impl StretchDeformation<'_> {
    /// Phase of the response.
    pub fn tau(&self, x: f64) -> f64 {
        self.stretch.tau + x * self.stretch.width
    }

    /// Phase of the excitation.
    pub fn phase(&self, x: f64) -> f64 {
        self.nu * self.tau(x)
    }

    /// Deformation and its derivative with respect to x.
    pub fn at(&self, x: f64) -> (f64, f64) {
        let (value, slope) = evaluate(&self.polynomial, x);
        match self.error {
            None => (value, slope),
            Some(e) => {
                let phase = self.phase(x);
                (
                    value - e.value(phase),
                    slope - e.derivative(phase) * self.nu * self.stretch.width,
                )
            }
        }
    }

    /// Abscissae inside the stretch where the deformation is extremal.
    pub fn extrema(&self) -> Vec<f64> {
        let mut derivative = [0.0; bernstein::SIZE];
        let terms = self.polynomial.iter().enumerate().skip(1);
        for (d, (k, c)) in derivative.iter_mut().zip(terms) {
            *d = k as f64 * c;
        }
        match self.error {
            None => bernstein::sign_changes(&derivative),
            Some(error) => self.extrema_with(error, &derivative[..self.polynomial.len()]),
        }
    }

    /// Adds a transmission error, cell by cell; `derivative`: of the polynomial.
    fn extrema_with(&self, error: &Periodic, derivative: &[f64]) -> Vec<f64> {
        let per_x = self.nu * self.stretch.width;
        let slope = |x: f64| {
            let (slope, second) = evaluate(derivative, x);
            let phase = self.phase(x);
            let error = [error.derivative(phase), error.second_derivative(phase)];
            (slope - per_x * error[0], second - per_x * per_x * error[1])
        };
        let cells = match error.highest_order() {
            Some(order) => FEWEST_CELLS + (CELLS_PER_WAVE * order as f64 * per_x / TAU) as usize,
            None => CELLS,
        };
        let at = |k: usize| k as f64 / cells as f64;
        let mut list = Vec::new();
        let mut before = slope(0.0).0;
        for k in 0..cells {
            let behind = slope(at(k + 1)).0;
            if (before > 0.0) != (behind > 0.0) {
                list.push(newton_bracketed(slope, (at(k), before), at(k + 1)));
            }
            before = behind;
        }
        list
    }
}

impl SegmentOrbit {
    /// Deformation of a connection on one stretch.
    pub(crate) fn deformation<'a>(
        &self,
        system: &'a System,
        connection: usize,
        stretch: &'a Stretch,
    ) -> StretchDeformation<'a> {
        let mut polynomial = vec![0.0; stretch.count];
        for (i, w) in system.element_map_row(connection) {
            polynomial
                .iter_mut()
                .zip(stretch.coordinate(*i))
                .for_each(|(p, c)| *p += w * c);
        }
        StretchDeformation {
            stretch,
            polynomial,
            error: system.mounts()[connection].transmission_error.as_ref(),
            nu: self.subharmonic as f64,
        }
    }

    /// Extrema (tau, deformation) of every connection whose law has breakpoints or a memory, in the order of time, the first one repeated a
    /// period later; an empty list for the others and where nothing moves.
    pub fn extrema(&self, system: &System) -> Vec<Vec<(f64, f64)>> {
        let mounts = system.mounts().iter().enumerate();
        mounts
            .map(|(k, mount)| match mount.element.is_featureless() {
                true => Vec::new(),
                false => self.extrema_of(system, k),
            })
            .collect()
    }

    /// The same for one connection. The slope's sign is read between the roots of each stretch: an extremum on a seam is found,
    /// and found once.
    pub(crate) fn extrema_of(&self, system: &System, connection: usize) -> Vec<(f64, f64)> {
        let mut runs: Vec<(f64, f64, bool)> = Vec::new();
        for stretch in &self.stretches {
            let deformation = self.deformation(system, connection, stretch);
            let mut ends = vec![0.0];
            ends.extend(deformation.extrema());
            ends.push(1.0);
            for pair in ends.windows(2).filter(|w| w[1] > w[0]) {
                let rises = deformation.at(0.5 * (pair[0] + pair[1])).1 > 0.0;
                let begin = (deformation.tau(pair[0]), deformation.at(pair[0]).0);
                runs.push((begin.0, begin.1, rises));
            }
        }
        let mut before = runs.last().is_some_and(|r| r.2);
        let mut list = Vec::new();
        for (tau, value, rises) in runs {
            if rises != before {
                list.push((tau, value));
            }
            before = rises;
        }
        if system.mounts()[connection].element.least_impact().is_some() {
            self.press(connection, &mut list);
        }
        if let Some((tau, value)) = list.first().copied() {
            list.push((tau + TAU, value));
        }
        list
    }

    /// Lets extrema at impacts on a stop reach beyond it by half the square of the rate: that height passes the level evenly where a
    /// branch comes to graze.
    fn press(&self, connection: usize, list: &mut [(f64, f64)]) {
        let own = (self.switches.iter())
            .filter(|s| s.connection == connection && s.kind == SwitchKind::Impact);
        for impact in own {
            let gap = |tau: f64| {
                let x = (tau - impact.tau).rem_euclid(TAU);
                x.min(TAU - x)
            };
            let nearest = list.iter_mut().min_by(|a, b| gap(a.0).total_cmp(&gap(b.0)));
            if let Some(extremum) = nearest.filter(|x| gap(x.0) < SAME_INSTANT) {
                extremum.1 = impact.level + 0.5 * impact.velocity * impact.velocity.abs();
            }
        }
    }

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

    /// The stretch at tau, and the place in it.
    fn stretch_at(&self, tau: f64) -> Option<(&Stretch, f64)> {
        let tau = tau.rem_euclid(TAU);
        let after = self.stretches.partition_point(|s| s.tau <= tau);
        let stretch = self.stretches.get(after.saturating_sub(1))?;
        let x = ((tau - stretch.tau) / stretch.width).clamp(0.0, 1.0);
        Some((stretch, x))
    }

    /// State [q; v] at tau into `state`, 2n values; with room for them the memories behind.
    pub fn state(&self, tau: f64, state: &mut [f64]) {
        if let Some((stretch, x)) = self.stretch_at(tau) {
            let rows = state.len() - self.dof;
            let part = Segment {
                coefficients: &stretch.coefficients[..rows * stretch.count],
                ..stretch.segment()
            };
            part.state(x, self.omega, state);
        }
    }

    /// Value and rate, d/d(omega_c t), of one coordinate at tau.
    pub fn coordinate(&self, i: usize, tau: f64) -> [f64; 2] {
        let mut state = [0.0; 2];
        if let Some((stretch, x)) = self.stretch_at(tau) {
            let alone = Segment {
                coefficients: stretch.coordinate(i),
                ..stretch.segment()
            };
            alone.state(x, self.omega, &mut state);
        }
        state
    }
}

impl FlowObserver for SegmentOrbit {
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
