//! Elastic modes of a train in full contact.

use super::mass::Mass;
use super::{Coupling, couple, mistake};
use crate::error::Diagnostic;
use crate::model::Train;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Elastic modes in full contact, without damping.
///
/// ```text
/// B^T K B U = M U Lam,    U^T M U = I
/// ```
#[derive(Debug, Clone)]
pub struct ElasticModes {
    /// Squares of the natural frequencies [rad^2/s^2], ascending, n values.
    pub eigenvalues: DVector<f64>,
    /// U, n_b x n, n elastic modes: motions of the bodies.
    pub shapes: DMatrix<f64>,
}

/// Elastic modes of a train from the symmetric matrix L^-1 B^T K B L^-T with M = L L^T; bodies with prescribed motion rest.
///
/// The n_b - n rigid-body modes are left out: their number is known from the coupling, so no threshold decides. Motions that
/// meet friction only are not elastic modes either: n is the rank of the rows of springs. Eigenvalues of elastic modes below
/// n eps max(Lam) are rounding and become 0.
///
/// # Errors
/// Matrices that overflow.
pub fn elastic_modes(train: &Train, coupling: &Coupling) -> Result<ElasticModes, Vec<Diagnostic>> {
    let mass = Mass::of(train);
    let a = mass.over_root(&coupling.incidence);
    let mut ka = a.clone();
    for (mut row, connection) in ka.row_iter_mut().zip(train.connections.values()) {
        row *= connection.contact_stiffness();
    }
    let (squares, vectors) = symmetric_eigen(a.tr_mul(&ka)).ok_or_else(out_of_range)?;
    let (n_b, n) = (vectors.nrows(), spring_rank(train, coupling)?);
    let shapes = mass.shapes_of(&vectors.columns(n_b - n, n).clone_owned());
    Ok(ElasticModes {
        eigenvalues: DVector::from_iterator(n, squares.iter().skip(n_b - n).copied()),
        shapes,
    })
}

/// Number of independent connections whose laws are springs.
fn spring_rank(train: &Train, coupling: &Coupling) -> Result<usize, Vec<Diagnostic>> {
    if train.connections.values().all(|c| c.element.is_spring()) {
        return Ok(coupling.coordinates.len());
    }
    let mut springs = train.clone();
    springs.connections.retain(|_, c| c.element.is_spring());
    if springs.connections.is_empty() {
        return Ok(0);
    }
    Ok(couple(&springs)?.coordinates.len())
}

fn out_of_range() -> Vec<Diagnostic> {
    let message = "stiffness times arm squared over inertia leaves the range of a 64-bit number";
    vec![mistake("connections", message, None)]
}

/// Eigenvalues, ascending and clipped below n eps of the largest, and eigenvectors of a symmetric positive matrix; `None` where a
/// number is not finite.
pub(super) fn symmetric_eigen(matrix: DMatrix<f64>) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let n = matrix.nrows();
    if matrix.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, 1000 + 100 * n)?;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let floor = n as f64 * f64::EPSILON * eigen.eigenvalues.amax();
    let values = order.iter().map(|k| {
        let x = eigen.eigenvalues[*k];
        if x.abs() < floor { 0.0 } else { x }
    });
    let values = DVector::from_iterator(n, values);
    Some((values, eigen.eigenvectors.select_columns(&order)))
}
