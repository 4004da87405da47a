//! Following one branch of periodic solutions: points, marks, stability, events.

mod beside;
mod bounds;
pub mod confirm;
mod joints;
mod ledger;
mod refit;
mod ripple;
mod steps;

use super::continuation::{
    Continuation, ContinuationOptions, CrossingSide, Heading, PathEnd, PathPoint,
};
use super::events::{
    BifurcationEvent, EventKind, Examined, Look, Probe, Resolution, Step, is_outside, is_same,
};
use super::floquet;
use super::newton::{NewtonOutcome, NewtonStatus};
use super::orbit::Orbit;
use super::place::Place;
use super::residual::{Extent, PeriodicResidual};
use crate::error::SolveError;
use crate::system::System;
use ledger::{Gap, Ledger};
use nalgebra::DVector;
use num_complex::Complex;

/// Stability of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stability {
    /// All multipliers inside the unit circle.
    Stable,
    /// Some multiplier outside.
    Unstable,
    /// Not requested.
    Unknown,
}

/// One accepted point.
#[derive(Debug, Clone)]
pub struct BranchPoint {
    /// The continued parameter.
    pub lambda: f64,
    /// Excitation frequency over omega_c.
    pub frequency: f64,
    /// Solved exactly at a listed value.
    pub is_mark: bool,
    /// Unknowns of the residual.
    pub unknowns: DVector<f64>,
    /// Floquet multipliers by decreasing modulus; empty if not requested.
    pub multipliers: Vec<Complex<f64>>,
    /// Multipliers that are 1 by construction, for each of which the list has a 0.
    pub neutral: usize,
    /// Stability.
    pub stability: Stability,
    /// End of the corrector.
    pub newton: NewtonOutcome,
    /// Values of the recorder.
    pub recorded: Vec<f64>,
}

/// A branch, complete or not.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Points in the order of the path.
    pub points: Vec<BranchPoint>,
    /// Events in the order of the path.
    pub events: Vec<BifurcationEvent>,
    /// Events of the method that the flow's branch, followed past them, does not have.
    pub refuted: Vec<BifurcationEvent>,
    /// Reason of the end of the path.
    pub end: PathEnd,
    /// Number of linear systems that elimination by blocks could not solve and that needed row exchanges across all coordinates.
    pub exchanges: usize,
}

/// Settings of the continuation of a branch.
#[derive(Debug, Clone)]
pub struct TraceOptions {
    /// Path following.
    pub continuation: ContinuationOptions,
    /// Parameter values to solve exactly, every time the branch passes them.
    pub marks: Vec<f64>,
    /// Whether to compute multipliers, and with them period doublings and Neimark-Sacker points.
    pub stability: bool,
    /// Changes of stability at least this wide are found.
    pub resolution: Resolution,
    /// Known crossings: the branch ends where it returns to one, or to an orbit of half its period. `None`: it continues
    /// there.
    pub known: Option<Vec<Place>>,
    /// Deformation of every connection beyond which the branch counts as unbounded; empty: no limit.
    pub bounds: Vec<f64>,
}

/// Start of a branch.
#[derive(Debug, Clone)]
pub enum Begin {
    /// A guess at the first value of the range.
    Guess(DVector<f64>),
    /// A guess at a value inside the range, left towards one side: forwards is the way to its last value.
    Inside(DVector<f64>, f64, CrossingSide),
    /// A crossing on a known branch, left along the other branch.
    Crossing(Box<PathPoint>, (CrossingSide, Heading)),
}

impl TraceOptions {
    fn extent(&self) -> Extent {
        match self.stability {
            true => Extent::Stability,
            false => Extent::Motion,
        }
    }
}

/// Callback for every accepted point, which keeps post-processing out of the solvers.
pub trait Recorder {
    /// Appends the values of one orbit of the system at lambda.
    fn record(&mut self, lambda: f64, system: &System, orbit: &Orbit, values: &mut Vec<f64>);

    /// Called after every accepted point; false ends the branch there.
    fn accept(&mut self, _point: &BranchPoint) -> bool {
        true
    }
}

/// Follows a branch from a first guess, or from a crossing, which is then its first point.
///
/// A first point that cannot be corrected or left is the inner `Err`.
///
/// # Errors
/// Contradictory options, or errors of the problem.
pub fn trace(
    problem: &mut dyn PeriodicResidual,
    begin: Begin,
    options: &TraceOptions,
    recorder: &mut dyn Recorder,
) -> Result<Result<Branch, NewtonOutcome>, SolveError> {
    let is_free = !matches!(begin, Begin::Crossing(..));
    let path = match refit::begin(problem, begin, options)? {
        Ok(path) => path,
        Err(outcome) => return Ok(Err(outcome)),
    };
    // A branch of orbits that repeat themselves as often as the excitation does stays one where others branch off.
    let parts = match is_free {
        true => problem.equal_parts(&path.point().u, path.point().lambda)?,
        false => 1,
    };
    let parts_outside = problem.restrict(parts);
    let branch = Branch {
        points: Vec::new(),
        events: Vec::new(),
        refuted: Vec::new(),
        end: PathEnd::MaxPoints,
        exchanges: 0,
    };
    let mut tracer = Tracer {
        problem,
        path,
        parts,
        options,
        recorder,
        branch,
        behind: Vec::new(),
        ledger: Ledger::default(),
        exchanges: 0,
    };
    let followed = match parts == parts_outside {
        true => tracer.follow(),
        false => tracer.begin_in_part().and_then(|()| tracer.follow()),
    };
    tracer.problem.restrict(parts_outside);
    let end = match followed {
        // Earlier results are kept.
        Err(SolveError::Interrupted) => PathEnd::Interrupted,
        end => end?,
    };
    tracer.ledger.close(&mut tracer.branch.events);
    let mut branch = Branch {
        end,
        ..tracer.branch
    };
    let count = branch.points.len();
    branch.events.retain(|e| e.after_point < count);
    ripple::remove(&mut branch.events);
    Ok(Ok(branch))
}

/// What is said of a crossing that has no second direction.
fn singular(point: &PathPoint) -> NewtonOutcome {
    NewtonOutcome {
        status: NewtonStatus::SingularJacobian,
        ..point.newton
    }
}

struct Tracer<'a> {
    problem: &'a mut dyn PeriodicResidual,
    path: Continuation,
    /// Equal parts of the period of all its orbits.
    parts: usize,
    options: &'a TraceOptions,
    recorder: &'a mut dyn Recorder,
    branch: Branch,
    /// Places before the present step, with smooth motion up to it, in the order of the path; their fractions are arclengths
    /// from its origin.
    behind: Vec<Look>,
    /// Passages of +1 that wait for their fold.
    ledger: Ledger,
    /// Row exchanges in the sizes that the problem has left.
    exchanges: usize,
}

/// Places before a step that are remembered: with its two ends they carry a cubic.
const BEHIND: usize = 2;
/// Distance from the unit circle below which nothing is said of an orbit at which a branch leaves another one.
const AT_CROSSING: f64 = 1e-4;

impl Tracer<'_> {
    /// Begins again in a part of the period: where orbits of twice its length have branched off, its determinant has another sign.
    fn begin_in_part(&mut self) -> Result<(), SolveError> {
        if let Some(path) = self.path.resized(self.problem)? {
            self.path = path;
        }
        Ok(())
    }

    /// Step by step to the end of the path.
    fn follow(&mut self) -> Result<PathEnd, SolveError> {
        let first = self.path.point().clone();
        let mut last = self.probe(first, 1.0)?;
        if !self.push(&last)? {
            return Ok(PathEnd::Interrupted);
        }
        loop {
            last.look.fraction = 0.0;
            let (next, examined) = match self.take_step(&last)? {
                Ok(step) => step,
                Err(end) => return Ok(end),
            };
            if let Some(joint) = self.joint(&last, &next, &examined.events)? {
                return self.end_at(joint, &last, examined);
            }
            self.keep(&last, &next, examined)?;
            let next = self.refit(next)?;
            if !self.push(&next)? {
                return Ok(PathEnd::Interrupted);
            }
            if let Some(end) = self.runaway(&next)? {
                return Ok(end);
            }
            last = next;
        }
    }

    fn probe(&mut self, point: PathPoint, fraction: f64) -> Result<Probe, SolveError> {
        let survey = self
            .problem
            .survey(&point.u, point.lambda, self.options.extent())?;
        let look = Look {
            fraction,
            lambda: point.lambda,
            survey,
        };
        Ok(Probe { point, look })
    }

    fn examine(&mut self, a: &Probe, b: &Probe) -> Result<Examined, SolveError> {
        let after_point = self.branch.points.len() - 1;
        // Measured in lengths of the present step.
        let chord = self.path.chord();
        let mut before = self.behind.clone();
        before.iter_mut().for_each(|look| look.fraction /= chord);
        let sight = (self.options.extent(), self.options.resolution);
        let step = Step::new(&mut self.path, self.problem, sight, after_point);
        let mut examined = step.examine(&before, (a, b), &self.options.marks)?;
        if self.has_equal_halves() {
            // What passes -1 in a part passes +1 in the whole period.
            let doublings = |e: &&mut BifurcationEvent| e.kind == EventKind::PeriodDoubling;
            let doublings = examined.events.iter_mut().filter(doublings);
            doublings.for_each(|e| e.kind = EventKind::BranchPoint);
        }
        self.double_at_grazings((a, b), &mut examined)?;
        Ok(examined)
    }

    /// Whether the halves of every orbit of this branch are one.
    fn has_equal_halves(&self) -> bool {
        self.parts.is_multiple_of(2)
    }

    /// Changes of stability and turns of the parameter in the step that its events do not explain; on a vertical branch a multiplier stays
    /// at 1.
    fn unexplained(
        &mut self,
        ends: (&Probe, &Probe),
        examined: &mut Examined,
    ) -> Result<Vec<Gap>, SolveError> {
        if self.path.is_vertical() != [false, false] {
            return Ok(Vec::new());
        }
        let may_break = self.may_break(ends.0)?;
        let mut gaps = ledger::unexplained(ends, examined, may_break);
        gaps.extend(ledger::missing_folds(ends, examined));
        Ok(gaps)
    }

    /// Remembers the begin of the step for the next one, unless something grazes in between.
    fn remember(&mut self, begin: &Probe, events: &[BifurcationEvent]) {
        let is_smooth = events.iter().all(|e| e.kind.is_bifurcation());
        if !is_smooth || begin.point.orientation == 0 {
            self.behind.clear();
            return;
        }
        let chord = self.path.chord();
        self.behind.push(begin.look.clone());
        if self.behind.len() > BEHIND {
            self.behind.remove(0);
        }
        self.behind
            .iter_mut()
            .for_each(|look| look.fraction -= chord);
    }

    fn is_mark(&self, lambda: f64) -> bool {
        self.options.marks.iter().any(|m| is_same(*m, lambda))
    }

    /// Appends what a step brought, but for its end.
    fn keep(&mut self, a: &Probe, b: &Probe, mut examined: Examined) -> Result<(), SolveError> {
        self.remember(a, &examined.events);
        let gaps = self.unexplained((a, b), &mut examined)?;
        let number = self.branch.points.len() - 1;
        let gaps = gaps.iter().map(|gap| gap.as_event(number));
        examined.events.extend(gaps);
        examined
            .events
            .sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        let Examined {
            mut events,
            marks,
            mut owed,
        } = examined;
        if a.point.orientation == 0 {
            // The crossing that the branch has just left explains a multiplier that passes 1 there.
            owed.clear();
        }
        for event in events.iter_mut().chain(&mut owed) {
            let earlier = |m: &&Probe| m.look.fraction < event.fraction;
            event.after_point += marks.iter().filter(earlier).count();
        }
        self.ledger
            .settle(&mut self.branch.events, &mut events, owed);
        for mut event in events {
            if let Some(point) = &event.point {
                event.recorded = self.record_at(point)?;
                if event.kind == EventKind::Fold {
                    event.doubt = self.doubt(point)?;
                }
                if let EventKind::Grazing {
                    connection,
                    breakpoint,
                } = event.kind
                {
                    let law = &self.problem.system_at(event.lambda)?.mounts()[connection].element;
                    event.breakpoint = law.breakpoints().get(breakpoint).copied();
                }
            }
            self.branch.events.push(event);
        }
        for mark in &marks {
            self.push(mark)?;
        }
        Ok(())
    }

    /// Values of the recorder at a point of the path.
    fn record_at(&mut self, point: &PathPoint) -> Result<Vec<f64>, SolveError> {
        let mut values = Vec::new();
        let orbit = self.problem.orbit(&point.u, point.lambda)?;
        let system = self.problem.system_at(point.lambda)?;
        self.recorder
            .record(point.lambda, system, &orbit, &mut values);
        Ok(values)
    }

    /// Appends a point; false when the recorder asks to stop.
    fn push(&mut self, probe: &Probe) -> Result<bool, SolveError> {
        let point = &probe.point;
        let survey = &probe.look.survey;
        let system = self.problem.system_at(point.lambda)?;
        let mut recorded = Vec::new();
        self.recorder
            .record(point.lambda, system, &survey.orbit, &mut recorded);
        let stability = match survey.multipliers.first() {
            None => Stability::Unknown,
            Some(largest)
                if point.orientation == 0 && (largest.norm() - 1.0).abs() < AT_CROSSING =>
            {
                Stability::Unknown
            }
            Some(largest) if is_outside(*largest) => Stability::Unstable,
            Some(_) => Stability::Stable,
        };
        let accepted = BranchPoint {
            lambda: point.lambda,
            frequency: system.reference_frequency(),
            is_mark: self.is_mark(point.lambda),
            unknowns: point.u.clone(),
            multipliers: floquet::whole(survey.multipliers.clone(), self.parts),
            neutral: survey.neutral,
            stability,
            newton: point.newton,
            recorded,
        };
        let go_on = self.recorder.accept(&accepted);
        self.branch.points.push(accepted);
        Ok(go_on)
    }
}
