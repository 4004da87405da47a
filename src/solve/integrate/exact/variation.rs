//! Small deviations from the motion: the recursion without loads, for every column of the transition matrix at once.

use super::series::MotionSeries;
use crate::numeric::taylor::COUNT;
use nalgebra::DMatrix;
use pulp::{Arch, NullaryFnOnce};

/// Longest step in units of time of the series.
///
/// That unit is the reciprocal of a bound on the highest frequency: for every initial state the terms of order k are below
/// theta^k / k!, so that those left out are below rounding.
pub(crate) const REACH: f64 = LIMIT[COUNT - 1];

/// LIMIT[k]: the largest theta at which theta^k / k! is below rounding, 1e-17^(1/k) (k!)^(1/k).
const LIMIT: [f64; COUNT] = limits();

const fn limits() -> [f64; COUNT] {
    let mut list = [0.0; COUNT];
    let mut k = 1;
    while k < COUNT {
        // The root by bisection: powers are not for constants.
        let (mut low, mut high) = (0.0, 8.0);
        let mut round = 0;
        while round < 60 {
            let theta = 0.5 * (low + high);
            let (mut term, mut j) = (1.0, 1);
            while j <= k {
                term *= theta / j as f64;
                j += 1;
            }
            if term < 1e-17 {
                low = theta;
            } else {
                high = theta;
            }
            round += 1;
        }
        list[k] = low;
        k += 1;
    }
    list
}

/// Work space: the latest terms and their sums, coordinate by coordinate, a column of the matrix beside the other. Rows are as
/// long as the processor's registers allow: what is behind the last column is zero.
#[derive(Debug, Clone, Default)]
pub(crate) struct VariationWorkspace {
    /// Length of a row.
    width: usize,
    now: Vec<f64>,
    rate: Vec<f64>,
    next: Vec<f64>,
    value: Vec<f64>,
    slope: Vec<f64>,
    /// Rows of the memory, which do not change within a step.
    memory: Vec<f64>,
}

/// Rows are multiples of this.
const LANES: usize = 4;

impl VariationWorkspace {
    /// For 2n columns, and one more for every number that laws remember.
    pub fn new(dof: usize, memory: usize) -> VariationWorkspace {
        let width = (2 * dof + memory).next_multiple_of(LANES);
        let zero = vec![0.0; dof * width];
        VariationWorkspace {
            width,
            memory: vec![0.0; memory * width],
            now: zero.clone(),
            rate: zero.clone(),
            next: zero.clone(),
            value: zero.clone(),
            slope: zero,
        }
    }

    /// Phi <- exp(A theta) Phi with the stiffness of the series' current regions.
    ///
    /// ```text
    /// (k + 1) r_{k+2} = -theta (h Gam r_{k+1} + h^2 kappa s W a_k + [k = 0] h^2 kappa df/dz z),   a_k = theta r_k / k
    /// ```
    ///
    /// a_k: terms of the coordinates, r_k: terms of their rates.
    pub fn advance(&mut self, series: &MotionSeries, phi: &mut DMatrix<f64>, theta: f64) {
        match phi.nrows() {
            _ if !self.memory.is_empty() => self.sparse(series, phi, theta),
            2 => small::<1, 2>(series, phi, theta),
            4 => Arch::new().dispatch(Small::<2, 4> { series, phi, theta }),
            6 => Arch::new().dispatch(Small::<3, 6> { series, phi, theta }),
            8 => Arch::new().dispatch(Small::<4, 8> { series, phi, theta }),
            _ => self.sparse(series, phi, theta),
        }
    }

    fn sparse(&mut self, series: &MotionSeries, phi: &mut DMatrix<f64>, theta: f64) {
        // Whatever instructions the processor has: products and sums are the same.
        Arch::new().dispatch(VariationStep {
            variation: self,
            series,
            phi,
            theta,
        });
    }

    /// M: length of a row, or 0 for any.
    #[inline(always)]
    fn rows<const M: usize>(&mut self, series: &MotionSeries, phi: &mut DMatrix<f64>, theta: f64) {
        let columns = if M > 0 { M } else { self.width };
        let n = series.q.len();
        for (j, column) in phi.column_iter().enumerate() {
            for (m, z) in column.iter().skip(2 * n).enumerate() {
                self.memory[m * columns + j] = *z;
            }
            for i in 0..n {
                self.now[i * columns + j] = column[i];
                self.rate[i * columns + j] = column[n + i] * series.unit;
            }
        }
        self.value.copy_from_slice(&self.now);
        self.slope.copy_from_slice(&self.rate);
        add(&mut self.value, theta, &self.rate);
        let row = |i: usize| i * columns..(i + 1) * columns;
        for k in 0..terms(theta / series.pace()) - 2 {
            let factor = -theta / (k + 1) as f64;
            self.next.fill(0.0);
            let parts = [(&series.damping, &self.rate), (&series.coupled, &self.now)];
            for (matrix, terms) in parts {
                for entry in matrix.entries() {
                    let part = &terms[row(entry.column)];
                    add_terms::<M>(&mut self.next[row(entry.row)], factor * entry.value, part);
                }
            }
            if k == 0 {
                for m in &series.memories {
                    let z = &self.memory[row(m.column)];
                    add(&mut self.next[row(m.row)], factor * m.value, z);
                }
            }
            let (inverse, share) = (theta / (k + 2) as f64, theta / (k + 1) as f64);
            for i in 0..n {
                let next = &self.next[row(i)];
                add_terms::<M>(&mut self.slope[row(i)], 1.0, next);
                add_terms::<M>(&mut self.value[row(i)], inverse, next);
                // a_{k+1} from r_{k+1}
                scale_terms::<M>(&mut self.now[row(i)], share, &self.rate[row(i)]);
            }
            std::mem::swap(&mut self.rate, &mut self.next);
        }
        for (j, mut column) in phi.column_iter_mut().enumerate() {
            for i in 0..n {
                column[i] = self.value[i * columns + j];
                column[n + i] = self.slope[i * columns + j] / series.unit;
            }
        }
    }
}

/// A step as the processor takes it.
struct VariationStep<'a> {
    variation: &'a mut VariationWorkspace,
    series: &'a MotionSeries,
    phi: &'a mut DMatrix<f64>,
    theta: f64,
}

impl NullaryFnOnce for VariationStep<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let VariationStep {
            variation,
            series,
            phi,
            theta,
        } = self;
        // Rows of known length, which the compiler unrolls, as long as they are short.
        match variation.width {
            4 => variation.rows::<4>(series, phi, theta),
            8 => variation.rows::<8>(series, phi, theta),
            12 => variation.rows::<12>(series, phi, theta),
            16 => variation.rows::<16>(series, phi, theta),
            _ => variation.rows::<0>(series, phi, theta),
        }
    }
}

/// The same for N coordinates; M = 2 N.
struct Small<'a, const N: usize, const M: usize> {
    series: &'a MotionSeries,
    phi: &'a mut DMatrix<f64>,
    theta: f64,
}

impl<const N: usize, const M: usize> NullaryFnOnce for Small<'_, N, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        small::<N, M>(self.series, self.phi, self.theta);
    }
}

/// One row more; M: its length, or 0 for any.
#[inline(always)]
fn add_terms<const M: usize>(sum: &mut [f64], factor: f64, part: &[f64]) {
    if let (Ok(sum), Ok(part)) = (
        <&mut [f64; M]>::try_from(&mut *sum),
        <&[f64; M]>::try_from(part),
    ) {
        return add_row(sum, factor, part);
    }
    add(sum, factor, part);
}

/// One row from another; M: its length, or 0 for any.
#[inline(always)]
fn scale_terms<const M: usize>(row: &mut [f64], factor: f64, part: &[f64]) {
    if let (Ok(row), Ok(part)) = (
        <&mut [f64; M]>::try_from(&mut *row),
        <&[f64; M]>::try_from(part),
    ) {
        for j in 0..M {
            row[j] = factor * part[j];
        }
        return;
    }
    (row.iter_mut().zip(part)).for_each(|(r, p)| *r = factor * p);
}

/// Terms that a step needs: the first rate left out is as small as the term before it.
pub fn terms(theta: f64) -> usize {
    let negligible = LIMIT.iter().position(|limit| theta < *limit);
    negligible.map_or(COUNT, |k| (k + 1).clamp(2, COUNT))
}

#[inline(always)]
fn add(sum: &mut [f64], factor: f64, part: &[f64]) {
    sum.iter_mut().zip(part).for_each(|(s, p)| *s += factor * p);
}

/// The same for rows of known length, which the compiler unrolls.
#[inline(always)]
fn add_row<const M: usize>(sum: &mut [f64; M], factor: f64, part: &[f64; M]) {
    for j in 0..M {
        sum[j] += factor * part[j];
    }
}

/// A step for N coordinates in arrays that the compiler can unroll; M = 2 N.
#[inline(always)]
fn small<const N: usize, const M: usize>(
    series: &MotionSeries,
    phi: &mut DMatrix<f64>,
    theta: f64,
) {
    let damping: [[f64; N]; N] = series.damping.rows();
    let stiffness: [[f64; N]; N] = series.coupled.rows();
    let mut now: [[f64; M]; N] = std::array::from_fn(|i| std::array::from_fn(|j| phi[(i, j)]));
    let mut rate: [[f64; M]; N] =
        std::array::from_fn(|i| std::array::from_fn(|j| phi[(N + i, j)] * series.unit));
    let (mut value, mut slope) = (now, rate);
    for i in 0..N {
        add_row(&mut value[i], theta, &rate[i]);
    }
    for k in 0..terms(theta / series.pace()) - 2 {
        let factor = -theta / (k + 1) as f64;
        let mut next = [[0.0; M]; N];
        for i in 0..N {
            for j in 0..N {
                add_row(&mut next[i], factor * damping[i][j], &rate[j]);
                add_row(&mut next[i], factor * stiffness[i][j], &now[j]);
            }
            add_row(&mut slope[i], 1.0, &next[i]);
            add_row(&mut value[i], theta / (k + 2) as f64, &next[i]);
        }
        // a_{k+1} from r_{k+1}
        let share = theta / (k + 1) as f64;
        for i in 0..N {
            for j in 0..M {
                now[i][j] = share * rate[i][j];
            }
        }
        rate = next;
    }
    for j in 0..M {
        for i in 0..N {
            phi[(i, j)] = value[i][j];
            phi[(N + i, j)] = slope[i][j] / series.unit;
        }
    }
}
