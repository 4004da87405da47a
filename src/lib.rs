//! Nonlinear dynamics of lumped torsional systems with clearances.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod analysis;
pub mod assembly;
pub mod cli;
pub mod element;
pub mod error;
pub mod model;
pub mod numeric;
pub mod output;
pub mod postprocess;
pub mod quantity;
pub mod report;
pub mod solve;
pub mod study;
pub mod system;
pub mod yaml;

pub use inventory;
pub use serde;
pub use typetag;
