//! Tori followed one way from a first curve.

use super::{CurveOfTorus, Locked, TorusPoint, TorusProblem, ring};
use crate::error::SolveError;
use crate::solve::continuation::{
    Advance, Continuation, ContinuationOptions, CrossingSide, Crossings, PathEnd, PathPoint,
    Started,
};
use crate::solve::newton::NewtonOptions;

/// Settings.
#[derive(Debug, Clone)]
pub(crate) struct TorusOptions {
    /// First and largest step, in ranges of the parameter and sizes of the states.
    pub step: (f64, f64),
    /// Smallest step.
    pub min_step: f64,
    /// Curves at most.
    pub max_points: usize,
    /// Largest invariance error before points are added, in sizes of the states.
    pub tolerance: f64,
    /// Limit of points on a curve.
    pub most: usize,
    /// Shares of the parameter that are solved exactly.
    pub marks: Vec<f64>,
}

/// Reason of the end of a path of tori.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum TorusEnd {
    /// The end of the range.
    RangeReached,
    /// It turned back and left the range where it began.
    Turned,
    /// The curve loses its smoothness: coefficients no longer fall.
    BreakUp,
    /// The rotation stays at a ratio.
    Locking {
        /// Turns.
        turns: usize,
        /// Maps.
        maps: usize,
    },
    /// The rotation comes to a ratio, at which a fold of periodic orbits on the torus has been located.
    Folded(Locked),
    /// The torus shrinks to a periodic orbit.
    Vanished,
    /// The path follower ended.
    Path(PathEnd),
    /// The model ends.
    NoModel(String),
}

impl TorusEnd {
    /// One word for files.
    pub fn reason(&self) -> &'static str {
        match self {
            TorusEnd::RangeReached => "range_reached",
            TorusEnd::Turned => "turned",
            TorusEnd::BreakUp => "break_up",
            TorusEnd::Locking { .. } | TorusEnd::Folded(_) => "locking",
            TorusEnd::Vanished => "vanished",
            TorusEnd::Path(end) => end.reason(),
            TorusEnd::NoModel(_) => "no_model",
        }
    }

    /// A sentence for people.
    pub fn message(&self) -> String {
        match self {
            TorusEnd::RangeReached => "the end of the range was reached".into(),
            TorusEnd::Turned => "the tori turned back and left the range where they began".into(),
            TorusEnd::BreakUp => {
                "the torus breaks up: its coefficients do not decrease for any number of points"
                    .into()
            }
            TorusEnd::Locking { turns, maps } => {
                format!("the torus locks: its rotation stays at {turns}/{maps}")
            }
            TorusEnd::Folded(Locked { turns, maps, .. }) => format!(
                "the torus locks: its rotation comes to {turns}/{maps}, where two periodic orbits of {maps} maps are born on it"
            ),
            TorusEnd::Vanished => "the torus shrank to a periodic orbit".into(),
            TorusEnd::Path(end) => end.message(),
            TorusEnd::NoModel(reason) => format!("the model ends: {reason}"),
        }
    }

    /// Whether nothing is missing.
    pub(crate) fn is_complete(&self) -> bool {
        matches!(self, TorusEnd::RangeReached | TorusEnd::Vanished)
    }
}

/// Tori in the order of the path.
#[derive(Debug, Clone)]
pub(crate) struct TorusArm {
    /// Tori; the first one is the start.
    pub points: Vec<TorusPoint>,
    /// Reason of the end.
    pub end: TorusEnd,
}

/// Corrector.
const NEWTON: NewtonOptions = NewtonOptions {
    tolerance: 1e-12,
    step_tolerance: 1e-10,
    max_iterations: 12,
    min_damping: 1.0 / 16.0,
};
/// Size of a curve, relative to its states, below which it is an orbit.
const SMALL: f64 = 1e-4;
/// Invariance error in tolerances from which more points are worth their cost only where they help.
const HOPELESS: f64 = 0.3;
/// Invariance error, in sizes, beyond which a curve is none.
const BROKEN: f64 = 3e-3;
/// Distance of a rotation from a ratio of small numbers that counts as locking, over the square of the maps.
const LOCKED: f64 = 1e-4;
/// Largest number of maps of a ratio.
const LONGEST: usize = 40;

/// Settings of the path follower for a share of a range.
pub(super) fn path_options(options: &TorusOptions, count: usize) -> ContinuationOptions {
    ContinuationOptions {
        range: (0.0, 1.0),
        step: options.step.0,
        min_step: options.min_step,
        max_step: options.step.1,
        max_points: options.max_points.max(2),
        weight: 1.0 / count as f64,
        newton: NEWTON,
        crossings: Crossings::Expected,
    }
}

impl TorusOptions {
    /// Settings of the path follower at a number of points.
    pub fn path(&self, count: usize) -> ContinuationOptions {
        path_options(self, count)
    }
}

/// Follows tori one way; `keep_going` is asked before each with the number of those before. `None` where the first cannot be corrected.
///
/// # Errors
/// Contradictory options, or errors of the problem.
pub(crate) fn follow(
    problem: &mut TorusProblem<'_>,
    first: &CurveOfTorus,
    side: CrossingSide,
    options: &TorusOptions,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> Result<Option<TorusArm>, SolveError> {
    let mut walker = TorusWalker {
        options,
        points: Vec::new(),
        side,
        best: f64::INFINITY,
    };
    let end = match walker.walk(problem, first, keep_going) {
        Err(SolveError::NoSystem { reason }) => TorusEnd::NoModel(reason),
        Err(SolveError::Interrupted) => TorusEnd::Path(PathEnd::Interrupted),
        end => match end? {
            Some(end) => end,
            None => return Ok(None),
        },
    };
    let points = walker.points;
    Ok(Some(TorusArm { points, end }))
}

struct TorusWalker<'a> {
    options: &'a TorusOptions,
    points: Vec<TorusPoint>,
    side: CrossingSide,
    /// Least invariance error that more points have brought.
    best: f64,
}

impl TorusWalker<'_> {
    /// `None`: the first curve cannot be corrected.
    fn walk(
        &mut self,
        problem: &mut TorusProblem<'_>,
        first: &CurveOfTorus,
        keep_going: &mut dyn FnMut(usize) -> bool,
    ) -> Result<Option<TorusEnd>, SolveError> {
        let Some((mut path, torus)) = self.stand(problem, first)? else {
            return Ok(None);
        };
        let is_mark = self.options.marks.contains(&torus.lambda);
        self.push(problem, torus, is_mark)?;
        while keep_going(self.points.len()) {
            if self.points.len() >= self.options.max_points {
                return Ok(Some(TorusEnd::Path(PathEnd::MaxPoints)));
            }
            let end = match path.advance(problem)? {
                Advance::Point(_) => None,
                Advance::End(end) => Some(end),
            };
            if let Some(end) = end {
                return Ok(Some(self.ended(end)));
            }
            let point = path.point().clone();
            self.marks(problem, &mut path)?;
            let torus = problem.torus(&point.u, point.lambda);
            if extent(&torus, problem.shots.size()) < SMALL * problem.size {
                return Ok(Some(TorusEnd::Vanished));
            }
            let error = self.push(problem, torus.clone(), false)?;
            if error > BROKEN * problem.size {
                self.points.pop();
                return Ok(Some(self.lost()));
            }
            if !self.suits(problem, &torus, error)? {
                self.side = match point.tangent_lambda >= 0.0 {
                    true => CrossingSide::Forward,
                    false => CrossingSide::Backward,
                };
                if matches!(point.lambda, 0.0 | 1.0) {
                    return Ok(Some(self.ended(PathEnd::RangeReached)));
                }
                match self.stand(problem, &torus)? {
                    Some((again, better)) => {
                        path = again;
                        self.points.pop();
                        self.push(problem, better, false)?;
                    }
                    None => return Ok(Some(self.lost())),
                }
            } else {
                problem.refer_to(&torus);
            }
        }
        Ok(Some(TorusEnd::Path(PathEnd::Interrupted)))
    }

    /// A path at a torus, with the required number of points and section.
    fn stand(
        &mut self,
        problem: &mut TorusProblem<'_>,
        torus: &CurveOfTorus,
    ) -> Result<Option<(Box<Continuation>, CurveOfTorus)>, SolveError> {
        let mut torus = torus.clone();
        self.best = f64::INFINITY;
        loop {
            if let Some(section) = problem.better_section(&torus)? {
                torus = problem.transported(&torus, section)?;
            }
            problem.refer_to(&torus);
            let begin = (problem.unknowns(&torus), torus.lambda);
            let settings = path_options(self.options, problem.count);
            let started = Continuation::start_at(problem, begin, self.side, settings)?;
            let Started::Path(path) = started else {
                return Ok(None);
            };
            let point: &PathPoint = path.point();
            torus = problem.torus(&point.u, point.lambda);
            problem.refer_to(&torus);
            let error = self.error(problem, &torus)?;
            let more = 2 * problem.count - 1;
            let is_good = error <= self.options.tolerance * problem.size;
            if is_good || more > self.options.most || error > HOPELESS * self.best {
                self.best = self.best.min(error);
                return Ok(Some((path, torus)));
            }
            self.best = error;
            let size = problem.shots.size();
            torus.points = ring::resampled(&torus.points, size, more);
        }
    }

    /// Whether points and section still do for a torus.
    fn suits(
        &self,
        problem: &mut TorusProblem<'_>,
        torus: &CurveOfTorus,
        error: f64,
    ) -> Result<bool, SolveError> {
        let is_good = error <= self.options.tolerance * problem.size || error <= 10.0 * self.best;
        let is_full = 2 * problem.count - 1 > self.options.most;
        if !is_good && !is_full {
            return Ok(false);
        }
        Ok(is_good || problem.better_section(torus)?.is_none())
    }

    /// Notes a torus; its invariance error.
    fn push(
        &mut self,
        problem: &mut TorusProblem<'_>,
        torus: CurveOfTorus,
        is_mark: bool,
    ) -> Result<f64, SolveError> {
        let error = self.error(problem, &torus)?;
        let exponent = problem.exponent(&torus)?;
        let mut switches = (usize::MAX, 0);
        for orbit in problem.orbits(&torus)? {
            let count = orbit.switches.len();
            switches = (switches.0.min(count), switches.1.max(count));
        }
        self.points.push(TorusPoint {
            torus,
            error,
            exponent,
            switches,
            is_mark,
        });
        Ok(error)
    }

    /// Largest |P(K) - K(theta + rho)| between the points.
    fn error(
        &self,
        problem: &mut TorusProblem<'_>,
        torus: &CurveOfTorus,
    ) -> Result<f64, SolveError> {
        let (n, count) = (problem.shots.size(), problem.count);
        let mut largest = 0.0_f64;
        let (mut here, mut there) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for j in 0..count {
            let theta = (j as f64 + 0.5) / count as f64;
            ring::value_weights(count, theta, &mut here);
            ring::value_weights(count, theta + torus.rotation, &mut there);
            let mut state = ring::value(&torus.points, n, &here);
            let target = ring::value(&torus.points, n, &there);
            problem.image(&mut state, torus.lambda)?;
            for (x, y) in state.iter().zip(&target) {
                let gap = (x - y).abs();
                largest = if gap.is_nan() {
                    f64::INFINITY
                } else {
                    largest.max(gap)
                };
            }
        }
        Ok(largest)
    }

    /// Tori at the marks in the last step.
    fn marks(
        &mut self,
        problem: &mut TorusProblem<'_>,
        path: &mut Continuation,
    ) -> Result<(), SolveError> {
        let mut turns = path.turns();
        turns.insert(0, 0.0);
        turns.push(1.0);
        let mut found: Vec<(f64, PathPoint)> = Vec::new();
        for arc in turns.windows(2) {
            let ends = [arc[0], arc[1]].map(|x| path.interpolate(x).1);
            for mark in &self.options.marks {
                if (ends[0] - mark) * (ends[1] - mark) < 0.0 {
                    found.extend(path.at_lambda(problem, *mark, (arc[0], arc[1]))?);
                }
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, point) in found {
            let torus = problem.torus(&point.u, point.lambda);
            self.push(problem, torus, true)?;
        }
        Ok(())
    }

    fn ended(&mut self, end: PathEnd) -> TorusEnd {
        match end {
            PathEnd::RangeReached => TorusEnd::RangeReached,
            PathEnd::ReturnedToStart => match self.side {
                // The other end of the range was where it went.
                CrossingSide::Backward => TorusEnd::RangeReached,
                CrossingSide::Forward => TorusEnd::Turned,
            },
            PathEnd::StepTooSmall { .. } | PathEnd::Creeping => self.lost(),
            end => TorusEnd::Path(end),
        }
    }

    /// Why there is no further torus: its rotation stays at a ratio, or it loses its smoothness.
    fn lost(&self) -> TorusEnd {
        let Some(last) = self.points.last() else {
            return TorusEnd::BreakUp;
        };
        let rotation = last.torus.rotation.rem_euclid(1.0);
        for maps in 1..=LONGEST {
            let turns = (rotation * maps as f64).round();
            let gap = (rotation - turns / maps as f64).abs();
            if gap < LOCKED / (maps * maps) as f64 {
                return TorusEnd::Locking {
                    turns: turns as usize,
                    maps,
                };
            }
        }
        TorusEnd::BreakUp
    }
}

/// Largest deviation of a curve from its mean.
fn extent(torus: &CurveOfTorus, size: usize) -> f64 {
    let count = torus.points.len() / size;
    let mut largest = 0.0_f64;
    for i in 0..size {
        let values = || torus.points.iter().skip(i).step_by(size);
        let mean = values().sum::<f64>() / count as f64;
        largest = values().fold(largest, |m, x| m.max((x - mean).abs()));
    }
    largest
}
