//! Forces that jump where a deformation passes a breakpoint of its law.
//!
//! A force that jumps by J as the deformation rises through a level has a slope J times Dirac's impulse there. Passed at a rate
//! v, the impulse turns deviations from the motion by the saltation matrix
//!
//! ```text
//! S = [[I, 0], [-kappa_k (J / |v|) w_k, I]]
//! ```
//!
//! kappa_k: column k of kappa, w_k: row k of W, in (q, dq/d(omega_c t)). A kink (J = 0) needs none.

use crate::error::SolveError;
use crate::system::{Mount, System};

/// J of a connection at a level: the force just above it less the force just below.
pub fn size(mount: &Mount, level: f64, rate: f64, phase: f64) -> f64 {
    if !mount.element.is_discontinuous() {
        return 0.0;
    }
    let (below, above) = sides(mount, level, rate, phase);
    above - below
}

/// Forces just below and just above a level, stiffness variation included.
pub fn sides(mount: &Mount, level: f64, rate: f64, phase: f64) -> (f64, f64) {
    let variation = mount.stiffness_variation.as_ref();
    let s = variation.map_or(1.0, |s| s.value(phase));
    let force = |x: f64| s * mount.element.eval(x, rate, phase).f;
    let aside = nudge(level);
    (force(level - aside), force(level + aside))
}

/// A distance from a level that rounding of the law's own arithmetic does not bridge.
fn nudge(level: f64) -> f64 {
    8.0 * f64::EPSILON * level.abs().max(1e-3)
}

/// Phi <- S Phi; `phi`: its columns one after the other.
pub(crate) fn saltate(system: &System, connection: usize, jump: f64, rate: f64, phi: &mut [f64]) {
    if jump == 0.0 {
        return;
    }
    let n = system.dof();
    let kappa = system.stiffness().column(connection);
    let w = system.element_map().row(connection);
    for column in phi.chunks_exact_mut(system.state_size()) {
        let (q, v) = column.split_at_mut(n);
        let strain: f64 = w.iter().zip(q.iter()).map(|(w, q)| w * q).sum();
        for (v, kappa) in v.iter_mut().zip(kappa.iter()) {
            *v -= kappa * strain * (jump / rate.abs());
        }
    }
}

/// Whether transition matrices of a system are known.
///
/// # Errors
/// The first connection whose law has hidden jumps ([`crate::element::Element::has_hidden_jumps`]).
pub(crate) fn refuse_hidden(system: &System) -> Result<(), SolveError> {
    let hidden = |mount: &Mount| mount.element.has_hidden_jumps();
    match system.mounts().iter().position(hidden) {
        None => Ok(()),
        Some(connection) => Err(SolveError::Unsupported {
            connection,
            reason: "its force may jump where no breakpoint is known, so transition matrices are unknown: no shooting".into(),
        }),
    }
}
