//! Order tracks: amplitudes of orders over whole revolutions.
//!
//! Samples are uniform in phase. Over a window of whole revolutions in which every order turns a whole number of times, the
//! least-squares fit of mean, cosines and sines is a discrete Fourier transform: it is summed revolution by revolution, and the
//! windows add up what their revolutions have. Other orders are fitted together.

use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use std::f64::consts::TAU;

/// Orders and how they are sampled.
#[derive(Debug, Clone)]
pub struct OrderSampling {
    /// The orders.
    pub list: Vec<f64>,
    /// Samples per revolution.
    pub samples: usize,
    /// Revolutions per window.
    pub window: usize,
    /// e^(i order phase) at the samples of the first revolution: sample by sample.
    waves: Vec<Complex<f64>>,
}

/// Sums over one revolution.
#[derive(Debug, Clone)]
pub struct OrderSums {
    /// Sum of the values.
    pub plain: f64,
    /// Sum of the values times e^(i order phase), phase counted from the begin of the revolution.
    pub waves: Vec<Complex<f64>>,
}

/// Order amplitude and phase: x ~ amplitude cos(order phi + phase).
pub type Wave = (f64, f64);

impl OrderSampling {
    /// Tables for orders.
    pub fn new(list: Vec<f64>, samples: usize, window: usize) -> OrderSampling {
        let angle = |j: usize, order: f64| TAU * (order * j as f64 / samples as f64);
        let waves = (0..samples).flat_map(|j| list.iter().map(move |o| Complex::cis(angle(j, *o))));
        OrderSampling {
            waves: waves.collect(),
            list,
            samples,
            window,
        }
    }

    /// Nothing summed yet.
    pub fn sums(&self) -> OrderSums {
        OrderSums {
            plain: 0.0,
            waves: vec![Complex::default(); self.list.len()],
        }
    }

    /// Adds sample `j` of a revolution.
    #[inline]
    pub fn add(&self, j: usize, value: f64, sums: &mut OrderSums) {
        sums.plain += value;
        let count = self.list.len();
        let waves = &self.waves[j * count..(j + 1) * count];
        for (sum, wave) in sums.waves.iter_mut().zip(waves) {
            *sum += value * wave;
        }
    }

    /// Whether the fit over a window is a discrete Fourier transform.
    fn is_orthogonal(&self) -> bool {
        let turns = |o: f64| o * self.window as f64;
        let half = 0.5 * self.samples as f64;
        let is_whole = |o: &f64| (turns(*o) - turns(*o).round()).abs() < 1e-9 && *o < half;
        self.list.iter().all(is_whole)
    }

    /// Turns of an order at the begin of a revolution, 0..1.
    fn turn(order: f64, revolution: i64) -> f64 {
        let whole = order.round();
        let rest = (order - whole) * revolution as f64;
        rest - rest.floor()
    }

    /// The waves of a window of revolutions, whose first one is `first`.
    pub fn fit<'s>(
        &self,
        first: i64,
        revolutions: impl Iterator<Item = &'s OrderSums>,
    ) -> Vec<Wave> {
        let mut plain = 0.0;
        let mut sums = vec![Complex::<f64>::default(); self.list.len()];
        for (revolution, own) in (first..).zip(revolutions) {
            plain += own.plain;
            for ((sum, wave), order) in sums.iter_mut().zip(&own.waves).zip(&self.list) {
                *sum += wave * Complex::cis(TAU * OrderSampling::turn(*order, revolution));
            }
        }
        let count = (self.window * self.samples) as f64;
        if !self.is_orthogonal() {
            sums = self.solve(first, plain, &sums);
        } else {
            sums.iter_mut().for_each(|s| *s *= 2.0 / count);
        }
        // sum = c + i s, x ~ c cos + s sin = |sum| cos(order phi - arg sum).
        sums.into_iter().map(|s| (s.norm(), -s.arg())).collect()
    }

    /// Least squares of mean, cosines and sines together: cos + i sin of every order.
    fn solve(&self, first: i64, plain: f64, sums: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let count = self.list.len();
        let size = 2 * count + 1;
        let mut normal = DMatrix::<f64>::zeros(size, size);
        let mut row = DVector::<f64>::zeros(size);
        row[0] = 1.0;
        for revolution in first..first + self.window as i64 {
            for j in 0..self.samples {
                for (k, order) in self.list.iter().enumerate() {
                    let start = Complex::cis(TAU * OrderSampling::turn(*order, revolution));
                    let wave = start * self.waves[j * count + k];
                    (row[2 * k + 1], row[2 * k + 2]) = (wave.re, wave.im);
                }
                normal.ger(1.0, &row, &row, 1.0);
            }
        }
        let mut rhs = DVector::<f64>::zeros(size);
        rhs[0] = plain;
        for (k, sum) in sums.iter().enumerate() {
            (rhs[2 * k + 1], rhs[2 * k + 2]) = (sum.re, sum.im);
        }
        let solution = normal.lu().solve(&rhs);
        let solution = solution.unwrap_or_else(|| DVector::from_element(size, f64::NAN));
        let pair = |k: usize| Complex::new(solution[2 * k + 1], solution[2 * k + 2]);
        (0..count).map(pair).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sum of waves is found again, whole orders or not.
    #[test]
    fn waves_are_found_again() {
        for list in [vec![0.5, 1.0, 3.0], vec![0.5, 1.27, 3.0]] {
            let orders = OrderSampling::new(list.clone(), 32, 4);
            let signal = |phi: f64| {
                2.0 + (0.5 * phi + 0.3).cos() + 0.2 * (list[1] * phi - 1.0).cos()
                    - 0.7 * (3.0 * phi).sin()
            };
            let first = 7;
            let revolutions: Vec<OrderSums> = (first..first + 4)
                .map(|r| {
                    let mut sums = orders.sums();
                    for j in 0..32 {
                        let phi = TAU * (r as f64 + j as f64 / 32.0);
                        orders.add(j, signal(phi), &mut sums);
                    }
                    sums
                })
                .collect();
            let found = orders.fit(first, revolutions.iter());
            let wanted = [(1.0, 0.3), (0.2, -1.0), (0.7, 0.25 * TAU)];
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found.0 - wanted.0).abs() < 1e-12, "{found:?}");
                let turn = (found.1 - wanted.1) / TAU;
                assert!((turn - turn.round()).abs() < 1e-11, "{found:?}");
            }
        }
    }
}
