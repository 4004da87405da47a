//! Where branches of periodic solutions begin.

use crate::solve::branch::Begin;
use crate::solve::continuation::{CrossingSide, Heading, PathPoint};
use crate::solve::residual::PeriodicResidual;
use nalgebra::DVector;

/// Where a branch of periodic solutions begins.
pub(super) enum BranchSource {
    /// A guess at the first value of the range.
    Guess(DVector<f64>),
    /// A solution inside the range, and the way to go.
    Inside(DVector<f64>, f64, CrossingSide),
    /// An event of another branch.
    Crossing {
        /// The point of that branch.
        point: Box<PathPoint>,
        /// nu of that branch.
        subharmonic: usize,
        /// Which way the new branch is followed.
        side: CrossingSide,
        /// In which of several directions it leaves.
        heading: Heading,
        /// Whether the new branch has twice the period.
        is_doubled: bool,
    },
}

impl BranchSource {
    /// The same in the unknowns of the new branch.
    pub fn begin(self, problem: &dyn PeriodicResidual) -> Begin {
        match self {
            BranchSource::Guess(u) => Begin::Guess(u),
            BranchSource::Inside(u, lambda, side) => Begin::Inside(u, lambda, side),
            BranchSource::Crossing {
                mut point,
                side,
                heading,
                is_doubled,
                ..
            } => {
                if is_doubled {
                    point.u = problem.in_doubled_period(&point.u);
                    point.tangent_u = problem.in_doubled_period(&point.tangent_u);
                }
                Begin::Crossing(point, (side, heading))
            }
        }
    }
}
