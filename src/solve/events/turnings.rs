//! Where a path turns in the parameter, and where the sign of its determinant tells that another one crosses it.

use super::locate::{Root, RootTarget, SearchResult};
use super::{BifurcationEvent, EventKind, Probe, Step};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::continuation::PathPoint;

/// Where a step that leaves a crossing is looked at first: nearer to it the parameter hardly moves.
const BEHIND_CROSSING: f64 = 0.5;

/// What turns at a fold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StepTurning {
    /// One solution. Where other branches cross beside it the tangents of two places may point either way; the sign of the determinant tells
    /// which.
    Single,
    /// An even number of equal parts, at which the determinant changes its sign too: it tells nothing.
    Together,
}

impl Step<'_> {
    /// Folds and branch points.
    pub(super) fn turnings(&mut self, a: &Probe, b: &Probe) -> Result<(), SolveError> {
        let begin = self.path.origin().clone();
        if a.point.tangent_lambda * begin.tangent_lambda < 0.0 {
            // The path turned at a corner before it left.
            let ends = (a.point.lambda, b.point.lambda);
            self.report(EventKind::Fold, ends, 0.0, corner(&a.point));
        }
        if begin.orientation != 0 {
            return self.turnings_between((0.0, &begin), (1.0, &b.point));
        }
        // The path leaves a crossing: no sign means anything there.
        match self.path.at_fraction(self.problem, BEHIND_CROSSING)? {
            Some(behind) => self.turnings_between((BEHIND_CROSSING, &behind), (1.0, &b.point)),
            None => Ok(()),
        }
    }

    fn turnings_between(
        &mut self,
        (x, a): (f64, &PathPoint),
        (y, b): (f64, &PathPoint),
    ) -> Result<(), SolveError> {
        self.crossing((x, a), (y, b))?;
        let mut guesses = self.path.turns();
        guesses.retain(|guess| *guess > x);
        if a.tangent_lambda * b.tangent_lambda < 0.0 {
            let guess = guesses.first().copied().unwrap_or(0.5);
            let event = self.fold((x, a), (y, b), (guess, StepTurning::Single))?;
            self.add(event);
            return Ok(());
        }
        if let [first, second] = guesses[..] {
            // The interpolant turns and turns back: the corrected path tells whether it does.
            let middle = 0.5 * (first + second);
            if let Some(m) = self.path.at_fraction(self.problem, middle)?
                && m.tangent_lambda * a.tangent_lambda < 0.0
            {
                let folds = [
                    self.fold((x, a), (middle, &m), (first, StepTurning::Single))?,
                    self.fold((middle, &m), (y, b), (second, StepTurning::Single))?,
                ];
                folds.into_iter().for_each(|event| self.add(event));
            }
        }
        Ok(())
    }

    /// The branch point between two fractions of the step; whether there is one.
    pub(super) fn crossing(
        &mut self,
        (x, a): (f64, &PathPoint),
        (y, b): (f64, &PathPoint),
    ) -> Result<bool, SolveError> {
        if i32::from(a.orientation) * i32::from(b.orientation) >= 0 {
            return Ok(false);
        }
        let orientation = |p: &PathPoint| f64::from(p.orientation);
        let middle = 0.5 * (x + y);
        let target = RootTarget {
            limits: (x, y),
            guess: middle,
            slope: orientation(b) - orientation(a),
            extent: None,
            values: Some(((x, orientation(a)), (y, orientation(b)))),
        };
        let mut found = self.locate(&target, |_, p, _| orientation(p))?;
        self.smooth_tangent(&mut found);
        self.report(EventKind::BranchPoint, (a.lambda, b.lambda), middle, found);
        Ok(true)
    }

    /// Gives a branch point the tangent of the path that was followed.
    pub(super) fn smooth_tangent(&self, found: &mut SearchResult) {
        if let SearchResult::Root(root) = found {
            let point = root.point.clone();
            root.point = self.path.with_smooth_tangent(point, root.fraction);
        }
    }

    /// A fold between two fractions of the step.
    pub(super) fn fold(
        &mut self,
        (x, a): (f64, &PathPoint),
        (y, b): (f64, &PathPoint),
        (guess, turning): (f64, StepTurning),
    ) -> Result<BifurcationEvent, SolveError> {
        let slope = |p: &PathPoint| match p.orientation * a.orientation < 0 {
            true if turning == StepTurning::Single => -p.tangent_lambda,
            _ => p.tangent_lambda,
        };
        let target = RootTarget {
            limits: (x, y),
            guess,
            slope: (slope(b) - slope(a)) / (y - x),
            extent: None,
            values: None,
        };
        let mut found = self.locate(&target, |_, p, _| slope(p))?;
        let side = a.tangent_lambda.signum();
        let farthest = (side * a.lambda).max(side * b.lambda);
        if matches!(&found, SearchResult::Root(root) if side * root.point.lambda < farthest) {
            found = self.farthest((x, y), side)?;
        }
        Ok(self.event(EventKind::Fold, (a.lambda, b.lambda), guess, &found))
    }

    /// The largest (`side` 1) or smallest (-1) parameter between two fractions, for a path that ripples at its fold, as that
    /// of a sampled force may: its tangent turns more than once there, and not where the fold is.
    fn farthest(&mut self, ends: (f64, f64), side: f64) -> Result<SearchResult, SolveError> {
        let mut failure = None;
        let mut best: Option<(f64, PathPoint)> = None;
        roots::maximum(
            |fraction| match self.path.at_fraction(self.problem, fraction) {
                Ok(Some(point)) => {
                    let value = side * point.lambda;
                    if best.as_ref().is_none_or(|b| value > side * b.1.lambda) {
                        best = Some((fraction, point));
                    }
                    value
                }
                Ok(None) => f64::NEG_INFINITY,
                Err(error) => {
                    failure = Some(error);
                    f64::NEG_INFINITY
                }
            },
            ends,
        );
        if let Some(error) = failure {
            return Err(error);
        }
        let root = best.map(|(fraction, point)| Root {
            bracket: (point.lambda, point.lambda),
            value: point.tangent_lambda,
            values: (0.0, 0.0),
            survey: None,
            fraction,
            point,
        });
        Ok(root.map_or(SearchResult::Lost, |root| {
            SearchResult::Root(Box::new(root))
        }))
    }
}

/// A fold at a point that is known.
fn corner(point: &PathPoint) -> SearchResult {
    SearchResult::Root(Box::new(Root {
        fraction: 0.0,
        point: point.clone(),
        survey: None,
        value: 0.0,
        values: (0.0, 0.0),
        bracket: (point.lambda, point.lambda),
    }))
}
