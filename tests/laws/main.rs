//! Laws of connections: conformance, closed forms.

#[path = "../support/common.rs"]
mod common;

mod conformance;
mod laws_closed_forms;
mod laws_jumping_force;
