//! From relative coordinates back to the bodies: absolute accelerations, Rook & Singh (1995), eq. (6a).

use super::{Assembly, Coupling, Scales, inertias};
use crate::model::Train;
use crate::numeric::periodic::Periodic;
use crate::system::{Scratch, System};
use nalgebra::{DMatrix, DVector};

/// Share of the mean load that counts as rounding when it accelerates a rigid-body motion.
const BALANCED: f64 = 1e-9;

/// What (6a) needs besides the motion, SI units.
#[derive(Debug, Clone)]
pub struct Anchor {
    /// Names of the bodies, n_b.
    pub bodies: Vec<String>,
    inertia: DVector<f64>,
    /// B, e x n_b.
    incidence: DMatrix<f64>,
    /// C P^+, n_b x n.
    rates: DMatrix<f64>,
    loads: Vec<(usize, Periodic)>,
    /// Dashpots parallel to a transmission error: connection, c, e.
    dashpots: Vec<(usize, f64, Periodic)>,
}

/// One instant of a motion, SI units.
#[derive(Debug, Clone, Copy)]
pub struct Instant<'a> {
    /// Excitation phase omega t \[rad\].
    pub phase: f64,
    /// Excitation frequency omega [rad/s].
    pub frequency: f64,
    /// Rates of the relative coordinates, n values [m/s or rad/s].
    pub rates: &'a [f64],
    /// Forces of the connections without their dashpots, K_j f_j, e values [N or N m].
    pub forces: &'a [f64],
}

impl Anchor {
    /// `rates`: C P^+, n_b x n.
    pub(super) fn new(train: &Train, coupling: &Coupling, rates: DMatrix<f64>) -> Anchor {
        let loads = (train.loads.iter())
            .filter_map(|(name, load)| Some((train.bodies.get_index_of(name)?, load)))
            .flat_map(|(body, load)| load.parts().map(move |series| (body, series.clone())))
            .collect();
        let dashpots = (train.connections.values().enumerate())
            .filter(|(_, c)| c.damping > 0.0)
            .filter_map(|(k, c)| Some((k, c.damping, c.transmission_error.clone()?)))
            .collect();
        Anchor {
            bodies: train.bodies.keys().cloned().collect(),
            inertia: inertias(train),
            incidence: coupling.incidence.clone(),
            rates,
            loads,
            dashpots,
        }
    }

    /// Absolute accelerations of the bodies into `out`, n_b values [rad/s^2; m/s^2 for translating masses].
    ///
    ///     z'' = M^-1 (F - C P^+ r' - B^T diag(K_j) f_j + B^T diag(c) e')
    ///
    /// Exact for trees and loops and for any damping. Rook & Singh (1995), eq. (6a).
    pub fn accelerations(&self, at: &Instant<'_>, out: &mut [f64]) {
        out.fill(0.0);
        for (body, series) in &self.loads {
            out[*body] += series.value(at.phase);
        }
        for (column, rate) in self.rates.column_iter().zip(at.rates) {
            for (a, c) in out.iter_mut().zip(column.iter()) {
                *a -= c * rate;
            }
        }
        for (row, force) in self.incidence.row_iter().zip(at.forces) {
            for (a, arm) in out.iter_mut().zip(row.iter()) {
                *a -= arm * force;
            }
        }
        for (k, c, error) in &self.dashpots {
            let force = c * at.frequency * error.derivative(at.phase);
            for (a, arm) in out.iter_mut().zip(self.incidence.row(*k).iter()) {
                *a += arm * force;
            }
        }
        for (a, inertia) in out.iter_mut().zip(self.inertia.iter()) {
            *a /= inertia;
        }
    }
}

impl Assembly {
    /// Absolute accelerations of the bodies at a nondimensional state, n_b values [rad/s^2; m/s^2 for translating masses];
    /// `None` for reduced systems.
    ///
    /// `system`: this assembly's, at its frequency; `state` = [q; v], 2n values. The responses stay in `scratch`.
    pub fn body_accelerations(
        &self,
        system: &System,
        tau: f64,
        state: &[f64],
        scratch: &mut Scratch,
    ) -> Option<Vec<f64>> {
        let (anchor, coupling) = (self.anchor.as_ref()?, self.coupling.as_ref()?);
        system.respond(tau, state, scratch);
        let Scales {
            frequency,
            displacement: l,
            stiffness,
        } = &self.scales;
        let v = &state[system.dof()..];
        let rates: Vec<f64> = (coupling.coordinates.iter().zip(v))
            .map(|(k, v)| l[*k] * frequency * v)
            .collect();
        let forces: Vec<f64> = (scratch.response.iter().enumerate())
            .map(|(k, r)| stiffness[k] * l[k] * r.f)
            .collect();
        let at = Instant {
            phase: system.subharmonic() as f64 * tau,
            frequency: frequency * system.excitation_frequency(),
            rates: &rates,
            forces: &forces,
        };
        let mut out = vec![0.0; anchor.bodies.len()];
        anchor.accelerations(&at, &mut out);
        Some(out)
    }
}

/// A warning when the mean loads accelerate a rigid-body motion, with the acceleration.
///
///     z'' = N (N^T M N)^-1 N^T F
pub(super) fn unbalanced_mean_load(train: &Train, coupling: &Coupling) -> Option<String> {
    let motions = &coupling.rigid_body;
    let inertia = inertias(train);
    let mut force = DVector::zeros(inertia.len());
    for (name, load) in &train.loads {
        if let Some(body) = train.bodies.get_index_of(name) {
            force[body] += load.mean();
        }
    }
    let mut heavy = motions.clone();
    for (mut row, m) in heavy.row_iter_mut().zip(inertia.iter()) {
        row *= *m;
    }
    let share = motions.tr_mul(&heavy).cholesky()?;
    let acceleration = motions * share.solve(&motions.tr_mul(&force));
    // Judged by energy: the part of M^(-1/2) F along the rigid-body motions against the whole.
    let root = inertia.map(f64::sqrt);
    let whole = force.component_div(&root).norm();
    if acceleration.component_mul(&root).norm() <= BALANCED * whole {
        return None;
    }
    let largest = acceleration.amax();
    let list: Vec<String> = (train.bodies.keys().zip(acceleration.iter()))
        .filter(|(_, a)| a.abs() > 1e-6 * largest)
        .take(4)
        .map(|(name, a)| format!("{name} {a:.4e}"))
        .collect();
    Some(format!(
        "the mean loads do not balance: rigid-body motion accelerates ({}, in rad/s^2, m/s^2 for translating masses); \
         relative motion is not affected",
        list.join(", ")
    ))
}
