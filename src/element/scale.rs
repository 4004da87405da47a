//! Laws that are evaluated in units of their own.

use super::number::Number;
use super::{Response, Units};

/// The units in which a law is evaluated, seen from those in which it is asked: 1 as written, else those of
/// [`super::nondimensional`].
///
/// Most laws become nondimensional parameter by parameter. A law whose parameters are not powers of displacement, time and
/// force (a formula, a table from a file) keeps a `Scale` instead, skipped by serde, and evaluates through it:
///
/// ```text
/// f*(q*, v*) = F(l q*, l omega_c v*) / (K l)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    displacement: f64,
    velocity: f64,
    force: f64,
}

impl Default for Scale {
    fn default() -> Scale {
        Scale {
            displacement: 1.0,
            velocity: 1.0,
            force: 1.0,
        }
    }
}

impl Scale {
    /// Takes over further units.
    pub fn rescale(&mut self, units: &Units) {
        self.displacement *= units.displacement;
        self.velocity *= units.displacement * units.frequency;
        self.force *= units.force;
    }

    /// Response at (q, v) of a law that takes displacement and velocity in its own units.
    #[inline]
    pub fn eval(&self, q: f64, v: f64, law: impl FnOnce(f64, f64) -> Response) -> Response {
        let own = law(q * self.displacement, v * self.velocity);
        Response {
            f: own.f / self.force,
            df_dq: own.df_dq * (self.displacement / self.force),
            df_dv: own.df_dv * (self.velocity / self.force),
        }
    }

    /// The same for a force over any kind of number.
    #[inline]
    pub fn force<N: Number>(&self, q: N, v: N, law: impl FnOnce(N, N) -> N) -> N {
        law(q * self.displacement, v * self.velocity) / self.force
    }

    /// A displacement in the law's own units.
    pub fn inwards(&self, q: f64) -> f64 {
        q * self.displacement
    }

    /// A displacement of the law, such as a breakpoint, in the units in which it is asked.
    pub fn outwards(&self, q: f64) -> f64 {
        q / self.displacement
    }
}
