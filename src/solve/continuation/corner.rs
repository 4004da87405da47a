//! Corners: the path of a piecewise-linear problem turns where a sample passes a kink, and may turn back.
//!
//! Behind a kink the Jacobian is another one. Its null vector is the direction in which the path goes on, and the sign of
//!
//!     det [dR/du, dR/dlambda; tangent]
//!
//! which no smooth stretch and no passage of a single kink changes, tells which of its two ends is ahead. Where the path turns
//! by more than a right angle no plane across the old tangent meets it, however short the step.

use super::{Continuation, PathPoint};
use crate::error::SolveError;
use crate::solve::residual::Residual;

/// Distances ahead at which the Jacobian behind the kink is looked for, as shares of the first step.
const AHEAD: [f64; 5] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2];
/// Steps tried along the new direction, as shares of the first step.
const STEPS: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
/// Cosine above which a direction is the old one.
const SAME: f64 = 1.0 - 1e-9;

impl Continuation {
    /// Takes a step round a corner; false when none of the pieces ahead leads on.
    pub(super) fn turn_corner(&mut self, problem: &mut dyn Residual) -> Result<bool, SolveError> {
        for ahead in AHEAD {
            let Some(base) = self.direction_behind(problem, ahead * self.options.step)? else {
                continue;
            };
            for share in STEPS {
                let step = share * self.options.step;
                if step < self.options.min_step {
                    break;
                }
                let guess = &base.u + &base.tangent_u * step;
                let lambda = base.lambda + base.tangent_lambda * step;
                let next = self.correct(problem, &base, step, guess, lambda)?;
                if next.newton.is_converged() && next.orientation == base.orientation {
                    (self.stride, self.step) = (step, step);
                    (self.origin, self.point) = (base, next);
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// The current point with the direction of the path in the piece that lies `distance` ahead; `None` when that is the old one.
    fn direction_behind(
        &mut self,
        problem: &mut dyn Residual,
        distance: f64,
    ) -> Result<Option<PathPoint>, SolveError> {
        let here = self.point.clone();
        let u = &here.u + &here.tangent_u * distance;
        let lambda = here.lambda + here.tangent_lambda * distance;
        let mut base = here.clone();
        let Some(found) = self.tangent_at(problem, &here, distance, u, lambda)? else {
            return Ok(None);
        };
        (base.tangent_u, base.tangent_lambda) = (found.tangent_u, found.tangent_lambda);
        if found.orientation != here.orientation {
            base.tangent_u.neg_mut();
            base.tangent_lambda = -base.tangent_lambda;
        }
        let cosine = self.dot(
            &here.tangent_u,
            here.tangent_lambda,
            &base.tangent_u,
            base.tangent_lambda,
        );
        Ok((cosine < SAME).then_some(base))
    }
}
