//! Eigenvalues of a real matrix, without vectors.

use nalgebra::{DMatrix, Hessenberg};
use num_complex::Complex;

/// Sweeps allowed for one eigenvalue.
const MAX_SWEEPS: usize = 300;
/// Sweeps after which the shift is an exceptional one.
const EXCEPTIONAL: usize = 10;

/// The eigenvalues of a square matrix of finite numbers, members of a pair side by side; `None` when the iteration does not
/// converge.
///
/// Francis' double-shift QR iteration on the Hessenberg form.
///
/// Wilkinson & Reinsch (1971), procedure hqr.
pub fn eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let size = matrix.nrows();
    let h = match size {
        0..=2 => matrix.clone(),
        _ => Hessenberg::new(matrix.clone()).unpack_h(),
    };
    let mut iteration = Iteration::new(h);
    let mut list = Vec::with_capacity(size);
    let mut count = size;
    while count > 0 {
        let found = iteration.deflate(count)?;
        count -= found.len();
        list.extend(found);
    }
    Some(list)
}

/// Shift of one sweep: sum of the two shifts taken apart, as hqr names them.
#[derive(Clone, Copy)]
struct Shift {
    x: f64,
    y: f64,
    w: f64,
}

struct Iteration {
    h: DMatrix<f64>,
    /// Exceptional shifts so far.
    shifted: f64,
    norm: f64,
}

impl Iteration {
    fn new(h: DMatrix<f64>) -> Iteration {
        let norm = h.iter().map(|x| x.abs()).sum();
        Iteration {
            h,
            shifted: 0.0,
            norm,
        }
    }

    /// One or two eigenvalues from the end of the leading block with a number of rows.
    fn deflate(&mut self, count: usize) -> Option<Vec<Complex<f64>>> {
        let last = count - 1;
        for sweep in 0..MAX_SWEEPS {
            let first = self.first_row(last);
            if first == last {
                let value = self.h[(last, last)] + self.shifted;
                return Some(vec![Complex::new(value, 0.0)]);
            }
            if first + 1 == last {
                return Some(self.pair(last));
            }
            let shift = self.shift(last, sweep);
            self.sweep((first, last), shift);
        }
        None
    }

    /// First row of the block that ends with a row and has no negligible subdiagonal entry.
    fn first_row(&mut self, last: usize) -> usize {
        for l in (1..=last).rev() {
            let sum = self.h[(l - 1, l - 1)].abs() + self.h[(l, l)].abs();
            let size = if sum == 0.0 { self.norm } else { sum };
            if self.h[(l, l - 1)].abs() <= f64::EPSILON * size {
                self.h[(l, l - 1)] = 0.0;
                return l;
            }
        }
        0
    }

    /// Eigenvalues of the two rows that end with this one.
    fn pair(&self, last: usize) -> Vec<Complex<f64>> {
        let h = &self.h;
        let (x, y) = (h[(last, last)], h[(last - 1, last - 1)]);
        let w = h[(last, last - 1)] * h[(last - 1, last)];
        let p = 0.5 * (y - x);
        let q = p * p + w;
        let (z, x) = (q.abs().sqrt(), x + self.shifted);
        if q >= 0.0 {
            let z = p + z.copysign(p);
            let second = if z != 0.0 { x - w / z } else { x + z };
            return vec![Complex::new(x + z, 0.0), Complex::new(second, 0.0)];
        }
        vec![Complex::new(x + p, z), Complex::new(x + p, -z)]
    }

    fn shift(&mut self, last: usize, sweep: usize) -> Shift {
        let h = &mut self.h;
        let (x, y) = (h[(last, last)], h[(last - 1, last - 1)]);
        let w = h[(last, last - 1)] * h[(last - 1, last)];
        if sweep == 0 || !sweep.is_multiple_of(EXCEPTIONAL) {
            return Shift { x, y, w };
        }
        self.shifted += x;
        (0..=last).for_each(|i| h[(i, i)] -= x);
        let s = h[(last, last - 1)].abs() + h[(last - 1, last - 2)].abs();
        Shift {
            x: 0.75 * s,
            y: 0.75 * s,
            w: -0.4375 * s * s,
        }
    }

    /// Row at which a sweep may begin, and the first column of its shifted square.
    fn begin(&self, (first, last): (usize, usize), shift: Shift) -> (usize, [f64; 3]) {
        let h = &self.h;
        let mut m = last - 2;
        loop {
            let z = h[(m, m)];
            let (r, s) = (shift.x - z, shift.y - z);
            let p = (r * s - shift.w) / h[(m + 1, m)] + h[(m, m + 1)];
            let q = h[(m + 1, m + 1)] - z - r - s;
            let r = h[(m + 2, m + 1)];
            let sum = p.abs() + q.abs() + r.abs();
            let [p, q, r] = [p / sum, q / sum, r / sum];
            if m == first {
                return (m, [p, q, r]);
            }
            let below = h[(m, m - 1)].abs() * (q.abs() + r.abs());
            let diagonal = h[(m - 1, m - 1)].abs() + z.abs() + h[(m + 1, m + 1)].abs();
            if below <= f64::EPSILON * p.abs() * diagonal {
                return (m, [p, q, r]);
            }
            m -= 1;
        }
    }

    /// One double QR step on a block.
    fn sweep(&mut self, (first, last): (usize, usize), shift: Shift) {
        let (m, mut column) = self.begin((first, last), shift);
        for i in m + 2..=last {
            self.h[(i, i - 2)] = 0.0;
            if i > m + 2 {
                self.h[(i, i - 3)] = 0.0;
            }
        }
        for k in m..last {
            let mut size = 1.0;
            if k != m {
                let below = if k + 1 < last {
                    self.h[(k + 2, k - 1)]
                } else {
                    0.0
                };
                column = [self.h[(k, k - 1)], self.h[(k + 1, k - 1)], below];
                size = column.iter().map(|x| x.abs()).sum();
                if size == 0.0 {
                    continue;
                }
                column = column.map(|x| x / size);
            }
            let [p, q, r] = column;
            let s = (p * p + q * q + r * r).sqrt().copysign(p);
            if s == 0.0 {
                continue;
            }
            if k != m {
                self.h[(k, k - 1)] = -s * size;
            } else if first != m {
                self.h[(k, k - 1)] = -self.h[(k, k - 1)];
            }
            let p = p + s;
            self.reflect((first, last), k, [p / s, q / s, r / s, q / p, r / p]);
        }
    }

    /// Householder's reflection of three rows and columns, the first of them k.
    fn reflect(&mut self, (first, last): (usize, usize), k: usize, [x, y, z, q, r]: [f64; 5]) {
        let (size, has_third) = (self.h.nrows(), k + 1 < last);
        let columns = &mut self.h.as_mut_slice()[k * size..];
        for column in columns.chunks_exact_mut(size).take(last + 1 - k) {
            match &mut column[k..=last.min(k + 2)] {
                [first, second, third] => {
                    let p = *first + q * *second + r * *third;
                    *third -= p * z;
                    *second -= p * y;
                    *first -= p * x;
                }
                [first, second] => {
                    let p = *first + q * *second;
                    *second -= p * y;
                    *first -= p * x;
                }
                _ => {}
            }
        }
        let rows = first..=last.min(k + 3);
        let (one, others) = columns.split_at_mut(size);
        let (two, others) = others.split_at_mut(size);
        let pairs = one[rows.clone()].iter_mut().zip(&mut two[rows.clone()]);
        if has_third {
            for ((one, two), three) in pairs.zip(&mut others[rows]) {
                let p = x * *one + y * *two + z * *three;
                *three -= p * r;
                *two -= p * q;
                *one -= p;
            }
        } else {
            for (one, two) in pairs {
                let p = x * *one + y * *two;
                *two -= p * q;
                *one -= p;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(mut list: Vec<Complex<f64>>) -> Vec<Complex<f64>> {
        list.sort_by(|a, b| (a.re, a.im).partial_cmp(&(b.re, b.im)).unwrap());
        list
    }

    #[test]
    fn agree_with_another_iteration() {
        for n in 1..=24 {
            let a = DMatrix::from_fn(n, n, |i, j| {
                ((1 + i * 7 + j * 13 + i * j * 5) as f64 * 0.731).sin() * 1.3
            });
            let ours = sorted(eigenvalues(&a).unwrap());
            let theirs = sorted(a.complex_eigenvalues().iter().copied().collect());
            for (x, y) in ours.iter().zip(&theirs) {
                assert!((x - y).norm() < 1e-11, "n = {n}: {x} and {y}");
            }
        }
    }

    #[test]
    fn shifts_that_stall_are_left() {
        // The companion matrix of z^4 = 1 is orthogonal: plain shifts turn it round for ever.
        let a = DMatrix::from_fn(4, 4, |i, j| f64::from((i + 1) % 4 == j));
        let list = eigenvalues(&a).unwrap();
        assert!(list.iter().all(|z| (z.powi(4) - 1.0).norm() < 1e-13));
        assert!(list.iter().map(|z| z.re).sum::<f64>().abs() < 1e-14);
        assert_eq!(eigenvalues(&DMatrix::zeros(5, 5)).unwrap().len(), 5);
    }
}
