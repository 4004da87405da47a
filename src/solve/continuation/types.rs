//! Settings, points and ends of a path.

use crate::error::SolveError;
use crate::solve::newton::{NewtonOptions, NewtonOutcome, NewtonStatus};
use nalgebra::DVector;

/// Settings of the path following.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuationOptions {
    /// First and last value of the parameter.
    pub range: (f64, f64),
    /// First step, in arclength.
    pub step: f64,
    /// Smallest step before the path is given up.
    pub min_step: f64,
    /// Largest step.
    pub max_step: f64,
    /// Limit of points per branch.
    pub max_points: usize,
    /// Weight of u against lambda in the arclength: ds^2 = weight |du|^2 + dlambda^2.
    pub weight: f64,
    /// Corrector.
    pub newton: NewtonOptions,
    /// Whether paths cross each other.
    pub crossings: Crossings,
}

/// Whether paths of a problem cross each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossings {
    /// They do: where the orientation changes on the way straight on, another path was crossed.
    Expected,
    /// They do not, but for special numbers: where the orientation changes in a step that is not tiny, the corrector has jumped to
    /// another path that comes near, facing the own one across a gap.
    Exceptional,
}

impl ContinuationOptions {
    /// Refuses contradictory settings.
    ///
    /// # Errors
    /// The first setting that makes no sense.
    pub fn validate(&self) -> Result<(), SolveError> {
        let option = |name, found: f64, wanted: &str| {
            Err(SolveError::Option {
                name,
                found: found.to_string(),
                wanted: wanted.to_string(),
            })
        };
        if self.min_step.is_nan() || self.min_step <= 0.0 {
            return option("min_step", self.min_step, "> 0");
        }
        if self.max_step.is_nan() || self.max_step < self.min_step {
            return option("max_step", self.max_step, "at least min_step");
        }
        if !(self.step >= self.min_step && self.step <= self.max_step) {
            return option("step", self.step, "between min_step and max_step");
        }
        if self.range.0 == self.range.1 || !self.range.0.is_finite() || !self.range.1.is_finite() {
            return option("to", self.range.1, "finite and different from `from`");
        }
        if self.max_points < 2 {
            return option("max_points", self.max_points as f64, "at least 2");
        }
        Ok(())
    }

    pub(super) fn direction(&self) -> f64 {
        (self.range.1 - self.range.0).signum()
    }
}

/// A point of the path with its unit tangent.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPoint {
    /// Unknowns.
    pub u: DVector<f64>,
    /// Parameter.
    pub lambda: f64,
    /// du/ds.
    pub tangent_u: DVector<f64>,
    /// dlambda/ds.
    pub tangent_lambda: f64,
    /// Sign of det [dR/du, dR/dlambda; tangent]: changes at branch points and nowhere else on a smooth path.
    pub orientation: i8,
    /// End of the corrector.
    pub newton: NewtonOutcome,
}

/// Reason of the end of a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PathEnd {
    /// The end of the range, solved exactly.
    RangeReached,
    /// The path turned back and left the range where it began.
    ReturnedToStart,
    /// The limit of points.
    MaxPoints,
    /// The corrector failed down to the smallest step.
    StepTooSmall {
        /// How the last correction ended.
        last: NewtonStatus,
    },
    /// Point after point brought hardly any progress.
    Creeping,
    /// The path came back to its first point.
    Closed,
    /// The path came back to a later point of itself, so that it cannot have followed one curve all the way.
    Looped,
    /// The path met another one that is known.
    Joined {
        /// Number of the crossing among those that the caller named; `None` for an orbit of half the period that lies on none
        /// of them.
        known: Option<usize>,
    },
    /// The solution grows without bound.
    Unbounded,
    /// Solutions of any size exist at one parameter: a straight line across it.
    Vertical,
    /// The user asked to stop.
    Interrupted,
}

impl PathEnd {
    /// One word for files.
    pub fn reason(&self) -> &'static str {
        match self {
            PathEnd::RangeReached => "range_reached",
            PathEnd::ReturnedToStart => "returned_to_start",
            PathEnd::MaxPoints => "max_points",
            PathEnd::StepTooSmall { .. } => "step_too_small",
            PathEnd::Creeping => "creeping",
            PathEnd::Closed => "closed",
            PathEnd::Looped => "looped",
            PathEnd::Joined { .. } => "joined",
            PathEnd::Unbounded => "unbounded",
            PathEnd::Vertical => "vertical",
            PathEnd::Interrupted => "interrupted",
        }
    }

    /// A sentence for people.
    pub fn message(&self) -> String {
        match self {
            PathEnd::RangeReached => "the end of the range was reached".into(),
            PathEnd::ReturnedToStart => {
                "the branch turned back and left the range where it began".into()
            }
            PathEnd::MaxPoints => "max_points was reached".into(),
            PathEnd::StepTooSmall { last } => format!("the step fell below min_step ({last})"),
            PathEnd::Creeping => "the last few hundred steps stayed far below max_step: no progress".into(),
            PathEnd::Closed => "the branch closed on itself".into(),
            PathEnd::Looped => {
                "the path reached one of its own earlier points, so it must have jumped between curves or passed a \
                 branch point".into()
            }
            PathEnd::Joined { .. } => "the branch returned to a known branch".into(),
            PathEnd::Unbounded => "the response grows without bound".into(),
            PathEnd::Vertical => {
                "the branch is vertical: orbits of any amplitude exist at this parameter".into()
            }
            PathEnd::Interrupted => "interrupted".into(),
        }
    }
}
