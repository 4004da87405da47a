//! Measures of orbits that consist of polynomials: integrals by Gauss' rule between switches, extrema as roots.

use super::contacts::Contacts;
use super::effective_stiffness;
use super::measures::{Measures, is_clearance};
use crate::numeric::bernstein::{RootFinder, evaluate};
use crate::numeric::quadrature::unit_nodes;
use crate::numeric::roots::newton_bracketed;
use crate::solve::orbit::Crossing;
use crate::solve::segment_orbit::{SegmentOrbit, Stretch};
use crate::system::{Mount, System};
use std::f64::consts::TAU;

/// Abscissae between which an extremum is sought where a transmission error forbids the roots of polynomials.
const CELLS: usize = 16;

/// Sums over an orbit.
#[derive(Debug, Default)]
struct Sums {
    /// Deformations count from here, so that small motions around a large mean keep their digits.
    origin: f64,
    x: f64,
    xx: f64,
    vv: f64,
    f: f64,
    fx: f64,
    ff: f64,
    slope: f64,
    damping: f64,
    low: f64,
    high: f64,
    smallest_force: f64,
    largest_force: f64,
    pulls: bool,
}

impl Sums {
    fn widen_force(&mut self, f: f64) {
        self.smallest_force = self.smallest_force.min(f);
        self.largest_force = self.largest_force.max(f);
    }
}

/// Deformation of one connection on one stretch.
struct Piece<'a> {
    stretch: &'a Stretch,
    mount: &'a Mount,
    /// W q as a polynomial of the stretch.
    polynomial: Vec<f64>,
    omega: f64,
    nu: f64,
}

impl Piece<'_> {
    fn phase(&self, x: f64) -> f64 {
        self.nu * (self.stretch.tau + x * self.stretch.width)
    }

    /// Deformation and its derivative with respect to x.
    fn deformation(&self, x: f64) -> (f64, f64) {
        let (value, slope) = evaluate(&self.polynomial, x);
        match &self.mount.transmission_error {
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

    /// Deformation, rate, force and its partials, stiffness variation included.
    fn response(&self, x: f64) -> [f64; 5] {
        let (q, slope) = self.deformation(x);
        let v = slope * self.omega / self.stretch.width;
        let r = self.mount.element.eval(q, v, self.phase(x));
        let s = self
            .mount
            .stiffness_variation
            .as_ref()
            .map_or(1.0, |s| s.value(self.phase(x)));
        [q, v, s * r.f, s * r.df_dq, s * r.df_dv]
    }

    /// Abscissae inside the stretch where the deformation is extremal.
    fn extrema(&self, finder: &mut RootFinder) -> Vec<f64> {
        if self.mount.transmission_error.is_some() {
            let slope = |x: f64| (self.deformation(x).1, 0.0);
            let at = |k: usize| k as f64 / CELLS as f64;
            let cells =
                (0..CELLS).filter(|k| (slope(at(*k)).0 > 0.0) != (slope(at(*k + 1)).0 > 0.0));
            return cells
                .map(|k| newton_bracketed(slope, (at(k), slope(at(k)).0), at(k + 1)))
                .collect();
        }
        let derivative: Vec<f64> = self
            .polynomial
            .iter()
            .enumerate()
            .skip(1)
            .map(|(k, c)| k as f64 * c)
            .collect();
        let mut list = Vec::new();
        let mut next = finder.first_root(&derivative);
        while let Some(x) =
            next.filter(|x| list.len() < 64 && list.last().is_none_or(|last| x > last))
        {
            list.push(x);
            next = finder.first_root_after(&derivative, x + 1e-12);
        }
        list
    }
}

/// Measures of every connection.
pub(super) fn measure(system: &System, orbit: &SegmentOrbit) -> Vec<Measures> {
    let mut finder = RootFinder::new();
    (0..system.element_count())
        .map(|e| connection(system, orbit, e, &mut finder))
        .collect()
}

fn connection(
    system: &System,
    orbit: &SegmentOrbit,
    e: usize,
    finder: &mut RootFinder,
) -> Measures {
    let mount = &system.mounts()[e];
    let pulls_possible =
        mount.element.depends_on_velocity() && is_clearance(mount.element.as_ref());
    let mut sums = Sums {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        smallest_force: f64::INFINITY,
        largest_force: f64::NEG_INFINITY,
        ..Sums::default()
    };
    for stretch in &orbit.stretches {
        let mut polynomial = vec![0.0; stretch.count];
        for (i, w) in system
            .element_map()
            .row(e)
            .iter()
            .enumerate()
            .filter(|(_, w)| **w != 0.0)
        {
            polynomial
                .iter_mut()
                .zip(stretch.coordinate(i))
                .for_each(|(p, c)| *p += w * c);
        }
        let piece = Piece {
            stretch,
            mount,
            polynomial,
            omega: orbit.omega,
            nu: orbit.subharmonic as f64,
        };
        let share = stretch.width / TAU;
        if sums.low > sums.high {
            sums.origin = piece.deformation(0.0).0;
        }
        // Exact to rounding for the squares of the polynomials here, whose high coefficients are tiny.
        for (x, weight) in unit_nodes() {
            let [q, v, f, slope, damping] = piece.response(x);
            let weight = weight * share;
            let x = q - sums.origin;
            sums.x += weight * x;
            sums.xx += weight * x * x;
            sums.vv += weight * v * v;
            sums.f += weight * f;
            sums.fx += weight * f * x;
            sums.ff += weight * f * f;
            sums.slope += weight * slope;
            sums.damping += weight * damping;
            sums.widen_force(f);
            sums.pulls |= pulls_possible && f64::from(mount.element.flank(q)) * f < 0.0;
        }
        for x in piece.extrema(finder).into_iter().chain([0.0, 1.0]) {
            let [q, _, f, _, _] = piece.response(x);
            (sums.low, sums.high) = (sums.low.min(q), sums.high.max(q));
            sums.widen_force(f);
        }
    }
    finish(system, orbit, e, &sums)
}

fn finish(system: &System, orbit: &SegmentOrbit, e: usize, sums: &Sums) -> Measures {
    let scale = sums.low.abs().max(sums.high.abs());
    let mean = sums.origin + sums.x;
    let variance = (sums.xx - sums.x * sums.x).max(0.0);
    let own = orbit.switches.iter().filter(|s| s.connection == e);
    let crossings: Vec<Crossing> = own.map(Crossing::from).collect();
    let moves = sums.high - sums.low > 1e-12 * scale;
    Measures {
        mean,
        rms: variance.sqrt(),
        min: sums.low,
        max: sums.high,
        rms_velocity: sums.vv.sqrt(),
        effective_stiffness: moves.then(|| (sums.fx - sums.f * sums.x) / variance),
        effective_stiffness_dc: effective_stiffness::direct(mean, sums.f, scale),
        mean_slope: sums.slope,
        mean_damping: sums.damping,
        contacts: Contacts::new(system, e, &crossings, mean, orbit.subharmonic as f64),
        force_mean: sums.f,
        force_min: sums.smallest_force,
        force_max: sums.largest_force,
        force_std: (sums.ff - sums.f * sums.f).max(0.0).sqrt(),
        pulls: sums.pulls,
    }
}
