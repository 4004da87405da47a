//! Responses against a parameter: what `frequency_response` and its like share.
//!
//! `keys` and `settings`: how branches are computed; `swept`: what the continued parameter means; `trace`: method by method
//! from a first solution along the parameter; `integration`: the method that follows attractors; `report`: tables and figure.

mod integration;
mod keys;
mod orbits;
mod report;
mod settings;
mod swept;
mod trace;

pub use keys::{BranchSettings, Method, Orbits};
pub(super) use keys::{branch_settings, defaults, response_keys};
pub(super) use swept::Swept;
pub(super) use trace::{run, tables};
