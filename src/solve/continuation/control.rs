//! Step control: where the next point is expected, whether it is the right one, how long the step after it is.

use super::{Continuation, Crossings, PathPoint};
use crate::numeric::interpolation;
use crate::solve::newton::SETTLED;
use nalgebra::DVector;

/// Largest angle between successive tangents; a step that turns further is halved [rad].
pub(super) const MAX_TURN: f64 = 0.5;
/// Largest distance of a point from the end of the tangent, in lengths of the step: a smooth path that turns by the largest angle stays
/// nearer, and what lies farther may be another path.
pub(super) const MAX_SHIFT: f64 = 0.3;
/// Largest angle between tangents where another path is crossed.
const MAX_TURN_CROSSING: f64 = 0.1;
/// Angle between successive tangents that the step length aims for [rad].
const TURN_AIM: f64 = 0.15;
/// Least share of a step that the next one keeps: a corner that was passed says nothing of the path behind it.
const SHORTEST: f64 = 0.5;
/// Shortest last step, in lengths of the next one, that tells how the path bends.
const SHORTEST_BEND: f64 = 0.1;
/// Distance of a point from the end of the tangent, in lengths of the step, below which the tangent is good enough.
const BESIDE_TANGENT: f64 = 5e-4;
/// Steps below this share of the first one may turn as they like: the path has a corner there.
const CORNER_STEP: f64 = 1e-3;

impl Continuation {
    /// Step length for the next step, from a point: few iterations and small turns lengthen it.
    pub(super) fn adapt(&mut self, next: &PathPoint, turn: f64, lengthening: f64) {
        // Where rounding ends the iteration, its last steps say nothing of the path.
        let is_rounding = next.newton.residual_norm > self.options.newton.tolerance;
        let idle = if is_rounding { SETTLED } else { 0 };
        let by_iterations = match next.newton.iterations.saturating_sub(idle) {
            0..=2 => 2.0,
            3 => 1.5,
            4 | 5 => 1.0,
            _ => 0.5,
        };
        let by_turn = (TURN_AIM / turn.max(1e-12)).clamp(SHORTEST, lengthening);
        let step = self.step * f64::min(by_iterations, by_turn);
        // A straight line is followed to its end, if it has one, in a few steps.
        let longest = match self.vertical[1] {
            true => f64::INFINITY,
            false => self.longest(next),
        };
        self.step = step.clamp(self.options.min_step, longest);
    }

    /// Where the path is expected a step on from the present point: along the parabola that the last two tangents make, or along
    /// the tangent where the last step turned too far, or was too short, to tell how the path bends. Where tangents are not to be
    /// trusted, along the parabola through the last three points.
    pub(super) fn predict(&self, step: f64) -> (DVector<f64>, f64) {
        if let Some(expected) = self.through_points(step) {
            return expected;
        }
        let (from, base) = (&self.origin, &self.point);
        let is_bend_known =
            self.stride > SHORTEST_BEND * step && self.turn(from, base) < 2.0 * TURN_AIM;
        let bend = match is_bend_known {
            true => 0.5 * step * step / self.stride,
            false => 0.0,
        };
        let along = step + bend;
        (
            &base.u + &base.tangent_u * along - &from.tangent_u * bend,
            base.lambda + base.tangent_lambda * along - from.tangent_lambda * bend,
        )
    }

    /// The point a step on of the parabola through the last three points, where the last one lies farther beside the tangent of the
    /// one before than the path turns: over long periods of unstable orbits tangents have few digits, and points have all.
    ///
    /// ```text
    /// x(s),    s = <t, x - x_2>,    t: tangent at the last point x_2, whichever way it points
    /// ```
    fn through_points(&self, step: f64) -> Option<(DVector<f64>, f64)> {
        let (first, from, base) = (self.before.as_ref()?, &self.origin, &self.point);
        let beside = self.shift(from, base, self.stride);
        let turn = self.turn(from, base);
        if !(beside > BESIDE_TANGENT.max(turn) && turn < TURN_AIM) {
            return None;
        }
        let nodes = [first, from, base].map(|point| {
            let (u, lambda) = (&point.u - &base.u, point.lambda - base.lambda);
            self.dot(&base.tangent_u, base.tangent_lambda, &u, lambda)
        });
        let is_apart = |k: usize| nodes[k + 1] - nodes[k] > SHORTEST_BEND * step;
        if !(is_apart(0) && is_apart(1)) {
            return None;
        }
        let mut shares = [0.0; 3];
        interpolation::weights(&nodes, step, &mut shares);
        let (mut u, mut lambda) = (DVector::zeros(base.u.len()), 0.0);
        for (share, point) in shares.iter().zip([first, from, base]) {
            u.axpy(*share, &point.u, 1.0);
            lambda += share * point.lambda;
        }
        Some((u, lambda))
    }

    /// Whether the path goes on at a corrected point.
    pub(super) fn is_acceptable(&self, base: &PathPoint, next: &PathPoint, turn: f64) -> bool {
        if !next.newton.is_converged() || next.orientation == 0 {
            return false;
        }
        // Where the path turns sharply, a change of orientation says that it lies the wrong way round.
        let is_kept = base.orientation == 0 || base.orientation == next.orientation;
        let is_crossing = match self.options.crossings {
            Crossings::Expected => turn <= MAX_TURN_CROSSING,
            Crossings::Exceptional => false,
        };
        if !is_kept && !is_crossing {
            return false;
        }
        let is_near = turn < MAX_TURN && self.shift(base, next, self.step) < MAX_SHIFT;
        is_near || self.is_tiny()
    }

    /// Whether the path may turn as it likes in the step.
    fn is_tiny(&self) -> bool {
        self.step < CORNER_STEP * self.options.step
    }

    /// Whether the orientation changes in a step so short that another path crosses, unless this one has a corner: at a
    /// crossing the tangents lie anywhere.
    pub(super) fn is_crossing(&self, base: &PathPoint, next: &PathPoint) -> bool {
        self.is_tiny() && base.orientation * next.orientation < 0
    }

    /// Angle between two tangents [rad].
    pub(super) fn turn(&self, a: &PathPoint, b: &PathPoint) -> f64 {
        self.dot(
            &a.tangent_u,
            a.tangent_lambda,
            &b.tangent_u,
            b.tangent_lambda,
        )
        .clamp(-1.0, 1.0)
        .acos()
    }

    /// Distance of a corrected point from the end of the tangent, in lengths of the step.
    pub(super) fn shift(&self, base: &PathPoint, next: &PathPoint, step: f64) -> f64 {
        let u = &next.u - &base.u - &base.tangent_u * step;
        let lambda = next.lambda - base.lambda - base.tangent_lambda * step;
        self.dot(&u, lambda, &u, lambda).sqrt() / step
    }
}
