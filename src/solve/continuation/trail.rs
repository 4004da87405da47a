//! Where a path has been: it ends where it comes back onto itself.

use super::{Continuation, PathEnd, PathPoint};
use crate::error::SolveError;
use crate::solve::residual::Residual;

/// Points from one waymark to the next.
const SPACING: usize = 16;
/// Points before the first one can be met again.
pub(super) const FEWEST: usize = 4;
/// Distance of two corrections of one point, in arclength; two curves that lie closer and side by side are unheard of.
const SAME: f64 = 1e-6;
/// Angle between tangents at one point of one curve [rad].
const SAME_DIRECTION: f64 = 0.05;

impl Continuation {
    /// Leaves a waymark at the present point at regular intervals of points.
    pub(super) fn leave_waymark(&mut self) {
        if self.points.is_multiple_of(SPACING) {
            self.trail.push(self.point.clone());
        }
    }

    /// Removes a waymark at the present point, which the path is going to leave out.
    pub(super) fn take_back_waymark(&mut self) {
        let is_here =
            |mark: &mut PathPoint| mark.lambda == self.point.lambda && mark.u == self.point.u;
        self.trail.pop_if(is_here);
    }

    /// How the path ends if the last step came back to a place where the path has been.
    pub(super) fn returned(
        &mut self,
        problem: &mut dyn Residual,
    ) -> Result<Option<PathEnd>, SolveError> {
        if self.points < FEWEST {
            return Ok(None);
        }
        if self.passes(&self.first).is_some_and(|p| p.is_onwards) {
            return Ok(Some(PathEnd::Closed));
        }
        for k in 0..self.trail.len() {
            let Some(passage) = self.passes(&self.trail[k]) else {
                continue;
            };
            let mark = self.trail[k].clone();
            let (u, lambda) = self.interpolate(passage.fraction);
            let again = self.correct(problem, &mark, 0.0, u, lambda)?;
            let (gap, along) = (&again.u - &mark.u, again.lambda - mark.lambda);
            if again.newton.is_converged()
                && self.dot(&gap, along, &gap, along).sqrt() < SAME
                && self.turn(&mark, &again) < SAME_DIRECTION
            {
                return Ok(Some(PathEnd::Looped));
            }
        }
        Ok(None)
    }

    /// Whether the last step passes the plane across the path at a point, near that point.
    fn passes(&self, mark: &PathPoint) -> Option<PlanePassage> {
        let near = 2.0 * self.stride;
        if (self.point.lambda - mark.lambda).abs() > near {
            return None;
        }
        let gap = &self.point.u - &mark.u;
        let ahead = self.point.lambda - mark.lambda;
        if self.dot(&gap, ahead, &gap, ahead).sqrt() > near {
            return None;
        }
        let along = |p: &PathPoint| {
            let (u, lambda) = (&p.u - &mark.u, p.lambda - mark.lambda);
            self.dot(&mark.tangent_u, mark.tangent_lambda, &u, lambda)
        };
        let (from, to) = (along(&self.origin), along(&self.point));
        // The step that leaves a waymark does not come back to it, whatever a new size of the problem makes of its place.
        if from.abs() < SAME {
            return None;
        }
        let is_onwards = from < 0.0 && to >= 0.0;
        let is_backwards = from > 0.0 && to <= 0.0;
        (is_onwards || is_backwards).then(|| PlanePassage {
            fraction: from / (from - to),
            is_onwards,
        })
    }
}

/// A plane passed in a step.
struct PlanePassage {
    fraction: f64,
    is_onwards: bool,
}
