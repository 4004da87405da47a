//! Steps of a path that go back on themselves.

use crate::solve::continuation::Continuation;
use nalgebra::DVector;

/// Cosine of the angle between two steps of a path that goes back on itself.
const BACK: f64 = -0.95;

/// The way of a step.
pub(super) struct Chord(DVector<f64>, f64);

impl Chord {
    /// Of the last step; zero before the first one.
    pub(super) fn of(path: &Continuation) -> Chord {
        let (from, to) = (path.origin(), path.point());
        Chord(&to.u - &from.u, to.lambda - from.lambda)
    }

    fn dot(&self, other: &Chord) -> f64 {
        self.0.dot(&other.0) + self.1 * other.1
    }
}

/// Whether the last step went back where the path had come from: it had met the end of the curve. At a corner the path turns by any
/// angle but that to the step `behind` it, whose tangents may be those of a difference across the corner.
pub(super) fn reverses(behind: &Chord, path: &Continuation) -> bool {
    let (from, to) = (path.origin(), path.point());
    let ahead = from.tangent_u.dot(&to.tangent_u) + from.tangent_lambda * to.tangent_lambda;
    let step = Chord::of(path);
    let along = from.tangent_u.dot(&step.0) + from.tangent_lambda * step.1;
    let lengths = (behind.dot(behind) * step.dot(&step)).sqrt();
    ahead < 0.0 || along < 0.0 || behind.dot(&step) < BACK * lengths
}
