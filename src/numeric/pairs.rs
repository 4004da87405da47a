//! Matrices that mix only the two coefficients of one harmonic: blocks of a Jacobian where every connection is linear.
//!
//! Rows and columns in the order mean, sin 1, cos 1, sin 2, cos 2, ...; nonzero are the diagonal and, for each harmonic, the two
//! entries beside it. Such matrices are closed under sums, products and inverses, at a cost linear in their size.

/// The entries of such a matrix, row by row: on the diagonal, and in the column of the other coefficient of the harmonic.
#[derive(Debug, Clone)]
pub(super) struct Pairs(Vec<[f64; 2]>);

/// Number of the other coefficient of a harmonic; its own for the mean and for a last one that is alone.
fn other(r: usize, size: usize) -> usize {
    match r {
        0 => 0,
        r if r % 2 == 0 => r - 1,
        r if r + 1 < size => r + 1,
        r => r,
    }
}

/// Whether a block, column by column, has no other entries.
pub(super) fn is_paired(block: &[f64], size: usize) -> bool {
    block.chunks_exact(size).enumerate().all(|(c, column)| {
        let (first, last) = (c.min(other(c, size)), c.max(other(c, size)));
        let mut rest = column[..first].iter().chain(&column[last + 1..]);
        rest.all(|x| *x == 0.0)
    })
}

impl Pairs {
    /// Zeros.
    pub fn new(size: usize) -> Pairs {
        Pairs(vec![[0.0; 2]; size])
    }

    /// Takes the entries of a block, column by column; zeros without one.
    pub fn load(&mut self, block: Option<&[f64]>) {
        let size = self.0.len();
        let Some(block) = block else {
            return self.0.fill([0.0; 2]);
        };
        for (r, row) in self.0.iter_mut().enumerate() {
            let other = other(r, size);
            let beside = if other == r {
                0.0
            } else {
                block[other * size + r]
            };
            *row = [block[r * size + r], beside];
        }
    }

    /// Becomes its inverse; the sign of the determinant, 0 when there is no inverse.
    pub(crate) fn invert(&mut self) -> i8 {
        let size = self.0.len();
        let mut sign = 1;
        for r in 0..size {
            let s = other(r, size);
            if s < r {
                continue;
            }
            let ([a, b], [d, c]) = (self.0[r], self.0[s]);
            let determinant = if s == r { a } else { a * d - b * c };
            if determinant == 0.0 || !determinant.is_finite() {
                return 0;
            }
            if determinant < 0.0 {
                sign = -sign;
            }
            if s == r {
                self.0[r] = [1.0 / a, 0.0];
            } else {
                self.0[r] = [d / determinant, -b / determinant];
                self.0[s] = [a / determinant, -c / determinant];
            }
        }
        sign
    }

    /// x <- A x.
    pub fn apply(&self, x: &mut [f64]) {
        x[0] *= self.0[0][0];
        for (x, a) in x[1..].chunks_mut(2).zip(self.0[1..].chunks(2)) {
            match (x, a) {
                ([x, y], [[a, b], [d, c]]) => (*x, *y) = (a * *x + b * *y, c * *x + d * *y),
                ([x], [[a, _]]) => *x *= a,
                _ => unreachable!("both have the same length"),
            }
        }
    }

    /// y <- y - A x.
    pub(crate) fn subtract_from(&self, x: &[f64], y: &mut [f64]) {
        y[0] -= self.0[0][0] * x[0];
        let columns = x[1..].chunks(2).zip(self.0[1..].chunks(2));
        for (y, (x, a)) in y[1..].chunks_mut(2).zip(columns) {
            match (y, x, a) {
                ([y, z], [x, w], [[a, b], [d, c]]) => {
                    *y -= a * x + b * w;
                    *z -= c * x + d * w;
                }
                ([y], [x], [[a, _]]) => *y -= a * x,
                _ => unreachable!("all have the same length"),
            }
        }
    }

    /// y <- y - A^T x.
    pub(crate) fn transpose_subtract_from(&self, x: &[f64], y: &mut [f64]) {
        let size = self.0.len();
        for (c, y) in y.iter_mut().enumerate() {
            let r = other(c, size);
            *y -= self.0[c][0] * x[c];
            if r != c {
                *y -= self.0[r][1] * x[r];
            }
        }
    }

    /// A <- B A.
    pub(crate) fn multiply_from_left(&mut self, b: &Pairs) {
        let size = self.0.len();
        for r in 0..size {
            let s = other(r, size);
            if s >= r {
                let (upper, lower) = (product_row(b, self, r, s), product_row(b, self, s, r));
                (self.0[r], self.0[s]) = (upper, lower);
            }
        }
    }

    /// A <- A - B C.
    pub(crate) fn subtract_product(&mut self, b: &Pairs, c: &Pairs) {
        let size = self.0.len();
        for (r, row) in self.0.iter_mut().enumerate() {
            let [own, beside] = product_row(b, c, r, other(r, size));
            row[0] -= own;
            row[1] -= beside;
        }
    }
}

/// Row r of B C, s the other coefficient.
fn product_row(b: &Pairs, c: &Pairs, r: usize, s: usize) -> [f64; 2] {
    let ([own, beside], [diagonal, right]) = (b.0[r], c.0[r]);
    if s == r {
        return [own * diagonal, 0.0];
    }
    let [lower, left] = c.0[s];
    [own * diagonal + beside * left, own * right + beside * lower]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn example(size: usize, seed: f64) -> (DMatrix<f64>, Pairs) {
        let dense = DMatrix::from_fn(size, size, |r, c| {
            let beside = r == c || other(r, size) == c;
            if beside {
                (seed + (3 * r + 5 * c) as f64).sin()
            } else {
                0.0
            }
        });
        let mut pairs = Pairs::new(size);
        assert!(is_paired(dense.as_slice(), size));
        pairs.load(Some(dense.as_slice()));
        (dense, pairs)
    }

    fn dense(pairs: &Pairs) -> DMatrix<f64> {
        let size = pairs.0.len();
        let mut matrix = DMatrix::zeros(size, size);
        for (r, row) in pairs.0.iter().enumerate() {
            matrix[(r, other(r, size))] = row[1];
            matrix[(r, r)] = row[0];
        }
        matrix
    }

    #[test]
    fn all_operations_are_those_of_the_whole_matrix() {
        for size in [1, 2, 3, 4, 7] {
            let ((a, mut pa), (b, pb)) = (example(size, 0.3), example(size, 1.1));
            let x = DVector::from_fn(size, |k, _| (k as f64).cos());
            let mut y = x.clone();
            pa.apply(y.as_mut_slice());
            assert!((&y - &a * &x).amax() < 1e-15);
            pa.subtract_from(x.as_slice(), y.as_mut_slice());
            assert!(y.amax() < 1e-15);
            pa.transpose_subtract_from(x.as_slice(), y.as_mut_slice());
            assert!((&y + a.transpose() * &x).amax() < 1e-15);
            let mut product = pb.clone();
            product.multiply_from_left(&pa);
            assert!((dense(&product) - &a * &b).amax() < 1e-15);
            product.subtract_product(&pa, &pb);
            assert!(dense(&product).amax() < 1e-15);
            assert_eq!(pa.invert(), a.determinant().signum() as i8);
            assert!((dense(&pa) * &a - DMatrix::identity(size, size)).amax() < 1e-13);
        }
    }

    #[test]
    fn other_entries_and_singular_matrices_are_seen() {
        let (mut a, _) = example(5, 0.3);
        a[(4, 1)] = 1e-300;
        assert!(!is_paired(a.as_slice(), 5));
        let mut pairs = Pairs::new(3);
        pairs.load(Some(&[1.0, 0.0, 0.0, 0.0, 2.0, 4.0, 0.0, 1.0, 2.0]));
        assert_eq!(pairs.invert(), 0);
    }
}
