//! One step under examination: folds and branch points, then marks, then grazings, then the multipliers between them.

use super::{BifurcationEvent, EventKind, Look, Probe, Resolution};
use crate::error::SolveError;
use crate::solve::continuation::{Continuation, PathPoint};
use crate::solve::residual::{Extent, PeriodicResidual};
use std::rc::Rc;

/// Looks at interpolated places that one step is worth.
const MAX_LOOKS: usize = 2000;
/// Excitation periods that these looks may cover all together, for long response periods,
const LOOKED_PERIODS: usize = 4000;
/// and the looks that are always allowed.
const FEWEST_LOOKS: usize = 60;
/// Two parameters closer than this, relative to their size, are the same mark.
const SAME_MARK: f64 = 1e-13;

/// Share of a step that leaves a crossing in which folds and branch points are that crossing.
pub(crate) const BESIDE_CROSSING: f64 = 1e-2;

/// The step under examination.
pub struct Step<'a> {
    pub(super) path: &'a mut Continuation,
    pub(super) problem: &'a mut dyn PeriodicResidual,
    pub(super) extent: Extent,
    pub(super) resolution: Resolution,
    pub(super) after_point: usize,
    pub(super) looks_left: usize,
    pub(super) found: Vec<BifurcationEvent>,
    /// Looks for extrema that touch a breakpoint.
    pub(super) touches: Vec<Rc<Look>>,
}

/// Result of a step.
#[derive(Debug, Clone)]
pub(crate) struct Examined {
    /// Everything that happens between its ends, in the order of the path.
    pub events: Vec<BifurcationEvent>,
    /// Marks solved on the way, in the order of the path.
    pub marks: Vec<Probe>,
    /// Passages of +1 without a fold or a branch point: that of a truncated series may lie in a neighbouring step.
    pub owed: Vec<BifurcationEvent>,
}

impl<'a> Step<'a> {
    /// The last step of a path, which began at a point of the branch with this number.
    pub fn new(
        path: &'a mut Continuation,
        problem: &'a mut dyn PeriodicResidual,
        (extent, resolution): (Extent, Resolution),
        after_point: usize,
    ) -> Step<'a> {
        Step {
            path,
            problem,
            extent,
            resolution,
            after_point,
            looks_left: MAX_LOOKS,
            found: Vec::new(),
            touches: Vec::new(),
        }
    }

    /// What happens between the two ends of the step. `before`: places of the path before the step, with nothing but smooth
    /// motion in between, in the order of the path. `marks`: parameters to solve exactly.
    ///
    /// # Errors
    /// Errors of the problem.
    pub(crate) fn examine(
        mut self,
        before: &[Look],
        (a, b): (&Probe, &Probe),
        marks: &[f64],
    ) -> Result<Examined, SolveError> {
        let affordable = LOOKED_PERIODS / a.look.survey.orbit.subharmonic();
        self.looks_left = affordable.clamp(FEWEST_LOOKS, MAX_LOOKS);
        // Where the parameter is constant it turns by rounding only, and a multiplier stays at 1.
        let [begins, ends] = self.path.is_vertical();
        if !begins && !ends {
            self.turnings(a, b)?;
        }
        let marks = self.solve_marks((a, b), marks)?;
        let mut knots = self.grazings(before.last(), &a.look, &b.look)?;
        knots.extend(self.slips(&a.look, &b.look)?);
        knots.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        let mut owed = Vec::new();
        if self.extent == Extent::Stability && !ends {
            let solved: Vec<Look> = marks.iter().map(|m| m.look.clone()).collect();
            let ones = self.passages(before, (&a.look, &b.look), (knots, &solved))?;
            owed = self.settle(ones, (a, b))?;
            self.sharpen()?;
        } else {
            self.merge_turns();
        }
        if self.path.origin().orientation == 0 {
            self.forget_crossing();
        }
        self.found.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        Ok(Examined {
            events: self.found,
            marks,
            owed,
        })
    }

    /// The path leaves a crossing, where it turns and other paths pass by definition: what is found beside it is the crossing itself.
    fn forget_crossing(&mut self) {
        self.found.retain(|e| {
            let is_turn = matches!(e.kind, EventKind::Fold | EventKind::BranchPoint);
            !is_turn || e.fraction > BESIDE_CROSSING
        });
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

    /// Solves the marks that the step passes; a fold inside the step is passed twice.
    fn solve_marks(
        &mut self,
        (a, b): (&Probe, &Probe),
        marks: &[f64],
    ) -> Result<Vec<Probe>, SolveError> {
        let mut folds: Vec<&BifurcationEvent> = self.found.iter().collect();
        folds.retain(|e| e.kind == EventKind::Fold && e.is_located());
        folds.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        let folds = folds.into_iter().map(|e| (e.fraction, e.lambda));
        let stretches: Vec<(f64, f64)> = [(0.0, a.point.lambda)]
            .into_iter()
            .chain(folds)
            .chain([(b.look.fraction, b.point.lambda)])
            .collect();
        let mut solved: Vec<(f64, PathPoint)> = Vec::new();
        for pair in stretches.windows(2) {
            let ((f0, l0), (f1, l1)) = (pair[0], pair[1]);
            let inside =
                |m: &&f64| (**m - l0) * (**m - l1) < 0.0 && !is_same(**m, l0) && !is_same(**m, l1);
            for mark in marks.iter().filter(inside) {
                solved.extend(self.path.at_lambda(self.problem, *mark, (f0, f1))?);
            }
        }
        solved.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut probes = Vec::with_capacity(solved.len());
        for (fraction, point) in solved {
            let survey = self.problem.survey(&point.u, point.lambda, self.extent)?;
            let look = Look {
                fraction,
                lambda: point.lambda,
                survey,
            };
            probes.push(Probe { point, look });
        }
        Ok(probes)
    }
}

/// Whether two parameters are the same mark.
pub(crate) fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME_MARK * a.abs()
}
