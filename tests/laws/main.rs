//! Laws of connections: conformance, closed forms, formulas.

#[path = "../support/common.rs"]
mod common;

mod clutch;
mod conformance;
mod evolving;
mod expression_law;
mod expression_mistakes;
mod laws_closed_forms;
mod laws_jumping_force;
mod one_way;
