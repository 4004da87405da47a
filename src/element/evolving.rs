//! Laws whose memory has a rate: force and rate are functions of motion and memory.
//!
//! ```text
//! f = f(q, v, phase, z)        z' = g(q, v, phase, z)        ' = d/d(omega_c t)
//! ```
//!
//! f and g are continuous; where one of them is not smooth (at v = 0, say) the law states the level among its kinks. A law writes
//! both once, over any [`Number`](super::number::Number): `evolve` calls them with dual numbers ([`from_rates`]), `trace` with
//! recording ones, from which the flow makes the Taylor series of motion and memory together. The memory has the unit of a displacement.

use super::Response;
use super::derivatives::Dual;
use super::traced::Symbol;

/// Force and rate of the memory at one instant, with their partial derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Evolution {
    /// f.
    pub force: f64,
    /// Partials of f by q, v, z.
    pub force_by: [f64; 3],
    /// g = dz/d(omega_c t).
    pub rate: f64,
    /// Partials of g by q, v, z.
    pub rate_by: [f64; 3],
}

impl Evolution {
    /// The force with its partials at a fixed memory.
    pub fn response(&self) -> Response {
        let [df_dq, df_dv, _] = self.force_by;
        Response {
            f: self.force,
            df_dq,
            df_dv,
        }
    }
}

/// Levels at which f or g is not smooth, each list ascending.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Kinks {
    /// Of the deformation q.
    pub deformation: Vec<f64>,
    /// Of its rate v.
    pub rate: Vec<f64>,
    /// Of the memory z.
    pub memory: Vec<f64>,
}

/// A law with one memory whose rate is a function.
pub trait Evolving {
    /// Force, rate and partials at q, v, phase, z. Finite for finite input; does not allocate.
    fn evolve(&self, at: [f64; 4]) -> Evolution;

    /// Force and rate evaluated with recording numbers, once in every region between the kinks.
    ///
    /// # Errors
    /// Reason why there is no series; the default. DOPRI5 integrates such laws.
    fn trace<'t>(&self, _at: [Symbol<'t>; 4]) -> Result<[Symbol<'t>; 2], String> {
        Err(
            "its force and rate are computed with plain numbers only (`evolve` without `trace`)"
                .into(),
        )
    }

    /// Where force or rate is not smooth.
    fn kinks(&self) -> Kinks {
        Kinks::default()
    }

    /// The memory after the deformation has grown from 0 to q, from z = 0: its state at rest under a load that was applied once.
    ///
    /// The default grows it at the rate 1; that is the answer for every law whose rate is proportional to v. A law that also relaxes at rest
    /// states where it comes to rest.
    fn loaded(&self, q: f64) -> f64 {
        grown(self, q)
    }
}

/// Force and rate with exact partials at q, v, phase, z, from a function of q, v, z.
#[inline]
pub fn from_rates(
    [q, v, _phase, z]: [f64; 4],
    law: impl Fn(Dual, Dual, Dual) -> [Dual; 2],
) -> Evolution {
    let [f, g] = law(Dual::displacement(q), Dual::velocity(v), Dual::constant(z));
    let [f_z, g_z] = law(Dual::constant(q), Dual::constant(v), Dual::displacement(z));
    Evolution {
        force: f.value,
        force_by: [f.dq, f.dv, f_z.dq],
        rate: g.value,
        rate_by: [g.dq, g.dv, g_z.dq],
    }
}

/// Force and slope on first loading, for `eval`: the memory is that of [`Evolving::loaded`].
pub fn first_loading(law: &dyn Evolving, q: f64, v: f64, phase: f64) -> Response {
    let z = law.loaded(q);
    let direction = if q < 0.0 { -1.0 } else { 1.0 };
    let slope = direction * law.evolve([q, direction, phase, z]).rate;
    let here = law.evolve([q, v, phase, z]);
    let [df_dq, df_dv, df_dz] = here.force_by;
    Response {
        f: here.force,
        df_dq: df_dq + df_dz * slope,
        df_dv,
    }
}

/// Relative error of a step of the growth before its extrapolation, about 1e-13 behind it, and the most steps: a law that moves faster is followed no further.
const TOLERANCE: f64 = 1e-11;
const MOST_STEPS: usize = 1_000_000;

/// dz/dq = g(q, +-1, z) / +-1 from z(0) = 0, by Runge and Kutta's rule of order 4 with steps in pairs.
fn grown<L: Evolving + ?Sized>(law: &L, q: f64) -> f64 {
    let (direction, end) = (if q < 0.0 { -1.0 } else { 1.0 }, q.abs());
    let rate = |x: f64, z: f64| law.evolve([direction * x, direction, 0.0, z]).rate;
    let step = |x: f64, z: f64, h: f64| {
        let a = rate(x, z);
        let b = rate(x + 0.5 * h, z + 0.5 * h * a);
        let c = rate(x + 0.5 * h, z + 0.5 * h * b);
        let d = rate(x + h, z + h * c);
        z + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    };
    let (mut x, mut z, mut h) = (0.0, 0.0, 1e-2 * end);
    for _ in 0..MOST_STEPS {
        let left = end - x;
        if left <= 1e-15 * end || left * rate(x, z).abs() <= 1e-14 * z.abs() {
            break;
        }
        h = f64::min(h, left);
        let whole = step(x, z, h);
        let halves = step(x + 0.5 * h, step(x, z, 0.5 * h), 0.5 * h);
        let error = (halves - whole) / 15.0;
        let allowed = TOLERANCE * halves.abs().max(TOLERANCE);
        if error.abs() <= allowed || h <= 1e-12 * end {
            (x, z) = (x + h, halves + error);
        }
        let error = error.abs();
        h *= (0.9 * (allowed / error.max(1e-300)).powf(0.2)).clamp(0.2, 4.0);
    }
    z
}
