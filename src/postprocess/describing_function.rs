//! Laws under a motion of one harmonic: the describing functions behind figures 3 and 4.

use crate::element::Element;
use crate::numeric::quadrature::unit_nodes;
use std::f64::consts::PI;

/// Widest stretch of the phase integrated by one Gauss rule: smooth laws are then integrated to rounding.
const PANEL: f64 = PI / 8.0;
/// Halvings of the interval in which a mean is sought: down to the resolution of its numbers.
const HALVINGS: usize = 200;
/// Doublings of that interval before a force is given up as out of reach.
const DOUBLINGS: usize = 200;

/// Response of a law to q = mean + amplitude cos(phi), nondimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DescribingFunction {
    /// Mean of f over a period.
    pub mean_force: f64,
    /// k_a (8b); `None` at amplitude 0.
    pub stiffness: Option<f64>,
    /// <df/dq>: the slope that replaces k_a at amplitude 0.
    pub mean_slope: f64,
}

/// Averages of a law over one period of the motion q = mean + amplitude cos(phi), integrated between the passages of its
/// breakpoints.
///
/// ```text
/// k_a = (<f q> - <f><q>) / (<q^2> - <q>^2) = (2/(pi a)) int_0^pi f cos(phi) dphi
/// ```
///
/// The law is taken at rate and phase zero: forces odd in the rate have no share in (8) under this motion.
///
/// Rook & Singh (1995), eq. (8a,b) with a single frequency.
pub fn describing_function(element: &dyn Element, mean: f64, amplitude: f64) -> DescribingFunction {
    if amplitude == 0.0 {
        let rest = element.eval(mean, 0.0, 0.0);
        return DescribingFunction {
            mean_force: rest.f,
            stiffness: None,
            mean_slope: rest.df_dq,
        };
    }
    let mut angles = vec![0.0, PI];
    let passages = element
        .breakpoints()
        .into_iter()
        .map(|b| (b - mean) / amplitude);
    angles.extend(passages.filter(|x| x.abs() < 1.0).map(f64::acos));
    angles.sort_by(f64::total_cmp);
    let (mut force, mut first, mut slope) = (0.0, 0.0, 0.0);
    for pair in angles.windows(2) {
        let panels = ((pair[1] - pair[0]) / PANEL).ceil().max(1.0);
        let width = (pair[1] - pair[0]) / panels;
        let begins = (0..panels as usize).map(|k| pair[0] + k as f64 * width);
        for (begin, (x, weight)) in begins.flat_map(|b| unit_nodes().map(move |node| (b, node))) {
            let cos = (begin + x * width).cos();
            let response = element.eval(mean + amplitude * cos, 0.0, 0.0);
            let weight = weight * width / PI;
            force += weight * response.f;
            first += weight * response.f * cos;
            slope += weight * response.df_dq;
        }
    }
    DescribingFunction {
        mean_force: force,
        stiffness: Some(2.0 * first / amplitude),
        mean_slope: slope,
    }
}

/// Mean displacement around which a motion of this amplitude has the mean force `target`; the middle where a whole stretch
/// has, its end where the stretch has no other. `None` where no mean displacement gives that force.
///
/// The mean force must not fall with the mean displacement, as with every law that holds its connection.
pub fn mean_for_force(element: &dyn Element, amplitude: f64, target: f64) -> Option<f64> {
    let force = |mean: f64| describing_function(element, mean, amplitude).mean_force;
    // Rounding of the integrals: a force this close to the target is the target.
    let close = 1e-13 * (target.abs() + amplitude);
    let low = edge(|mean| force(mean) < target - close, -1.0);
    let high = edge(|mean| force(mean) > target + close, 1.0);
    match (low, high) {
        (Some(low), Some(high)) => Some(0.5 * (low + high)),
        (one, other) => one
            .or(other)
            .filter(|mean| (force(*mean) - target).abs() <= 1e3 * close),
    }
}

/// Where a predicate that holds beyond some point in the direction of `sign` begins to hold; `None` where it never does.
fn edge(holds: impl Fn(f64) -> bool, sign: f64) -> Option<f64> {
    let mut reach = 1.0;
    let mut doublings = 0;
    while !holds(sign * reach) {
        reach *= 2.0;
        doublings += 1;
        if doublings > DOUBLINGS {
            return None;
        }
    }
    let (mut outside, mut inside) = (sign * reach, -sign * reach);
    let mut doublings = 0;
    while holds(inside) {
        inside *= 2.0;
        doublings += 1;
        if doublings > DOUBLINGS {
            return None;
        }
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (outside + inside);
        if middle == outside || middle == inside {
            break;
        }
        if holds(middle) {
            outside = middle;
        } else {
            inside = middle;
        }
    }
    Some(inside)
}
