//! Roots of test functions on the corrected path.

use super::{BifurcationEvent, EventKind, Look, Step, Verdict};
use crate::error::SolveError;
use crate::numeric::roots;
use crate::solve::continuation::PathPoint;
use crate::solve::residual::{Extent, Survey};

/// Width of a located bracket in the parameter, relative to its size.
const WIDTH: f64 = 2e-9;
/// Widest bracket as a fraction of the step: near a fold the parameter hardly moves.
pub(super) const WIDEST: f64 = 1e-7;
/// Narrowest bracket as a fraction of the step.
const NARROWEST: f64 = 1e-12;

/// Events of one kind closer than this share of the step are one.
const SAME: f64 = 2.0 * WIDEST;

/// Where a root is sought.
pub(super) struct RootTarget {
    /// Fractions of the step that it cannot leave.
    pub limits: (f64, f64),
    /// Expected position.
    pub guess: f64,
    /// Derivative of the test function there.
    pub slope: f64,
    /// Data of the test function besides the point.
    pub extent: Option<Extent>,
    /// Two fractions with values of opposite sign on the path: where the search from the guess ends at a limit, the root lies
    /// between them.
    pub values: Option<((f64, f64), (f64, f64))>,
}

/// What a search brought.
pub(super) enum SearchResult {
    /// The root.
    Root(Box<Root>),
    /// The test function keeps its sign.
    Nothing,
    /// The path cannot be corrected where the root is sought.
    Lost,
}

/// A root on the corrected path.
pub(super) struct Root {
    pub fraction: f64,
    pub point: PathPoint,
    pub survey: Option<Survey>,
    /// Value of the test function.
    pub value: f64,
    /// Parameters that enclose it.
    pub bracket: (f64, f64),
    /// Values of the test function at the ends of the bracket, in the order of the path.
    pub values: (f64, f64),
}

impl Root {
    /// A look at its place; `None` without multipliers.
    pub fn look(&self) -> Option<Look> {
        let survey = self.survey.as_ref();
        let survey = survey.filter(|s| !s.multipliers.is_empty());
        survey.map(|survey| Look {
            fraction: self.fraction,
            lambda: self.point.lambda,
            survey: survey.clone(),
        })
    }
}

impl Step<'_> {
    /// Root of a test function of fraction, point and survey.
    pub(super) fn locate(
        &mut self,
        target: &RootTarget,
        mut test: impl FnMut(f64, &PathPoint, Option<&Survey>) -> f64,
    ) -> Result<SearchResult, SolveError> {
        let mut seen: Vec<Root> = Vec::new();
        let width = self.width(target.guess);
        let mut evaluate = |x: f64| {
            let point = self.path.at_fraction(self.problem, x).map_err(Some)?;
            let point = point.ok_or(None)?;
            let survey = match target.extent {
                None => None,
                Some(extent) => Some(
                    self.problem
                        .survey(&point.u, point.lambda, extent)
                        .map_err(Some)?,
                ),
            };
            let value = test(x, &point, survey.as_ref());
            let bracket = (point.lambda, point.lambda);
            seen.push(Root {
                fraction: x,
                point,
                survey,
                value,
                bracket,
                values: (value, value),
            });
            Ok::<f64, Option<SolveError>>(value)
        };
        let RootTarget {
            limits,
            guess,
            slope,
            ..
        } = *target;
        let mut sought = roots::near_guess(&mut evaluate, guess, slope, limits, width);
        if let (Ok(None), Some((low, high))) = (&sought, target.values) {
            sought = roots::bracketed(&mut evaluate, low, high, width).map(Some);
        }
        let sought = match sought {
            Err(Some(error)) => return Err(error),
            Err(None) => return Ok(SearchResult::Lost),
            Ok(None) => return Ok(SearchResult::Nothing),
            Ok(Some(sought)) => sought,
        };
        let at = |x: f64| {
            let found = seen.iter().find(|s| s.fraction == x);
            found.map(|s| (s.point.lambda, s.value))
        };
        let (Some(low), Some(high)) = (at(sought.low), at(sought.high)) else {
            // The search ran into an end that it was told about: the path does not change its sign there.
            return Ok(SearchResult::Nothing);
        };
        let root = seen.into_iter().find(|s| s.fraction == sought.root);
        Ok(root.map_or(SearchResult::Lost, |mut root| {
            root.bracket = (low.0.min(high.0), low.0.max(high.0));
            root.values = (low.1, high.1);
            SearchResult::Root(Box::new(root))
        }))
    }

    /// Fraction of the step in which the parameter moves by the width of a located bracket.
    fn width(&self, fraction: f64) -> f64 {
        let (_, lambda) = self.path.interpolate(fraction);
        let slope = self.path.lambda_slope(fraction).abs();
        (WIDTH * lambda.abs() / slope).clamp(NARROWEST, WIDEST)
    }

    /// Adds an event to the list; `ends`: parameters at the two places between which it was sought.
    pub(super) fn report(
        &mut self,
        kind: EventKind,
        ends: (f64, f64),
        guess: f64,
        found: SearchResult,
    ) {
        let event = self.event(kind, ends, guess, &found);
        self.add(event);
    }

    /// What a search brought, as an event.
    pub(super) fn event(
        &self,
        kind: EventKind,
        ends: (f64, f64),
        guess: f64,
        found: &SearchResult,
    ) -> BifurcationEvent {
        let outer = (ends.0.min(ends.1), ends.0.max(ends.1));
        let unknown = BifurcationEvent {
            kind,
            lambda: 0.5 * (outer.0 + outer.1),
            method_lambda: 0.5 * (outer.0 + outer.1),
            verdict: Verdict::NotTried,
            bracket: outer,
            multiplicity: 1,
            unstable: None,
            after_point: self.after_point,
            fraction: guess,
            point: None,
            breakpoint: None,
            doubt: 0.0,
            recorded: Vec::new(),
        };
        match found {
            SearchResult::Nothing | SearchResult::Lost => unknown,
            SearchResult::Root(root) => BifurcationEvent {
                lambda: root.point.lambda,
                method_lambda: root.point.lambda,
                bracket: match kind {
                    EventKind::Fold => outer,
                    _ => root.bracket,
                },
                fraction: root.fraction,
                point: Some(root.point.clone()),
                ..unknown
            },
        }
    }

    /// Adds an event, unless another search has ended at the same root.
    pub(super) fn add(&mut self, event: BifurcationEvent) {
        let is_same = |other: &BifurcationEvent| {
            other.kind == event.kind && (other.fraction - event.fraction).abs() <= SAME
        };
        if !self.found.iter().any(is_same) {
            self.found.push(event);
        }
    }
}
