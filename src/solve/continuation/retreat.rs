//! Steps that are retried.

use super::{Continuation, PathEnd, PathPoint};

/// Share of a step that is tried instead of it.
const SHARE: f64 = 0.25;

/// A step that was taken back.
#[derive(Debug)]
pub(crate) struct TakenStep {
    before: Option<PathPoint>,
    point: PathPoint,
    origin: PathPoint,
    stride: f64,
    step: f64,
    vertical: [bool; 2],
    progress: [f64; 2],
    end: Option<PathEnd>,
}

impl Continuation {
    /// Goes back to where the last step began, for a shorter one; `None`, and nothing changes, where that would be too short.
    pub(crate) fn retreat(&mut self) -> Option<TakenStep> {
        let step = SHARE * self.stride;
        if step < self.options.min_step {
            return None;
        }
        self.take_back_waymark();
        self.points -= 1;
        self.rejections += 1;
        let before = [self.progress[0]; 2];
        Some(TakenStep {
            progress: std::mem::replace(&mut self.progress, before),
            before: self.before.take(),
            point: std::mem::replace(&mut self.point, self.origin.clone()),
            origin: self.origin.clone(),
            stride: self.stride,
            step: std::mem::replace(&mut self.step, step),
            vertical: std::mem::take(&mut self.vertical),
            end: self.end.take(),
        })
    }

    /// Takes the step after all.
    pub(crate) fn restore(&mut self, taken: TakenStep) {
        (self.point, self.origin) = (taken.point, taken.origin);
        self.before = taken.before;
        (self.stride, self.step, self.end) = (taken.stride, taken.step, taken.end);
        (self.vertical, self.progress) = (taken.vertical, taken.progress);
        self.points += 1;
    }
}
