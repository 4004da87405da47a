//! Measures of orbits that consist of polynomials: integrals by Gauss' rule between switches, extrema as roots.

use super::contacts::Contacts;
use super::effective_stiffness;
use super::measures::{Measures, is_clearance};
use crate::numeric::quadrature::unit_nodes;
use crate::solve::orbit::Crossing;
use crate::solve::segment_orbit::{SegmentOrbit, StretchDeformation};
use crate::system::{Mount, System};
use std::f64::consts::TAU;

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

/// Deformation of one connection on one stretch, with its law.
struct Piece<'a> {
    deformation: StretchDeformation<'a>,
    mount: &'a Mount,
    /// Om / width: d/dT for one d/dx.
    rate: f64,
}

impl Piece<'_> {
    /// Deformation, rate, force and its partials, stiffness variation included.
    fn response(&self, x: f64) -> [f64; 5] {
        let (q, slope) = self.deformation.at(x);
        let phase = self.deformation.phase(x);
        let v = slope * self.rate;
        let r = self.mount.respond(q, v, phase);
        [q, v, r.f, r.df_dq, r.df_dv]
    }
}

/// Measures of every connection.
pub(super) fn measure(system: &System, orbit: &SegmentOrbit) -> Vec<Measures> {
    (0..system.element_count())
        .map(|e| connection(system, orbit, e))
        .collect()
}

fn connection(system: &System, orbit: &SegmentOrbit, e: usize) -> Measures {
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
        let piece = Piece {
            deformation: orbit.deformation(system, e, stretch),
            mount,
            rate: orbit.omega / stretch.width,
        };
        let share = stretch.width / TAU;
        if sums.low > sums.high {
            sums.origin = piece.deformation.at(0.0).0;
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
        for x in piece.deformation.extrema().into_iter().chain([0.0, 1.0]) {
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
        contacts: Contacts::new(
            system,
            e,
            &crossings,
            mean,
            (orbit.subharmonic * system.revolutions()) as f64,
        ),
        force_mean: sums.f,
        force_min: sums.smallest_force,
        force_max: sums.largest_force,
        force_std: (sums.ff - sums.f * sums.f).max(0.0).sqrt(),
        pulls: sums.pulls,
    }
}
