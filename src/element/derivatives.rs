//! Exact derivatives of a law without writing them: numbers that carry their partial derivatives along.
//!
//! A law computes its force with [`Dual`] numbers instead of `f64`; [`from_force`] makes the [`Response`] of it:
//!
//!     fn eval(&self, q: f64, v: f64, _phase: f64) -> Response {
//!         from_force(q, v, |q, v| q + self.cubic * q.powi(3) + self.damping * v)
//!     }

use super::Response;
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number with its partial derivatives with respect to displacement q and velocity v.
///
/// Comparisons look at the value alone, so that `if q > b` works as with plain numbers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Dual {
    /// The number.
    pub value: f64,
    /// Its derivative with respect to q.
    pub dq: f64,
    /// Its derivative with respect to v.
    pub dv: f64,
}

/// Force and exact partials of a law at (q, v), from its force alone.
pub fn from_force(q: f64, v: f64, force: impl FnOnce(Dual, Dual) -> Dual) -> Response {
    let f = force(Dual::displacement(q), Dual::velocity(v));
    Response {
        f: f.value,
        df_dq: f.dq,
        df_dv: f.dv,
    }
}

impl Dual {
    /// A number that depends on neither q nor v.
    pub const fn constant(value: f64) -> Dual {
        Dual {
            value,
            dq: 0.0,
            dv: 0.0,
        }
    }

    /// q itself.
    pub const fn displacement(q: f64) -> Dual {
        Dual {
            value: q,
            dq: 1.0,
            dv: 0.0,
        }
    }

    /// v itself.
    pub const fn velocity(v: f64) -> Dual {
        Dual {
            value: v,
            dq: 0.0,
            dv: 1.0,
        }
    }

    /// A function of this number: its value here, and its slope here by the chain rule.
    #[must_use]
    pub fn chain(self, value: f64, slope: f64) -> Dual {
        Dual {
            value,
            dq: product(slope, self.dq),
            dv: product(slope, self.dv),
        }
    }

    /// |x|; at 0 the slope of the right side.
    #[must_use]
    pub fn abs(self) -> Dual {
        if self.value < 0.0 { -self } else { self }
    }

    /// -1, 0 or 1.
    #[must_use]
    pub fn sign(self) -> Dual {
        match self.value {
            x if x > 0.0 => Dual::constant(1.0),
            x if x < 0.0 => Dual::constant(-1.0),
            x => Dual::constant(0.0 * x),
        }
    }

    /// The smaller one; not a number if either is none.
    #[must_use]
    pub fn min(self, other: impl Into<Dual>) -> Dual {
        let other = other.into();
        if other.value < self.value || other.value.is_nan() {
            other
        } else {
            self
        }
    }

    /// The larger one; not a number if either is none.
    #[must_use]
    pub fn max(self, other: impl Into<Dual>) -> Dual {
        let other = other.into();
        if other.value > self.value || other.value.is_nan() {
            other
        } else {
            self
        }
    }

    /// The nearest number between two bounds, `low` <= `high`.
    #[must_use]
    pub fn clamp(self, low: f64, high: f64) -> Dual {
        self.max(low).min(high)
    }

    /// x^n for a whole number n.
    #[must_use]
    pub fn powi(self, n: i32) -> Dual {
        let slope = match n {
            0 => 0.0,
            n => f64::from(n) * self.value.powi(n - 1),
        };
        self.chain(self.value.powi(n), slope)
    }

    /// x^n for a constant n.
    #[must_use]
    pub fn powf(self, n: f64) -> Dual {
        let slope = if n == 0.0 {
            0.0
        } else {
            n * self.value.powf(n - 1.0)
        };
        self.chain(self.value.powf(n), slope)
    }

    /// x^y.
    #[must_use]
    pub fn pow(self, y: Dual) -> Dual {
        let base = self.powf(y.value);
        let exponent = y.chain(base.value, base.value * self.value.ln());
        Dual {
            value: base.value,
            dq: base.dq + exponent.dq,
            dv: base.dv + exponent.dv,
        }
    }

    /// Square root.
    #[must_use]
    pub fn sqrt(self) -> Dual {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }

    /// e^x.
    #[must_use]
    pub fn exp(self) -> Dual {
        let value = self.value.exp();
        self.chain(value, value)
    }

    /// Natural logarithm.
    #[must_use]
    pub fn ln(self) -> Dual {
        self.chain(self.value.ln(), 1.0 / self.value)
    }

    /// Sine.
    #[must_use]
    pub fn sin(self) -> Dual {
        let (sin, cos) = self.value.sin_cos();
        self.chain(sin, cos)
    }

    /// Cosine.
    #[must_use]
    pub fn cos(self) -> Dual {
        let (sin, cos) = self.value.sin_cos();
        self.chain(cos, -sin)
    }

    /// Tangent.
    #[must_use]
    pub fn tan(self) -> Dual {
        let tan = self.value.tan();
        self.chain(tan, 1.0 + tan * tan)
    }

    /// Arc tangent.
    #[must_use]
    pub fn atan(self) -> Dual {
        self.chain(self.value.atan(), 1.0 / (1.0 + self.value * self.value))
    }

    /// Hyperbolic sine.
    #[must_use]
    pub fn sinh(self) -> Dual {
        self.chain(self.value.sinh(), self.value.cosh())
    }

    /// Hyperbolic cosine.
    #[must_use]
    pub fn cosh(self) -> Dual {
        self.chain(self.value.cosh(), self.value.sinh())
    }

    /// Hyperbolic tangent.
    #[must_use]
    pub fn tanh(self) -> Dual {
        let tanh = self.value.tanh();
        self.chain(tanh, 1.0 - tanh * tanh)
    }
}

/// Slope times derivative: what does not vary stays constant, also where the slope is infinite (the root at 0).
fn product(slope: f64, derivative: f64) -> f64 {
    if derivative == 0.0 {
        0.0
    } else {
        slope * derivative
    }
}

/// Derivative of a quotient from those above and below the line.
fn quotient_slope(quotient: f64, divisor: f64, (above, below): (f64, f64)) -> f64 {
    product(1.0 / divisor, above - product(quotient, below))
}

impl From<f64> for Dual {
    fn from(value: f64) -> Dual {
        Dual::constant(value)
    }
}

impl PartialEq for Dual {
    fn eq(&self, other: &Dual) -> bool {
        self.value == other.value
    }
}

impl PartialOrd for Dual {
    fn partial_cmp(&self, other: &Dual) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl PartialEq<f64> for Dual {
    fn eq(&self, other: &f64) -> bool {
        self.value == *other
    }
}

impl PartialOrd<f64> for Dual {
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.value.partial_cmp(other)
    }
}

impl Neg for Dual {
    type Output = Dual;

    fn neg(self) -> Dual {
        self.chain(-self.value, -1.0)
    }
}

impl Add for Dual {
    type Output = Dual;

    fn add(self, other: Dual) -> Dual {
        Dual {
            value: self.value + other.value,
            dq: self.dq + other.dq,
            dv: self.dv + other.dv,
        }
    }
}

impl Sub for Dual {
    type Output = Dual;

    fn sub(self, other: Dual) -> Dual {
        Dual {
            value: self.value - other.value,
            dq: self.dq - other.dq,
            dv: self.dv - other.dv,
        }
    }
}

impl Mul for Dual {
    type Output = Dual;

    fn mul(self, other: Dual) -> Dual {
        Dual {
            value: self.value * other.value,
            dq: product(other.value, self.dq) + product(self.value, other.dq),
            dv: product(other.value, self.dv) + product(self.value, other.dv),
        }
    }
}

impl Div for Dual {
    type Output = Dual;

    fn div(self, other: Dual) -> Dual {
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
        impl $operator<f64> for Dual {
            type Output = Dual;

            fn $method(self, other: f64) -> Dual {
                $operator::$method(self, Dual::constant(other))
            }
        }

        impl $operator<Dual> for f64 {
            type Output = Dual;

            fn $method(self, other: Dual) -> Dual {
                $operator::$method(Dual::constant(self), other)
            }
        }
    )* };
}

with_numbers!(Add add Sub sub Mul mul Div div);
