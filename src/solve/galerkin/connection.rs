//! From the coordinates to one connection and back: what its force adds to the equations.

use crate::solve::residual::Linearisation;
use crate::system::System;
use nalgebra::{DMatrix, DVector};

/// Coefficients of W q, `size` a coordinate; zeros where `a` is longer.
pub(super) fn gather(system: &System, e: usize, u: &DVector<f64>, size: usize, a: &mut [f64]) {
    a.fill(0.0);
    for (j, w) in system.element_map_row(e) {
        let block = &u.as_slice()[j * size..(j + 1) * size];
        a.iter_mut().zip(block).for_each(|(a, b)| *a += w * b);
    }
}

/// Adds (I (x) kappa) c to the residual, c the coefficients of the force.
pub(super) fn add_force(system: &System, e: usize, c: &[f64], out: &mut Linearisation) {
    let largest = c.iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    add_column(system, e, c, &mut out.r);
    for (_, kappa) in system.stiffness_column(e) {
        out.magnitude = out.magnitude.max(kappa.abs() * largest);
    }
}

/// Adds (I (x) kappa) c to a coordinate-major vector.
pub(super) fn add_column(system: &System, e: usize, c: &[f64], out: &mut DVector<f64>) {
    for (i, kappa) in system.stiffness_column(e) {
        let block = &mut out.as_mut_slice()[i * c.len()..(i + 1) * c.len()];
        block.iter_mut().zip(c).for_each(|(r, c)| *r += kappa * c);
    }
}

/// Adds kappa (F+ diag(g) F) W to the Jacobian (12).
pub(super) fn add_jacobian(
    system: &System,
    e: usize,
    hill: &DMatrix<f64>,
    out: &mut Linearisation,
) {
    for (i, kappa) in system.stiffness_column(e) {
        for (j, w) in system.element_map_row(e) {
            let mut block = out.dr_du.block_mut(hill.nrows(), (*i, *j));
            block.add(kappa * w, hill.as_slice());
        }
    }
}

/// The same where the slope is the same all the time: F+ diag(g) F = g I.
pub(super) fn add_diagonal(
    system: &System,
    e: usize,
    slope: f64,
    size: usize,
    out: &mut Linearisation,
) {
    for (i, kappa) in system.stiffness_column(e) {
        for (j, w) in system.element_map_row(e) {
            let mut block = out.dr_du.block_mut(size, (*i, *j));
            for k in 0..size {
                block.column(k)[k] += kappa * w * slope;
            }
        }
    }
}
