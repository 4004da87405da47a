//! Floquet multipliers of the averaged system: an estimate that costs one small eigenvalue problem.

use crate::numeric::eigenvalues::eigenvalues;
use crate::solve::floquet::by_falling_modulus;
use crate::system::System;
use nalgebra::DMatrix;
use num_complex::Complex;
use std::f64::consts::TAU;

/// Estimated multipliers over one response period, by falling modulus, 2n values; NaN where the means are not finite or the
/// eigenvalues do not converge.
///
/// ```text
/// Phi(2 pi) ~ exp(2 pi Abar),    Abar = [[0, I], [-kappa diag(k_f1) W, -(Gam + kappa diag(k_f2) W)]] / Om   (in q, v)
/// ```
///
/// `means`: k_f1 = <df/dq>, k_f2 = <df/dv> of every connection, (21). Exact for linear systems; elsewhere the parametric part of A(tau)
/// is lost: an estimate, never a verdict on stability. det Phi is exact where no law depends on the velocity.
///
/// Rook & Singh (1995), eqs. (19)-(22).
pub fn averaged_multipliers(system: &System, means: &[[f64; 2]]) -> Vec<Complex<f64>> {
    let n = system.dof();
    let weighted = |part: usize| {
        let mut scaled = system.stiffness().clone();
        for (mut column, mean) in scaled.column_iter_mut().zip(means) {
            column *= mean[part];
        }
        scaled * system.element_map()
    };
    let mut matrix = DMatrix::zeros(2 * n, 2 * n);
    matrix.view_mut((0, n), (n, n)).fill_with_identity();
    matrix.view_mut((n, 0), (n, n)).copy_from(&-weighted(0));
    let damping = system.damping() + weighted(1);
    matrix.view_mut((n, n), (n, n)).copy_from(&-damping);
    let unknown = || vec![Complex::new(f64::NAN, f64::NAN); 2 * n];
    if matrix.iter().any(|x| !x.is_finite()) {
        return unknown();
    }
    let Some(exponents) = eigenvalues(&matrix) else {
        return unknown();
    };
    let period = TAU / system.omega();
    let multiplier = |x: &Complex<f64>| (Complex::new(x.re, x.im) * period).exp();
    by_falling_modulus(exponents.iter().map(multiplier).collect())
}
