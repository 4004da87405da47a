//! Paths that lead nowhere: straight across the parameter, along an asymptote, or hardly on at all.

use super::{Continuation, PathPoint};

/// Size of the unknowns, in units of arclength, above which the longest step grows with them.
const FAR: f64 = 2.0;
/// Largest change of the parameter in a step of a vertical path, relative to the larger of parameter and range: what correctors
/// leave.
const STANDING: f64 = 1e-9;
/// The same in the step that leaves a crossing, which is located less well.
const STANDING_FIRST: f64 = 2e-8;
/// Largest angle between the tangents of a straight path [rad]: what correctors leave.
const STRAIGHT: f64 = 1e-6;
/// Shortest vertical step, in arclength: in shorter ones any path looks straight.
const SHORTEST: f64 = 1e-3;
/// Points from one look at the progress to the next.
const WINDOW: usize = 100;
/// Least progress in between, in longest steps: a path that needs shorter ones for so long cannot be followed.
const LEAST: f64 = 0.5;

impl Continuation {
    /// Whether the points since the last look brought hardly any progress.
    pub(super) fn creeps(&mut self) -> bool {
        let before = self.progress[1];
        let behind = before + self.stride;
        let is_look = self.points.is_multiple_of(WINDOW);
        self.progress = [before, if is_look { 0.0 } else { behind }];
        is_look && behind < LEAST * self.options.max_step
    }

    /// Longest step from a point: far out lengths are relative, or it takes for ever to get anywhere.
    pub(super) fn longest(&self, point: &PathPoint) -> f64 {
        let size = self.dot(&point.u, 0.0, &point.u, 0.0).sqrt();
        self.options.max_step * (size - FAR).max(1.0)
    }

    /// Whether a step goes straight across the parameter: a family of solutions, linear in its amplitude. Beside a pole the response grows
    /// like c / (lambda - lambda_0): along a short step it looks straight too, but not over a length of its own size.
    pub(super) fn is_straight_across(&self, a: &PathPoint, b: &PathPoint) -> bool {
        let (from, to) = self.options.range;
        let scale = a.lambda.abs().max((to - from).abs());
        let (standing, is_straight) = match a.orientation {
            0 => (STANDING_FIRST, true),
            _ => (STANDING, self.turn(a, b) < STRAIGHT),
        };
        let size = self.dot(&a.u, 0.0, &a.u, 0.0).sqrt();
        let lengths = match a.orientation {
            0 => 1.0,
            _ => (size / self.stride).max(1.0),
        };
        let change = lengths * (b.lambda - a.lambda).abs();
        change <= standing * scale && self.stride >= SHORTEST && is_straight
    }

    /// Whether the path is vertical at the begin or at the end of the last step: there the sign of the parameter's change
    /// means nothing.
    pub(crate) fn is_vertical(&self) -> [bool; 2] {
        self.vertical
    }
}
