//! Bifurcations and grazings inside one step of a path: detection, refinement, location.
//!
//! The search between two accepted points uses the Hermite interpolant of the step, which needs no correction; reported events
//! are located on the corrected path.

mod bound;
mod grazings;
mod locate;
mod pace;
mod passages;
mod polynomial;
pub mod quiet;
mod settle;
mod sharpen;
mod slips;
mod spectrum;
mod step;
mod touch;
mod turnings;

pub(crate) use sharpen::beyond_one;
pub use spectrum::Count;
pub(crate) use spectrum::{Sought, is_outside};
pub use step::Step;
pub(crate) use step::{BESIDE_CROSSING, Examined, is_same};

use super::continuation::PathPoint;
use super::orbit::Orbit;
use super::residual::Survey;

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// The branch turns in the parameter (multiplier +1).
    Fold,
    /// Another branch crosses (multiplier +1 without turning).
    BranchPoint,
    /// A real multiplier passes -1.
    PeriodDoubling,
    /// A complex pair passes the unit circle.
    NeimarkSacker,
    /// An extremum of a deformation touches a breakpoint of its law.
    Grazing {
        /// Connection.
        connection: usize,
        /// Breakpoint of its law, counted from below.
        breakpoint: usize,
    },
    /// The span of what a slider follows grows to what it can hold: on one side it sticks all the time.
    SlipOnset {
        /// Connection.
        connection: usize,
    },
    /// The number of multipliers outside the unit circle changes, and no located event explains it.
    Unresolved,
}

impl EventKind {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            EventKind::Fold => "fold",
            EventKind::BranchPoint => "branch_point",
            EventKind::PeriodDoubling => "period_doubling",
            EventKind::NeimarkSacker => "neimark_sacker",
            EventKind::Grazing { .. } => "grazing",
            EventKind::SlipOnset { .. } => "slip_onset",
            EventKind::Unresolved => "unresolved",
        }
    }

    /// Whether stability or the number of solutions changes; a grazing and an onset of slip change neither.
    pub fn is_bifurcation(self) -> bool {
        !matches!(
            self,
            EventKind::Grazing { .. } | EventKind::SlipOnset { .. }
        )
    }
}

/// Verdict of the flow on an event of another method.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Verdict {
    /// Not tried.
    #[default]
    NotTried,
    /// The flow's own branch has the event, with the same change of the number of unstable multipliers.
    Confirmed,
    /// The flow's own branch does not have the event.
    Refuted,
}

/// An event between two points of a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct BifurcationEvent {
    /// Kind.
    pub kind: EventKind,
    /// Parameter at the event: of the flow where it confirmed the event, else of the method.
    pub lambda: f64,
    /// Parameter at the event on the method's own branch; not a number for an event that only the flow has.
    pub method_lambda: f64,
    /// Verdict of the flow.
    pub verdict: Verdict,
    /// Parameters that enclose it; for a fold the neighbouring points', which may not.
    pub bracket: (f64, f64),
    /// Equal multipliers that pass together: 1 for a single one or a single pair, m for those of m equal parts.
    pub multiplicity: usize,
    /// Multipliers outside the unit circle just before and just behind the event; `None` where they are not known.
    pub unstable: Option<(usize, usize)>,
    /// Point of the branch before the event.
    pub after_point: usize,
    /// Position as a fraction of the step.
    pub fraction: f64,
    /// The point of the path at the event; `None` when the location did not converge.
    pub point: Option<PathPoint>,
    /// The breakpoint that is touched; `None` for bifurcations.
    pub breakpoint: Option<f64>,
    /// Possible error of the parameter of a fold due to sampling of forces; 0 without sampling.
    pub doubt: f64,
    /// Values of the recorder at the event; empty when it could not be located.
    pub recorded: Vec<f64>,
}

impl BifurcationEvent {
    /// Whether it was found as a root, and the flow did not refute it.
    pub fn is_located(&self) -> bool {
        match self.verdict {
            Verdict::NotTried => self.point.is_some(),
            Verdict::Confirmed => true,
            Verdict::Refuted => false,
        }
    }
}

/// Data at one place of a step.
#[derive(Debug, Clone)]
pub(crate) struct Look {
    /// Fraction of the step, 0 at its origin.
    pub fraction: f64,
    /// Parameter.
    pub lambda: f64,
    /// The solution, or its interpolant.
    pub survey: Survey,
}

impl Look {
    /// What its multipliers say; `None` where they are not known.
    pub fn count(&self) -> Option<Count> {
        Count::of(&self.survey.multipliers)
    }

    /// Response frequency, d tau / dT.
    fn omega(&self) -> f64 {
        match &self.survey.orbit {
            Orbit::Fourier(orbit) => orbit.omega,
            Orbit::Segments(orbit) => orbit.omega,
        }
    }
}

/// Width of the narrowest window of changed stability that is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Share of the larger of the parameter and a tenth of the range.
    pub share: f64,
    /// Value of lambda at which the parameter vanishes.
    pub zero: f64,
    /// Length of the range in lambda.
    pub range: f64,
}

impl Resolution {
    /// The width at a lambda.
    pub fn width(&self, lambda: f64) -> f64 {
        self.share * (lambda - self.zero).abs().max(0.1 * self.range.abs())
    }
}

/// A point of the path with its data.
#[derive(Debug, Clone)]
pub(crate) struct Probe {
    /// The point.
    pub point: PathPoint,
    /// Data.
    pub look: Look,
}
