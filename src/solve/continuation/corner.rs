//! Corners: where a derivative of the residual jumps, the path may leave in a direction that no short step forwards reaches.
//!
//! Beyond the surface on which a derivative jumps, the Jacobian is another one and with it the tangent t+. The determinant of the
//! bordered Jacobian tells which way along it leads on:
//!
//! ```text
//! [dR/du  dR/dlambda] t+ = 0  just beyond the corner,    sign det [dR/du  dR/dlambda; t+] = the path's orientation
//! ```
//!
//! Allgower & Georg (1990), Numerical continuation methods, chapter 15.

use super::bordered::Bordered;
use super::control::{MAX_SHIFT, MAX_TURN};
use super::{Continuation, PathPoint};
use crate::error::SolveError;
use crate::solve::residual::Residual;

/// How far beyond the last point the Jacobian is taken, in smallest steps: beyond the first of several surfaces that lie close
/// together, or beyond all of them.
const BEYOND: [f64; 5] = [4.0, 16.0, 128.0, 1024.0, 8192.0];
/// First length tried behind a corner, as a share of the first step.
const LEAVING: f64 = 1e-2;
/// Shortening of a length that fails.
const SHORTER: f64 = 0.125;
/// Shortest length behind a corner, in distances of the Jacobian.
const CLEAR: f64 = 4.0;

impl Continuation {
    /// The first point behind a corner that lies within a smallest step of `base`, with `base` in its new direction and the
    /// length between them; `None` where the path does not leave.
    pub(super) fn turn_corner(
        &mut self,
        problem: &mut dyn Residual,
        base: &PathPoint,
    ) -> Result<Option<(PathPoint, PathPoint, f64)>, SolveError> {
        if base.orientation == 0 {
            return Ok(None);
        }
        for distance in BEYOND.map(|k| k * self.options.min_step) {
            let Some(corner) = self.direction_beyond(problem, base, distance)? else {
                continue;
            };
            let mut step = LEAVING * self.options.step;
            while step >= CLEAR * distance {
                let next = self.attempt(problem, &corner, step)?;
                if next.newton.is_converged()
                    && next.orientation == base.orientation
                    && self.turn(&corner, &next) < MAX_TURN
                    && self.shift(&corner, &next, step) < MAX_SHIFT
                {
                    return Ok(Some((corner, next, step)));
                }
                step *= SHORTER;
            }
        }
        Ok(None)
    }

    /// `base` with the tangent that holds a distance further on.
    fn direction_beyond(
        &mut self,
        problem: &mut dyn Residual,
        base: &PathPoint,
        distance: f64,
    ) -> Result<Option<PathPoint>, SolveError> {
        let u = &base.u + &base.tangent_u * distance;
        let x = u.push(base.lambda + base.tangent_lambda * distance);
        let mut bordered = Bordered {
            problem,
            base,
            weight: self.options.weight,
            inner: &mut self.inner,
            u: &mut self.inner_u,
        };
        self.newton.visit(&mut bordered, &x, distance)?;
        let (tangent_u, tangent_lambda, orientation) = self.tangent();
        if orientation == 0 {
            return Ok(None);
        }
        // The border keeps the direction of `base`; where the determinant has changed its sign, the path turns back.
        let sign = f64::from(orientation * base.orientation);
        Ok(Some(PathPoint {
            tangent_u: tangent_u * sign,
            tangent_lambda: tangent_lambda * sign,
            ..base.clone()
        }))
    }

    /// The point a step on along the tangent of `base`, whatever became of its correction.
    fn attempt(
        &mut self,
        problem: &mut dyn Residual,
        base: &PathPoint,
        step: f64,
    ) -> Result<PathPoint, SolveError> {
        let guess = &base.u + &base.tangent_u * step;
        let lambda = base.lambda + base.tangent_lambda * step;
        self.correct(problem, base, step, guess, lambda)
    }
}
