//! A point on a path of tori.

use super::CurveOfTorus;

/// A torus with what is known of it.
#[derive(Debug, Clone)]
pub(crate) struct TorusPoint {
    /// The curve.
    pub torus: CurveOfTorus,
    /// Largest |P(K(theta)) - K(theta + rho)| between the points of the curve.
    pub error: f64,
    /// Largest transverse exponent per map, and its uncertainty.
    pub exponent: (f64, f64),
    /// Fewest and most passages of breakpoints per map.
    pub switches: (usize, usize),
    /// Whether it was solved at a mark.
    pub is_mark: bool,
}
