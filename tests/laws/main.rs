//! Laws of connections: conformance, closed forms, formulas.

#[path = "../support/common.rs"]
mod common;

mod conformance;
mod expression_law;
mod expression_mistakes;
mod laws_closed_forms;
mod laws_jumping_force;
