//! Leaving a path where another one crosses it.

use super::bordered::Bordered;
use super::{Continuation, ContinuationOptions, PathPoint};
use crate::error::SolveError;
use crate::numeric::factors::Factors;
use crate::solve::residual::{Linearisation, Residual};
use nalgebra::DVector;

/// The two ways along a path that crosses another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The way on which the largest part of the direction grows.
    Forward,
    /// The other one.
    Backward,
}

/// Inverse iterations; the smallest singular value lies below the next one by 1e-4 and less.
const ROUNDS: usize = 4;
/// Shifts of the parameter, relative to its size, tried where a pivot vanishes at the crossing itself.
const SHIFTS: [f64; 3] = [0.0, 1e-10, 1e-8];
/// Increment of the golden ratio: an uneven right-hand side, the same everywhere.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Continuation {
    /// A path that stands at a crossing and leaves it along the direction that the known path does not have; `None` when
    /// there is no such direction.
    ///
    ///     [dR/du  dR/dlambda] n = 0,    <tangent, n> = 0
    ///
    /// `crossing` is a point of the known path with its tangent.
    ///
    /// # Errors
    /// Contradictory options, or what the problem returns.
    pub fn branch_off(
        problem: &mut dyn Residual,
        crossing: &PathPoint,
        side: Side,
        options: ContinuationOptions,
    ) -> Result<Option<Continuation>, SolveError> {
        options.validate()?;
        let Some(direction) = second_direction(problem, crossing, options.weight)? else {
            return Ok(None);
        };
        let mut origin = crossing.clone();
        let dim = problem.dim();
        (origin.tangent_u, origin.tangent_lambda) = (direction.rows(0, dim).into(), direction[dim]);
        // Neither path is the only one here: the determinant has no sign.
        origin.orientation = 0;
        let mut this = Continuation::standing(problem, origin, options);
        let (u, lambda) = (&this.origin.tangent_u, this.origin.tangent_lambda);
        let length = this.dot(u, lambda, u, lambda).sqrt();
        let sign = match side {
            Side::Forward => 1.0,
            Side::Backward => -1.0,
        };
        this.origin.tangent_u *= sign / length;
        this.origin.tangent_lambda *= sign / length;
        (this.first, this.point) = (this.origin.clone(), this.origin.clone());
        Ok(Some(this))
    }
}

/// Half width of the difference quotient along the interpolant, in lengths of the step.
const QUOTIENT: f64 = 1e-4;

impl Continuation {
    /// The point with the tangent of the interpolant at its fraction of the last step: at a crossing the corrector's matrix is
    /// singular and its tangent may lie anywhere between the two paths.
    pub fn with_smooth_tangent(&self, mut point: PathPoint, fraction: f64) -> PathPoint {
        let (before, lambda_before) = self.interpolate(fraction - QUOTIENT);
        let (behind, lambda_behind) = self.interpolate(fraction + QUOTIENT);
        let (u, lambda) = (behind - before, lambda_behind - lambda_before);
        let length = self.dot(&u, lambda, &u, lambda).sqrt();
        (point.tangent_u, point.tangent_lambda) = (u / length, lambda / length);
        point
    }
}

/// The null vector (u, lambda) that is orthogonal to the tangent, its largest part positive.
fn second_direction(
    problem: &mut dyn Residual,
    crossing: &PathPoint,
    weight: f64,
) -> Result<Option<DVector<f64>>, SolveError> {
    let structure = problem.structure().bordered();
    let (mut inner, mut u) = (Linearisation::of(problem), crossing.u.clone());
    let mut bordered = Bordered {
        problem,
        base: crossing,
        weight,
        inner: &mut inner,
        u: &mut u,
    };
    let mut work = Linearisation::new(&structure);
    let mut factors = Factors::new(&structure);
    for shift in SHIFTS {
        let lambda = crossing.lambda * (1.0 + shift) + shift;
        bordered.linearise(&crossing.u.clone().push(lambda), 0.0, &mut work)?;
        if !factors.factorise(&work.dr_du) {
            continue;
        }
        let mut x = DVector::from_fn(work.r.len(), |k, _| (k as f64 * GOLDEN).fract() - 0.5);
        let mut best = (0.0, None);
        for _ in 0..ROUNDS {
            x /= x.norm();
            if !factors.solve(&work.dr_du, &mut x) {
                break;
            }
            // The larger the solution, the smaller its product with the matrix.
            let growth = x.norm();
            if growth.is_finite() && growth > best.0 {
                best = (growth, Some(x.clone()));
            }
        }
        if let Some(direction) = best.1 {
            let largest = direction[direction.icamax()];
            return Ok(Some(direction / largest));
        }
    }
    Ok(None)
}
