//! Nonlinear dynamics of gear trains, and of lumped torsional systems in general, with clearances.
//!
//! Everything that is computed is a property of one equation, in nondimensional relative coordinates q:
//!
//!     Om^2 q'' + Om Gam q' + kappa f(W q - e, Om (W q' - nu e'), phase) = Q(tau)
//!
//! `Om` is the excitation frequency over omega_c and over the subharmonic index nu, ' = d/dtau, phase = nu tau; each
//! connection has one force law f of its own deformation, one column of kappa (n x e) and one row of W (e x n). For a tree
//! W is the identity and this is (4a) of T. E. Rook and R. Singh, Dynamic analysis of a reverse-idler gear pair with
//! concurrent clearances, J. Sound Vib. 182(2), 303-322 (1995), times Om^2.
//!
//! The way of a model: [`study`] loads a file ([`yaml`], [`model`]), [`assembly`] couples and scales it into a
//! [`system::System`], [`solve`] finds periodic solutions, [`analysis`] makes tables of them ([`report`]), [`output`] writes
//! files. `examples/quickstart.rs` does it in a page; `ARCHITECTURE.md` has the map.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
// Indented blocks in the documentation are equations.
#![allow(rustdoc::invalid_rust_codeblocks)]

pub mod analysis;
pub mod assembly;
#[cfg(feature = "cli")]
pub mod cli;
pub mod element;
pub mod error;
pub mod interrupt;
pub mod machine;
pub mod measure;
pub mod model;
pub mod numeric;
pub mod output;
pub mod postprocess;
pub mod quantity;
pub mod report;
pub mod schema;
pub mod solve;
pub mod study;
pub mod system;
pub mod yaml;

pub use inventory;
pub use serde;
pub use serde_json;
pub use typetag;
