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

/// The same matrix in an array.
pub fn dense<const N: usize>(entries: &[MatrixEntry]) -> [[f64; N]; N] {
    let mut matrix = [[0.0; N]; N];
    entries
        .iter()
        .for_each(|e| matrix[e.row][e.column] = e.value);
    matrix
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
