//! Matrix exponential by scaling, Taylor polynomial and squaring.

use nalgebra::DMatrix;

/// Largest 1-norm at which the Taylor polynomial of degree 16 is exact to rounding: 0.7^17 / 17! = 7e-18.
const TAYLOR_RADIUS: f64 = 0.7;
const TAYLOR_DEGREE: usize = 16;

/// exp(A) of a square matrix.
///
/// Scaling by 2^-s brings the 1-norm below the radius of the polynomial; s squarings undo it. The identity is left out
/// while squaring, exp(2x) - 1 = y (y + 2) with y = exp(x) - 1, which keeps small exponents accurate.
pub fn exponential(a: &DMatrix<f64>) -> DMatrix<f64> {
    let n = a.nrows();
    let norm = a
        .column_iter()
        .map(|c| c.iter().map(|x| x.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let squarings = if norm > TAYLOR_RADIUS {
        (norm / TAYLOR_RADIUS).log2().ceil() as i32
    } else {
        0
    };
    let x = a * 0.5_f64.powi(squarings);
    // Horner: y = x (1 + x/2 (1 + x/3 (...))).
    let mut y = DMatrix::zeros(n, n);
    let mut next = DMatrix::zeros(n, n);
    for k in (1..=TAYLOR_DEGREE).rev() {
        for i in 0..n {
            y[(i, i)] += 1.0;
        }
        x.mul_to(&y, &mut next);
        next /= k as f64;
        std::mem::swap(&mut y, &mut next);
    }
    for _ in 0..squarings {
        y.mul_to(&y, &mut next);
        next.zip_apply(&y, |square, y| *square += 2.0 * y);
        std::mem::swap(&mut y, &mut next);
    }
    for i in 0..n {
        y[(i, i)] += 1.0;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
