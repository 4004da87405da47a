//! The laws of a system that the exact flow can take.

use crate::error::SolveError;
use crate::solve::affine::AffineLaw;
use crate::solve::closed_form::ClosedForm;
use crate::system::System;

/// The tables of every connection.
///
/// # Errors
/// A law that is not piecewise affine, an excitation that is no Fourier series, or a stiffness variation that is neither
/// constant nor rectangular; the connection is named by its number.
pub fn read(system: &System) -> Result<Vec<AffineLaw>, SolveError> {
    for (connection, mount) in system.mounts().iter().enumerate() {
        if let Some(reason) = ClosedForm::Flow.refusal(mount) {
            return Err(SolveError::Unsupported { connection, reason });
        }
    }
    Ok(system
        .mounts()
        .iter()
        .map(|m| AffineLaw::read(m.element.as_ref()))
        .collect())
}
