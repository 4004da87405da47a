//! One point of a Galerkin branch beside what the flow has there.

use crate::analysis::branch_table::main;
use crate::analysis::response::Swept;
use crate::analysis::response::guarded::Guarded;
use crate::error::SolveError;
use crate::postprocess::connection::Measures;
use crate::postprocess::measures::Meter;
use crate::solve::branch::BranchPoint;
use crate::solve::branch::confirm::CheckedBranch;
use crate::solve::continuation::{ContinuationOptions, Section};
use crate::solve::events::{BifurcationEvent, EventKind, Verdict};
use crate::solve::residual::{PeriodicResidual, Residual};
use nalgebra::DVector;

/// Digits that agree when nothing differs.
pub(super) const ALL_DIGITS: f64 = 16.0;
/// R.m.s. values below this share of the largest one count as large as that: a connection that hardly moves has no digits to lose.
const HARDLY_MOVES: f64 = 1e-3;

/// Result of the flow at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FlowAnswer {
    /// An orbit, with the number of corrector iterations.
    Orbit(usize),
    /// None at this parameter: the exact branch turns back at this one, the Galerkin branch a little later.
    BeyondFold(f64),
    /// None at this parameter that the corrector reaches; the exact branch runs beside it.
    Beside,
    /// None that the corrector reaches.
    Nothing,
}

/// Values of one connection along the flow, nondimensional.
#[derive(Debug, Clone, Copy)]
pub(in crate::analysis::response) struct Exactly {
    /// R.m.s. deformation.
    pub rms: f64,
    /// R.m.s. rate.
    pub rms_velocity: f64,
    /// Largest force.
    pub force_max: f64,
}

/// What the flow said about one point.
pub(in crate::analysis::response) struct FlowRow {
    pub(super) branch: usize,
    pub point: usize,
    pub(super) lambda: f64,
    pub(super) found: FlowAnswer,
    pub(super) digits: f64,
    /// Whether the orbit is the one of the series.
    pub is_same: bool,
    /// Of the multipliers of the series, relative.
    pub multiplier_error: f64,
    /// By connection; empty where there is no orbit.
    pub exactly: Vec<Exactly>,
}

impl FlowRow {
    pub(super) fn is_converged(&self) -> bool {
        matches!(self.found, FlowAnswer::Orbit(_))
    }

    pub(super) fn iterations(&self) -> usize {
        match self.found {
            FlowAnswer::Orbit(iterations) => iterations,
            _ => 0,
        }
    }

    pub(super) fn fold(&self) -> Option<f64> {
        match self.found {
            FlowAnswer::BeyondFold(fold) => Some(fold),
            _ => None,
        }
    }

    pub(super) fn reason(&self) -> String {
        let word = match self.found {
            FlowAnswer::Orbit(_) => "",
            FlowAnswer::BeyondFold(_) => "beyond_fold",
            FlowAnswer::Beside | FlowAnswer::Nothing => "no_orbit",
        };
        word.into()
    }
}

/// The checked points of one branch on their way into rows.
pub(super) struct PointCheck<'a> {
    pub galerkin: &'a mut dyn PeriodicResidual,
    pub shooting: &'a mut Guarded<'a>,
    pub meter: Meter,
    pub options: ContinuationOptions,
    pub points: &'a [BranchPoint],
    pub events: &'a [BifurcationEvent],
    pub swept: &'a Swept<'a>,
}

impl PointCheck<'_> {
    pub(super) fn row(
        &mut self,
        branch: usize,
        checked: &CheckedBranch,
    ) -> Result<FlowRow, SolveError> {
        let CheckedBranch {
            point,
            orbit,
            is_same,
            has_branch,
            multiplier_error,
        } = checked;
        let lambda = self.points[*point].lambda;
        let (found, exactly) = match orbit {
            None => {
                let otherwise = match has_branch {
                    true => FlowAnswer::Beside,
                    false => FlowAnswer::Nothing,
                };
                let fold = self.fold(*point)?;
                (fold.map_or(otherwise, FlowAnswer::BeyondFold), Vec::new())
            }
            Some((state, iterations)) => (
                FlowAnswer::Orbit(*iterations),
                self.measured(state, lambda)?,
            ),
        };
        let digits = match exactly.is_empty() {
            true => f64::NAN,
            false => self.digits(*point, &exactly),
        };
        Ok(FlowRow {
            branch,
            point: *point,
            lambda,
            found,
            digits,
            is_same: *is_same,
            multiplier_error: *multiplier_error,
            exactly,
        })
    }

    /// Measures of the flow's orbit from a state at phase 0.
    fn measured(&mut self, state: &DVector<f64>, lambda: f64) -> Result<Vec<Exactly>, SolveError> {
        let orbit = self.shooting.orbit(state, lambda)?;
        let system = self.shooting.system_at(lambda)?;
        let here = self.swept.here(lambda);
        let measures = self.meter.measure(system, &orbit).into_iter();
        let one = |(mut m, stiffening): (Measures, &f64)| {
            m.scale_force(*stiffening);
            Exactly {
                rms: m.rms,
                rms_velocity: m.rms_velocity,
                force_max: m.force_max,
            }
        };
        Ok(measures.zip(&here.stiffening).map(one).collect())
    }

    /// -lg of the largest relative difference of the r.m.s. deformations.
    fn digits(&self, point: usize, exactly: &[Exactly]) -> f64 {
        let series = recorded(self.swept, &self.points[point], "rms");
        let pairs = || exactly.iter().map(|x| x.rms).zip(series.iter().copied());
        let largest = pairs().fold(0.0_f64, |m, (x, y)| m.max(x).max(y));
        let floor = (HARDLY_MOVES * largest).max(f64::MIN_POSITIVE);
        let gaps = pairs().map(|(x, y)| (x - y).abs() / x.max(y).max(floor));
        (-gaps.fold(0.0, f64::max).log10()).min(ALL_DIGITS)
    }

    /// State of a Galerkin point at phase 0, and its parameter.
    fn state(&mut self, point: usize) -> Result<(DVector<f64>, f64), SolveError> {
        let BranchPoint {
            lambda, unknowns, ..
        } = &self.points[point];
        let mut state = DVector::zeros(self.shooting.dim());
        let orbit = self.galerkin.orbit(unknowns, *lambda)?;
        orbit.state(0.0, state.as_mut_slice());
        Ok((state, *lambda))
    }

    /// Where the exact branch turns back before it reaches a point: at a confirmed fold beside it, or sought across the direction
    /// of the Galerkin branch.
    fn fold(&mut self, point: usize) -> Result<Option<f64>, SolveError> {
        let here = self.points[point].lambda;
        let beside = self.events.iter().filter(|e| {
            let is_fold = e.kind == EventKind::Fold && e.verdict == Verdict::Confirmed;
            is_fold && (e.after_point..=e.after_point + 1).contains(&point)
        });
        let gap = |lambda: &f64| (lambda - here).abs();
        let nearest = beside
            .map(|e| e.lambda)
            .min_by(|a, b| gap(a).total_cmp(&gap(b)));
        if nearest.is_some() {
            return Ok(nearest);
        }
        let place = self.state(point)?;
        let before = self.state(point.saturating_sub(1))?;
        let behind = self.state((point + 1).min(self.points.len() - 1))?;
        let (lambda, direction) = (place.1, (behind.0 - before.0, behind.1 - before.1));
        if direction.0.amax() == 0.0 {
            return Ok(None);
        }
        let shooting = &mut *self.shooting;
        let mut section = Section::new(shooting, place, direction, self.options)?;
        let turn = section.turn(shooting)?;
        let beyond = turn.filter(|(fold, side)| (lambda - fold.lambda) * side < 0.0);
        Ok(beyond.map(|(fold, _)| fold.lambda))
    }
}

/// Recorded values of one measure of a point, by connection.
pub(in crate::analysis::response) fn recorded(
    swept: &Swept<'_>,
    point: &BranchPoint,
    measure: &str,
) -> Vec<f64> {
    let columns = main(swept, measure).into_iter();
    columns.map(|(k, _)| point.recorded[k]).collect()
}
