//! The first passage of a polynomial through a level, none missed.

use crate::numeric::roots::newton_bracketed;

/// Highest degree of a polynomial.
pub const MAX_DEGREE: usize = 31;

/// Halves of [0, 1] below this width are not divided: what happens there is a touch within rounding.
const NARROWEST: f64 = 1e-15;

type Coefficients = [f64; MAX_DEGREE + 1];

/// Which way a level is passed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From below to above.
    Up,
    /// From above to below.
    Down,
}

impl Direction {
    /// +1 or -1.
    pub fn sign(self) -> f64 {
        match self {
            Direction::Up => 1.0,
            Direction::Down => -1.0,
        }
    }
}

/// First x in (0, 1] where a polynomial passes `level` in `direction` by more than `tolerance`.
///
/// `coefficients` belong to the powers of x, at most [`MAX_DEGREE`] + 1 of them. The polynomial is taken to start on the
/// near side: a start on the level, or beyond it by rounding, does not fire. A touch that goes less than `tolerance`
/// beyond the level is no passage.
pub fn first_passage(
    coefficients: &[f64],
    level: f64,
    direction: Direction,
    tolerance: f64,
) -> Option<f64> {
    let mut beyond: Coefficients = [0.0; MAX_DEGREE + 1];
    for (b, c) in beyond.iter_mut().zip(coefficients) {
        *b = direction.sign() * c;
    }
    beyond[0] = (beyond[0] - direction.sign() * level).min(0.0) - tolerance;
    first_rise(&beyond[..coefficients.len()])
}

/// First x in [0, 1] where a polynomial becomes positive.
///
/// In Bernstein form the polynomial lies in the hull of its coefficients and has no more roots than they have changes of
/// sign: no change decides at once, one change brackets a simple root, more are divided by de Casteljau's scheme.
pub fn first_rise(coefficients: &[f64]) -> Option<f64> {
    let mut bernstein: Coefficients = [0.0; MAX_DEGREE + 1];
    let count = coefficients.len();
    for (i, b) in bernstein.iter_mut().enumerate().take(count) {
        // C(i, k) / C(m, k), m = count - 1
        let mut weight = 1.0;
        for (k, c) in coefficients.iter().enumerate().take(i + 1) {
            *b += weight * c;
            weight *= (i - k) as f64 / (count - 1 - k).max(1) as f64;
        }
    }
    search(&bernstein[..count], 0.0, 1.0, coefficients)
}

fn search(b: &[f64], left: f64, width: f64, coefficients: &[f64]) -> Option<f64> {
    if b.iter().all(|b| *b <= 0.0) {
        return None;
    }
    let signs = b.iter().filter(|b| **b != 0.0).map(|b| *b > 0.0);
    let (mut changes, mut previous, mut first) = (0, None, true);
    for sign in signs {
        match previous {
            Some(p) if p != sign => changes += 1,
            None => first = sign,
            _ => {}
        }
        previous = Some(sign);
    }
    if first {
        return Some(left);
    }
    if changes == 1 {
        let value = |x: f64| evaluate(coefficients, x);
        return Some(newton_bracketed(value, (left, -1.0), left + width));
    }
    if width < NARROWEST {
        return (b[b.len() - 1] > 0.0).then_some(left + width);
    }
    let (mut low, mut high): (Coefficients, Coefficients) =
        ([0.0; MAX_DEGREE + 1], [0.0; MAX_DEGREE + 1]);
    let count = b.len();
    high[..count].copy_from_slice(b);
    for (k, first) in low.iter_mut().enumerate().take(count) {
        *first = high[0];
        for i in 0..count - 1 - k {
            high[i] = 0.5 * (high[i] + high[i + 1]);
        }
    }
    let half = 0.5 * width;
    search(&low[..count], left, half, coefficients)
        .or_else(|| search(&high[..count], left + half, half, coefficients))
}

/// Value and derivative.
fn evaluate(coefficients: &[f64], x: f64) -> (f64, f64) {
    coefficients
        .iter()
        .rev()
        .fold((0.0, 0.0), |(value, slope), c| {
            (value * x + c, slope * x + value)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Product of (x - root), times a factor.
    fn from_roots(factor: f64, roots: &[f64]) -> Vec<f64> {
        let mut c = vec![factor];
        for root in roots {
            c.insert(0, 0.0);
            for k in 0..c.len() - 1 {
                c[k] -= root * c[k + 1];
            }
        }
        c
    }

    #[test]
    fn first_of_several() {
        let c = from_roots(-1.0, &[0.3, 0.300001, 0.8, 0.9, 1.7]);
        // positive from the start
        assert_eq!(first_rise(&c), Some(0.0));
        let c = from_roots(1.0, &[0.3, 0.300001, 0.8, 0.9, 1.7]);
        assert!((first_rise(&c).unwrap() - 0.3).abs() < 1e-9);
    }

    #[test]
    fn two_close_passages_and_a_near_miss() {
        for depth in [1e-3, 1e-6, 1e-10] {
            // depth - (x - 0.4)^2
            let hit = [depth - 0.16, 0.8, -1.0, 0.0, 0.0, 0.0];
            let x = first_rise(&hit).unwrap();
            assert!((x - (0.4 - f64::sqrt(depth))).abs() < 1e-10, "{depth}: {x}");
            let miss = [-depth - 0.16, 0.8, -1.0, 0.0, 0.0, 0.0];
            assert_eq!(first_rise(&miss), None, "{depth}");
        }
    }

    #[test]
    fn start_on_the_level_does_not_fire() {
        let level = 0.7;
        let inwards = [level + 1e-17, -1.0, 0.2];
        assert_eq!(first_passage(&inwards, level, Direction::Up, 1e-15), None);
        // leaves downwards, comes back and passes at x = 0.5
        let back = [level, -1.0, 2.0];
        let x = first_passage(&back, level, Direction::Up, 1e-15).unwrap();
        assert!((x - 0.5).abs() < 1e-14);
        let down = [level, 1.0, -2.0];
        assert_eq!(first_passage(&down, level, Direction::Down, 1e-15), Some(x));
    }

    #[test]
    fn high_degree() {
        let roots: Vec<f64> = (0..12).map(|k| 0.05 + 0.08 * k as f64).collect();
        let c = from_roots(-1.0, &roots);
        let x = first_rise(&c).unwrap();
        assert!((x - 0.05).abs() < 1e-9, "{x}");
    }
}
