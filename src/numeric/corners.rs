//! Spectra and samples of periodic functions in closed form: tables and steps have corners that no grid of samples meets.
//!
//! A function of straight pieces with jumps d_j of its value and s_j of its slope at the corners phi_j has the coefficients
//!
//! ```text
//! X_l = 1/(2 pi) sum_j e^(-i l phi_j) [d_j / (i l) + s_j / (i l)^2],    l >= 1
//! ```
//!
//! of e^(i l phase): nothing is sampled, so nothing aliases.

use super::periodic::{Harmonic, Periodic};
use num_complex::Complex;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// A straight piece between two corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    /// Phase at its begin, in [0, 2 pi).
    pub begin: f64,
    /// Length.
    pub width: f64,
    /// Value in its middle.
    pub value: f64,
    /// Derivative with respect to the phase.
    pub slope: f64,
}

impl Periodic {
    /// Highest order of a Fourier series; `None` for tables and steps, which have no highest order.
    pub fn highest_order(&self) -> Option<usize> {
        match self {
            Periodic::Fourier { harmonics, .. } => harmonics.iter().map(|h| h.order).max(),
            Periodic::Table { .. } | Periodic::Uneven { .. } | Periodic::Rectangular { .. } => None,
        }
    }

    /// The straight pieces of tables and steps by ascending phase; empty for a Fourier series.
    pub(crate) fn pieces(&self) -> Vec<Piece> {
        let corners = self.kinks();
        let ends = corners.iter().skip(1).copied();
        let ends = ends.chain(corners.first().map(|phase| phase + TAU));
        let piece = |(begin, end): (&f64, f64)| {
            let middle = 0.5 * (begin + end);
            Piece {
                begin: *begin,
                width: end - begin,
                value: self.value(middle),
                slope: self.derivative(middle),
            }
        };
        corners.iter().zip(ends).map(piece).collect()
    }

    /// Fourier coefficients in tau of the function at phase nu tau: mean, sin 1, cos 1, ... as many as `out` holds.
    pub fn coefficients(&self, nu: usize, out: &mut [f64]) {
        out.fill(0.0);
        out[0] = self.mean();
        let last = (out.len() - 1) / 2;
        let mut add = |order: usize, sin: f64, cos: f64| {
            out[2 * nu * order - 1] += sin;
            out[2 * nu * order] += cos;
        };
        if let Periodic::Fourier { harmonics, .. } = self {
            for h in harmonics.iter().filter(|h| nu * h.order <= last) {
                add(h.order, h.sin, h.cos);
            }
            return;
        }
        let pieces = self.pieces();
        for order in 1..=last / nu {
            let x = spectrum(&pieces, order);
            add(order, -2.0 * x.im, 2.0 * x.re);
        }
    }

    /// The same function made of harmonics: all of a series; of a table twice as many as it has corners, within `orders`.
    pub fn harmonics(&self, orders: RangeInclusive<usize>) -> Vec<Harmonic> {
        if let Periodic::Fourier { harmonics, .. } = self {
            return harmonics.clone();
        }
        let (least, most) = orders.into_inner();
        let turns = self.turns();
        let last = (2 * self.kinks().len() / turns).clamp(least, most);
        let mut coefficients = vec![0.0; 2 * last * turns + 1];
        self.coefficients(1, &mut coefficients);
        let harmonics = (1..=last).map(|k| Harmonic {
            order: k * turns,
            cos: coefficients[2 * k * turns],
            sin: coefficients[2 * k * turns - 1],
        });
        harmonics.collect()
    }

    /// The antiderivative of what varies, with mean 0, made of these harmonics.
    pub(crate) fn antiderivative(&self, orders: RangeInclusive<usize>) -> Periodic {
        let mut harmonics = self.harmonics(orders);
        for h in &mut harmonics {
            let order = h.order as f64;
            (h.cos, h.sin) = (-h.sin / order, h.cos / order);
        }
        let mean = 0.0;
        Periodic::Fourier { mean, harmonics }
    }

    /// The same of the derivative with respect to the phase.
    pub(crate) fn derivative_coefficients(&self, nu: usize, out: &mut [f64]) {
        self.coefficients(nu, out);
        out[0] = 0.0;
        for (k, pair) in out[1..].chunks_exact_mut(2).enumerate() {
            let order = (k + 1) as f64 / nu as f64;
            (pair[0], pair[1]) = (-order * pair[1], order * pair[0]);
        }
    }

    /// Mean squares of what the orders above `order` add to the function and to its derivative with respect to the phase,
    /// steps left out of the derivative.
    pub(crate) fn squares_above(&self, order: usize) -> [f64; 2] {
        if let Periodic::Fourier { harmonics, .. } = self {
            return squares_of_harmonics(harmonics, order);
        }
        let (mean, mut squares) = (self.mean(), [0.0; 2]);
        let pieces = self.pieces();
        for p in &pieces {
            let share = p.width / TAU;
            squares[0] += share * ((p.value - mean).powi(2) + (p.slope * p.width).powi(2) / 12.0);
            squares[1] += share * p.slope * p.slope;
        }
        for l in 1..=order {
            let square = 2.0 * spectrum(&pieces, l).norm_sqr();
            squares[0] -= square;
            squares[1] -= square * (l * l) as f64;
        }
        squares.map(|square| square.max(0.0))
    }

    /// Values at `count` equally spaced tau of one response period, as weights of samples: with those of `of`(value) the
    /// trapezoidal rule integrates `of`(value) times a straight line between two samples exactly, wherever steps lie.
    pub fn weights(&self, nu: usize, count: usize, of: impl Fn(f64) -> f64) -> Vec<f64> {
        match self {
            Periodic::Rectangular { .. } => averages(&self.pieces(), (nu, count), |p| of(p.value)),
            _ => at_samples(nu, count, |phase| of(self.value(phase))),
        }
    }

    /// The same of the derivative with respect to the phase, which steps where a table has corners.
    pub(crate) fn derivative_weights(&self, nu: usize, count: usize) -> Vec<f64> {
        match self {
            Periodic::Table { .. } | Periodic::Uneven { .. } => {
                averages(&self.pieces(), (nu, count), |p| p.slope)
            }
            _ => at_samples(nu, count, |phase| self.derivative(phase)),
        }
    }
}

/// Coefficient of e^(i order phase).
fn spectrum(pieces: &[Piece], order: usize) -> Complex<f64> {
    let l = order as f64;
    let mut sum = Complex::default();
    let Some(mut before) = pieces.last() else {
        return sum;
    };
    for piece in pieces {
        let end = before.value + 0.5 * before.slope * before.width;
        let jump = piece.value - 0.5 * piece.slope * piece.width - end;
        let bend = piece.slope - before.slope;
        sum += Complex::cis(-l * piece.begin) * Complex::new(-bend / (l * l), -jump / l);
        before = piece;
    }
    sum / TAU
}

/// Harmonics of one order add up before they are squared.
fn squares_of_harmonics(harmonics: &[Harmonic], order: usize) -> [f64; 2] {
    let mut squares = [0.0; 2];
    for (k, h) in harmonics.iter().enumerate() {
        let is_first = harmonics[..k].iter().all(|other| other.order != h.order);
        if h.order <= order || !is_first {
            continue;
        }
        let same = harmonics[k..].iter().filter(|o| o.order == h.order);
        let (sin, cos) = same.fold((0.0, 0.0), |sum, h| (sum.0 + h.sin, sum.1 + h.cos));
        let square = 0.5 * (sin * sin + cos * cos);
        squares[0] += square;
        squares[1] += square * (h.order * h.order) as f64;
    }
    squares
}

fn at_samples(nu: usize, count: usize, value: impl Fn(f64) -> f64) -> Vec<f64> {
    let phase = |j: usize| TAU * (nu * j) as f64 / count as f64;
    (0..count).map(|j| value(phase(j))).collect()
}

/// Integrals of a function that is constant on every piece against the hats that are 1 at one sample and 0 at its neighbours,
/// over the distance h of two samples. A unit step at (j + theta) h gives (1 - theta)^2 / 2 at sample j and 1 - theta^2 / 2 at
/// j + 1.
fn averages(
    pieces: &[Piece],
    (nu, count): (usize, usize),
    value: impl Fn(&Piece) -> f64,
) -> Vec<f64> {
    let place = |m: usize, p: &Piece| (p.begin / TAU + m as f64) / nu as f64 * count as f64;
    let copies = (0..nu).flat_map(|m| pieces.iter().map(move |p| (m, p)));
    let steps: Vec<(f64, f64)> = copies.map(|(m, p)| (place(m, p), value(p))).collect();
    let last = steps.last().map_or(0.0, |s| s.1);
    let mut list = vec![last; count];
    let ends = steps.iter().skip(1).map(|s| s.0);
    for ((begin, value), end) in steps.iter().zip(ends.chain([count as f64])) {
        let samples = (begin.ceil() as usize).min(count)..(end.ceil() as usize).min(count);
        list[samples].fill(*value);
    }
    let mut before = last;
    for (place, value) in &steps {
        let (jump, theta) = (value - before, place.fract());
        let j = *place as usize;
        // A sample on the step already has the value behind it.
        let has_value = if theta == 0.0 { 1.0 } else { 0.0 };
        list[j % count] += jump * (0.5 * (1.0 - theta).powi(2) - has_value);
        list[(j + 1) % count] -= jump * 0.5 * theta * theta;
        before = *value;
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::fourier::Fourier;

    fn table() -> Periodic {
        Periodic::Table {
            values: vec![1.3, 0.2, -0.7, 0.9, 0.4],
            base_order: 3,
        }
    }

    fn steps() -> Periodic {
        Periodic::Rectangular {
            high: 1.5,
            low: 0.4,
            duty: 0.3,
            phase: 0.7,
            base_order: 2,
        }
    }

    /// An uneven table over the places of an even one, with a corner more on a straight piece.
    #[test]
    fn an_uneven_table_has_the_spectrum_of_its_even_twin() {
        let even = Periodic::Table {
            values: vec![1.0, 3.0, 2.0, 0.5],
            base_order: 2,
        };
        let uneven = Periodic::Uneven {
            places: vec![0.25, 0.35, 0.5, 0.75],
            values: vec![3.0, 2.6, 2.0, 0.5],
            base_order: 2,
        };
        let uneven_at = |x: f64| uneven.value(x);
        assert!((uneven_at(0.0) - 1.75).abs() < 1e-15);
        let closed = Periodic::Uneven {
            places: vec![0.0, 0.25, 0.35, 0.5, 0.75],
            values: vec![1.0, 3.0, 2.6, 2.0, 0.5],
            base_order: 2,
        };
        let (mut a, mut b) = (vec![0.0; 41], vec![0.0; 41]);
        even.coefficients(1, &mut a);
        closed.coefficients(1, &mut b);
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
        assert_eq!(even.mean(), closed.mean());
        for k in 0..50 {
            let x = 0.37 * k as f64;
            assert!((even.value(x) - closed.value(x)).abs() < 1e-13);
            assert!((even.derivative(x) - closed.derivative(x)).abs() < 1e-12);
        }
    }

    /// Samples alias like 1/m^2 at a corner: Richardson's extrapolation is good to 1e-10 and better.
    #[test]
    fn coefficients_are_the_limit_of_samples() {
        let sampled = |samples: usize, nu: usize| {
            let mut out = vec![0.0; 81];
            let values = at_samples(nu, samples, |phase| table().value(phase));
            Fourier::new(samples).to_coefficients(&values, &mut out);
            out
        };
        for nu in [1, 2] {
            let (coarse, fine) = (sampled(15 * 512, nu), sampled(15 * 1024, nu));
            let mut exact = vec![0.0; 81];
            table().coefficients(nu, &mut exact);
            for (k, e) in exact.iter().enumerate() {
                let limit = (4.0 * fine[k] - coarse[k]) / 3.0;
                assert!((limit - e).abs() < 1e-9, "{k}: {limit} {e}");
            }
        }
    }

    #[test]
    fn orders_below_and_above_make_up_the_whole() {
        for series in [table(), steps()] {
            let mean_square = |samples: usize| {
                let values = at_samples(1, samples, |x| (series.value(x) - series.mean()).powi(2));
                values.iter().sum::<f64>() / samples as f64
            };
            let whole = series.squares_above(0);
            assert!((whole[0] / mean_square(1 << 18) - 1.0).abs() < 1e-4);
            let mut a = vec![0.0; 61];
            series.coefficients(1, &mut a);
            let below = 0.5 * a[1..].iter().map(|a| a * a).sum::<f64>();
            let above = series.squares_above(30)[0];
            assert!((below + above - whole[0]).abs() < 1e-14);
        }
    }

    /// Against a wave the weights of steps err like 1/m^2, plain values like 1/m.
    #[test]
    fn weights_of_steps_are_of_second_order() {
        let mut exact = vec![0.0; 9];
        for nu in [1, 2] {
            steps().coefficients(nu, &mut exact);
            let gap = |samples: usize| {
                let mut out = vec![0.0; 9];
                let weights = steps().weights(nu, samples, |x| x);
                Fourier::new(samples).to_coefficients(&weights, &mut out);
                let gaps = out.iter().zip(&exact).map(|(a, b)| (a - b).abs());
                gaps.fold(0.0, f64::max)
            };
            let [coarse, fine] = [128, 1024].map(gap);
            assert!(coarse < 2e-3 && fine < coarse / 50.0, "{coarse:e} {fine:e}");
        }
    }
}
