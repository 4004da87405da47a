//! Small deviations from the motion where the slopes of forces change in time: their series, all columns at once.

use super::acting::Acting;
use super::decay::SeriesControl;
use super::entries::MatrixEntry;
use super::regions::Regions;
use super::series::MotionSeries;
use crate::numeric::roots::root_below;
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::system::System;
use nalgebra::DMatrix;

/// Series of the columns of a transition matrix.
///
/// ```text
/// (k + 2)(k + 1) a_{k+2} = -h Gam (k + 1) a_{k+1} - h^2 kappa (slope W a_k + sum_j A_j W a_{k-j} + B_j W r_{k-j})
/// ```
///
/// A, B: series of s df/dx and s df/dv along the motion; r: rates of a in omega_c t. A memory with a rate has deviations of its own, c:
///
/// ```text
/// force + sum_j C_j c_{k-j},    (k + 1) c_{k+1} = h sum_j (G_j W a_{k-j} + H_j W r_{k-j} + I_j c_{k-j})
/// ```
#[derive(Debug, Clone, Default)]
pub(crate) struct Deviations {
    columns: usize,
    /// terms[(k * n + i) * columns + j]: coefficient k of coordinate i in column j.
    terms: Vec<f64>,
    /// Deformations, their rates and deviations of the memory, order by order, of one acting connection behind the other.
    motions: Vec<f64>,
    /// Rows of the memory, which do not change within a step.
    memory: Vec<f64>,
    /// Coefficient of the force of one acting connection, column by column.
    force: Vec<f64>,
    count: usize,
}

impl Deviations {
    /// Makes the series from a transition matrix; largest theta at which they hold.
    pub(crate) fn expand(
        &mut self,
        system: &System,
        (series, acting, regions): (&MotionSeries, &Acting, &Regions),
        phi: &DMatrix<f64>,
    ) -> f64 {
        let (n, columns) = (system.dof(), phi.ncols());
        self.columns = columns;
        self.memory.clear();
        for m in 2 * n..phi.nrows() {
            self.memory.extend(phi.row(m).iter());
        }
        self.count = series.count;
        self.terms.resize(COUNT * n * columns, 0.0);
        self.force.resize(columns, 0.0);
        self.motions
            .resize(acting.list.len() * 3 * COUNT * columns, 0.0);
        for (place, part) in acting.list.iter().enumerate() {
            if let Some(m) = regions.parts()[*part]
                .memory
                .filter(|_| acting.evolves(*part))
            {
                let memory = &mut self.motions[(place * 3 + 2) * COUNT * columns..];
                memory[..columns].copy_from_slice(&self.memory[m * columns..(m + 1) * columns]);
            }
        }
        for i in 0..n {
            for j in 0..columns {
                self.terms[i * columns + j] = phi[(i, j)];
                self.terms[(n + i) * columns + j] = phi[(n + i, j)] * series.unit;
            }
        }
        for k in 0..self.count - 2 {
            self.step(system, series, acting, k);
        }
        self.reach(n, series.control, acting)
    }

    /// Coefficient k + 2 of all coordinates in all columns.
    fn step(&mut self, system: &System, series: &MotionSeries, acting: &Acting, k: usize) {
        let (n, columns) = (system.dof(), self.columns);
        let (known, next) = self.terms.split_at_mut((k + 2) * n * columns);
        let next = &mut next[..n * columns];
        next.fill(0.0);
        let order = (k + 1) as f64;
        let row = |k: usize, i: usize| (k * n + i) * columns..(k * n + i + 1) * columns;
        let out = |i: usize| i * columns..(i + 1) * columns;
        for MatrixEntry {
            row: i,
            column,
            value,
        } in series.damping.entries()
        {
            add(
                &mut next[out(*i)],
                -value * order,
                &known[row(k + 1, *column)],
            );
        }
        for MatrixEntry {
            row: i,
            column,
            value,
        } in series.coupled.entries()
        {
            add(&mut next[out(*i)], -value, &known[row(k, *column)]);
        }
        if k == 0 {
            for m in &series.memories {
                let row = m.column * columns..(m.column + 1) * columns;
                add(&mut next[out(m.row)], -m.value, &self.memory[row]);
            }
        }
        let square = series.unit * series.unit;
        for (place, part) in acting.list.iter().enumerate() {
            let e = acting.connection(*part);
            let motions = &mut self.motions[place * 3 * COUNT * columns..][..3 * COUNT * columns];
            let (x, rest) = motions.split_at_mut(COUNT * columns);
            let (rate, memory) = rest.split_at_mut(COUNT * columns);
            let here = k * columns..(k + 1) * columns;
            x[here.clone()].fill(0.0);
            rate[here.clone()].fill(0.0);
            for (i, w) in system.element_map_row(e) {
                add(&mut x[here.clone()], *w, &known[row(k, *i)]);
                let factor = w * order / series.unit;
                add(&mut rate[here.clone()], factor, &known[row(k + 1, *i)]);
            }
            let (force_by, rate_by) = acting.partials(*part).split_at(3);
            let evolves = acting.evolves(*part);
            self.force.fill(0.0);
            let counted = if evolves { 3 } else { 2 };
            let motions = [&*x, &*rate, &*memory];
            for (partial, motion) in force_by.iter().zip(motions).take(counted) {
                convolve(&mut self.force, partial, motion, k);
            }
            if evolves {
                let (known, next) = memory.split_at_mut((k + 1) * columns);
                let next = &mut next[..columns];
                next.fill(0.0);
                for (partial, motion) in rate_by.iter().zip([&*x, &*rate, &*known]) {
                    convolve(next, partial, motion, k);
                }
                let factor = series.unit / order;
                next.iter_mut().for_each(|c| *c *= factor);
            }
            for (i, kappa) in series.column(system, e) {
                add(&mut next[out(*i)], -square * kappa, &self.force);
            }
        }
        let factor = 1.0 / (order * (k + 2) as f64);
        next.iter_mut().for_each(|a| *a *= factor);
    }

    /// Largest theta at which the last two terms, as rates, are negligible.
    fn reach(&self, n: usize, control: SeriesControl, acting: &Acting) -> f64 {
        let block = n * self.columns;
        let largest = |terms: &[f64]| terms.iter().fold(f64::MIN_POSITIVE, |m, c| m.max(c.abs()));
        let values = largest(&self.terms[..block]);
        let rates = largest(&self.terms[block..2 * block]);
        let last = largest(&self.terms[(self.count - 2) * block..self.count * block]);
        // A memory counts as a rate does.
        let (mut rates, mut last) = (rates, last);
        for (place, _) in self.evolving(acting) {
            let memory = &self.motions[(place * 3 + 2) * COUNT * self.columns..];
            rates = rates.max(largest(&memory[..self.columns]));
            let behind = (self.count - 3) * self.columns..(self.count - 1) * self.columns;
            last = last.max(largest(&memory[behind]));
        }
        let size = rates.max(control.share * values);
        let ratio = control.tolerance * size / ((self.count - 1) as f64 * last);
        let power = match ratio < 1.0 {
            true => self.count - 3,
            false => self.count - 2,
        };
        root_below(ratio, 1.0 / power as f64)
    }

    /// Acting parts whose memory has a rate: their places in the list, and their numbers.
    fn evolving<'a>(&self, acting: &'a Acting) -> impl Iterator<Item = (usize, usize)> + use<'a> {
        let list = acting.list.iter().copied().enumerate();
        list.filter(|(_, part)| acting.evolves(*part))
    }

    /// The transition matrix at theta.
    pub fn evaluate(
        &self,
        phi: &mut DMatrix<f64>,
        (acting, regions): (&Acting, &Regions),
        (n, theta, unit): (usize, f64, f64),
    ) {
        let columns = self.columns;
        for (place, part) in self.evolving(acting) {
            let Some(m) = regions.parts()[part].memory else {
                continue;
            };
            let memory = &self.motions[(place * 3 + 2) * COUNT * columns..];
            for j in 0..columns {
                let terms = (0..self.count - 1).rev();
                phi[(2 * n + m, j)] =
                    terms.fold(0.0, |sum, k| sum * theta + memory[k * columns + j]);
            }
        }
        for i in 0..n {
            for j in 0..columns {
                let (mut value, mut slope) = (0.0, 0.0);
                for k in (0..self.count).rev() {
                    slope = slope * theta + value;
                    value = value * theta + self.terms[(k * n + i) * columns + j];
                }
                phi[(i, j)] = value;
                phi[(n + i, j)] = slope / unit;
            }
        }
    }
}

/// out += sum_j partial_j motion_(k-j), a row of columns each.
fn convolve(out: &mut [f64], partial: &Polynomial, motion: &[f64], k: usize) {
    let columns = out.len();
    for (j, p) in partial[..=k].iter().enumerate() {
        if *p != 0.0 {
            let row = &motion[(k - j) * columns..(k - j + 1) * columns];
            add(out, *p, row);
        }
    }
}

#[inline]
fn add(sum: &mut [f64], factor: f64, part: &[f64]) {
    sum.iter_mut().zip(part).for_each(|(s, p)| *s += factor * p);
}
