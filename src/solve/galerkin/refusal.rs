//! Systems whose motions this method does not find.

use crate::error::SolveError;
use crate::solve::closed_form::ClosedForm;
use crate::system::{Mount, System};

/// Whether the solutions of a system have Fourier series that this method finds.
///
/// # Errors
/// [`SolveError::Unsupported`] names the first connection that has none.
pub fn refuse(system: &System) -> Result<(), SolveError> {
    let reason = |mount: &Mount| {
        let law = mount.element.as_ref();
        let jumps =
            "the velocity jumps at its impacts, and Fourier series of such motions do not converge";
        match law.least_impact() {
            Some(_) => Some(jumps.to_string()),
            None if law.evolving().is_some() => None,
            None if law.memory_count() > 0 => ClosedForm::Quadrature.refusal(mount),
            None => None,
        }
    };
    let mut reasons = system.mounts().iter().map(reason).enumerate();
    match reasons.find_map(|(connection, reason)| Some((connection, reason?))) {
        None => Ok(()),
        Some((connection, reason)) => {
            let reason = format!("{reason}: use `method: shooting` or `integration`");
            Err(SolveError::Unsupported { connection, reason })
        }
    }
}
