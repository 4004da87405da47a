//! Pseudo-arclength path following; knows nothing of vibration.
//!
//! The problem is lent to each call, not held, so that the caller may ask it for orbits and multipliers between steps.

mod bordered;
mod control;
mod corner;
mod crossing;
mod growth;
mod inside;
mod interpolant;
mod inverse;
mod resize;
mod retreat;
mod section;
mod trail;
mod types;
mod uncertainty;

pub use crossing::{CrossingSide, Heading};
pub use section::Section;
pub use types::{ContinuationOptions, Crossings, PathEnd, PathPoint};

use super::newton::{Newton, NewtonOutcome};
use super::residual::{Linearisation, Residual};
use crate::error::SolveError;
use bordered::Bordered;
use nalgebra::DVector;

/// Result of one call of `advance`.
#[derive(Debug)]
pub enum Advance<'p> {
    /// The next point.
    Point(&'p PathPoint),
    /// The path has ended.
    End(PathEnd),
}

/// Result of the first correction.
#[derive(Debug)]
pub enum Started {
    /// A path at its first point.
    Path(Box<Continuation>),
    /// The first point cannot be corrected.
    Failed(NewtonOutcome),
}

/// Pseudo-arclength continuation.
#[derive(Debug)]
pub struct Continuation {
    options: ContinuationOptions,
    newton: Newton,
    inner: Linearisation,
    inner_u: DVector<f64>,
    /// The point before `origin`, where the path leads on from there without a corner.
    before: Option<PathPoint>,
    origin: PathPoint,
    point: PathPoint,
    /// Arclength from `origin` to `point` along the tangent at `origin`.
    stride: f64,
    step: f64,
    points: usize,
    rejections: usize,
    /// Whether the path goes straight across the parameter at `origin` and at `point`.
    vertical: [bool; 2],
    first: PathPoint,
    /// Some of the points behind.
    trail: Vec<PathPoint>,
    /// Arclength since the last look at the progress, without the last step and with it.
    progress: [f64; 2],
    end: Option<PathEnd>,
}

impl Continuation {
    /// Corrects `u` at the first value of the range and finds the tangent there, pointing into the range.
    ///
    /// # Errors
    /// Contradictory options, or errors of the problem.
    pub fn start(
        problem: &mut dyn Residual,
        u: DVector<f64>,
        options: ContinuationOptions,
    ) -> Result<Started, SolveError> {
        Continuation::start_at(
            problem,
            (u, options.range.0),
            CrossingSide::Forward,
            options,
        )
    }

    /// A path at a point.
    fn standing(
        problem: &dyn Residual,
        origin: PathPoint,
        options: ContinuationOptions,
    ) -> Continuation {
        Continuation {
            newton: Newton::new(&problem.structure().bordered(), options.newton),
            inner: Linearisation::of(problem),
            inner_u: DVector::zeros(problem.dim()),
            point: origin.clone(),
            first: origin.clone(),
            trail: Vec::new(),
            before: None,
            origin,
            stride: 0.0,
            step: options.step,
            points: 1,
            rejections: 0,
            vertical: [false; 2],
            progress: [0.0; 2],
            end: None,
            options,
        }
    }

    /// The current point.
    pub fn point(&self) -> &PathPoint {
        &self.point
    }

    /// The point before the current one.
    pub fn origin(&self) -> &PathPoint {
        &self.origin
    }

    /// Linear systems that needed row exchanges across all coordinates, elimination by blocks having failed.
    pub fn exchanges(&self) -> usize {
        self.newton.exchanges()
    }

    /// Steps that were tried and shortened.
    pub fn rejections(&self) -> usize {
        self.rejections
    }

    /// Takes the next step.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn advance(&mut self, problem: &mut dyn Residual) -> Result<Advance<'_>, SolveError> {
        if self.end.is_none() && self.points >= self.options.max_points {
            self.end = Some(PathEnd::MaxPoints);
        }
        if let Some(end) = self.end {
            return Ok(Advance::End(end));
        }
        let base = self.point.clone();
        let mut is_first_try = true;
        loop {
            let (guess, lambda) = self.predict(self.step);
            let next = self.correct(problem, &base, self.step, guess, lambda)?;
            let turn = self.turn(&base, &next);
            if self.is_acceptable(&base, &next, turn) {
                self.stride = self.step;
                self.vertical = [self.vertical[1], self.is_straight_across(&base, &next)];
                // Where a longer step has just failed, the next one is no longer than this.
                let lengthening = if is_first_try { 2.0 } else { 1.0 };
                self.adapt(&next, turn, lengthening);
                self.before = Some(std::mem::replace(&mut self.origin, base));
                self.point = next;
                break;
            }
            self.rejections += 1;
            is_first_try = false;
            let is_crossing = self.is_crossing(&base, &next);
            if is_crossing || self.step <= self.options.min_step {
                if let Some((corner, next, step)) = self.turn_corner(problem, &base)? {
                    (self.stride, self.step) = (step, step);
                    self.vertical = [false; 2];
                    self.before = None;
                    (self.origin, self.point) = (corner, next);
                    break;
                }
                if is_crossing {
                    self.stride = self.step;
                    self.vertical = [false; 2];
                    self.before = None;
                    (self.origin, self.point) = (base, next);
                    break;
                }
                let end = PathEnd::StepTooSmall {
                    last: next.newton.status,
                };
                self.end = Some(end);
                return Ok(Advance::End(end));
            }
            self.step = (0.5 * self.step).max(self.options.min_step);
        }
        self.points += 1;
        self.finish(problem)?;
        if self.end.is_none() && self.creeps() {
            self.end = Some(PathEnd::Creeping);
        }
        Ok(Advance::Point(&self.point))
    }

    /// Ends the path exactly at the border of the range when the last step crossed it, or where the path closes.
    fn finish(&mut self, problem: &mut dyn Residual) -> Result<(), SolveError> {
        let (from, to) = self.options.range;
        let direction = self.options.direction();
        let (target, end) = match () {
            _ if (self.point.lambda - to) * direction >= 0.0 => (to, PathEnd::RangeReached),
            _ if (self.point.lambda - from) * direction <= 0.0 => (from, PathEnd::ReturnedToStart),
            _ => {
                self.end = self.returned(problem)?;
                self.leave_waymark();
                return Ok(());
            }
        };
        self.end = Some(end);
        if let Some((_, border)) = self.at_lambda(problem, target, (0.0, 1.0))? {
            self.point = border;
        }
        Ok(())
    }

    fn dot(&self, u: &DVector<f64>, lambda: f64, v: &DVector<f64>, mu: f64) -> f64 {
        self.options.weight * u.dot(v) + lambda * mu
    }

    /// Corrects a guess onto the path and the plane <tangent of `base`, x - base> = s, and finds the tangent.
    fn correct(
        &mut self,
        problem: &mut dyn Residual,
        base: &PathPoint,
        s: f64,
        guess: DVector<f64>,
        lambda: f64,
    ) -> Result<PathPoint, SolveError> {
        let dim = problem.dim();
        let mut x = guess.push(lambda);
        let (inner, u) = (&mut self.inner, &mut self.inner_u);
        let mut bordered = Bordered {
            problem,
            base,
            weight: self.options.weight,
            inner,
            u,
        };
        let newton = self.newton.solve(&mut bordered, &mut x, s)?;
        let (tangent_u, tangent_lambda, orientation) = match newton.is_converged() {
            true => self.tangent(),
            false => (DVector::from_element(dim, f64::NAN), f64::NAN, 0),
        };
        let lambda = x[dim];
        Ok(PathPoint {
            u: x.remove_row(dim),
            lambda,
            tangent_u,
            tangent_lambda,
            orientation,
            newton,
        })
    }

    /// Unit tangent at the last point visited, and the sign of the bordered determinant.
    fn tangent(&mut self) -> (DVector<f64>, f64, i8) {
        let dim = self.inner_u.len();
        // The last row of the bordered matrix is the tangent of the base, scaled: the solution keeps its direction.
        let mut tangent = DVector::zeros(dim + 1);
        tangent[dim] = 1.0;
        let orientation = self.newton.solve_linear(&mut tangent);
        let lambda = tangent[dim];
        let u = tangent.remove_row(dim);
        let norm = self.dot(&u, lambda, &u, lambda).sqrt();
        (u / norm, lambda / norm, orientation)
    }
}
