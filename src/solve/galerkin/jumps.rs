//! Forces that jump, in alternating frequency/time: the samples do not say where in its cell the jump lies.
//!
//! A force g that jumps by d at tau* = tau_s + theta h, between two samples a distance h apart, is integrated by the trapezoidal
//! rule as if the jump lay in the middle of the cell. Each coefficient therefore gets
//!
//! ```text
//! c_k <- c_k + n_k h (1/2 - theta) d phi_k(tau*),    n_0 = 1/(2 pi), n_k = 1/pi
//! ```
//!
//! phi_k the k-th function of the basis. With it the force is a continuous function of the unknowns and as accurate as one with a
//! kink, and the derivative follows from that of tau*: d tau*/d a_l = -phi_l(tau*) / x'(tau*).

use crate::numeric::roots::newton_bracketed;
use crate::solve::jumps;
use crate::system::Mount;
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};

/// A jump of a force between two samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    /// Its instant tau*.
    pub tau: f64,
    /// h (1/2 - theta).
    pub shift: f64,
    /// Force before.
    pub before: f64,
    /// Force after.
    pub after: f64,
    /// J / |x'|: weight of Dirac's impulse in df/dq, per radian.
    pub impulse: f64,
}

impl Edge {
    /// A jump whose place is known exactly: its impulse alone counts.
    pub(crate) fn of_impulse(tau: f64, impulse: f64) -> Edge {
        Edge {
            tau,
            shift: 0.0,
            before: 0.0,
            after: 0.0,
            impulse,
        }
    }
}

/// The jumps of a connection's force over one period, in no particular order.
///
/// `x`: samples of the deformation; `at`: deformation and its slope at tau; `omega`: Om, `nu`: subharmonic index.
pub(crate) fn edges(
    mount: &Mount,
    x: &[f64],
    at: impl Fn(f64) -> [f64; 2],
    (omega, nu): (f64, f64),
    out: &mut Vec<Edge>,
) {
    out.clear();
    if !mount.element.is_discontinuous() {
        return;
    }
    let h = TAU / x.len() as f64;
    for level in mount.element.breakpoints() {
        for (s, begin) in x.iter().enumerate() {
            let end = x[(s + 1) % x.len()];
            if (*begin > level) == (end > level) {
                continue;
            }
            let from = s as f64 * h;
            let distance = |tau: f64| {
                let [x, slope] = at(tau);
                (x - level, slope)
            };
            let tau = newton_bracketed(distance, (from, begin - level), from + h);
            let slope = at(tau)[1];
            let (below, above) = jumps::sides(mount, level, omega * slope, nu * tau);
            if below == above {
                continue;
            }
            let (before, after) = match end > level {
                true => (below, above),
                false => (above, below),
            };
            out.push(Edge {
                tau,
                shift: 0.5 * h - (tau - from),
                before,
                after,
                impulse: (above - below) / slope.abs(),
            });
        }
    }
}

/// Corrects the Fourier coefficients of a sampled force.
pub(crate) fn correct(edges: &[Edge], c: &mut [f64]) {
    for edge in edges {
        let weight = edge.shift * (edge.after - edge.before);
        basis(edge.tau, c.len(), |k, phi, _| {
            c[k] += normal(k) * weight * phi;
        });
    }
}

/// Adds the impulses of the slope to F+ diag(df/dq) F.
pub(crate) fn add_slopes(edges: &[Edge], matrix: &mut DMatrix<f64>) {
    let size = matrix.nrows();
    for edge in edges {
        basis(edge.tau, size, |l, column, _| {
            basis(edge.tau, size, |k, phi, derivative| {
                let row = normal(k) * (phi - edge.shift * derivative);
                matrix[(k, l)] += edge.impulse * row * column;
            });
        });
    }
}

fn normal(k: usize) -> f64 {
    if k == 0 { 1.0 / TAU } else { 1.0 / PI }
}

/// Number, value and derivative of 1, sin tau, cos tau, sin 2 tau, ...
fn basis(tau: f64, count: usize, mut see: impl FnMut(usize, f64, f64)) {
    see(0, 1.0, 0.0);
    for k in 1..=count / 2 {
        let order = k as f64;
        let (sin, cos) = (order * tau).sin_cos();
        see(2 * k - 1, sin, order * cos);
        see(2 * k, cos, -order * sin);
    }
}
