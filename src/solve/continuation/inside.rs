//! Paths that begin inside the range.

use super::trail::FEWEST;
use super::{Continuation, ContinuationOptions, CrossingSide, PathPoint, Started};
use crate::error::SolveError;
use crate::solve::newton::NewtonOutcome;
use crate::solve::residual::Residual;
use nalgebra::DVector;

impl Continuation {
    /// Corrects `u` at a parameter and finds the tangent there; forwards is the way from the first to the last value of the
    /// range.
    ///
    /// # Errors
    /// Contradictory options, or errors of the problem.
    pub(crate) fn start_at(
        problem: &mut dyn Residual,
        (u, lambda): (DVector<f64>, f64),
        side: CrossingSide,
        options: ContinuationOptions,
    ) -> Result<Started, SolveError> {
        let sign = match side {
            CrossingSide::Forward => options.direction(),
            CrossingSide::Backward => -options.direction(),
        };
        // With du = 0 and dlambda = +-1 as tangent the arclength equation keeps lambda where it is.
        let direction = (DVector::zeros(u.len()), sign);
        Continuation::start_across(problem, (u, lambda), direction, options)
    }

    /// The same in the plane across a unit direction (du, dlambda), along which the path leads on.
    ///
    /// # Errors
    /// Contradictory options, or errors of the problem.
    pub(crate) fn start_across(
        problem: &mut dyn Residual,
        (u, lambda): (DVector<f64>, f64),
        (tangent_u, tangent_lambda): (DVector<f64>, f64),
        options: ContinuationOptions,
    ) -> Result<Started, SolveError> {
        options.validate()?;
        let origin = PathPoint {
            tangent_u,
            tangent_lambda,
            lambda,
            u,
            orientation: 0,
            newton: NewtonOutcome::unsolved(),
        };
        let mut this = Continuation::standing(problem, origin.clone(), options);
        let point = this.correct(problem, &origin, 0.0, origin.u.clone(), lambda)?;
        if !point.newton.is_converged() {
            return Ok(Started::Failed(point.newton));
        }
        this.origin = point.clone();
        this.first = point.clone();
        this.point = point;
        Ok(Started::Path(Box::new(this)))
    }

    /// A path whose last step is known, from `origin` to `point`; it is closed where it comes to `first`.
    pub(crate) fn from_step(
        problem: &dyn Residual,
        (origin, point): (PathPoint, PathPoint),
        first: PathPoint,
        options: ContinuationOptions,
    ) -> Continuation {
        let mut this = Continuation::standing(problem, origin, options);
        (this.point, this.first) = (point, first);
        // What lies before the step counts.
        this.points = FEWEST;
        this.stride = this.chord();
        this
    }
}
