//! The size of the problem along a branch: more or fewer unknowns where the solution asks for it.
//!
//! A seam is a point that is solved in two sizes. The step before it is examined in the old size, the step behind it in the new
//! one; both must see the same side of every event there, or an event between the two solutions would be lost or doubled. Where
//! they do not, the old size stays for a step more.

use super::{Begin, TraceOptions, Tracer, singular};
use crate::error::SolveError;
use crate::solve::continuation::{Continuation, CrossingSide, Started};
use crate::solve::events::Probe;
use crate::solve::newton::NewtonOutcome;
use crate::solve::residual::{Fit, PeriodicResidual, Survey};

/// Halvings of a step that ends where the size no longer suits.
const HALVINGS: usize = 3;
/// Changes of size at one point.
const CHANGES: usize = 12;

/// The path at its first point, in a size that suits it.
pub(super) fn begin(
    problem: &mut dyn PeriodicResidual,
    begin: Begin,
    options: &TraceOptions,
) -> Result<Result<Continuation, NewtonOutcome>, SolveError> {
    let (mut guess, lambda, side) = match begin {
        Begin::Guess(u) => (u, options.continuation.range.0, CrossingSide::Forward),
        Begin::Inside(u, lambda, side) => (u, lambda, side),
        Begin::Crossing(point, way) => {
            let path = Continuation::branch_off(problem, &point, way, options.continuation)?;
            return Ok(path.ok_or_else(|| singular(&point)));
        }
    };
    loop {
        let start = Continuation::start_at(problem, (guess, lambda), side, options.continuation);
        let path = match start? {
            Started::Path(path) => *path,
            Started::Failed(outcome) => return Ok(Err(outcome)),
        };
        let point = path.point();
        match problem.fit(&point.u, point.lambda)? {
            Fit::Strains { size } | Fit::Fails { size } => {
                problem.resize(size)?;
                guess = problem.in_present_size(&point.u);
            }
            Fit::Suits | Fit::Wastes { .. } => return Ok(Ok(path)),
        }
    }
}

impl Tracer<'_> {
    /// The end of the last step, drawn nearer while the error there is too large: events and marks inside a step are solved in
    /// the size of its beginning.
    pub(super) fn reached(&mut self) -> Result<Probe, SolveError> {
        for _ in 0..HALVINGS {
            let point = self.path.point();
            let fit = self.problem.fit(&point.u, point.lambda)?;
            if !matches!(fit, Fit::Fails { .. }) || !self.path.halve_step(self.problem)? {
                break;
            }
        }
        let point = self.path.point().clone();
        self.probe(point, 1.0)
    }

    /// The same point in the size that suits it.
    pub(super) fn refit(&mut self, mut stands: Probe) -> Result<Probe, SolveError> {
        for _ in 0..CHANGES {
            let (u, lambda) = (&stands.point.u, stands.point.lambda);
            let (size, is_larger) = match self.problem.fit(u, lambda)? {
                Fit::Suits => break,
                Fit::Wastes { size } => (size, false),
                Fit::Strains { size } | Fit::Fails { size } => (size, true),
            };
            if self.path.has_ended() {
                break;
            }
            let before = self.problem.size();
            self.problem.resize(size)?;
            match self.seam(&stands, is_larger)? {
                Some((path, probe)) => {
                    self.exchanges += self.path.exchanges();
                    (self.path, stands) = (path, probe);
                }
                None => {
                    self.problem.resize(before)?;
                    break;
                }
            }
            if !is_larger {
                break;
            }
        }
        Ok(stands)
    }

    /// The path from the present point in the present size, if that size suits and both sizes see the same side of every event.
    fn seam(
        &mut self,
        old: &Probe,
        is_larger: bool,
    ) -> Result<Option<(Continuation, Probe)>, SolveError> {
        let Some(path) = self.path.resized(self.problem)? else {
            return Ok(None);
        };
        let point = path.point().clone();
        if !is_larger {
            let fit = self.problem.fit(&point.u, point.lambda)?;
            if matches!(fit, Fit::Strains { .. } | Fit::Fails { .. }) {
                return Ok(None);
            }
        }
        let new = self.probe(point, 1.0)?;
        let turns = |p: &Probe| (p.point.orientation, p.point.tangent_lambda > 0.0);
        let is_same = turns(old) == turns(&new)
            && outside(&old.look.survey) == outside(&new.look.survey)
            && passages(&old.look.survey) == passages(&new.look.survey);
        Ok(is_same.then_some((path, new)))
    }
}

/// Multipliers outside the unit circle: real ones beyond 1, beyond -1, complex ones.
fn outside(survey: &Survey) -> [usize; 3] {
    let mut count = [0; 3];
    for mu in survey.multipliers.iter().filter(|mu| mu.norm() >= 1.0) {
        let kind = match () {
            _ if mu.im != 0.0 => 2,
            _ if mu.re < 0.0 => 1,
            _ => 0,
        };
        count[kind] += 1;
    }
    count
}

/// Passages of every breakpoint in a period.
fn passages(survey: &Survey) -> Vec<usize> {
    let connections = survey.extrema.iter().zip(&survey.breakpoints);
    let counts = connections.flat_map(|(extrema, breakpoints)| {
        let passes = |level: &f64| {
            let pairs = extrema.windows(2);
            pairs
                .filter(|w| (w[0].1 > *level) != (w[1].1 > *level))
                .count()
        };
        breakpoints.iter().map(passes)
    });
    counts.collect()
}
