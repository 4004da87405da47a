//! Points inside the last step: at a fraction of it, and at a parameter.

use super::{Continuation, PathPoint};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::residual::Residual;

/// Width to which the fraction of a parameter is found.
const NARROW: f64 = 1e-12;

impl Continuation {
    /// A point at a fraction of the last step, between `origin` (0) and `point` (1): the primitive for locating events.
    /// `None` when the corrector fails there.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn at_fraction(
        &mut self,
        problem: &mut dyn Residual,
        fraction: f64,
    ) -> Result<Option<PathPoint>, SolveError> {
        let origin = self.origin.clone();
        let (u, lambda) = self.interpolate(fraction);
        // Measured along the chord where the last point was moved to the border of the range.
        let s = self.dot(
            &origin.tangent_u,
            origin.tangent_lambda,
            &(&u - &origin.u),
            lambda - origin.lambda,
        );
        let point = self.correct(problem, &origin, s, u, lambda)?;
        Ok(point.newton.is_converged().then_some(point))
    }

    /// The point of the last step with this parameter and its fraction, between two fractions whose parameters enclose it,
    /// solved exactly at `target`. `None` when it cannot be reached.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn at_lambda(
        &mut self,
        problem: &mut dyn Residual,
        target: f64,
        (low, high): (f64, f64),
    ) -> Result<Option<(f64, PathPoint)>, SolveError> {
        if let Some(found) = self.by_interpolant(problem, target, (low, high))? {
            return Ok(Some(found));
        }
        // Next to a fold the interpolant may turn before the path does, or end on the wrong arm.
        let ends = [
            self.at_fraction(problem, low)?,
            self.at_fraction(problem, high)?,
        ];
        let [Some(a), Some(b)] = ends.map(|end| end.map(|p| p.lambda - target)) else {
            return Ok(None);
        };
        if a * b > 0.0 {
            return Ok(None);
        }
        let mut last = None;
        let value = |x: f64| {
            let point = self.at_fraction(problem, x).map_err(Some)?.ok_or(None)?;
            let value = point.lambda - target;
            last = Some((x, point));
            Ok::<f64, Option<SolveError>>(value)
        };
        let root = match roots::bracketed(value, (low, a), (high, b), NARROW) {
            Ok(found) => found.root,
            Err(Some(error)) => return Err(error),
            Err(None) => return Ok(None),
        };
        let near = match last.filter(|(x, _)| *x == root) {
            Some((_, point)) => Some(point),
            None => self.at_fraction(problem, root)?,
        };
        let Some(near) = near else { return Ok(None) };
        let point = self.at_fixed(problem, &near, target)?;
        Ok(point.map(|point| (root, point)))
    }

    /// The same from the root of the interpolant, which is a guess good to the fourth order of the step; `None` where it has
    /// none, or where the corrector leaves the arm of the path on which it lies.
    fn by_interpolant(
        &mut self,
        problem: &mut dyn Residual,
        target: f64,
        (low, high): (f64, f64),
    ) -> Result<Option<(f64, PathPoint)>, SolveError> {
        let value = |this: &Self, x: f64| this.interpolate(x).1 - target;
        let (at_low, at_high) = (value(self, low), value(self, high));
        if (at_low > 0.0) == (at_high > 0.0) && at_low != 0.0 && at_high != 0.0 {
            return Ok(None);
        }
        let interpolant = |x: f64| Ok::<_, SolveError>(value(self, x));
        let fraction = roots::bracketed(interpolant, (low, at_low), (high, at_high), NARROW)?.root;
        let Some(near) = self.at_fraction(problem, fraction)? else {
            return Ok(None);
        };
        let point = self.at_fixed(problem, &near, target)?;
        let rise = at_high - at_low;
        let is_onward =
            |p: &PathPoint| p.tangent_lambda * rise > 0.0 && near.tangent_lambda * rise > 0.0;
        Ok(point.filter(is_onward).map(|point| (fraction, point)))
    }

    /// The point at a parameter near a point of the last step; `None` when the corrector fails or leads elsewhere.
    fn at_fixed(
        &mut self,
        problem: &mut dyn Residual,
        near: &PathPoint,
        target: f64,
    ) -> Result<Option<PathPoint>, SolveError> {
        let direction = if near.tangent_lambda < 0.0 { -1.0 } else { 1.0 };
        let mut fixed = near.clone();
        fixed.tangent_u.fill(0.0);
        fixed.tangent_lambda = direction;
        fixed.lambda = target;
        let slope = (target - near.lambda) / near.tangent_lambda;
        let guess = if slope.abs() < self.stride {
            &near.u + &near.tangent_u * slope
        } else {
            near.u.clone()
        };
        let mut point = self.correct(problem, &fixed, 0.0, guess, target)?;
        // The Newton step at fixed parameter must not have jumped to another part of the path.
        let gap = &point.u - &near.u;
        let distance = self.dot(&gap, 0.0, &gap, 0.0).sqrt();
        if !point.newton.is_converged() || distance > self.stride {
            return Ok(None);
        }
        if self.dot(
            &point.tangent_u,
            point.tangent_lambda,
            &near.tangent_u,
            near.tangent_lambda,
        ) < 0.0
        {
            point.tangent_u.neg_mut();
            point.tangent_lambda = -point.tangent_lambda;
            point.orientation = -point.orientation;
        }
        Ok(Some(point))
    }
}
