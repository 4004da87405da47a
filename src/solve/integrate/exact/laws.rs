//! The laws of a system that the exact flow can take.

use crate::error::SolveError;
use crate::numeric::periodic::Periodic;
use crate::solve::affine::AffineLaw;
use crate::system::System;

/// The tables of every connection.
///
/// # Errors
/// A law that is not piecewise affine, an excitation that is no Fourier series, or a stiffness variation that is neither
/// constant nor rectangular; the connection is named by its number.
pub fn read(system: &System) -> Result<Vec<AffineLaw>, SolveError> {
    let refuse = |connection: usize, reason: &str| {
        Err(SolveError::Unsupported {
            connection,
            reason: reason.into(),
        })
    };
    for (connection, mount) in system.mounts().iter().enumerate() {
        if !mount.element.is_piecewise_affine() {
            return refuse(
                connection,
                "exact integration needs a piecewise-affine law (and impact_damping 0)",
            );
        }
        if matches!(&mount.transmission_error, Some(e) if !matches!(e, Periodic::Fourier { .. })) {
            return refuse(
                connection,
                "exact integration needs a transmission error made of harmonics, not of a table",
            );
        }
        let varies = |s: &Periodic| !s.is_constant() && !matches!(s, Periodic::Rectangular { .. });
        if mount.stiffness_variation.as_ref().is_some_and(varies) {
            return refuse(
                connection,
                "exact integration needs a constant or rectangular stiffness variation",
            );
        }
    }
    Ok(system
        .mounts()
        .iter()
        .map(|m| AffineLaw::read(m.element.as_ref()))
        .collect())
}
