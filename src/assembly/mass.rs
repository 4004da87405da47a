//! Inertias: a number for a body, a matrix for the coordinates of a part that is given by matrices.

use super::inertias;
use crate::model::{MatrixPart, Train};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// M = L L^T of a train.
pub(super) struct Mass<'a> {
    diagonal: DVector<f64>,
    /// The same, infinite where the motion of a body is prescribed: what divides.
    divisor: DVector<f64>,
    parts: Vec<(&'a MatrixPart, Cholesky<f64, Dyn>)>,
}

impl<'a> Mass<'a> {
    /// Parts whose matrix has no factors, which the reader refuses, count as bodies.
    pub fn of(train: &'a Train) -> Mass<'a> {
        let factored = |part: &'a MatrixPart| Some((part, part.inertia.clone().cholesky()?));
        let diagonal = inertias(train);
        let mut divisor = diagonal.clone();
        for motion in &train.motions {
            divisor[motion.body] = f64::INFINITY;
        }
        Mass {
            diagonal,
            divisor,
            parts: train.parts.iter().filter_map(factored).collect(),
        }
    }

    /// M X, from X, n_b x k.
    pub fn times(&self, x: &DMatrix<f64>) -> DMatrix<f64> {
        let mut product = x.clone();
        for (mut row, m) in product.row_iter_mut().zip(self.diagonal.iter()) {
            row *= *m;
        }
        self.replace_rows(&mut product, x, |part, _, rows| &part.inertia * rows);
        product
    }

    /// B M^-1, from B, e x n_b.
    pub fn divided(&self, b: &DMatrix<f64>) -> DMatrix<f64> {
        let mut quotient = b.clone();
        for (mut column, m) in quotient.column_iter_mut().zip(self.divisor.iter()) {
            column /= *m;
        }
        self.replace_columns(&mut quotient, b, |factors, rows| factors.solve(rows));
        quotient
    }

    /// B L^-T, from B, e x n_b.
    pub(crate) fn over_root(&self, b: &DMatrix<f64>) -> DMatrix<f64> {
        let mut quotient = b.clone();
        for (mut column, m) in quotient.column_iter_mut().zip(self.divisor.iter()) {
            column /= m.sqrt();
        }
        self.replace_columns(&mut quotient, b, |factors, rows| {
            let solved = factors.l_dirty().solve_lower_triangular(rows);
            solved.unwrap_or_else(|| rows.clone())
        });
        quotient
    }

    /// L^-T V, from V, n_b x k.
    pub(crate) fn shapes_of(&self, v: &DMatrix<f64>) -> DMatrix<f64> {
        let mut shapes = v.clone();
        for (mut row, m) in shapes.row_iter_mut().zip(self.divisor.iter()) {
            row /= m.sqrt();
        }
        self.replace_rows(&mut shapes, v, |_, factors, rows| {
            let solved = factors.l_dirty().tr_solve_lower_triangular(&rows);
            solved.unwrap_or(rows)
        });
        shapes
    }

    /// Bodies whose forces accelerate each body, with m times the entry of M^-1: itself with 1, or the coordinates of its part.
    pub(crate) fn partners(&self) -> Vec<Vec<(usize, f64)>> {
        let mut list: Vec<Vec<(usize, f64)>> =
            (0..self.diagonal.len()).map(|k| vec![(k, 1.0)]).collect();
        for (part, factors) in &self.parts {
            let inverse = factors.inverse();
            for (i, body) in part.bodies.iter().enumerate() {
                let share =
                    |(j, other): (usize, &usize)| (*other, inverse[(i, j)] * self.diagonal[*body]);
                list[*body] = part.bodies.iter().enumerate().map(share).collect();
            }
        }
        list
    }

    fn replace_rows(
        &self,
        into: &mut DMatrix<f64>,
        from: &DMatrix<f64>,
        map: impl Fn(&MatrixPart, &Cholesky<f64, Dyn>, DMatrix<f64>) -> DMatrix<f64>,
    ) {
        for (part, factors) in &self.parts {
            let rows = map(part, factors, from.select_rows(&part.bodies));
            for (i, body) in part.bodies.iter().enumerate() {
                into.set_row(*body, &rows.row(i));
            }
        }
    }

    /// `map` sees the columns as rows.
    fn replace_columns(
        &self,
        into: &mut DMatrix<f64>,
        from: &DMatrix<f64>,
        map: impl Fn(&Cholesky<f64, Dyn>, &DMatrix<f64>) -> DMatrix<f64>,
    ) {
        for (part, factors) in &self.parts {
            let rows = map(factors, &from.select_columns(&part.bodies).transpose());
            for (i, body) in part.bodies.iter().enumerate() {
                into.set_column(*body, &rows.row(i).transpose());
            }
        }
    }
}
