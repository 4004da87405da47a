//! Measures of orbits that consist of polynomials: integrals by Gauss' rule between switches, extrema as roots.

use super::connection::{Measures, is_clearance};
use super::contacts::Contacts;
use super::effective_stiffness;
use crate::element::Element;
use crate::numeric::bernstein::evaluate;
use crate::numeric::quadrature::unit_nodes;
use crate::numeric::roots::summit;
use crate::solve::integrate::{Switch, SwitchKind};
use crate::solve::orbit::Crossing;
use crate::solve::segment_orbit::{SegmentOrbit, StretchDeformation};
use crate::system::{Mount, System};
use nalgebra::{DMatrix, DVector};
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
    fv: f64,
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
struct MeasuredPiece<'a> {
    deformation: StretchDeformation<'a>,
    mount: &'a Mount,
    /// Om / width: d/dT for one d/dx.
    rate: f64,
    /// Coefficients of what the law remembers.
    memory: Vec<&'a [f64]>,
}

impl MeasuredPiece<'_> {
    /// Deformation, rate, force and its partials, stiffness variation included.
    fn response(&self, x: f64) -> [f64; 5] {
        let (q, slope) = self.deformation.at(x);
        let phase = self.deformation.phase(x);
        let v = slope * self.rate;
        let r = match self.memory.is_empty() {
            true => self.mount.respond_with([q, v], phase, &[]),
            false => {
                let memory: Vec<f64> = self.memory.iter().map(|c| evaluate(c, x).0).collect();
                self.mount.respond_with([q, v], phase, &memory)
            }
        };
        [q, v, r.f, r.df_dq, r.df_dv]
    }
}

impl MeasuredPiece<'_> {
    /// Extremes of a force whose stiffness varies, between the nodes: they need not lie at those of the deformation.
    fn refine_force(&self, sums: &mut Sums) {
        let mut nodes: Vec<(f64, f64)> = unit_nodes()
            .map(|(x, _)| (x, self.response(x)[2]))
            .collect();
        nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        for sign in [1.0, -1.0] {
            let Some(top) = (0..nodes.len())
                .max_by(|a, b| (sign * nodes[*a].1).total_cmp(&(sign * nodes[*b].1)))
            else {
                return;
            };
            let low = top.checked_sub(1).map_or(0.0, |k| nodes[k].0);
            let high = nodes.get(top + 1).map_or(1.0, |node| node.0);
            let start = (nodes[top].0, sign * nodes[top].1);
            let force = |x: f64| sign * self.response(x)[2];
            sums.widen_force(sign * summit(force, start, (low, high), 0.0));
        }
    }
}

/// Measures of every connection.
pub(super) fn measure(system: &System, orbit: &SegmentOrbit) -> Vec<Measures> {
    let all = (0..system.element_count()).map(|e| connection(system, orbit, e));
    let mut list: Vec<Measures> = all.collect();
    carry(system, &mut list);
    list
}

/// The same where contacts alone are read. Those of a connection that passes its breakpoints follow from the passages; where it passes
/// none its mean tells them, and of the impacts on a stop its r.m.s. rate tells which count.
pub(super) fn contacts(system: &System, orbit: &SegmentOrbit) -> Vec<Measures> {
    let one = |e: usize| {
        let crossings = crossings(orbit, e, 0.0);
        let periods = excitation_periods(system, orbit);
        Measures::of_contacts(
            match crossings.is_empty() || mount_of(system, e).least_impact().is_some() {
                true => connection(system, orbit, e).contacts,
                false => Contacts::new(system, e, &crossings, f64::NAN, periods),
            },
        )
    };
    (0..system.element_count()).map(one).collect()
}

/// Passages of the breakpoints of a connection, and its impacts from a speed on.
fn crossings(orbit: &SegmentOrbit, e: usize, least: f64) -> Vec<Crossing> {
    let counts = |s: &&Switch| {
        s.connection == e
            && s.kind != SwitchKind::Memory
            && (s.kind != SwitchKind::Impact || s.velocity.abs() >= least)
    };
    let own = orbit.switches.iter().filter(counts);
    own.map(Crossing::from).collect()
}

/// Excitation periods in a response period.
fn excitation_periods(system: &System, orbit: &SegmentOrbit) -> f64 {
    (orbit.subharmonic * system.revolutions()) as f64
}

fn connection(system: &System, orbit: &SegmentOrbit, e: usize) -> Measures {
    let mount = &system.mounts()[e];
    let pulls_possible =
        mount.element.depends_on_velocity() && is_clearance(mount.element.as_ref());
    let n = system.dof();
    let mut sums = Sums {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
        smallest_force: f64::INFINITY,
        largest_force: f64::NEG_INFINITY,
        ..Sums::default()
    };
    for stretch in &orbit.stretches {
        let piece = MeasuredPiece {
            deformation: orbit.deformation(system, e, stretch),
            mount,
            rate: orbit.omega / stretch.width,
            memory: system
                .memory_of(e)
                .map(|m| stretch.coordinate(n + m))
                .collect(),
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
            sums.fv += weight * f * v;
            sums.slope += weight * slope;
            sums.damping += weight * damping;
            sums.widen_force(f);
            sums.pulls |= pulls_possible && f64::from(mount.element.flank(q)) * f < 0.0;
        }
        if mount.stiffness_variation.is_some() {
            piece.refine_force(&mut sums);
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
    let least = match mount_of(system, e).least_impact() {
        Some(share) => share * sums.vv.sqrt(),
        None => 0.0,
    };
    let crossings = crossings(orbit, e, least);
    let periods = excitation_periods(system, orbit);
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
        contacts: Contacts::new(system, e, &crossings, mean, periods),
        force_mean: sums.f,
        force_min: sums.smallest_force,
        force_max: sums.largest_force,
        force_std: (sums.ff - sums.f * sums.f).max(0.0).sqrt(),
        pulls: sums.pulls,
        // A period lasts 2 pi / Om.
        loss: sums.fv * TAU / orbit.omega / periods,
    }
}

fn mount_of(system: &System, e: usize) -> &dyn Element {
    system.mounts()[e].element.as_ref()
}

/// Forces of rigid stops: their mean follows from the balance of what is periodic, the rest is not a number. A stop that is never
/// touched has none; between stops that act in the same direction the balance does not decide.
///
/// ```text
/// sum_stops kappa_e mean f_e = mean Q - sum_others kappa_e mean f_e
/// ```
fn carry(system: &System, list: &mut [Measures]) {
    let stops: Vec<usize> = (0..list.len())
        .filter(|e| mount_of(system, *e).least_impact().is_some())
        .collect();
    if stops.is_empty() {
        return;
    }
    let mut rest = system.mean_load();
    for (e, m) in list.iter().enumerate().filter(|(e, _)| !stops.contains(e)) {
        rest.axpy(-m.force_mean, &system.stiffness().column(e), 1.0);
    }
    let is_touched = |e: &usize| {
        let Contacts { front, back, .. } = &list[*e].contacts;
        [front, back]
            .iter()
            .any(|f| f.share > 0.0 || f.impacts > 0.0)
    };
    let touched: Vec<usize> = stops.iter().copied().filter(is_touched).collect();
    let found = mean_forces(&system.stiffness().select_columns(&touched), &rest);
    for e in stops {
        let m = &mut list[e];
        let place = touched.iter().position(|t| *t == e);
        m.force_mean = place.map_or(0.0, |k| found[k]);
        for force in [
            &mut m.force_min,
            &mut m.force_max,
            &mut m.force_std,
            &mut m.loss,
        ] {
            *force = f64::NAN;
        }
        (m.effective_stiffness, m.effective_stiffness_dc) = (None, None);
    }
}

/// Solution of columns f = load; NaN where another column acts in the same direction, so that the load does not decide.
fn mean_forces(columns: &DMatrix<f64>, load: &DVector<f64>) -> Vec<f64> {
    let count = columns.ncols();
    if count == 0 {
        return Vec::new();
    }
    let svd = columns.clone().svd(true, true);
    let Ok(found) = svd.solve(load, SAME_DIRECTION * svd.singular_values.max()) else {
        return vec![f64::NAN; count];
    };
    let rows = svd.v_t.unwrap_or_else(|| DMatrix::zeros(0, count));
    let values = svd.singular_values;
    let decided = |k: usize| -> f64 {
        let counted = (0..values.len()).filter(|i| values[*i] > SAME_DIRECTION * values.max());
        counted.map(|i| rows[(i, k)].powi(2)).sum()
    };
    let value = |k: usize| match decided(k) > 1.0 - 1e-9 {
        true => found[k],
        false => f64::NAN,
    };
    (0..count).map(value).collect()
}

/// Share of the largest singular value below which directions are the same.
const SAME_DIRECTION: f64 = 1e-12;
