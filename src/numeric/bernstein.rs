//! Roots of polynomials on [0, 1] through their Bernstein form: none missed, none found twice.
//!
//! In Bernstein form a polynomial lies in the hull of its coefficients and has no more roots than they change their sign: no
//! change decides at once, one change brackets a simple root, more are halved by de Casteljau's scheme. Polynomials are arrays
//! of the coefficients of 1, x, x^2, ...

use super::roots::newton_from;
use pulp::Simd;

/// Coefficients that the tables serve: degree + 1.
pub(crate) const SIZE: usize = 32;

/// Halves of [0, 1] below this width are not divided: what happens there is a touch within rounding.
const NARROWEST: f64 = 1e-15;

/// Coefficients of the head that [`hull`] converts.
const HEAD: usize = 8;

pub(super) type BernsteinTable = [[f64; SIZE]; SIZE];

/// BINOMIAL[k][j] = C(j, k), zero for j < k.
static BINOMIAL: BernsteinTable = binomial();

/// RECIPROCAL[n][k] = 1 / C(n, k), zero for k > n.
static RECIPROCAL: BernsteinTable = reciprocal();

pub(super) const fn binomial() -> BernsteinTable {
    let mut table = [[0.0; SIZE]; SIZE];
    let mut j = 0;
    while j < SIZE {
        table[0][j] = 1.0;
        let mut k = 1;
        while k <= j {
            table[k][j] = table[k - 1][j - 1] + table[k][j - 1];
            k += 1;
        }
        j += 1;
    }
    table
}

pub(super) const fn reciprocal() -> BernsteinTable {
    let binomial = binomial();
    let mut table = [[0.0; SIZE]; SIZE];
    let mut n = 0;
    while n < SIZE {
        let mut k = 0;
        while k <= n {
            table[n][k] = 1.0 / binomial[k][n];
            k += 1;
        }
        n += 1;
    }
    table
}

/// Direction in which a level is passed.
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

/// First x in [0, 1] where a polynomial passes `level` in `direction` by more than `tolerance`.
///
/// The polynomial is taken to start on the near side: a start on the level, or beyond it by rounding, does not fire. A touch
/// that goes less than `tolerance` beyond the level is not a passage. The abscissa is that of the level itself.
pub(crate) fn first_passage<const N: usize>(
    coefficients: &[f64; N],
    level: f64,
    direction: Direction,
    tolerance: f64,
) -> Option<f64> {
    let sign = direction.sign();
    let mut beyond = coefficients.map(|c| sign * c);
    let start = (beyond[0] - sign * level).min(0.0);
    beyond[0] = start - tolerance;
    let mut first = None;
    let mut search = SignChanges {
        sign: -1.0,
        found: |bracket| {
            first = Some(bracket);
            true
        },
    };
    search.walk(&convert(&beyond), 0.0, 1.0);
    let bracket: Bracket = first?;
    beyond[0] = start;
    Some(bracket.root(&beyond, -1.0))
}

/// Every x in (0, 1) where a polynomial changes its sign, ascending. Two changes within rounding of each other count as a
/// touch; a root at 0 does not count.
pub(crate) fn sign_changes<const N: usize>(coefficients: &[f64; N]) -> Vec<f64> {
    let mut brackets = Vec::new();
    let mut search = SignChanges {
        sign: 0.0,
        found: |bracket| {
            brackets.push(bracket);
            false
        },
    };
    let bernstein = convert(coefficients);
    search.walk(&bernstein, 0.0, 1.0);
    let first = bernstein.into_iter().find(|b| *b != 0.0).unwrap_or(0.0);
    let signs = [first, -first].into_iter().cycle();
    let roots = brackets
        .iter()
        .zip(signs)
        .map(|(b, s)| b.root(coefficients, s));
    roots.filter(|x| *x < 1.0).collect()
}

/// Lowest and highest value that a polynomial can have on [0, 1]: the hull of the Bernstein coefficients of its head, widened by
/// the sum of the remaining coefficients.
pub(crate) fn hull<const N: usize>(coefficients: &[f64; N]) -> (f64, f64) {
    let mut head = [0.0; HEAD];
    let (kept, rest) = coefficients.split_at(N.min(HEAD));
    head[..kept.len()].copy_from_slice(kept);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for b in convert(&head) {
        (low, high) = (low.min(b), high.max(b));
    }
    let rest: f64 = rest.iter().map(|c| c.abs()).sum();
    (low - rest, high + rest)
}

/// Value and derivative of c_0 + c_1 x + ...
///
/// ```text
/// p(x) = E(x^2) + x O(x^2),   p'(x) = O + 2 x (E' + x O')
/// ```
pub fn evaluate(coefficients: &[f64], x: f64) -> (f64, f64) {
    // Even and odd powers apart: two short chains of operations instead of a long one.
    let y = x * x;
    let (pairs, top) = coefficients.as_chunks::<2>();
    let (mut even, mut odd) = (top.first().copied().unwrap_or(0.0), 0.0);
    let (mut even_slope, mut odd_slope) = (0.0, 0.0);
    for [a, b] in pairs.iter().rev() {
        (even_slope, odd_slope) = (even_slope * y + even, odd_slope * y + odd);
        (even, odd) = (even * y + a, odd * y + b);
    }
    (even + x * odd, odd + 2.0 * x * (even_slope + x * odd_slope))
}

/// [`evaluate`] for several polynomials at once, each at its own x: `coefficients[k][l]` belongs to x^k in the one with number l.
#[inline(always)]
pub(crate) fn evaluate_each<S: Simd, const N: usize, const L: usize>(
    simd: S,
    coefficients: &[[f64; L]; N],
    x: &[f64; L],
) -> ([f64; L], [f64; L]) {
    const { assert!(N.is_multiple_of(2)) };
    let (mut value, mut slope) = ([0.0; L], [0.0; L]);
    let (add, mul) = (
        |a: S::f64s, b: S::f64s| simd.add_f64s(a, b),
        |a: S::f64s, b: S::f64s| simd.mul_f64s(a, b),
    );
    for part in 0..L / S::F64_LANES {
        let of = |each: &[f64; L]| S::as_simd_f64s(each).0[part];
        let (x, zero) = (of(x), simd.splat_f64s(0.0));
        let square = mul(x, x);
        let (mut even, mut odd, mut even_slope, mut odd_slope) = (zero, zero, zero, zero);
        for [a, b] in coefficients.as_chunks::<2>().0.iter().rev() {
            even_slope = add(mul(even_slope, square), even);
            odd_slope = add(mul(odd_slope, square), odd);
            even = add(mul(even, square), of(a));
            odd = add(mul(odd, square), of(b));
        }
        let bend = add(even_slope, mul(x, odd_slope));
        let twice = mul(simd.splat_f64s(2.0), x);
        S::as_mut_simd_f64s(&mut value).0[part] = add(even, mul(x, odd));
        S::as_mut_simd_f64s(&mut slope).0[part] = add(odd, mul(twice, bend));
    }
    (value, slope)
}

/// b_j = sum_k C(j, k) / C(n, k) c_k, n = N - 1.
fn convert<const N: usize>(coefficients: &[f64; N]) -> [f64; N] {
    let mut out = [coefficients[0]; N];
    for k in 1..N {
        let part = coefficients[k] * RECIPROCAL[N - 1][k];
        // Zeros below the diagonal keep the length of the loop fixed.
        for (b, c) in out.iter_mut().zip(&BINOMIAL[k]) {
            *b += c * part;
        }
    }
    out
}

/// Stretch with one change of sign.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    low: f64,
    high: f64,
    /// Where the coefficients of the Bernstein form change their sign.
    guess: f64,
}

impl Bracket {
    fn root(&self, coefficients: &[f64], at_low: f64) -> f64 {
        if self.low == self.high {
            return self.low;
        }
        let value = |x: f64| evaluate(coefficients, x);
        newton_from(value, self.guess, (self.low, at_low), self.high)
    }
}

/// Walks through the sign changes of a polynomial from left to right.
struct SignChanges<F> {
    /// Sign before the stretch at hand; 0: not known.
    sign: f64,
    /// Sees every change; `true` ends the search.
    found: F,
}

impl<F: FnMut(Bracket) -> bool> SignChanges<F> {
    /// `true` when the search has ended.
    fn walk<const N: usize>(&mut self, b: &[f64; N], low: f64, width: f64) -> bool {
        let (mut changes, mut at, mut last) = (0, 0, self.sign);
        for (j, b) in b.iter().enumerate() {
            if b * last < 0.0 {
                changes += 1;
                at = j;
            }
            if *b != 0.0 {
                last = b.signum();
            }
        }
        let before = std::mem::replace(&mut self.sign, last);
        if changes == 0 {
            return false;
        }
        let high = low + width;
        if changes == 1 {
            let guess = match at {
                // The change lies between the stretches.
                0 => {
                    return (self.found)(Bracket {
                        low,
                        high: low,
                        guess: low,
                    });
                }
                _ => (at as f64 - b[at] / (b[at] - b[at - 1])) / (N - 1) as f64,
            };
            let guess = low + width * guess;
            return (self.found)(Bracket { low, high, guess });
        }
        if width < NARROWEST {
            let guess = high;
            return before * last < 0.0
                && (self.found)(Bracket {
                    low: high,
                    high,
                    guess,
                });
        }
        self.sign = before;
        let (left, right) = halve(b);
        let half = 0.5 * width;
        self.walk(&left, low, half) || self.walk(&right, low + half, half)
    }
}

/// Bernstein coefficients of both halves, by de Casteljau's scheme.
fn halve<const N: usize>(b: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut left, mut right) = ([0.0; N], *b);
    for (round, first) in left.iter_mut().enumerate() {
        *first = right[0];
        for i in 0..N - 1 - round {
            right[i] = 0.5 * (right[i] + right[i + 1]);
        }
    }
    (left, right)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Product of (x - root), times a factor.
    fn product<const N: usize>(factor: f64, roots: [f64; N]) -> [f64; SIZE] {
        let mut c = [0.0; SIZE];
        c[0] = factor;
        for (degree, root) in roots.iter().enumerate() {
            for k in (0..=degree + 1).rev() {
                c[k] = if k > 0 { c[k - 1] } else { 0.0 } - root * c[k];
            }
        }
        c
    }

    fn rise<const N: usize>(c: &[f64; N]) -> Option<f64> {
        first_passage(c, 0.0, Direction::Up, 1e-15)
    }

    fn close(found: &[f64], wanted: &[f64]) -> bool {
        found.len() == wanted.len() && found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9)
    }

    #[test]
    fn every_sign_change_in_order() {
        let p = product(1.0, [0.31, 0.32, 0.9, 1.5, -0.2]);
        assert!(close(&sign_changes(&p), &[0.31, 0.32, 0.9]));
        assert!(close(&sign_changes(&product(1.0, [-0.1, 1.2, 3.0])), &[]));
        // Roots where the intervals are halved.
        let p = product(-1.0, [0.25, 0.5, 0.625, 0.75]);
        assert!(close(&sign_changes(&p), &[0.25, 0.5, 0.625, 0.75]));
        assert!(close(
            &sign_changes(&product(1.0, [0.0, 0.5, 0.7])),
            &[0.5, 0.7]
        ));
        let roots: [f64; 7] = std::array::from_fn(|k| 0.05 + 0.14 * k as f64);
        assert!(close(&sign_changes(&product(-1.0, roots)), &roots));
    }

    #[test]
    fn a_touch_is_no_root_and_two_close_roots_are_two() {
        assert!(close(&sign_changes(&[0.25 + 1e-12, -1.0, 1.0]), &[]));
        let found = sign_changes(&[0.25 - 1e-10, -1.0, 1.0]);
        assert!(close(&found, &[0.5 - 1e-5, 0.5 + 1e-5]), "{found:?}");
        for depth in [1e-3, 1e-6, 1e-10] {
            // depth - (x - 0.4)^2
            let x = rise(&[depth - 0.16, 0.8, -1.0]).unwrap();
            assert!((x - (0.4 - f64::sqrt(depth))).abs() < 1e-10, "{depth}: {x}");
            assert_eq!(rise(&[-depth - 0.16, 0.8, -1.0]), None, "{depth}");
        }
    }

    #[test]
    fn a_start_on_the_level_does_not_fire() {
        let level = 0.7;
        let inwards = [level + 1e-17, -1.0, 0.2];
        assert_eq!(first_passage(&inwards, level, Direction::Up, 1e-15), None);
        // Leaves downwards, comes back and passes at x = 0.5.
        let back = [level, -1.0, 2.0];
        let x = first_passage(&back, level, Direction::Up, 1e-15).unwrap();
        assert!((x - 0.5).abs() < 1e-15);
        let down = [level, 1.0, -2.0];
        assert_eq!(first_passage(&down, level, Direction::Down, 1e-15), Some(x));
        // Leaves at once.
        let x = first_passage(&[level, 1.0, 0.1], level, Direction::Up, 1e-15).unwrap();
        assert!(x < 2e-15, "{x:e}");
    }

    #[test]
    fn the_hull_encloses_the_values() {
        let p: [f64; 20] = std::array::from_fn(|k| (1.7 * k as f64).sin() / (1.0 + k as f64));
        let (low, high) = hull(&p);
        for k in 0..=100 {
            let value = evaluate(&p, 0.01 * k as f64).0;
            assert!(value >= low && value <= high);
        }
    }

    #[test]
    fn value_and_derivative() {
        // 1 + 2 x + 3 x^2 + 4 x^3 (+ 5 x^4) at 2
        assert_eq!(evaluate(&[1.0, 2.0, 3.0, 4.0], 2.0), (49.0, 62.0));
        assert_eq!(evaluate(&[1.0, 2.0, 3.0, 4.0, 5.0], 2.0), (129.0, 222.0));
    }
}
