//! Transition matrices along Fourier orbits of systems with memory: every law is affine between two events.
//!
//! ```text
//! d(q, v, z)/dT = [[0, 1, 0], [-kappa diag(df/dq) W, -Gam - kappa diag(df/dv) W, -kappa df/dz], [0, 0, 0]] (q, v, z)
//! ```
//!
//! A memory that has followed its deformation is taken over as z = W q; nothing else jumps.

use super::variation::is_piecewise_constant;
use crate::numeric::dense;
use crate::numeric::exponential::Exponential;
use crate::solve::galerkin::march::{self, MarchTrack};
use crate::solve::integrate::{IntegrationEnd, IntegratorChoice, choose};
use crate::solve::orbit::FourierOrbit;
use crate::system::System;
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// The transition matrix up to a phase; `None` where some law is not affine between its events.
pub(super) fn transition(
    system: &System,
    orbit: &FourierOrbit,
    extrema: &[Vec<(f64, f64)>],
    to: f64,
) -> Option<DMatrix<f64>> {
    let is_affine = |m: &crate::system::Mount| {
        let law = m.element.as_ref();
        m.stiffness_variation.is_none()
            && (law.memory_count() > 0 || is_piecewise_constant(m) && !law.is_discontinuous())
    };
    let tracks = march::all_tracks(system, orbit);
    if tracks.iter().any(|t| t.course.is_some()) {
        return by_flow(system, orbit, &tracks, to);
    }
    if !system.mounts().iter().all(is_affine) {
        return None;
    }
    let size = system.state_size();
    let mut exponential = Exponential::new(size);
    let (mut phi, mut next) = (DMatrix::identity(size, size), DMatrix::zeros(size, size));
    let mut fill = Filler::new(system, orbit);
    hand_over(system, &tracks, 0.0, &mut phi);
    for cut in cuts((system, orbit), extrema, &tracks, to).windows(2) {
        let width = cut[1] - cut[0];
        if width <= 0.0 {
            continue;
        }
        let exponent = fill.exponent(&tracks, 0.5 * (cut[0] + cut[1]), width / orbit.omega);
        dense::multiply(exponential.of(exponent), &phi, &mut next);
        std::mem::swap(&mut phi, &mut next);
        hand_over(system, &tracks, cut[0] + 0.5 * width, &mut phi);
    }
    Some(phi)
}

/// The transition matrix of the flow from the begin of the orbit, where some memory has a rate.
fn by_flow(
    system: &System,
    orbit: &FourierOrbit,
    tracks: &[MarchTrack],
    to: f64,
) -> Option<DMatrix<f64>> {
    let mut flow = choose(system, IntegratorChoice::Auto).ok()?;
    let mut state = vec![0.0; system.state_size()];
    orbit.state(0.0, &mut state);
    for track in tracks {
        if let Some(m) = track.memory {
            let [x, _] = orbit.deformation(system, track.connection).at(0.0);
            state[2 * system.dof() + m] = track.memory_at(0.0, x);
        }
    }
    let size = system.state_size();
    let mut phi = DMatrix::identity(size, size);
    let end = flow.advance_with_variation(system, (0.0, to), &mut state, &mut phi, &mut ());
    (end == IntegrationEnd::Reached).then_some(phi)
}

/// 0, every instant at which some law changes its region, the end.
fn cuts(
    (system, orbit): (&System, &FourierOrbit),
    extrema: &[Vec<(f64, f64)>],
    tracks: &[MarchTrack],
    to: f64,
) -> Vec<f64> {
    let mut list = vec![0.0, to];
    for (e, mount) in system.mounts().iter().enumerate() {
        if extrema[e].is_empty() || mount.element.memory_count() > 0 {
            continue;
        }
        let deformation = orbit.deformation(system, e);
        for level in mount.element.breakpoints() {
            list.extend(deformation.crossings(level, &extrema[e]));
        }
    }
    let ends = tracks.iter().flat_map(|t| &t.stretches);
    list.extend(ends.map(|s| s.end.rem_euclid(TAU)));
    list.retain(|tau| *tau <= to);
    list.sort_by(f64::total_cmp);
    list
}

/// Rows of the memories that follow their deformations at an instant.
fn hand_over(system: &System, tracks: &[MarchTrack], tau: f64, phi: &mut DMatrix<f64>) {
    for track in tracks {
        let Some(m) = track
            .memory
            .filter(|_| track.at(tau).is_some_and(|s| s.follows))
        else {
            continue;
        };
        let row = 2 * system.dof() + m;
        for j in 0..phi.ncols() {
            let parts = system.element_map_row(track.connection).iter();
            phi[(row, j)] = parts.map(|(i, w)| w * phi[(*i, j)]).sum();
        }
    }
}

/// The matrix above at an instant, with its buffers.
struct Filler<'a> {
    system: &'a System,
    orbit: &'a FourierOrbit,
    state: Vec<f64>,
    exponent: DMatrix<f64>,
}

impl<'a> Filler<'a> {
    fn new(system: &'a System, orbit: &'a FourierOrbit) -> Filler<'a> {
        let size = system.state_size();
        Filler {
            system,
            orbit,
            state: vec![0.0; 2 * system.dof()],
            exponent: DMatrix::zeros(size, size),
        }
    }

    fn exponent(&mut self, tracks: &[MarchTrack], tau: f64, width: f64) -> &DMatrix<f64> {
        let (system, n) = (self.system, self.system.dof());
        self.exponent.fill(0.0);
        for i in 0..n {
            self.exponent[(i, n + i)] = width;
        }
        for j in 0..n {
            for (i, gamma) in system.damping_column(j) {
                self.exponent[(n + i, n + j)] -= width * gamma;
            }
        }
        self.orbit.state(tau, &mut self.state);
        let mut scratch = system.scratch();
        system.respond(tau, &self.state, &mut scratch);
        for (e, mount) in system.mounts().iter().enumerate() {
            let own = tracks.iter().filter(|t| t.connection == e);
            let (slope, damping) = match mount.element.memory_count() {
                0 => (scratch.response[e].df_dq, scratch.response[e].df_dv),
                _ => (
                    own.clone().filter_map(|t| t.at(tau)).map(|s| s.slope).sum(),
                    0.0,
                ),
            };
            for (i, kappa) in system.stiffness_column(e) {
                for (j, w) in system.element_map_row(e) {
                    self.exponent[(n + i, *j)] -= width * kappa * slope * w;
                    self.exponent[(n + i, n + j)] -= width * kappa * damping * w;
                }
                for track in own.clone() {
                    if let (Some(m), Some(stretch)) = (track.memory, track.at(tau)) {
                        self.exponent[(n + i, 2 * n + m)] -= width * kappa * stretch.gain;
                    }
                }
            }
        }
        &self.exponent
    }
}
