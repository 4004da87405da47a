//! Roots of functions of one variable inside a bracket.

/// A bracket that holds a sign change, with the best abscissa so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bracketed {
    /// Best estimate of the root.
    pub root: f64,
    /// Lower end of the bracket.
    pub low: f64,
    /// Upper end of the bracket.
    pub high: f64,
}

/// Root of f between a and b, f(a) f(b) <= 0, to an absolute width, by Chandrupatla's method: inverse quadratic
/// interpolation where it is safe, bisection elsewhere. Works for functions with one-sided square roots or kinks.
///
/// `f` may fail: its error ends the search.
///
/// # Errors
/// Whatever `f` returns.
pub(crate) fn bracketed<E>(
    mut f: impl FnMut(f64) -> Result<f64, E>,
    (a, fa): (f64, f64),
    (b, fb): (f64, f64),
    width: f64,
) -> Result<Bracketed, E> {
    let (mut x1, mut f1, mut x2, mut f2) = (b, fb, a, fa);
    // The secant, where it is finite and not too close to an end.
    let secant = f1 / (f1 - f2);
    let mut t = if secant.is_finite() {
        secant.clamp(0.1, 0.9)
    } else {
        0.5
    };
    loop {
        let x = x1 + t * (x2 - x1);
        let fx = f(x)?;
        let (x3, f3);
        if (fx > 0.0) == (f1 > 0.0) {
            (x3, f3) = (x1, f1);
        } else {
            (x3, f3) = (x2, f2);
            (x2, f2) = (x1, f1);
        }
        (x1, f1) = (x, fx);
        let root = if f1.abs() < f2.abs() { x1 } else { x2 };
        let tolerance = width.max(2.0 * f64::EPSILON * root.abs());
        let relative = tolerance / (x2 - x1).abs();
        if relative >= 1.0 || f1 == 0.0 {
            return Ok(Bracketed {
                root,
                low: x1.min(x2),
                high: x1.max(x2),
            });
        }
        let xi = (x1 - x2) / (x3 - x2);
        let phi = (f1 - f2) / (f3 - f2);
        let interpolate = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
        t = if interpolate {
            f1 / (f2 - f1) * f3 / (f2 - f3)
                + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        } else {
            0.5
        };
        t = t.clamp(0.5 * relative, 1.0 - 0.5 * relative);
    }
}

/// Root of f near a guess at which its slope is about known, between two limits: the first step overshoots Newton's, so that two
/// values enclose the root, and [`bracketed`] ends the search. `None` when no change of sign is met up to the limit.
///
/// # Errors
/// Whatever `f` returns.
pub(crate) fn near_guess<E>(
    mut f: impl FnMut(f64) -> Result<f64, E>,
    guess: f64,
    slope: f64,
    limits: (f64, f64),
    width: f64,
) -> Result<Option<Bracketed>, E> {
    let (mut x, mut value) = (guess, f(guess)?);
    let mut stride = -OVERSHOOT * value / slope;
    if !stride.is_finite() || stride.abs() < width {
        stride = width * if value * slope > 0.0 { -1.0 } else { 1.0 };
    }
    loop {
        if value == 0.0 {
            let (root, low, high) = (x, x, x);
            return Ok(Some(Bracketed { root, low, high }));
        }
        let next = (x + stride).clamp(limits.0, limits.1);
        if next == x {
            return Ok(None);
        }
        let beyond = f(next)?;
        if (beyond > 0.0) != (value > 0.0) {
            return bracketed(f, (x, value), (next, beyond), width).map(Some);
        }
        (x, value) = (next, beyond);
        stride *= GROWTH;
    }
}

/// Share of Newton's step that the first step from a guess takes: more than 1, so that it passes the root.
const OVERSHOOT: f64 = 1.5;
/// Factor by which the steps from a guess grow.
const GROWTH: f64 = 4.0;

/// Root of a differentiable function between a and b, f(a) f(b) <= 0: Newton's method kept inside the bracket.
///
/// `f` returns value and derivative.
pub(crate) fn newton_bracketed(
    f: impl FnMut(f64) -> (f64, f64),
    (a, fa): (f64, f64),
    b: f64,
) -> f64 {
    newton_from(f, 0.5 * (a + b), (a, fa), b)
}

/// The same from a guess between a and b.
pub(crate) fn newton_from(
    mut f: impl FnMut(f64) -> (f64, f64),
    guess: f64,
    (a, fa): (f64, f64),
    b: f64,
) -> f64 {
    let mut newton = BracketedNewton::new(guess, (a, fa), b);
    loop {
        let at = f(newton.x);
        if newton.is_over(at) {
            return newton.x;
        }
    }
}

/// Newton's method inside a bracket, step by step.
#[derive(Debug, Clone, Copy)]
pub struct BracketedNewton {
    /// Where the function is wanted next; in the end the root.
    pub x: f64,
    negative: f64,
    positive: f64,
    width: f64,
    /// Length of the step before; NaN when it was not Newton's.
    before: f64,
    left: u32,
}

impl BracketedNewton {
    /// From a guess between a and b.
    #[inline]
    pub fn new(guess: f64, (a, fa): (f64, f64), b: f64) -> BracketedNewton {
        let (negative, positive) = if fa < 0.0 { (a, b) } else { (b, a) };
        BracketedNewton {
            x: guess,
            negative,
            positive,
            width: (b - a).abs(),
            before: f64::NAN,
            left: MOST_NEWTON,
        }
    }

    /// Takes value and derivative at x; whether x is the root now.
    #[inline]
    pub(crate) fn is_over(&mut self, (value, slope): (f64, f64)) -> bool {
        let x = self.x;
        if value == 0.0 {
            return true;
        }
        if value < 0.0 {
            self.negative = x
        } else {
            self.positive = x
        }
        let newton = x - value / slope;
        let (low, high) = (
            self.negative.min(self.positive),
            self.negative.max(self.positive),
        );
        let length = (newton - x).abs();
        // Newton that does not halve its step each time gives way to bisection.
        let converges = newton > low && newton < high && length <= 0.5 * self.width;
        self.x = if converges {
            newton
        } else {
            0.5 * (low + high)
        };
        self.width = (self.x - x).abs();
        self.left -= 1;
        let resolution = 2.0 * f64::EPSILON * x.abs().max(1.0);
        // Steps of a quadratic convergence: the next one is length^3 / before^2.
        let before = self.before;
        let is_last = length < 1e-4 * before
            && length * length * length <= 0.25 * resolution * before * before;
        self.before = if converges { length } else { f64::NAN };
        self.width <= resolution || (converges && is_last) || self.left == 0
    }
}

/// Steps of [`BracketedNewton`] at most.
pub(super) const MOST_NEWTON: u32 = 100;

/// A little below x^(1 / n), `share` = 1 / n, n >= 3: by less than 3 %, for n >= 20 by less than 1 %.
///
/// ```text
/// log2(2^e (1 + m)) >= e + m,   2^f <= 1 + 0.6568 f + 0.3432 f^2 (1 + 0.003)
/// ```
#[inline(always)]
pub(crate) fn root_below(x: f64, share: f64) -> f64 {
    const ONE: u64 = 1.0_f64.to_bits();
    const MANTISSA: u64 = (1 << 52) - 1;
    if x == 0.0 {
        return 0.0;
    }
    let one = ONE as f64;
    let bits = (one + (x.abs().to_bits() as f64 - one) * share) as u64;
    let fraction = f64::from_bits(bits & MANTISSA | ONE) - 1.0;
    let power = f64::from_bits(bits & !MANTISSA);
    0.996 * power * (1.0 + fraction * (0.6568 + 0.3432 * fraction))
}

/// Steps of [`maximum`]: they shrink the interval to its 1e-10th, where a smooth function no longer changes.
const GOLDEN_STEPS: usize = 48;

/// Abscissa of the largest value of a function with one maximum inside the interval, by golden section; at a kink as well as at
/// a smooth top.
pub fn maximum(mut f: impl FnMut(f64) -> f64, (mut low, mut high): (f64, f64)) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut left, mut right) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_left, mut at_right) = (f(left), f(right));
    for _ in 0..GOLDEN_STEPS {
        if at_left > at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - golden * (high - low);
            at_left = f(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + golden * (high - low);
            at_right = f(right);
        }
    }
    0.5 * (low + high)
}

/// Largest value of a function near an abscissa at which it is larger than at both ends of the interval around it: Brent's
/// method, parabolas through the best three values where they help, golden section elsewhere. Ends when these three values
/// differ by `rounding`, or their abscissae by a 1e-10th of the interval (at a kink). At a smooth top it takes a dozen values.
pub(crate) fn summit(
    mut f: impl FnMut(f64) -> f64,
    (start, value): (f64, f64),
    ends: (f64, f64),
    rounding: f64,
) -> f64 {
    let (mut low, mut high) = ends;
    let resolution = 1e-10 * (high - low);
    // Best, second, third; the last step but one.
    let (mut x, mut w, mut v) = (start, start, start);
    let (mut fx, mut fw, mut fv) = (value, value, value);
    let (mut stride, mut before) = (0.0_f64, 0.0_f64);
    for step in 0..2 * GOLDEN_STEPS {
        let middle = 0.5 * (low + high);
        let is_flat = (fx - fv).max(fx - fw) <= rounding.max(2.0 * f64::EPSILON * fx.abs());
        if (step > 2 && is_flat) || high - low <= 2.0 * resolution {
            break;
        }
        let (r, q) = ((x - w) * (fx - fv), (x - v) * (fx - fw));
        let parabola = -((x - v) * q - (x - w) * r) / (2.0 * (q - r));
        let helps = parabola.abs() < 0.5 * before.abs()
            && x + parabola > low + resolution
            && x + parabola < high - resolution;
        before = stride;
        stride = if helps {
            parabola
        } else {
            before = if x < middle { high - x } else { low - x };
            GOLDEN * before
        };
        let next = x + stride.abs().max(resolution).copysign(stride);
        let fnext = f(next);
        if fnext >= fx {
            if next >= x {
                low = x
            } else {
                high = x
            }
            (v, fv, w, fw, x, fx) = (w, fw, x, fx, next, fnext);
        } else {
            if next < x {
                low = next
            } else {
                high = next
            }
            if fnext >= fw || w == x {
                (v, fv, w, fw) = (w, fw, next, fnext);
            } else if fnext >= fv || v == x || v == w {
                (v, fv) = (next, fnext);
            }
        }
    }
    fx
}

/// Share of the longer part of an interval that a step by golden section takes.
const GOLDEN: f64 = 0.381_966_011_250_105_1;

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn finds_smooth_and_kinked_tops() {
        let top = maximum(|x| (x - 0.2).cos(), (-1.0, 1.0));
        assert!((top - 0.2).abs() < 1e-7, "{top}");
        let top = maximum(|x| -(x - 0.7).abs(), (-1.0, 1.0));
        assert!((top - 0.7).abs() < 1e-9, "{top}");
    }

    #[test]
    fn summits_are_found_in_few_steps() {
        let mut calls = 0;
        let top = summit(
            |x| {
                calls += 1;
                (x - 0.2).cos()
            },
            (0.19, 0.01_f64.cos()),
            (0.1, 0.3),
            0.0,
        );
        assert!(
            (top - 1.0).abs() < 4.0 * f64::EPSILON && calls <= 12,
            "{top} {calls}"
        );
        // A kink, a kink that is steep on one side, a flat top, and a top at which the search starts.
        let top = summit(|x| 1.0 - (x - 0.7).abs(), (0.65, 0.95), (0.6, 0.9), 0.0);
        assert!((top - 1.0).abs() < 1e-9, "{top}");
        let steep = |x: f64| {
            1.0 - if x < 0.7 {
                0.1 * (0.7 - x)
            } else {
                40.0 * (x - 0.7)
            }
        };
        let top = summit(steep, (0.69, steep(0.69)), (0.6, 0.8), 0.0);
        assert!((top - 1.0).abs() < 1e-8, "{top}");
        assert_eq!(summit(|_| 3.0, (0.5, 3.0), (0.0, 1.0), 0.0), 3.0);
        let top = summit(|x| 2.0 - (x - 0.5).powi(2), (0.5, 2.0), (0.0, 1.0), 0.0);
        assert_eq!(top, 2.0);
        // Noise does not keep the search going.
        let mut calls = 0;
        let noisy = |x: f64| {
            calls += 1;
            (x - 0.2).cos() + 1e-10 * (1e12 * x).sin()
        };
        let top = summit(noisy, (0.19, 0.01_f64.cos()), (0.1, 0.3), 4e-10);
        assert!((top - 1.0).abs() < 1e-9 && calls <= 20, "{top} {calls}");
    }

    #[test]
    fn finds_smooth_and_kinked_roots() {
        let smooth = |x: f64| Ok::<_, Infallible>(x.exp() - 2.0);
        let found = bracketed(smooth, (0.0, -1.0), (2.0, 5.4), 1e-14).unwrap();
        assert!((found.root - 2.0_f64.ln()).abs() < 1e-13);
        let kink = |x: f64| Ok::<_, Infallible>(if x < 0.3 { -1e-3 } else { (x - 0.3).sqrt() });
        let found = bracketed(kink, (0.0, -1e-3), (1.0, 0.7), 1e-12).unwrap();
        assert!(found.low <= 0.3 && found.high >= 0.3 && found.high - found.low < 1e-11);
    }

    #[test]
    fn finds_a_root_from_a_guess() {
        let mut calls = 0;
        let f = |x: f64| {
            calls += 1;
            Ok::<_, Infallible>(x.exp() - 2.0)
        };
        let found = near_guess(f, 0.69, 2.0, (0.0, 2.0), 1e-9).unwrap().unwrap();
        assert!(found.low <= 2.0_f64.ln() && found.high >= 2.0_f64.ln());
        assert!(found.high - found.low <= 1e-9 && calls <= 5, "{calls}");
        // A slope of the wrong size costs steps, one of the wrong sign or no root at all ends at the limit.
        let f = |x: f64| Ok::<_, Infallible>(x.exp() - 2.0);
        assert!(
            near_guess(f, 0.5, 50.0, (0.0, 2.0), 1e-9)
                .unwrap()
                .is_some()
        );
        assert!(
            near_guess(f, 0.5, -2.0, (0.0, 2.0), 1e-9)
                .unwrap()
                .is_none()
        );
    }

    #[test]
    fn newton_stays_inside() {
        let root = newton_bracketed(|x| (x.atan(), 1.0 / (1.0 + x * x)), (-50.0, -1.55), 70.0);
        assert!(root.abs() < 1e-14);
    }
}
