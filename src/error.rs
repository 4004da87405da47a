//! Errors, per layer.
//!
//! `Err` means that the caller can fix the input. An outcome of the computation (no convergence, end of a branch)
//! is data in the results, never an error.

mod render;
mod suggest;

pub use render::{Colour, render};
pub use suggest::{did_you_mean, nearest};

use std::path::PathBuf;
use std::sync::Arc;

/// A text that positions refer to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// File name as the user wrote it, or `--set` and the like.
    pub name: String,
    /// The whole text.
    pub text: String,
}

/// A place in a source text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// The text the place is in.
    pub source: Arc<Source>,
    /// Line, counted from 1.
    pub line: usize,
    /// Column in characters, counted from 1.
    pub column: usize,
}

/// One error in the input: path, place, found and expected values, next step.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Place in the text, if it has one.
    pub location: Option<Location>,
    /// Dotted path, such as `connections.mesh_1.element.half_gap`; empty for the whole document.
    pub path: String,
    /// Found and expected values.
    pub message: String,
    /// The next step, such as the nearest valid name.
    pub help: Option<String>,
}

/// Misuse of the solvers, detected before or during a run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// A quantity that must be finite is not.
    #[error("{what} is not finite")]
    NotFinite {
        /// Name of the quantity.
        what: String,
    },
    /// Matrices or vectors with inconsistent shapes.
    #[error("{what} is {found}, wanted {wanted}")]
    Shape {
        /// Name of the quantity.
        what: String,
        /// Shape found.
        found: String,
        /// Shape wanted.
        wanted: String,
    },
    /// An option with an invalid value.
    #[error("option {name} = {found}: must be {wanted}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Value found.
        found: String,
        /// Values allowed.
        wanted: String,
    },
    /// A value of the parameter at which the model does not exist.
    #[error("{reason}")]
    NoSystem {
        /// Errors of the model at this value.
        reason: String,
    },
    /// Interrupted on request; there is no result.
    #[error("interrupted")]
    Interrupted,
    /// A law that the method does not support.
    #[error("connection {connection}: {reason}")]
    Unsupported {
        /// Index of the connection.
        connection: usize,
        /// Reason.
        reason: String,
    },
}

/// Errors that end a command with exit status 2, and errors of the file system.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Errors in the input, all that were found.
    #[error("{}", summary(.0))]
    Input(Vec<Diagnostic>),
    /// Misuse of a solver.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A file that cannot be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    File {
        /// "read", "write", "create".
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
}

fn summary(list: &[Diagnostic]) -> String {
    list.iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join("\n")
}

impl std::fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(at) = &self.location {
            write!(f, "{}:{}:{}: ", at.source.name, at.line, at.column)?;
        }
        if !self.path.is_empty() {
            write!(f, "{}: ", self.path)?;
        }
        write!(f, "{}", self.message)?;
        match &self.help {
            Some(help) => write!(f, "; {help}"),
            None => Ok(()),
        }
    }
}
