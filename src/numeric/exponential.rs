//! Matrix exponential by scaling, Taylor polynomial and squaring.

use super::dense::multiply;
use nalgebra::DMatrix;

/// Largest 1-norm at which the Taylor polynomial of degree 16 is exact to rounding: 0.7^17 / 17! = 7e-18.
const TAYLOR_RADIUS: f64 = 0.7;
/// 1/k! for k = 0..16.
const RECIPROCAL_FACTORIALS: [f64; 17] = reciprocal_factorials();

const fn reciprocal_factorials() -> [f64; 17] {
    let mut list = [1.0; 17];
    let (mut k, mut factorial) = (1, 1.0);
    while k < 17 {
        factorial *= k as f64;
        list[k] = 1.0 / factorial;
        k += 1;
    }
    list
}

/// exp(A) of square matrices of one size; owns its buffers.
#[derive(Debug)]
pub struct Exponential {
    /// x, x^2, x^3, x^4.
    powers: [DMatrix<f64>; 4],
    sum: DMatrix<f64>,
    next: DMatrix<f64>,
}

impl Exponential {
    /// Buffers for n x n matrices.
    pub fn new(n: usize) -> Exponential {
        let zero = || DMatrix::zeros(n, n);
        Exponential {
            powers: [zero(), zero(), zero(), zero()],
            sum: zero(),
            next: zero(),
        }
    }

    /// n.
    pub fn size(&self) -> usize {
        self.sum.nrows()
    }

    /// exp(A).
    ///
    /// Scaling by 2^-s brings the 1-norm below the radius of the polynomial, which is summed in powers of x^4; s squarings undo
    /// it. The identity is left out while squaring, exp(2x) - 1 = y (y + 2) with y = exp(x) - 1, which keeps small exponents accurate.
    pub fn of(&mut self, a: &DMatrix<f64>) -> &DMatrix<f64> {
        let squarings = self.scale(a);
        let c = RECIPROCAL_FACTORIALS;
        self.sum.copy_from(&self.powers[3]);
        self.sum *= c[16];
        for first in [12, 8, 4] {
            self.add(&c[first..first + 4]);
            multiply(&self.sum, &self.powers[3], &mut self.next);
            std::mem::swap(&mut self.sum, &mut self.next);
        }
        self.add(&[0.0, c[1], c[2], c[3]]);
        for _ in 0..squarings {
            multiply(&self.sum, &self.sum, &mut self.next);
            self.next
                .zip_apply(&self.sum, |square, y| *square += 2.0 * y);
            std::mem::swap(&mut self.sum, &mut self.next);
        }
        for i in 0..a.nrows() {
            self.sum[(i, i)] += 1.0;
        }
        &self.sum
    }

    /// Powers of x = 2^-s A; returns s.
    fn scale(&mut self, a: &DMatrix<f64>) -> i32 {
        let sums = a
            .column_iter()
            .map(|c| c.iter().map(|x| x.abs()).sum::<f64>());
        let norm = sums.fold(0.0, f64::max);
        let squarings = if norm > TAYLOR_RADIUS {
            (norm / TAYLOR_RADIUS).log2().ceil() as i32
        } else {
            0
        };
        let [x, x2, x3, x4] = &mut self.powers;
        x.copy_from(a);
        *x *= 0.5_f64.powi(squarings);
        multiply(x, x, x2);
        multiply(x2, x, x3);
        multiply(x2, x2, x4);
        squarings
    }

    /// sum += c_0 + c_1 x + c_2 x^2 + c_3 x^3.
    fn add(&mut self, c: &[f64]) {
        let [x, x2, x3, _] = &self.powers;
        let powers = x.iter().zip(x2.iter()).zip(x3.iter());
        for (sum, ((x, x2), x3)) in self.sum.iter_mut().zip(powers) {
            *sum += c[1] * x + c[2] * x2 + c[3] * x3;
        }
        for i in 0..self.sum.nrows() {
            self.sum[(i, i)] += c[0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exponential(a: &DMatrix<f64>) -> DMatrix<f64> {
        Exponential::new(a.nrows()).of(a).clone()
    }

    #[test]
    fn closed_forms() {
        let t: f64 = 12.3;
        let turn = DMatrix::from_row_slice(2, 2, &[0.0, t, -t, 0.0]);
        let exact = DMatrix::from_row_slice(2, 2, &[t.cos(), t.sin(), -t.sin(), t.cos()]);
        approx::assert_relative_eq!(exponential(&turn), exact, epsilon = 1e-13);
        // Free flight: nilpotent.
        let flight = DMatrix::from_row_slice(2, 2, &[0.0, 5.0, 0.0, 0.0]);
        assert_eq!(
            exponential(&flight),
            DMatrix::from_row_slice(2, 2, &[1.0, 5.0, 0.0, 1.0])
        );
        let decay = DMatrix::from_row_slice(1, 1, &[-30.0]);
        approx::assert_relative_eq!(
            exponential(&decay)[(0, 0)],
            (-30.0_f64).exp(),
            epsilon = 1e-15
        );
    }

    #[test]
    fn large_matrices_through_the_library() {
        // Twenty rotations side by side, one angle each.
        let n = 40;
        let angle = |k: usize| 0.3 + 0.2 * k as f64;
        let mut a = DMatrix::zeros(n, n);
        let mut exact = DMatrix::zeros(n, n);
        for k in 0..n / 2 {
            let (i, j, t) = (k, n - 1 - k, angle(k));
            (a[(i, j)], a[(j, i)]) = (t, -t);
            (exact[(i, i)], exact[(j, j)]) = (t.cos(), t.cos());
            (exact[(i, j)], exact[(j, i)]) = (t.sin(), -t.sin());
        }
        approx::assert_relative_eq!(exponential(&a), exact, epsilon = 1e-13);
    }
}
