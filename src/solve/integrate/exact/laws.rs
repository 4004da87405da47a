//! The laws of a system that the exact flow can take.

use crate::error::SolveError;
use crate::numeric::periodic::Periodic;
use crate::solve::affine::AffineLaw;
use crate::system::{Mount, System};

/// What keeps the exact flow from a connection, if anything does.
pub fn needs(mount: &Mount) -> Option<&'static str> {
    let is_fourier = |e: &Periodic| matches!(e, Periodic::Fourier { .. });
    let is_stepwise = |s: &Periodic| s.is_constant() || matches!(s, Periodic::Rectangular { .. });
    if !mount.element.is_piecewise_affine() {
        Some("exact integration needs a piecewise-affine law (and impact_damping 0)")
    } else if !mount.transmission_error.iter().all(is_fourier) {
        Some("exact integration needs a transmission error made of harmonics, not of a table")
    } else if !mount.stiffness_variation.iter().all(is_stepwise) {
        Some("exact integration needs a constant or rectangular stiffness variation")
    } else {
        None
    }
}

/// The tables of every connection.
///
/// # Errors
/// A law that is not piecewise affine, an excitation that is no Fourier series, or a stiffness variation that is neither
/// constant nor rectangular; the connection is named by its number.
pub fn read(system: &System) -> Result<Vec<AffineLaw>, SolveError> {
    for (connection, mount) in system.mounts().iter().enumerate() {
        if let Some(need) = needs(mount) {
            return Err(SolveError::Unsupported {
                connection,
                reason: need.into(),
            });
        }
    }
    Ok(system
        .mounts()
        .iter()
        .map(|m| AffineLaw::read(m.element.as_ref()))
        .collect())
}
