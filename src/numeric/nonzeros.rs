//! Entries of a matrix that are not 0, line by line: trains are long and their couplings short.

use nalgebra::DMatrix;
use std::cmp::Ordering;

/// Nonzero entries of the lines (rows or columns) of a matrix.
#[derive(Debug, Clone, Default)]
pub(crate) struct Nonzeros {
    starts: Vec<usize>,
    entries: Vec<(usize, f64)>,
}

impl Nonzeros {
    /// Row by row: column and value.
    pub(crate) fn of_rows(matrix: &DMatrix<f64>) -> Nonzeros {
        Nonzeros::collect(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)])
    }

    /// Column by column: row and value.
    pub(crate) fn of_columns(matrix: &DMatrix<f64>) -> Nonzeros {
        Nonzeros::collect(matrix.ncols(), matrix.nrows(), |j, i| matrix[(i, j)])
    }

    fn collect(lines: usize, length: usize, at: impl Fn(usize, usize) -> f64) -> Nonzeros {
        let (mut starts, mut entries) = (vec![0], Vec::new());
        for line in 0..lines {
            let all = (0..length).map(|k| (k, at(line, k)));
            entries.extend(all.filter(|(_, value)| *value != 0.0));
            starts.push(entries.len());
        }
        Nonzeros { starts, entries }
    }

    /// One line.
    pub fn line(&self, k: usize) -> &[(usize, f64)] {
        &self.entries[self.starts[k]..self.starts[k + 1]]
    }
}

/// Product of two ascending lists of nonzero entries.
pub(crate) fn sparse_dot(mut a: &[(usize, f64)], mut b: &[(usize, f64)]) -> f64 {
    let mut sum = 0.0;
    while let (Some((i, x)), Some((j, y))) = (a.first(), b.first()) {
        match i.cmp(j) {
            Ordering::Less => a = &a[1..],
            Ordering::Greater => b = &b[1..],
            Ordering::Equal => {
                sum += x * y;
                (a, b) = (&a[1..], &b[1..]);
            }
        }
    }
    sum
}
