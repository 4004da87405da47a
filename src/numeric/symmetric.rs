//! Matrices that a diagonal scaling makes symmetric, and their eigenvalues.

use nalgebra::{DMatrix, SymmetricEigen};

/// Positive d such that diag(d) A diag(d)^-1 is symmetric: (d_j / d_i)^2 = a_ij / a_ji. `None` when there is none.
pub fn symmetriser(a: &DMatrix<f64>) -> Option<Vec<f64>> {
    let n = a.nrows();
    let mut scale = vec![0.0; n];
    for start in 0..n {
        if scale[start] != 0.0 {
            continue;
        }
        scale[start] = 1.0;
        let mut queue = vec![start];
        while let Some(i) = queue.pop() {
            for j in (0..n).filter(|j| *j != i) {
                let (forth, back) = (a[(i, j)], a[(j, i)]);
                if forth == 0.0 && back == 0.0 {
                    continue;
                }
                if forth == 0.0 || back == 0.0 || forth / back < 0.0 {
                    return None;
                }
                if scale[j] == 0.0 {
                    scale[j] = scale[i] * (forth / back).sqrt();
                    queue.push(j);
                }
            }
        }
    }
    let is_symmetric = (0..n).all(|i| {
        (0..i).all(|j| {
            let (x, y) = (
                scale[i] * a[(i, j)] / scale[j],
                scale[j] * a[(j, i)] / scale[i],
            );
            (x - y).abs() <= 1e-10 * x.abs().max(y.abs())
        })
    });
    is_symmetric.then_some(scale)
}

/// Eigenvalues of a symmetric matrix, ascending, in n^2 operations for a tridiagonal one (a chain); its lower half is read.
/// `None` when the iteration does not converge.
pub fn eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<f64>> {
    let n = matrix.nrows();
    let is_tridiagonal = (0..n).all(|j| (j + 2..n).all(|i| matrix[(i, j)] == 0.0));
    if !is_tridiagonal {
        let found = SymmetricEigen::try_new(matrix.clone(), f64::EPSILON, MAX_SWEEPS * n)?;
        let mut list: Vec<f64> = found.eigenvalues.iter().copied().collect();
        list.sort_by(f64::total_cmp);
        return Some(list);
    }
    let diagonal = (0..n).map(|i| matrix[(i, i)]).collect();
    let below = (1..n).map(|i| matrix[(i, i - 1)]).collect();
    tridiagonal(diagonal, below)
}

/// Sweeps allowed an eigenvalue.
const MAX_SWEEPS: usize = 60;

/// QL iteration with implicit shifts; `below`: the n - 1 entries under the diagonal.
fn tridiagonal(mut d: Vec<f64>, mut below: Vec<f64>) -> Option<Vec<f64>> {
    let n = d.len();
    below.push(0.0);
    let e = &mut below;
    for l in 0..n {
        for sweep in 0.. {
            let is_small = |m: &usize| e[*m].abs() <= f64::EPSILON * (d[*m].abs() + d[m + 1].abs());
            let m = (l..n - 1).find(is_small).unwrap_or(n - 1);
            if m == l {
                break;
            }
            if sweep == MAX_SWEEPS {
                return None;
            }
            let slope = (d[l + 1] - d[l]) / (2.0 * e[l]);
            let root = slope.hypot(1.0).copysign(slope);
            let mut g = d[m] - d[l] + e[l] / (slope + root);
            let (mut s, mut c, mut p) = (1.0, 1.0, 0.0);
            let mut is_split = false;
            for i in (l..m).rev() {
                let (f, b) = (s * e[i], c * e[i]);
                let r = (f * f + g * g).sqrt();
                e[i + 1] = r;
                if r == 0.0 {
                    d[i + 1] -= p;
                    e[m] = 0.0;
                    is_split = true;
                    break;
                }
                (s, c) = (f / r, g / r);
                g = d[i + 1] - p;
                let q = (d[i] - g) * s + 2.0 * c * b;
                p = s * q;
                d[i + 1] = g + p;
                g = c * q - b;
            }
            if !is_split {
                d[l] -= p;
                e[l] = g;
                e[m] = 0.0;
            }
        }
    }
    d.sort_by(f64::total_cmp);
    Some(d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_of_a_chain() {
        // tridiag(-1, 2, -1): 2 - 2 cos(k pi / (n + 1)).
        for n in [1, 2, 7, 200] {
            let a = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
                0 => 2.0,
                1 => -1.0,
                _ => 0.0,
            });
            let found = eigenvalues(&a).unwrap();
            for (k, x) in found.iter().enumerate() {
                let angle = (k + 1) as f64 * std::f64::consts::PI / (n + 1) as f64;
                assert!((x - (2.0 - 2.0 * angle.cos())).abs() < 1e-13, "{n} {k}");
            }
        }
        // Uncoupled coordinates, and zeros on the diagonal.
        let a = DMatrix::from_row_slice(3, 3, &[0.0, 2.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, -1.0]);
        assert_eq!(eigenvalues(&a).unwrap(), [-2.0, -1.0, 2.0]);
    }

    #[test]
    fn both_roads_agree() {
        let n = 40;
        let mut a = DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 2.0 + (i as f64).sin(),
            1 => -1.0 / (1 + i.min(j)) as f64,
            _ => 0.0,
        });
        let chain = eigenvalues(&a).unwrap();
        (a[(n - 1, 0)], a[(0, n - 1)]) = (1e-300, 1e-300);
        let general = eigenvalues(&a).unwrap();
        assert!(
            chain
                .iter()
                .zip(&general)
                .all(|(x, y)| (x - y).abs() < 1e-13)
        );
    }

    #[test]
    fn a_scaling_is_found_or_refused() {
        let a = DMatrix::from_row_slice(2, 2, &[2.0, 4.0, 1.0, 2.0]);
        assert_eq!(symmetriser(&a), Some(vec![1.0, 2.0]));
        let b = DMatrix::from_row_slice(2, 2, &[2.0, 4.0, -1.0, 2.0]);
        assert_eq!(symmetriser(&b), None);
    }
}
