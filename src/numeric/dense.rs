//! Dense LU factorisation in buffers that are allocated once. The only file that names faer.

use crate::interrupt;
use dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_unit_lower_triangular_in_place;
use faer::perm::PermRef;
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};
use nalgebra::{DMatrix, DVector};

/// LU factors of a square matrix, with the work space to make and to use them.
pub(crate) struct Lu {
    factors: DMatrix<f64>,
    forward: Vec<usize>,
    inverse: Vec<usize>,
    memory: MemBuffer,
    odd_permutation: bool,
}

/// A matrix of zeros in memory that the system hands out as zeros already: of a large one no page is touched before it is used, so
/// that an interruption is heard in between.
pub fn zeros(rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_vec(rows, columns, vec![0.0; rows * columns])
}

/// Rows from which a factorisation takes seconds: it goes panel by panel.
const LONG: usize = 1500;
/// Columns of a panel.
const PANEL: usize = 96;
/// Columns that a panel is taken out of at a time: a fraction of a second at the largest sizes.
const SLAB: usize = 1024;

impl Lu {
    /// Buffers for n x n matrices and one right-hand side.
    pub fn new(n: usize) -> Lu {
        Lu::with_columns(n, 1)
    }

    /// Buffers for n x n matrices and a number of simultaneous right-hand sides.
    pub(crate) fn with_columns(n: usize, columns: usize) -> Lu {
        let factor = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default());
        let solve = solve::solve_in_place_scratch::<usize, f64>(n, columns, Par::Seq);
        Lu {
            factors: zeros(n, n),
            forward: vec![0; n],
            inverse: vec![0; n],
            memory: MemBuffer::new(factor.or(solve)),
            odd_permutation: false,
        }
    }

    /// Factorises with partial pivoting; false when a pivot vanishes or is not finite, or when an interrupt is requested.
    pub fn factorise(&mut self, matrix: &DMatrix<f64>) -> bool {
        // The first use of large buffers takes seconds by itself.
        let stretch = SLAB * self.rows().max(1);
        let (to, from) = (self.factors.as_mut_slice(), matrix.as_slice());
        for (to, from) in to.chunks_mut(stretch).zip(from.chunks(stretch)) {
            if from.len() == stretch && interrupt::is_requested() {
                return false;
            }
            to.copy_from_slice(from);
        }
        self.factorise_stored()
    }

    /// The matrix that [`Lu::factorise_stored`] will factorise, to be filled in place.
    pub(crate) fn matrix_mut(&mut self) -> &mut DMatrix<f64> {
        &mut self.factors
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.factors.nrows()
    }

    /// Factorises the content of [`Lu::matrix_mut`]; false when a pivot vanishes or is not finite, or when an interrupt is requested.
    pub(crate) fn factorise_stored(&mut self) -> bool {
        let n = self.factors.nrows();
        if n >= LONG {
            return self.factorise_by_panels(PANEL);
        }
        let view = MatMut::from_column_major_slice_mut(self.factors.as_mut_slice(), n, n);
        let stack = MemStack::new(&mut self.memory);
        let (forward, inverse) = (&mut self.forward, &mut self.inverse);
        let (info, _) =
            factor::lu_in_place(view, forward, inverse, Par::Seq, stack, Default::default());
        self.odd_permutation = info.transposition_count % 2 == 1;
        self.is_regular()
    }

    fn is_regular(&self) -> bool {
        let mut pivots = (0..self.rows()).map(|i| self.factors[(i, i)]);
        pivots.all(|pivot| pivot != 0.0 && pivot.is_finite())
    }

    /// The same panel by panel, so that an interruption is heard in between.
    fn factorise_by_panels(&mut self, width: usize) -> bool {
        let n = self.rows();
        (0..n).for_each(|i| self.forward[i] = i);
        self.odd_permutation = false;
        let (mut order, mut inverse) = (vec![0; n], vec![0; n]);
        let mut exchanged = Vec::with_capacity(n);
        for begin in (0..n).step_by(width) {
            if interrupt::is_requested() {
                return false;
            }
            let (rows, end) = (n - begin, (begin + width).min(n));
            let (order, inverse) = (&mut order[..rows], &mut inverse[..rows]);
            let whole = MatMut::from_column_major_slice_mut(self.factors.as_mut_slice(), n, n);
            let panel = whole.submatrix_mut(begin, begin, rows, end - begin);
            let stack = MemStack::new(&mut self.memory);
            let (info, _) =
                factor::lu_in_place(panel, order, inverse, Par::Seq, stack, Default::default());
            self.odd_permutation ^= info.transposition_count % 2 == 1;
            let mut exchange = |column: &mut [f64]| {
                exchanged.clear();
                exchanged.extend(order.iter().map(|i| column[*i]));
                column.copy_from_slice(&exchanged);
            };
            for column in (0..begin).chain(end..n) {
                let below = column * n + begin..(column + 1) * n;
                exchange(&mut self.factors.as_mut_slice()[below]);
            }
            let moved: Vec<usize> = order.iter().map(|i| self.forward[begin + i]).collect();
            self.forward[begin..].copy_from_slice(&moved);
            if !self.eliminate(begin, end) {
                return false;
            }
        }
        for (to, from) in self.forward.iter().enumerate() {
            self.inverse[*from] = to;
        }
        self.is_regular()
    }

    /// Takes the columns of a factorised panel out of those to the right of it; false when an interrupt is requested.
    fn eliminate(&mut self, begin: usize, end: usize) -> bool {
        let n = self.rows();
        let whole = MatMut::from_column_major_slice_mut(self.factors.as_mut_slice(), n, n);
        let (left, mut right) = whole.split_at_col_mut(end);
        let (_, panel) = left.rb().split_at_col(begin);
        let (pivot, below) = panel.split_at_row(begin).1.split_at_row(end - begin);
        for first in (end..n).step_by(SLAB) {
            if interrupt::is_requested() {
                return false;
            }
            let columns = SLAB.min(n - first);
            let slab = right.rb_mut().subcols_mut(first - end, columns);
            let (mut upper, lower) =
                { slab.split_at_row_mut(begin).1 }.split_at_row_mut(end - begin);
            solve_unit_lower_triangular_in_place(pivot, upper.rb_mut(), Par::Seq);
            matmul(lower, Accum::Add, below, upper.rb(), -1.0, Par::Seq);
        }
        true
    }

    /// Sign of the determinant of the factorised matrix.
    pub fn determinant_sign(&self) -> i8 {
        let negative = self.factors.diagonal().iter().filter(|d| **d < 0.0).count();
        if (negative % 2 == 1) == self.odd_permutation {
            1
        } else {
            -1
        }
    }

    /// Smallest pivot in modulus: a cheap sign of a singular matrix.
    pub(crate) fn smallest_pivot(&self) -> f64 {
        self.factors
            .diagonal()
            .iter()
            .fold(f64::INFINITY, |m, d| m.min(d.abs()))
    }

    /// Overwrites `rhs` with the solution.
    pub fn solve(&mut self, rhs: &mut DVector<f64>) {
        self.solve_columns(rhs.as_mut_slice(), 1);
    }

    /// Overwrites right-hand sides, column by column, with their solutions.
    pub(crate) fn solve_columns(&mut self, rhs: &mut [f64], columns: usize) {
        let n = self.factors.nrows();
        let factors = MatRef::from_column_major_slice(self.factors.as_slice(), n, n);
        let permutation = PermRef::new_checked(&self.forward, &self.inverse, n);
        let rhs = MatMut::from_column_major_slice_mut(&mut rhs[..n * columns], n, columns);
        let stack = MemStack::new(&mut self.memory);
        solve::solve_in_place(factors, factors, permutation, rhs, Par::Seq, stack);
    }
}

/// C <- C - A B for square matrices of `size` rows, column by column.
pub(crate) fn subtract_product(c: &mut [f64], a: &[f64], b: &[f64], size: usize) {
    let c = MatMut::from_column_major_slice_mut(c, size, size);
    let a = MatRef::from_column_major_slice(a, size, size);
    let b = MatRef::from_column_major_slice(b, size, size);
    matmul(c, Accum::Add, a, b, -1.0, Par::Seq);
}

/// Rows below which plain loops beat a library's call.
const SMALL: usize = 8;

/// C <- A B.
pub fn multiply(a: &DMatrix<f64>, b: &DMatrix<f64>, c: &mut DMatrix<f64>) {
    if a.nrows() < SMALL {
        a.mul_to(b, c);
        return;
    }
    let view = |m: &'_ DMatrix<f64>| (m.nrows(), m.ncols());
    let ((m, k), n) = (view(a), b.ncols());
    matmul(
        MatMut::from_column_major_slice_mut(c.as_mut_slice(), m, n),
        Accum::Replace,
        MatRef::from_column_major_slice(a.as_slice(), m, k),
        MatRef::from_column_major_slice(b.as_slice(), k, n),
        1.0,
        Par::Seq,
    );
}

impl std::fmt::Debug for Lu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Lu({})", self.factors.nrows())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_factorised() {
        for n in [1, 3, 40, 130] {
            let a = DMatrix::from_fn(n, n, |i, j| {
                ((7 * i + 3 * j * j + 1) % 17) as f64 - 8.0 + if i == j { 20.0 } else { 0.0 }
            });
            let x = DVector::from_fn(n, |i, _| (i as f64).sin());
            let mut b = &a * &x;
            let mut lu = Lu::new(n);
            assert!(lu.factorise(&a));
            lu.solve(&mut b);
            approx::assert_relative_eq!(b, x, epsilon = 1e-10);
        }
    }

    #[test]
    fn panels_give_the_same_factors() {
        let n = 130;
        let a = DMatrix::from_fn(n, n, |i, j| {
            ((7 * i * i + 13 * j * j + 5 * i * j) as f64).sin()
        });
        let (mut whole, mut panels) = (Lu::new(n), Lu::new(n));
        assert!(whole.factorise(&a));
        panels.matrix_mut().copy_from(&a);
        assert!(panels.factorise_by_panels(16));
        assert_eq!(whole.determinant_sign(), panels.determinant_sign());
        let x = DVector::from_fn(n, |i, _| (i as f64).sin());
        let mut b = &a * &x;
        panels.solve(&mut b);
        approx::assert_relative_eq!(b, x, epsilon = 1e-9);
        let flag = interrupt::Interrupt::default();
        flag.request();
        assert!(!flag.scope(|| panels.factorise_by_panels(16)));
    }

    #[test]
    fn knows_the_sign_of_the_determinant() {
        let swap = DMatrix::from_row_slice(3, 3, &[0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 3.0]);
        let mut lu = Lu::new(3);
        assert!(lu.factorise(&swap));
        assert_eq!(lu.determinant_sign(), -1);
        assert!(lu.factorise(&-swap));
        assert_eq!(lu.determinant_sign(), 1);
    }

    #[test]
    fn says_that_a_matrix_is_singular() {
        assert!(!Lu::new(2).factorise(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 4.0])));
    }
}
