//! Roots of polynomials on [0, 1] through their Bernstein form: none missed, none found twice.

/// Highest degree that the tables serve.
pub const MAX_DEGREE: usize = 32;

/// Width below which two sign changes count as a touch, not as two roots.
const TOUCH: f64 = 1e-13;

/// Polynomials given by coefficients of 1, x, x^2, ...; owns its work space.
#[derive(Debug, Clone)]
pub struct RootFinder {
    /// binomial[n][k].
    binomial: Vec<Vec<f64>>,
    stack: Vec<(f64, f64, Vec<f64>)>,
    spare: Vec<Vec<f64>>,
}

impl Default for RootFinder {
    fn default() -> Self {
        RootFinder::new()
    }
}

impl RootFinder {
    /// Tables up to [`MAX_DEGREE`].
    pub fn new() -> RootFinder {
        let mut binomial = vec![vec![1.0; 1]];
        for n in 1..=MAX_DEGREE {
            let row = |k: usize| {
                if k == 0 || k == n {
                    1.0
                } else {
                    binomial[n - 1][k - 1] + binomial[n - 1][k]
                }
            };
            let next = (0..=n).map(row).collect();
            binomial.push(next);
        }
        RootFinder {
            binomial,
            stack: Vec::new(),
            spare: Vec::new(),
        }
    }

    /// Lowest and highest value that the polynomial can have on [0, 1]: the hull of the Bernstein coefficients of its head of
    /// degree `head`, widened by the sum of the remaining coefficients.
    pub fn hull(&self, coefficients: &[f64], head: usize) -> (f64, f64) {
        let degree = head.min(coefficients.len() - 1);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for j in 0..=degree {
            let b = self.coefficient(&coefficients[..=degree], j);
            (low, high) = (low.min(b), high.max(b));
        }
        let rest: f64 = coefficients[degree + 1..].iter().map(|c| c.abs()).sum();
        (low - rest, high + rest)
    }

    /// b_j = sum_k C(j, k) / C(n, k) c_k.
    fn coefficient(&self, coefficients: &[f64], j: usize) -> f64 {
        let whole = &self.binomial[coefficients.len() - 1];
        let part = &self.binomial[j];
        coefficients[..=j]
            .iter()
            .zip(part)
            .zip(whole)
            .map(|((c, a), b)| c * a / b)
            .sum()
    }

    /// Smallest root in (0, 1] at which the polynomial changes its sign; `None` when it keeps it.
    ///
    /// A polynomial that starts at 0 has no root there. Two roots closer than about 1e-13 count as a touch.
    pub fn first_root(&mut self, coefficients: &[f64]) -> Option<f64> {
        self.first_root_after(coefficients, 0.0)
    }

    /// The same beyond an abscissa.
    pub fn first_root_after(&mut self, coefficients: &[f64], begin: f64) -> Option<f64> {
        while let Some((_, _, used)) = self.stack.pop() {
            self.spare.push(used);
        }
        let mut first = self.spare.pop().unwrap_or_default();
        first.clear();
        first.extend((0..coefficients.len()).map(|j| self.coefficient(coefficients, j)));
        self.stack.push((0.0, 1.0, first));
        while let Some((low, high, mut bernstein)) = self.stack.pop() {
            let changes = if high <= begin {
                0
            } else {
                sign_changes(&bernstein)
            };
            if changes == 1 && low >= begin {
                let found = polish(coefficients, low, high);
                self.spare.push(bernstein);
                return Some(found);
            }
            if changes == 0 || high - low < TOUCH {
                self.spare.push(bernstein);
                continue;
            }
            let mut left = self.spare.pop().unwrap_or_default();
            left.clear();
            let last = bernstein.len() - 1;
            // De Casteljau at the middle: the left halves fall out, the right halves stay.
            for round in 0..=last {
                left.push(bernstein[0]);
                for k in 0..last - round {
                    bernstein[k] = 0.5 * (bernstein[k] + bernstein[k + 1]);
                }
            }
            let middle = 0.5 * (low + high);
            self.stack.push((middle, high, bernstein));
            self.stack.push((low, middle, left));
        }
        None
    }
}

/// Value and derivative of c_0 + c_1 x + ...
pub fn evaluate(coefficients: &[f64], x: f64) -> (f64, f64) {
    coefficients
        .iter()
        .rev()
        .fold((0.0, 0.0), |(value, slope), c| {
            (value * x + c, slope * x + value)
        })
}

fn sign_changes(list: &[f64]) -> usize {
    let mut last = 0.0;
    let mut changes = 0;
    for b in list.iter().filter(|b| **b != 0.0) {
        if last * b < 0.0 {
            changes += 1;
        }
        last = b.signum();
    }
    changes
}

/// The only root between two abscissae, by Newton's method kept inside.
fn polish(coefficients: &[f64], low: f64, high: f64) -> f64 {
    let at_low = evaluate(coefficients, low).0;
    if at_low == 0.0 {
        // The sign change starts at a root that belongs to the stretch before; step off it.
        let off = low + 1e-9 * (high - low);
        return super::roots::newton_bracketed(
            |x| evaluate(coefficients, x),
            (off, evaluate(coefficients, off).0),
            high,
        );
    }
    super::roots::newton_bracketed(|x| evaluate(coefficients, x), (low, at_low), high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn product(roots: &[f64]) -> Vec<f64> {
        roots.iter().fold(vec![1.0], |p, r| {
            let mut next = vec![0.0; p.len() + 1];
            for (k, c) in p.iter().enumerate() {
                next[k + 1] += c;
                next[k] -= r * c;
            }
            next
        })
    }

    #[test]
    fn finds_the_first_of_several() {
        let mut finder = RootFinder::new();
        let p = product(&[0.31, 0.32, 0.9, 1.5, -0.2]);
        assert!((finder.first_root(&p).unwrap() - 0.31).abs() < 1e-12);
        assert!((finder.first_root_after(&p, 0.315).unwrap() - 0.32).abs() < 1e-12);
        assert!((finder.first_root_after(&p, 0.5).unwrap() - 0.9).abs() < 1e-12);
        assert_eq!(finder.first_root_after(&p, 0.95), None);
        assert_eq!(finder.first_root(&product(&[-0.1, 1.2, 3.0])), None);
    }

    #[test]
    fn a_touch_is_no_root_and_two_close_roots_are_two() {
        let mut finder = RootFinder::new();
        assert_eq!(finder.first_root(&[0.25 + 1e-12, -1.0, 1.0]), None);
        let found = finder.first_root(&[0.25 - 1e-10, -1.0, 1.0]).unwrap();
        assert!((found - (0.5 - 1e-5)).abs() < 1e-9);
        assert_eq!(
            finder.first_root(&[0.0, 1.0, 1.0]),
            None,
            "a root at the start does not count"
        );
    }

    #[test]
    fn the_hull_encloses_the_values() {
        let finder = RootFinder::new();
        let p: Vec<f64> = (0..20)
            .map(|k| (1.7 * k as f64).sin() / (1.0 + k as f64))
            .collect();
        let (low, high) = finder.hull(&p, 8);
        for k in 0..=100 {
            let value = evaluate(&p, 0.01 * k as f64).0;
            assert!(value >= low && value <= high);
        }
    }
}
