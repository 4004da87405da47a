//! Matrices that a diagonal scaling makes symmetric, and their eigenvalues.

use nalgebra::{DMatrix, SymmetricEigen};

/// Positive d such that diag(d) A diag(d)^-1 is symmetric: (d_j / d_i)^2 = a_ij / a_ji. `None` when there is none.
pub(crate) fn symmetriser(a: &DMatrix<f64>) -> Option<Vec<f64>> {
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
                    // Numbers that differ by more than a float can hold.
                    if !(scale[j] > 0.0 && scale[j].is_finite()) {
                        return None;
                    }
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

/// Symmetric QR iteration with Wilkinson's shift on the diagonal `d` and the n - 1 entries `e` beside it.
fn tridiagonal(mut d: Vec<f64>, mut e: Vec<f64>) -> Option<Vec<f64>> {
    let mut high = d.len().saturating_sub(1);
    let mut sweeps = 0;
    while high > 0 {
        // The last part of the matrix that does not fall into two.
        let is_zero = |k: usize| e[k].abs() <= f64::EPSILON * (d[k].abs() + d[k + 1].abs());
        let low = (0..high).rev().find(|k| is_zero(*k)).map_or(0, |k| k + 1);
        if low == high {
            high -= 1;
            sweeps = 0;
        } else if sweeps < MAX_SWEEPS {
            sweep(&mut d[low..=high], &mut e[low..high]);
            sweeps += 1;
        } else {
            return None;
        }
    }
    d.sort_by(f64::total_cmp);
    Some(d)
}

/// One QR step: a rotation of the first two rows and columns that the shift asks for; it leaves an entry outside the three
/// diagonals, which further rotations push down and out.
fn sweep(d: &mut [f64], e: &mut [f64]) {
    let last = e.len();
    let half = 0.5 * (d[last - 1] - d[last]);
    let corner = e[last - 1];
    let shift = d[last] - corner * corner / (half + half.hypot(corner).copysign(half));
    let (mut kept, mut outside) = (d[0] - shift, e[0]);
    for k in 0..last {
        let length = (kept * kept + outside * outside).sqrt();
        let (c, s) = match length > 0.0 {
            true => (kept / length, outside / length),
            false => (1.0, 0.0),
        };
        if k > 0 {
            e[k - 1] = length;
        }
        let (upper, beside, lower) = (d[k], e[k], d[k + 1]);
        let change = s * (2.0 * c * beside - s * (upper - lower));
        d[k] = upper + change;
        d[k + 1] = lower - change;
        e[k] = c * s * (lower - upper) + (c * c - s * s) * beside;
        if k + 1 < last {
            (kept, outside) = (e[k], s * e[k + 1]);
            e[k + 1] *= c;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_scaling_beyond_the_range_of_floats() {
        for (forth, back) in [(1e-200, 1e200), (1e200, 1e-200)] {
            let a = DMatrix::from_row_slice(2, 2, &[1.0, forth, back, 1.0]);
            assert_eq!(symmetriser(&a), None);
        }
    }

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
        let found = eigenvalues(&a).unwrap();
        assert!(
            (found.iter().zip([-2.0, -1.0, 2.0])).all(|(x, y)| (x - y).abs() < 4.0 * f64::EPSILON)
        );
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
