//! The kinds of numbers a law can be computed with.
//!
//! A law writes its force once, over any [`Number`]: plain numbers give values, [`Dual`](super::derivatives::Dual) numbers
//! partial derivatives, [`Traced`](super::Traced) numbers a program from which Taylor series follow.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Something that behaves as a real number does. Comparisons look at the value alone, so that `if q > b` works.
pub trait Number:
    Copy
    + Debug
    + From<f64>
    + PartialOrd
    + PartialOrd<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The number alone.
    fn value(self) -> f64;

    /// Whether it is 0 and stays 0 whatever it depends on.
    fn is_zero(self) -> bool;

    /// x^n for a whole number n.
    #[must_use]
    fn powi(self, n: i32) -> Self;

    /// x^n for a constant n.
    #[must_use]
    fn powf(self, n: f64) -> Self;

    /// x^y.
    #[must_use]
    fn pow(self, y: Self) -> Self;

    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;

    /// e^x.
    #[must_use]
    fn exp(self) -> Self;

    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self;

    /// Sine.
    #[must_use]
    fn sin(self) -> Self;

    /// Cosine.
    #[must_use]
    fn cos(self) -> Self;

    /// Tangent.
    #[must_use]
    fn tan(self) -> Self;

    /// Arc tangent.
    #[must_use]
    fn atan(self) -> Self;

    /// Hyperbolic sine.
    #[must_use]
    fn sinh(self) -> Self;

    /// Hyperbolic cosine.
    #[must_use]
    fn cosh(self) -> Self;

    /// Hyperbolic tangent.
    #[must_use]
    fn tanh(self) -> Self;

    /// |x|; at 0 the slope of the right side.
    #[inline]
    #[must_use]
    fn abs(self) -> Self {
        if self < 0.0 { -self } else { self }
    }

    /// -1, 0 or 1.
    #[inline]
    #[must_use]
    fn sign(self) -> Self {
        Self::from(match self.value() {
            x if x > 0.0 => 1.0,
            x if x < 0.0 => -1.0,
            x => 0.0 * x,
        })
    }

    /// The smaller one; not a number if either is none.
    #[inline]
    #[must_use]
    fn min(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        if other < self || other.value().is_nan() {
            other
        } else {
            self
        }
    }

    /// The larger one; not a number if either is none.
    #[inline]
    #[must_use]
    fn max(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        if other > self || other.value().is_nan() {
            other
        } else {
            self
        }
    }

    /// The nearest number between two bounds, `low` <= `high`.
    #[inline]
    #[must_use]
    fn clamp(self, low: f64, high: f64) -> Self {
        self.max(low).min(high)
    }
}

/// Functions of plain numbers.
macro_rules! functions {
    ($($name:ident)*) => { $(
        #[inline]
        fn $name(self) -> f64 {
            f64::$name(self)
        }
    )* };
}

impl Number for f64 {
    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn is_zero(self) -> bool {
        self == 0.0
    }

    #[inline]
    fn powi(self, n: i32) -> f64 {
        f64::powi(self, n)
    }

    #[inline]
    fn powf(self, n: f64) -> f64 {
        f64::powf(self, n)
    }

    #[inline]
    fn pow(self, y: f64) -> f64 {
        f64::powf(self, y)
    }

    functions!(sqrt exp ln sin cos tan atan sinh cosh tanh);
}
