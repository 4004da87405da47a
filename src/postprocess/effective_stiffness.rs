//! Effective stiffness and the natural frequencies that follow from it.

use crate::numeric::nonzeros::sparse_dot;
use crate::numeric::symmetric::{self, symmetriser};
use crate::solve::equilibrium::Equilibrium;
use crate::system::System;
use nalgebra::DMatrix;

/// Effective stiffness of a connection from the Fourier coefficients of its deformation and its force.
///
/// ```text
/// k_a = (a . c - a_0 c_0) / (a . a - a_0^2)
/// ```
///
/// with the means counted once and every other product halved, as the averages of (8b) demand. `a`, `c`: coefficients,
/// mean first. Dimensionless; 1 in permanent contact, 0 in free flight. `None` where the deformation does not move beyond
/// rounding of `scale`.
///
/// Rook & Singh (1995), eqs. (8b), (16).
pub fn alternating(a: &[f64], c: &[f64], scale: f64) -> Option<f64> {
    let dot = |x: &[f64], y: &[f64]| x[1..].iter().zip(&y[1..]).map(|(x, y)| x * y).sum::<f64>();
    let square = dot(a, a);
    (square > (1e-12 * scale).powi(2)).then(|| dot(a, c) / square)
}

/// Effective stiffness of the means, k_dc = mean(f) / mean(q). `None` where the mean deformation vanishes.
///
/// Rook & Singh (1995), eq. (8a).
pub fn direct(mean_deformation: f64, mean_force: f64, scale: f64) -> Option<f64> {
    (mean_deformation.abs() > 1e-12 * scale).then(|| mean_force / mean_deformation)
}

/// Natural frequencies over omega_c of the train linearised at its static equilibrium, ascending, n values: 0 for motions that
/// meet no stiffness there. `names`: those of the connections.
///
/// # Errors
/// A connection that sticks to a jump of its force.
pub fn frequencies_at_rest(
    system: &System,
    rest: &Equilibrium,
    names: &[String],
) -> Result<Vec<f64>, String> {
    let slopes = rest.slopes(names)?;
    Ok(natural_frequencies(system, &slopes))
}

/// Natural frequencies over omega_c, ascending, n values, of the system with every law replaced by a slope.
///
/// ```text
/// det(kappa diag(k) W - w^2 I) = 0
/// ```
///
/// Rook & Singh (1995), eq. (9); loops through W. A slope below zero can make w^2 negative: 0 is returned for such a mode.
/// NaN where slopes or stiffnesses are too large to be multiplied.
pub fn natural_frequencies(system: &System, slopes: &[f64]) -> Vec<f64> {
    match symmetric_frequencies(system, slopes) {
        Some(list) => list,
        None => general_frequencies(system, slopes),
    }
}

/// The same where W kappa can be scaled to be symmetric, as in every train, and no slope is below zero: diag(k) W kappa and
/// kappa diag(k) W have the same eigenvalues but for zeros, and so has diag(k)^(1/2) W kappa diag(k)^(1/2).
fn symmetric_frequencies(system: &System, slopes: &[f64]) -> Option<Vec<f64>> {
    let (n, e) = (system.dof(), system.element_count());
    let mut matrix = if system.is_tree() {
        system.stiffness().clone()
    } else {
        let entry = |j, k| sparse_dot(system.element_map_row(j), system.stiffness_column(k));
        DMatrix::from_fn(e, e, entry)
    };
    let scale = symmetriser(&matrix)?;
    let is_sound = |k: &f64| *k >= 0.0 && k.is_finite();
    if !slopes.iter().all(is_sound) || e < n {
        return None;
    }
    let root: Vec<f64> = slopes.iter().map(|k| k.sqrt()).collect();
    for k in 0..e {
        for j in 0..e {
            matrix[(j, k)] *= root[j] * root[k] * scale[j] / scale[k];
        }
    }
    if matrix.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let squares = symmetric::eigenvalues(&matrix)?;
    Some(squares[e - n..].iter().map(|x| x.max(0.0).sqrt()).collect())
}

fn general_frequencies(system: &System, slopes: &[f64]) -> Vec<f64> {
    let largest = slopes.iter().fold(0.0_f64, |m, k| m.max(k.abs()));
    let unit = if largest > 0.0 { largest } else { 1.0 };
    let mut scaled = system.stiffness().clone();
    for (mut column, k) in scaled.column_iter_mut().zip(slopes) {
        column *= *k / unit;
    }
    let matrix: DMatrix<f64> = scaled * system.element_map();
    if matrix.iter().any(|x| !x.is_finite()) {
        // The eigenvalue iteration would not end.
        return vec![f64::NAN; system.dof()];
    }
    let mut list: Vec<f64> = matrix
        .complex_eigenvalues()
        .iter()
        .map(|x| x.re.max(0.0).sqrt() * unit.sqrt())
        .collect();
    list.sort_by(f64::total_cmp);
    list
}
