//! Exact derivatives of a law without writing them: numbers that carry their partial derivatives along.
//!
//! A law computes its force over any [`Number`]; [`from_force`] makes the [`Response`] of it:
//!
//! ```text
//! fn force<N: Number>(&self, q: N, v: N) -> N {
//!     q + q.powi(3) * self.cubic + v * self.damping
//! }
//!
//! fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
//!     from_force(q, v, |q, v| self.force(q, v))
//! }
//! ```

use super::Response;
use super::number::Number;
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number with its partial derivatives with respect to displacement q and velocity v.
///
/// Comparisons look at the value alone, so that `if q > b` works as with plain numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Dual<N = f64> {
    /// The number.
    pub value: N,
    /// Its derivative with respect to q.
    pub dq: N,
    /// Its derivative with respect to v.
    pub dv: N,
}

/// Force and exact partials of a law at (q, v), from its force alone.
#[inline]
pub fn from_force(q: f64, v: f64, force: impl FnOnce(Dual, Dual) -> Dual) -> Response {
    let f = force(Dual::displacement(q), Dual::velocity(v));
    Response {
        f: f.value,
        df_dq: f.dq,
        df_dv: f.dv,
    }
}

impl<N: Number> Dual<N> {
    /// A number that depends on neither q nor v.
    #[inline]
    pub fn constant(value: N) -> Dual<N> {
        let zero = N::from(0.0);
        Dual {
            value,
            dq: zero,
            dv: zero,
        }
    }

    /// q itself.
    #[inline]
    pub fn displacement(q: N) -> Dual<N> {
        Dual {
            dq: N::from(1.0),
            ..Dual::constant(q)
        }
    }

    /// v itself.
    #[inline]
    pub fn velocity(v: N) -> Dual<N> {
        Dual {
            dv: N::from(1.0),
            ..Dual::constant(v)
        }
    }

    /// A function of this number: its value here, and its slope here by the chain rule.
    #[inline]
    #[must_use]
    pub fn chain(self, value: N, slope: N) -> Dual<N> {
        Dual {
            value,
            dq: product(slope, self.dq),
            dv: product(slope, self.dv),
        }
    }
}

impl<N: Number> Number for Dual<N> {
    #[inline]
    fn value(self) -> f64 {
        self.value.value()
    }

    #[inline]
    fn is_zero(self) -> bool {
        self.value.is_zero() && self.dq.is_zero() && self.dv.is_zero()
    }

    #[inline]
    fn powi(self, n: i32) -> Dual<N> {
        let slope = match n {
            0 => N::from(0.0),
            n => self.value.powi(n - 1) * f64::from(n),
        };
        self.chain(self.value.powi(n), slope)
    }

    #[inline]
    fn powf(self, n: f64) -> Dual<N> {
        let slope = if n == 0.0 {
            N::from(0.0)
        } else {
            self.value.powf(n - 1.0) * n
        };
        self.chain(self.value.powf(n), slope)
    }

    #[inline]
    fn pow(self, y: Dual<N>) -> Dual<N> {
        let value = self.value.pow(y.value);
        let slope = if y.value.is_zero() {
            N::from(0.0)
        } else {
            y.value * self.value.pow(y.value - 1.0)
        };
        let base = self.chain(value, slope);
        if y.dq.is_zero() && y.dv.is_zero() {
            return base;
        }
        let exponent = y.chain(value, value * self.value.ln());
        Dual {
            value,
            dq: base.dq + exponent.dq,
            dv: base.dv + exponent.dv,
        }
    }

    #[inline]
    fn sqrt(self) -> Dual<N> {
        let root = self.value.sqrt();
        self.chain(root, N::from(0.5) / root)
    }

    #[inline]
    fn exp(self) -> Dual<N> {
        let value = self.value.exp();
        self.chain(value, value)
    }

    #[inline]
    fn ln(self) -> Dual<N> {
        self.chain(self.value.ln(), N::from(1.0) / self.value)
    }

    #[inline]
    fn sin(self) -> Dual<N> {
        self.chain(self.value.sin(), self.value.cos())
    }

    #[inline]
    fn cos(self) -> Dual<N> {
        self.chain(self.value.cos(), -self.value.sin())
    }

    #[inline]
    fn tan(self) -> Dual<N> {
        let tan = self.value.tan();
        self.chain(tan, tan * tan + 1.0)
    }

    #[inline]
    fn atan(self) -> Dual<N> {
        let below = self.value * self.value + 1.0;
        self.chain(self.value.atan(), N::from(1.0) / below)
    }

    #[inline]
    fn sinh(self) -> Dual<N> {
        self.chain(self.value.sinh(), self.value.cosh())
    }

    #[inline]
    fn cosh(self) -> Dual<N> {
        self.chain(self.value.cosh(), self.value.sinh())
    }

    #[inline]
    fn tanh(self) -> Dual<N> {
        let tanh = self.value.tanh();
        self.chain(tanh, N::from(1.0) - tanh * tanh)
    }
}

/// Slope times derivative: what does not vary stays constant, also where the slope is infinite (the root at 0).
#[inline]
fn product<N: Number>(slope: N, derivative: N) -> N {
    if derivative.is_zero() {
        N::from(0.0)
    } else {
        slope * derivative
    }
}

/// Derivative of a quotient from those above and below the line.
#[inline]
fn quotient_slope<N: Number>(quotient: N, divisor: N, (above, below): (N, N)) -> N {
    let change = above - product(quotient, below);
    product(N::from(1.0) / divisor, change)
}

impl<N: Number> From<f64> for Dual<N> {
    #[inline]
    fn from(value: f64) -> Dual<N> {
        Dual::constant(N::from(value))
    }
}

impl<N: Number> PartialEq for Dual<N> {
    #[inline]
    fn eq(&self, other: &Dual<N>) -> bool {
        self.value == other.value
    }
}

impl<N: Number> PartialOrd for Dual<N> {
    #[inline]
    fn partial_cmp(&self, other: &Dual<N>) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<N: Number> PartialEq<f64> for Dual<N> {
    #[inline]
    fn eq(&self, other: &f64) -> bool {
        self.value == *other
    }
}

impl<N: Number> PartialOrd<f64> for Dual<N> {
    #[inline]
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.value.partial_cmp(other)
    }
}

impl<N: Number> Neg for Dual<N> {
    type Output = Dual<N>;

    #[inline]
    fn neg(self) -> Dual<N> {
        Dual {
            value: -self.value,
            dq: -self.dq,
            dv: -self.dv,
        }
    }
}

impl<N: Number> Add for Dual<N> {
    type Output = Dual<N>;

    #[inline]
    fn add(self, other: Dual<N>) -> Dual<N> {
        Dual {
            value: self.value + other.value,
            dq: self.dq + other.dq,
            dv: self.dv + other.dv,
        }
    }
}

impl<N: Number> Sub for Dual<N> {
    type Output = Dual<N>;

    #[inline]
    fn sub(self, other: Dual<N>) -> Dual<N> {
        Dual {
            value: self.value - other.value,
            dq: self.dq - other.dq,
            dv: self.dv - other.dv,
        }
    }
}

impl<N: Number> Mul for Dual<N> {
    type Output = Dual<N>;

    #[inline]
    fn mul(self, other: Dual<N>) -> Dual<N> {
        Dual {
            value: self.value * other.value,
            dq: product(other.value, self.dq) + product(self.value, other.dq),
            dv: product(other.value, self.dv) + product(self.value, other.dv),
        }
    }
}

impl<N: Number> Div for Dual<N> {
    type Output = Dual<N>;

    #[inline]
    fn div(self, other: Dual<N>) -> Dual<N> {
        let value = self.value / other.value;
        Dual {
            value,
            dq: quotient_slope(value, other.value, (self.dq, other.dq)),
            dv: quotient_slope(value, other.value, (self.dv, other.dv)),
        }
    }
}

/// The operators with a plain number on either side.
macro_rules! with_numbers {
    ($($operator:ident $method:ident)*) => { $(
        impl<N: Number> $operator<f64> for Dual<N> {
            type Output = Dual<N>;

            #[inline]
            fn $method(self, other: f64) -> Dual<N> {
                $operator::$method(self, Dual::from(other))
            }
        }

        impl<N: Number> $operator<Dual<N>> for f64 {
            type Output = Dual<N>;

            #[inline]
            fn $method(self, other: Dual<N>) -> Dual<N> {
                $operator::$method(Dual::from(self), other)
            }
        }
    )* };
}

with_numbers!(Add add Sub sub Mul mul Div div);
