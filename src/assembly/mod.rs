//! From a model in SI units to the nondimensional system in relative coordinates, and back.

use crate::system::System;
use nalgebra::{DMatrix, DVector};

/// How bodies, connections and relative coordinates hang together.
#[derive(Debug, Clone)]
pub struct Coupling {
    /// B, e x n_b. Lever arms.
    pub incidence: DMatrix<f64>,
    /// P, n x n_b. r = P z.
    pub transform: DMatrix<f64>,
    /// W, e x n, geometric (not scaled). Deformations = W r.
    pub element_map: DMatrix<f64>,
    /// N, n_b x (n_b - n). Motions that strain no connection.
    pub rigid_body: DMatrix<f64>,
    /// Connection that each relative coordinate measures.
    pub coordinates: Vec<usize>,
}

/// Characteristic values; the only bridge between SI and nondimensional numbers.
#[derive(Debug, Clone)]
pub struct Scales {
    /// omega_c [rad/s]; 1 for reduced systems.
    pub frequency: f64,
    /// l of every connection [m or rad]; 1 for reduced systems.
    pub displacement: Vec<f64>,
    /// K of every connection [N/m or N m/rad]; 1 for reduced systems.
    pub stiffness: Vec<f64>,
}

/// The nondimensional system with everything needed to talk about it in the user's words.
#[derive(Debug, Clone)]
pub struct Assembly {
    /// The system, at Om = 1, nu = 1.
    pub system: System,
    /// Names of the connections, e of them.
    pub connections: Vec<String>,
    /// Names of the relative coordinates, n of them.
    pub coordinates: Vec<String>,
    /// Scales.
    pub scales: Scales,
    /// The coupling; `None` for reduced systems.
    pub coupling: Option<Coupling>,
    /// Natural frequencies in full contact over omega_c, ascending, elastic modes only: eigenvalues of (kappa W)^(1/2).
    pub natural_frequencies: DVector<f64>,
    /// What the user must know.
    pub warnings: Vec<String>,
}
