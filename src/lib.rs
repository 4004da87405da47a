//! Nonlinear dynamics of gear trains, and of lumped torsional systems in general, with clearances.
//!
//! All results are properties of one equation in nondimensional relative coordinates q:
//!
//! ```text
//! Om^2 q'' + Om Gam q' + kappa f(W q - e, Om (W q' - nu e'), phase) = Q(tau)
//! ```
//!
//! `Om` is the excitation frequency divided by omega_c and by the subharmonic index nu, ' = d/dtau, phase = nu tau. Each
//! connection has one force law f of its own deformation, one column of kappa (n x e) and one row of W (e x n). For a tree
//! W is the identity and this is (4a) of T. E. Rook and R. Singh, Dynamic analysis of a reverse-idler gear pair with
//! concurrent clearances, J. Sound Vib. 182(2), 303-322 (1995), times Om^2.
//!
//! # A first program
//!
//! ```
//! use gearlash::prelude::*;
//!
//! let model = Model::builder()
//!     .body("A", 1e-3)
//!     .body("B", 1e-3)
//!     .gear("mesh", ("A", 0.05), ("B", 0.05))
//!     .stiffness(2e8)
//!     .law(Backlash::half_gap(50e-6))
//!     .modal_damping(0.05)
//!     .load("A", Load::mean(100.0).harmonic(1, 150.0))
//!     .load("B", Load::mean(100.0))
//!     .build()?;
//! let response = FrequencyResponse::between(hertz(8000.0), hertz(3000.0)).harmonics(20).run(&model)?;
//! for p in response.points() {
//!     println!("{} {} {}", p.frequency_hz(), p.rms("mesh"), p.is_stable());
//! }
//! # assert!(response.points().count() > 10);
//! # Ok::<(), Error>(())
//! ```
//!
//! Models are values. They are built as above, or read from a text ([`Model::from_yaml`]), a file ([`Model::load`]) or a tree of values
//! ([`Model::from_tree`]). Every number has a name: [`Model::knob`], [`Model::get`], [`Model::set`], [`Model::numbers`]. Analyses run on a
//! model in memory and return columns with units; [`analysis::Observer`] reports progress and stops them. Errors are the enum [`Error`].
//! [`system::System`] and the solvers in [`solve`] are usable without a model.
//!
//! See [`conventions`] for units, signs and scales.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod analysis;
pub mod assembly;
#[cfg(feature = "cli")]
pub mod cli;
pub mod conventions;
pub mod element;
pub mod error;
pub mod interrupt;
pub mod machine;
pub mod measure;
pub mod model;
pub mod numeric;
pub mod output;
pub mod postprocess;
pub mod prelude;
pub mod quantity;
pub mod report;
pub mod schema;
pub mod solve;
pub mod study;
pub mod system;
pub mod yaml;

pub use error::Error;
pub use model::Model;
pub use report::Report;

pub use inventory;
pub use nalgebra;
pub use num_complex;
pub use serde;
pub use serde_json;
pub use typetag;

/// The programs of `docs/library.md` run as tests.
#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
mod library {}
