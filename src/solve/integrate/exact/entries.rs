//! Matrices without their zeros.

use nalgebra::DMatrix;

/// One nonzero entry of a matrix.
#[derive(Debug, Clone, Copy)]
pub struct MatrixEntry {
    pub row: usize,
    pub column: usize,
    pub value: f64,
}

/// The entries of a matrix, multiplied.
pub fn entries(matrix: &DMatrix<f64>, factor: f64) -> Vec<MatrixEntry> {
    let all =
        (0..matrix.nrows()).flat_map(|row| (0..matrix.ncols()).map(move |column| (row, column)));
    all.map(|(row, column)| MatrixEntry {
        row,
        column,
        value: factor * matrix[(row, column)],
    })
    .filter(|e| e.value != 0.0)
    .collect()
}

/// Rows up to which a matrix is kept in full, too.
const SMALL: usize = 4;

/// A square matrix by its nonzero entries; a small one also in full, which is quicker to read.
#[derive(Debug, Clone)]
pub struct SquareMatrix {
    size: usize,
    entries: Vec<MatrixEntry>,
    /// Row after row, where there are few.
    full: [f64; SMALL * SMALL],
}

impl SquareMatrix {
    /// Of a number of rows.
    pub fn new(size: usize, entries: Vec<MatrixEntry>) -> SquareMatrix {
        let mut matrix = SquareMatrix {
            size,
            entries,
            full: [0.0; SMALL * SMALL],
        };
        matrix.change(|_| {});
        matrix
    }

    /// The entries.
    pub fn entries(&self) -> &[MatrixEntry] {
        &self.entries
    }

    /// Gives the entries other values.
    pub fn change(&mut self, write: impl FnOnce(&mut [MatrixEntry])) {
        write(&mut self.entries);
        if self.size <= SMALL {
            for e in &self.entries {
                self.full[e.row * self.size + e.column] = e.value;
            }
        }
    }

    /// The matrix of N rows, N up to [`SMALL`], in an array.
    #[inline(always)]
    pub fn rows<const N: usize>(&self) -> [[f64; N]; N] {
        const { assert!(N <= SMALL) };
        std::array::from_fn(|i| std::array::from_fn(|j| self.full[i * N + j]))
    }
}

/// Entries of kappa W and what each connection adds to them.
pub fn couple(
    stiffness: &[MatrixEntry],
    map: &[MatrixEntry],
) -> (Vec<MatrixEntry>, Vec<MatrixEntry>) {
    let (mut coupled, mut links): (Vec<MatrixEntry>, Vec<MatrixEntry>) = (Vec::new(), Vec::new());
    let mut known = std::collections::HashMap::new();
    for s in stiffness {
        for w in map.iter().filter(|w| w.row == s.column) {
            let target = *known.entry((s.row, w.column)).or_insert_with(|| {
                coupled.push(MatrixEntry {
                    row: s.row,
                    column: w.column,
                    value: 0.0,
                });
                coupled.len() - 1
            });
            links.push(MatrixEntry {
                row: target,
                column: s.column,
                value: s.value * w.value,
            });
        }
    }
    (coupled, links)
}
