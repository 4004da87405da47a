//! Where a path turns in the parameter, and where the sign of its determinant tells that another one crosses it.

use super::locate::{Root, RootTarget, SearchResult, WIDEST};
use super::{BifurcationEvent, EventKind, Probe, Step};
use crate::error::SolveError;
use crate::numeric::turning::{self, Sloped};
use crate::solve::continuation::PathPoint;

/// Where a step that leaves a crossing is looked at first: nearer to it the parameter hardly moves.
const BEHIND_CROSSING: f64 = 0.5;

/// Halvings of the way to an end beyond a fold after which a ripple counts as too short to be seen.
const HALVINGS: usize = 30;

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
            self.report(EventKind::Fold, ends, 0.0, turn(0.0, a.point.clone()));
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
        let side = a.tangent_lambda.signum();
        let slope = |p: &PathPoint| match p.orientation * a.orientation < 0 {
            true if turning == StepTurning::Single => -p.tangent_lambda.signum(),
            _ => p.tangent_lambda.signum(),
        };
        let ends = [(x, a), (y, b)].map(|(x, p)| self.sloped(x, p, slope(p)));
        let mut found = self.top((ends[0], ends[1]), guess, &slope)?;
        if let SearchResult::Root(root) = &found {
            let near = self.sloped(root.fraction, &root.point, 0.0);
            if let Some((low, high)) = self.farther(near, ends, (side, &slope))? {
                let middle = 0.5 * (low.x + high.x);
                let farther = self.top((low, high), middle, &slope)?;
                if matches!(farther, SearchResult::Root(_)) {
                    found = farther;
                }
            }
        }
        Ok(self.event(EventKind::Fold, (a.lambda, b.lambda), guess, &found))
    }

    /// A point of the path as one of the parameter over the fraction; `sign`: of its slope.
    fn sloped(&self, x: f64, point: &PathPoint, sign: f64) -> Sloped {
        Sloped {
            x,
            value: point.lambda,
            slope: self.path.slope_at(x, point).abs() * sign,
        }
    }

    /// Where the path turns between two places at which its slopes have different signs.
    fn top(
        &mut self,
        (low, high): (Sloped, Sloped),
        guess: f64,
        sign: &dyn Fn(&PathPoint) -> f64,
    ) -> Result<SearchResult, SolveError> {
        if low.slope * high.slope > 0.0 {
            return Ok(SearchResult::Nothing);
        }
        let mut seen: Vec<(f64, PathPoint)> = Vec::new();
        let value = |x: f64| {
            let point = self.path.at_fraction(self.problem, x).map_err(Some)?;
            let point = point.ok_or(None)?;
            let here = self.sloped(x, &point, sign(&point));
            seen.push((x, point));
            Ok::<_, Option<SolveError>>((here.value, here.slope))
        };
        let root = match turning::turning(value, (low, high), guess, WIDEST) {
            Err(Some(error)) => return Err(error),
            Err(None) => return Ok(SearchResult::Lost),
            Ok(found) => found.root,
        };
        let found = seen.into_iter().find(|(x, _)| *x == root);
        Ok(found.map_or(SearchResult::Nothing, |(x, point)| turn(x, point)))
    }

    /// Two places between which a path that ripples turns farther away than at `near`, as that of a sampled force may where the step's end
    /// lies beyond its first turn: on the way there the path turns back and once more. `None` where no end lies beyond.
    fn farther(
        &mut self,
        mut near: Sloped,
        ends: [Sloped; 2],
        (side, sign): (f64, &dyn Fn(&PathPoint) -> f64),
    ) -> Result<Option<(Sloped, Sloped)>, SolveError> {
        let height = |place: &Sloped| side * place.value;
        let is_right = height(&ends[1]) > height(&ends[0]);
        let mut far = ends[usize::from(is_right)];
        if height(&far) <= height(&near) {
            return Ok(None);
        }
        // Slopes towards the far end.
        let onward = if is_right { side } else { -side };
        for _ in 0..HALVINGS {
            let x = 0.5 * (near.x + far.x);
            let Some(point) = self.path.at_fraction(self.problem, x)? else {
                return Ok(None);
            };
            let here = self.sloped(x, &point, sign(&point));
            match () {
                _ if here.slope * onward > 0.0 && is_right => return Ok(Some((here, far))),
                _ if here.slope * onward > 0.0 => return Ok(Some((far, here))),
                _ if height(&here) < height(&far) => near = here,
                _ => far = here,
            }
        }
        Ok(None)
    }
}

/// A fold at a point that is known.
fn turn(fraction: f64, point: PathPoint) -> SearchResult {
    SearchResult::Root(Box::new(Root {
        fraction,
        bracket: (point.lambda, point.lambda),
        survey: None,
        value: 0.0,
        values: (0.0, 0.0),
        point,
    }))
}
