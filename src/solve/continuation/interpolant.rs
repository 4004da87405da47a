//! Cubic Hermite interpolant of the last step: places of the path good to the fourth order of its length, without a correction.

use super::{Continuation, PathPoint};
use crate::numeric::turning;
use nalgebra::DVector;

impl Continuation {
    /// Unknowns and parameter at a fraction of the last step, between `origin` (0) and `point` (1).
    pub(crate) fn interpolate(&self, x: f64) -> (DVector<f64>, f64) {
        let (a, b) = (&self.origin, &self.point);
        let chord = &b.u - &a.u;
        let length = self.chord();
        let h11 = x * x * (x - 1.0) * length;
        let h10 = x * (x - 1.0) * (x - 1.0) * length;
        let h01 = x * x * (3.0 - 2.0 * x);
        let u = &a.u + chord * h01 + &a.tangent_u * h10 + &b.tangent_u * h11;
        let lambda = a.lambda
            + (b.lambda - a.lambda) * h01
            + a.tangent_lambda * h10
            + b.tangent_lambda * h11;
        (u, lambda)
    }

    /// Derivative of the parameter with respect to the fraction.
    pub(crate) fn lambda_slope(&self, x: f64) -> f64 {
        let [c0, c1, c2] = self.lambda_slope_coefficients();
        c0 + x * (c1 + x * c2)
    }

    /// Derivative of the parameter with respect to the fraction on the corrected path, up to its sign where the path turns by more than a
    /// right angle in the step.
    pub(crate) fn slope_at(&self, x: f64, point: &PathPoint) -> f64 {
        let (a, b) = (&self.origin, &self.point);
        let along = |u: &DVector<f64>, lambda| self.dot(&a.tangent_u, a.tangent_lambda, u, lambda);
        let (chord, length) = (&b.u - &a.u, self.chord());
        let advance = 6.0 * x * (1.0 - x) * along(&chord, b.lambda - a.lambda)
            + length * (1.0 - x) * (1.0 - 3.0 * x)
            + length * x * (3.0 * x - 2.0) * along(&b.tangent_u, b.tangent_lambda);
        point.tangent_lambda * advance / along(&point.tangent_u, point.tangent_lambda)
    }

    /// Fractions inside the last step at which the parameter turns, ascending.
    pub fn turns(&self) -> Vec<f64> {
        let mut list: Vec<f64> = turning::turns_of_cubic(self.lambda_slope_coefficients())
            .into_iter()
            .filter(|x| *x > 0.0 && *x < 1.0)
            .collect();
        list.sort_by(f64::total_cmp);
        list.dedup();
        list
    }

    /// Arclength of the chord of the last step.
    pub fn chord(&self) -> f64 {
        let (a, b) = (&self.origin, &self.point);
        let (u, lambda) = (&b.u - &a.u, b.lambda - a.lambda);
        self.dot(&u, lambda, &u, lambda).sqrt()
    }

    /// Coefficients of 1, x, x^2.
    fn lambda_slope_coefficients(&self) -> [f64; 3] {
        let (a, b) = (&self.origin, &self.point);
        let length = self.chord();
        let (ta, tb) = (length * a.tangent_lambda, length * b.tangent_lambda);
        turning::slope_of_cubic((ta, tb), b.lambda - a.lambda)
    }
}
