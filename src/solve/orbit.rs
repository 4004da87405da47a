//! A periodic orbit: deformations, switching instants, extrema.

use super::integrate::{Switch, SwitchKind};
use super::segment_orbit::SegmentOrbit;
use crate::numeric::periodic::Periodic;
use crate::numeric::{roots, trigonometric};
use crate::system::{Mount, System};
use std::f64::consts::TAU;

/// A periodic solution.
#[derive(Debug, Clone, PartialEq)]
pub enum Orbit {
    /// Fourier series, from the Galerkin method.
    Fourier(FourierOrbit),
    /// Intervals of polynomials, from an integrator.
    Segments(SegmentOrbit),
}

impl Orbit {
    /// nu, excitation periods in the response period.
    pub fn subharmonic(&self) -> usize {
        match self {
            Orbit::Fourier(orbit) => orbit.subharmonic,
            Orbit::Segments(orbit) => orbit.subharmonic,
        }
    }

    /// State [q; v] at tau into `state`, 2n values.
    pub fn state(&self, tau: f64, state: &mut [f64]) {
        match self {
            Orbit::Fourier(orbit) => orbit.state(tau, state),
            Orbit::Segments(orbit) => orbit.state(tau, state),
        }
    }

    /// Value and rate, d/d(omega_c t), of one coordinate at tau.
    pub fn coordinate(&self, i: usize, tau: f64) -> [f64; 2] {
        match self {
            Orbit::Fourier(orbit) => orbit.coordinate(i, tau),
            Orbit::Segments(orbit) => orbit.coordinate(i, tau),
        }
    }
}

/// Sum of the amplitudes, relative to the mean, up to which a deformation does not move: what solvers leave of the rest.
const STILL: f64 = 1e-12;

/// A periodic solution as Fourier series of the relative coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierOrbit {
    /// Fourier coefficients of each coordinate: mean, sin 1, cos 1, ... of tau.
    pub coefficients: Vec<Vec<f64>>,
    /// Om = omega / (nu omega_c).
    pub omega: f64,
    /// nu.
    pub subharmonic: usize,
}

/// One connection passes a breakpoint of its law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Phase of the response, in [0, 2 pi).
    pub tau: f64,
    /// Connection.
    pub connection: usize,
    /// Flank before: -1, 0 (open) or 1.
    pub from: i8,
    /// Flank after.
    pub to: i8,
    /// Rate of the deformation, d/d(omega_c t).
    pub velocity: f64,
    /// Action at the passage.
    pub kind: SwitchKind,
}

impl From<&Switch> for Crossing {
    fn from(switch: &Switch) -> Crossing {
        Crossing {
            tau: switch.tau,
            connection: switch.connection,
            from: switch.from,
            to: switch.to,
            velocity: switch.velocity,
            kind: switch.kind,
        }
    }
}

/// Deformation of one connection along an orbit: W q - e.
#[derive(Debug, Clone)]
pub struct Deformation<'a> {
    /// Fourier coefficients of W q in tau.
    pub coefficients: Vec<f64>,
    error: Option<&'a Periodic>,
    subharmonic: f64,
}

impl Deformation<'_> {
    /// Value and derivative with respect to tau.
    pub fn at(&self, tau: f64) -> [f64; 2] {
        let [x, slope, _] = trigonometric::evaluate(&self.coefficients, tau);
        match self.error {
            None => [x, slope],
            Some(e) => {
                let phase = self.subharmonic * tau;
                [
                    x - e.value(phase),
                    slope - self.subharmonic * e.derivative(phase),
                ]
            }
        }
    }

    /// Coefficients of W q - e, as many as W q has.
    pub fn series(&self) -> Vec<f64> {
        let mut series = self.coefficients.clone();
        if let Some(error) = self.error {
            let mut terms = vec![0.0; series.len()];
            error.coefficients(self.subharmonic as usize, &mut terms);
            series.iter_mut().zip(&terms).for_each(|(a, e)| *a -= e);
        }
        series
    }

    /// Extrema in the order of time over one period, the first one repeated a period later; empty when nothing moves but
    /// rounding.
    pub fn extrema(&self) -> Vec<(f64, f64)> {
        let harmonics = self.coefficients.len() / 2;
        let motion: f64 = self.coefficients[1..].iter().map(|a| a.abs()).sum();
        if self.error.is_none() && motion <= STILL * self.coefficients[0].abs() {
            return Vec::new();
        }
        let fine = self
            .error
            .map_or(0, |e| 8 * self.subharmonic as usize * (1 + e.kinks().len()));
        let cells = (8 * harmonics).max(64).max(fine);
        let tau = |j: usize| j as f64 * TAU / cells as f64;
        let slopes = self.slopes(cells);
        let mut list = Vec::new();
        for j in 0..cells {
            if (slopes[j] > 0.0) == (slopes[(j + 1) % cells] > 0.0) {
                continue;
            }
            let slope = |x: f64| {
                let [_, first, second] = trigonometric::evaluate(&self.coefficients, x);
                let Some(e) = self.error else {
                    return (first, second);
                };
                let (nu, phase) = (self.subharmonic, self.subharmonic * x);
                let error = [e.derivative(phase), e.second_derivative(phase)];
                (first - nu * error[0], second - nu * nu * error[1])
            };
            let x = roots::newton_bracketed(slope, (tau(j), slopes[j]), tau(j + 1));
            list.push((x, self.at(x)[0]));
        }
        if let Some((x, value)) = list.first().copied() {
            list.push((x + TAU, value));
        }
        list
    }

    /// Derivatives at equally spaced instants of one period.
    fn slopes(&self, cells: usize) -> Vec<f64> {
        let mut list = vec![0.0; cells];
        trigonometric::sample_derivative(&self.coefficients, &mut list);
        if let Some(e) = self.error {
            for (j, slope) in list.iter_mut().enumerate() {
                let phase = self.subharmonic * j as f64 * TAU / cells as f64;
                *slope -= self.subharmonic * e.derivative(phase);
            }
        }
        list
    }

    /// Instants at which the deformation passes a level, in no particular order, given its extrema.
    pub fn crossings(&self, level: f64, extrema: &[(f64, f64)]) -> Vec<f64> {
        let pieces = extrema
            .windows(2)
            .filter(|w| (w[0].1 > level) != (w[1].1 > level));
        pieces
            .map(|w| {
                let f = |x: f64| {
                    let [value, slope] = self.at(x);
                    (value - level, slope)
                };
                roots::newton_bracketed(f, (w[0].0, w[0].1 - level), w[1].0).rem_euclid(TAU)
            })
            .collect()
    }
}

impl FourierOrbit {
    /// Highest harmonic of tau.
    pub fn harmonics(&self) -> usize {
        self.coefficients.first().map_or(0, |a| a.len() / 2)
    }

    /// Deformation of a connection.
    pub fn deformation<'s>(&self, system: &'s System, connection: usize) -> Deformation<'s> {
        let mut coefficients = vec![0.0; 2 * self.harmonics() + 1];
        for (j, w) in system.element_map_row(connection) {
            let terms = coefficients.iter_mut().zip(&self.coefficients[*j]);
            terms.for_each(|(sum, a)| *sum += w * a);
        }
        let error = system.mounts()[connection].transmission_error.as_ref();
        Deformation {
            coefficients,
            error,
            subharmonic: self.subharmonic as f64,
        }
    }

    /// Extrema of every deformation whose law has breakpoints or a memory; an empty list for the others.
    pub fn extrema(&self, system: &System) -> Vec<Vec<(f64, f64)>> {
        let one = |(k, mount): (usize, &Mount)| match mount.element.is_featureless() {
            true => Vec::new(),
            false => self.deformation(system, k).extrema(),
        };
        system.mounts().iter().enumerate().map(one).collect()
    }

    /// State [q; v] at tau into `state`, 2n values.
    pub fn state(&self, tau: f64, state: &mut [f64]) {
        let n = self.coefficients.len();
        for i in 0..n {
            [state[i], state[n + i]] = self.coordinate(i, tau);
        }
    }

    /// Value and rate, d/d(omega_c t), of one coordinate at tau.
    pub fn coordinate(&self, i: usize, tau: f64) -> [f64; 2] {
        let [q, slope, _] = trigonometric::evaluate(&self.coefficients[i], tau);
        [q, self.omega * slope]
    }

    /// Every passage of a breakpoint in one response period, in the order of time; for one connection.
    pub fn crossings(
        &self,
        system: &System,
        connection: usize,
        extrema: &[(f64, f64)],
    ) -> Vec<Crossing> {
        let deformation = self.deformation(system, connection);
        let element = &system.mounts()[connection].element;
        let breakpoints = element.breakpoints();
        let mut instants: Vec<f64> = breakpoints
            .iter()
            .flat_map(|level| deformation.crossings(*level, extrema))
            .collect();
        instants.sort_by(f64::total_cmp);
        let count = instants.len();
        // The flank between two instants is read in the middle, where no rounding can blur it.
        let flank_after = |k: usize| {
            let next = if k + 1 < count {
                instants[k + 1]
            } else {
                instants[0] + TAU
            };
            element.flank(deformation.at(0.5 * (instants[k] + next))[0])
        };
        let flanks: Vec<i8> = (0..count).map(flank_after).collect();
        (0..count)
            .map(|k| Crossing {
                tau: instants[k],
                connection,
                from: flanks[(k + count - 1) % count],
                to: flanks[k],
                velocity: self.omega * deformation.at(instants[k])[1],
                kind: SwitchKind::Breakpoint,
            })
            .collect()
    }
}
