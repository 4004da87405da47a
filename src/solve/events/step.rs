//! One step under examination: folds and branch points, then grazings, then the multipliers between them.

use super::locate::{Found, Root, Target};
use super::{BifurcationEvent, EventKind, Look, Probe};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::continuation::{Continuation, PathPoint};
use crate::solve::residual::{Extent, PeriodicResidual};

/// Looks at interpolated places that one step is worth.
const MAX_LOOKS: usize = 300;
/// Excitation periods that these looks may cover all together, for long response periods,
const LOOKED_PERIODS: usize = 1200;
/// and the looks that are always allowed.
const FEWEST_LOOKS: usize = 60;

/// Where a step that leaves a crossing is looked at first: nearer to it the parameter hardly moves.
const BEHIND_CROSSING: f64 = 0.5;

/// A fold this near to a branch point, as a share of the step, is the turning of the arms that meet there.
const SAME_TURN: f64 = 1e-3;

/// The step under examination.
pub struct Step<'a> {
    pub(super) path: &'a mut Continuation,
    pub(super) problem: &'a mut dyn PeriodicResidual,
    pub(super) extent: Extent,
    pub(super) after_point: usize,
    pub(super) looks_left: usize,
    pub(super) found: Vec<BifurcationEvent>,
}

impl<'a> Step<'a> {
    /// The last step of a path, which began at a point of the branch with this number.
    pub fn new(
        path: &'a mut Continuation,
        problem: &'a mut dyn PeriodicResidual,
        extent: Extent,
        after_point: usize,
    ) -> Step<'a> {
        Step {
            path,
            problem,
            extent,
            after_point,
            looks_left: MAX_LOOKS,
            found: Vec::new(),
        }
    }

    /// Everything that happens between the two ends of the step, in the order of the path. `before`: a place of the path
    /// before the step, with nothing but smooth motion in between.
    ///
    /// # Errors
    /// What the problem returns.
    pub fn events(
        mut self,
        before: Option<&Look>,
        a: &Probe,
        b: &Probe,
    ) -> Result<Vec<BifurcationEvent>, SolveError> {
        let affordable = LOOKED_PERIODS / a.look.survey.orbit.subharmonic();
        self.looks_left = affordable.clamp(FEWEST_LOOKS, MAX_LOOKS);
        // Where the parameter stands still it turns by rounding only, and a multiplier stays at 1.
        let [begins, ends] = self.path.is_vertical();
        if !begins && !ends {
            self.turnings(a, b)?;
        }
        let knots = self.grazings(before, &a.look, &b.look)?;
        if self.extent == Extent::Stability && !ends {
            self.passages(before, &a.look, &b.look, knots)?;
        }
        self.found.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        Ok(self.found)
    }

    /// A look at the interpolant.
    pub(super) fn look(&mut self, fraction: f64, extent: Extent) -> Result<Look, SolveError> {
        self.looks_left = self.looks_left.saturating_sub(1);
        let (u, lambda) = self.path.interpolate(fraction);
        let survey = self.problem.survey(&u, lambda, extent)?;
        Ok(Look {
            fraction,
            lambda,
            survey,
        })
    }

    /// Folds and branch points.
    fn turnings(&mut self, a: &Probe, b: &Probe) -> Result<(), SolveError> {
        let begin = self.path.origin().clone();
        if a.point.tangent_lambda * begin.tangent_lambda < 0.0 {
            // The path turned at a corner before it left.
            let ends = (a.point.lambda, b.point.lambda);
            self.report(EventKind::Fold, ends, 0.0, corner(&a.point));
        }
        if begin.orientation != 0 {
            return self.turnings_between((0.0, &begin), &b.point);
        }
        // The path leaves a crossing: no sign means anything there.
        match self.path.at_fraction(self.problem, BEHIND_CROSSING)? {
            Some(behind) => self.turnings_between((BEHIND_CROSSING, &behind), &b.point),
            None => Ok(()),
        }
    }

    fn turnings_between(
        &mut self,
        (x, a): (f64, &PathPoint),
        b: &PathPoint,
    ) -> Result<(), SolveError> {
        let crossing = self.crossing((x, a), b)?;
        let mut guesses = self.path.turns();
        guesses.retain(|guess| *guess > x);
        if a.tangent_lambda * b.tangent_lambda < 0.0 {
            let guess = guesses.first().copied().unwrap_or(0.5);
            return self.fold((x, a), (1.0, b), (guess, crossing));
        }
        if let [first, second] = guesses[..] {
            // The interpolant turns and turns back: the corrected path tells whether it does.
            let middle = 0.5 * (first + second);
            if let Some(m) = self.path.at_fraction(self.problem, middle)?
                && m.tangent_lambda * a.tangent_lambda < 0.0
            {
                self.fold((x, a), (middle, &m), (first, crossing))?;
                return self.fold((middle, &m), (1.0, b), (second, crossing));
            }
        }
        Ok(())
    }

    /// The branch point of the step; the fraction at which it was located.
    fn crossing(
        &mut self,
        (x, a): (f64, &PathPoint),
        b: &PathPoint,
    ) -> Result<Option<f64>, SolveError> {
        if i32::from(a.orientation) * i32::from(b.orientation) >= 0 {
            return Ok(None);
        }
        let orientation = |p: &PathPoint| f64::from(p.orientation);
        let target = Target {
            limits: (x, 1.0),
            guess: 0.5,
            slope: orientation(b) - orientation(a),
            extent: None,
            values: Some(((x, orientation(a)), (1.0, orientation(b)))),
        };
        let mut found = self.locate(&target, |_, p, _| orientation(p))?;
        let mut fraction = None;
        if let Found::Root(root) = &mut found {
            fraction = Some(root.fraction);
            root.point = self
                .path
                .with_smooth_tangent(root.point.clone(), root.fraction);
        }
        self.report(EventKind::BranchPoint, (a.lambda, b.lambda), 0.5, found);
        Ok(fraction)
    }

    /// A fold between two fractions of the step, unless the path turns where another one crosses: so do the arms of a pitchfork.
    fn fold(
        &mut self,
        (x, a): (f64, &PathPoint),
        (y, b): (f64, &PathPoint),
        (guess, crossing): (f64, Option<f64>),
    ) -> Result<(), SolveError> {
        let target = Target {
            limits: (x, y),
            guess,
            slope: (b.tangent_lambda - a.tangent_lambda) / (y - x),
            extent: None,
            values: None,
        };
        let mut found = self.locate(&target, |_, p, _| p.tangent_lambda)?;
        let side = a.tangent_lambda.signum();
        let farthest = (side * a.lambda).max(side * b.lambda);
        if matches!(&found, Found::Root(root) if side * root.point.lambda < farthest) {
            found = self.farthest((x, y), side)?;
        }
        if let (Found::Root(root), Some(crossing)) = (&found, crossing)
            && (root.fraction - crossing).abs() < SAME_TURN
        {
            return Ok(());
        }
        self.report(EventKind::Fold, (a.lambda, b.lambda), guess, found);
        Ok(())
    }

    /// The largest (`side` 1) or smallest (-1) parameter between two fractions, for a path that ripples at its fold, as that
    /// of a sampled force may: its tangent turns more than once there, and not where the fold is.
    fn farthest(&mut self, ends: (f64, f64), side: f64) -> Result<Found, SolveError> {
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
            survey: None,
            fraction,
            point,
        });
        Ok(root.map_or(Found::Lost, |root| Found::Root(Box::new(root))))
    }
}

/// A fold at a point that is known.
fn corner(point: &PathPoint) -> Found {
    Found::Root(Box::new(Root {
        fraction: 0.0,
        point: point.clone(),
        survey: None,
        value: 0.0,
        bracket: (point.lambda, point.lambda),
    }))
}
