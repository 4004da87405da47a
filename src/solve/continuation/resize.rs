//! A path through a problem that changes its number of unknowns on the way, and steps that end before their point.

use super::{Continuation, PathPoint};
use crate::error::SolveError;
use crate::solve::residual::Residual;

impl Continuation {
    /// The path that goes on from the present point in the present unknowns of the problem, with its tangent, step length and
    /// number of points; `None` when the point cannot be corrected there.
    ///
    /// # Errors
    /// Errors of the problem.
    pub(crate) fn resized(
        &self,
        problem: &mut dyn Residual,
    ) -> Result<Option<Continuation>, SolveError> {
        let resized = |point: &PathPoint| PathPoint {
            u: problem.in_present_size(&point.u),
            tangent_u: problem.in_present_size(&point.tangent_u),
            ..point.clone()
        };
        let (point, first) = (resized(&self.point), resized(&self.first));
        let trail = self.trail.iter().map(resized).collect();
        let mut path = Continuation::standing(problem, point.clone(), self.options);
        let (guess, lambda) = (point.u.clone(), point.lambda);
        let point = path.correct(problem, &point, 0.0, guess, lambda)?;
        (path.step, path.stride, path.points) = (self.step, self.stride, self.points);
        (path.origin, path.point, path.first) = (point.clone(), point, first);
        (path.trail, path.rejections) = (trail, self.rejections);
        (path.vertical, path.progress) = (self.vertical, self.progress);
        let stands = path.point.newton.is_converged() && path.point.orientation != 0;
        Ok(stands.then_some(path))
    }

    /// Ends the last step half way; false, and nothing changes, when the corrector fails there.
    ///
    /// # Errors
    /// Errors of the problem.
    pub(crate) fn halve_step(&mut self, problem: &mut dyn Residual) -> Result<bool, SolveError> {
        match self.at_fraction(problem, 0.5)? {
            Some(point) if point.orientation != 0 => {
                self.take_back_waymark();
                self.stride *= 0.5;
                self.step = self.stride.max(self.options.min_step);
                (self.point, self.end) = (point, None);
                Ok(true)
            }
            _ => Ok(false),
        }
    }

    /// Whether the present point is the last one.
    pub(crate) fn has_ended(&self) -> bool {
        self.end.is_some()
    }
}
