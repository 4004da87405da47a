//! Solvers of the nondimensional system: periodic solutions, path following, stability, integration.
//!
//! They import the system and never the model. A numerical outcome (no convergence, end of a branch) is a value, never a
//! panic and never an `Err`.

mod affine;
pub mod attractor;
pub mod branch;
pub mod closed_form;
pub mod continuation;
pub mod curve;
pub mod ensemble;
pub mod equilibrium;
pub mod events;
pub mod family;
pub mod floquet;
pub mod galerkin;
pub mod integrate;
pub mod jumps;
pub mod newton;
pub mod orbit;
pub mod place;
pub mod residual;
pub mod segment_orbit;
pub mod shooting;
pub mod start;
pub mod support;
pub mod torus;

use crate::error::SolveError;
use crate::interrupt;

/// `Err` once an interrupt is requested: intermediate values are not results.
pub(crate) fn uninterrupted() -> Result<(), SolveError> {
    match interrupt::is_requested() {
        true => Err(SolveError::Interrupted),
        false => Ok(()),
    }
}
