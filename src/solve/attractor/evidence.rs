//! Whether the points of a record are evidence of an invariant curve that attracts them.

use super::curve::{self, InvariantCurve};
use super::geometry::Cloud;
use super::lyapunov::Exponents;
use super::map::Tori;

/// Error of the prediction on an invariant curve that is evidence for it.
const PREDICTED: f64 = 0.05;
/// The same where exponents do not confirm it.
const PREDICTED_ALONE: f64 = 1e-6;
/// Error of the prediction above which it must fall with the length of the record, and to which share.
const FALLING: (f64, f64) = (1e-3, 0.7);
/// Logarithm of the contraction across the curve over the record; where its prediction needs no falling, which shows that what lies
/// across has decayed.
const CONTRACTION: [f64; 2] = [4.0, 1.0];
/// Points on which a torus is judged in the end, as far as the limit of the extension allows: fewer cannot tell it from a slow approach to an
/// orbit of some dozens of periods.
pub(super) const POINTS: usize = 600;
/// Error of the prediction, in those of the first points, that the curve of more points may have.
const WORSE: f64 = 1.5;
/// The curve on which points seem to lie.
pub(super) fn curve(
    tori: Tori,
    cloud: &Cloud<'_>,
    exponents: Option<&Exponents>,
) -> Option<InvariantCurve> {
    let is_neutral = match (tori, exponents) {
        (Tori::Excluded, _) => false,
        (_, Some(e)) => e.is_neutral(),
        (_, None) => true,
    };
    if !is_neutral {
        return None;
    }
    let limit = match exponents {
        Some(_) => PREDICTED,
        None => PREDICTED_ALONE,
    };
    let falls = |curve: &InvariantCurve| {
        curve.error <= FALLING.0 || curve.error <= FALLING.1 * curve.error_of_half
    };
    let attracts = |curve: &InvariantCurve| match (tori, exponents) {
        (Tori::Possible, Some(e)) => {
            e.contracts_across(CONTRACTION[usize::from(curve.error <= FALLING.0)])
        }
        _ => true,
    };
    curve::invariant_curve(cloud)
        .filter(|curve| curve.error <= limit && falls(curve) && attracts(curve))
}

/// Whether the curve of a record that has gone on predicts about as well as that of its first points.
pub(super) fn still_predicts(
    curve: &InvariantCurve,
    first: &InvariantCurve,
    exponents: Option<&Exponents>,
) -> bool {
    let good = exponents.map_or(PREDICTED_ALONE, |_| FALLING.0);
    curve.error <= WORSE * first.error.max(good)
}
