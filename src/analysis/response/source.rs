//! Where branches of periodic solutions begin.

use crate::solve::branch::Begin;
use crate::solve::continuation::{Heading, PathPoint, Side};
use crate::solve::residual::PeriodicResidual;
use nalgebra::DVector;

/// Where a branch of periodic solutions begins.
pub(super) enum Source {
    /// A guess at the first value of the range.
    Guess(DVector<f64>),
    /// A solution inside the range, and the way to go.
    Inside(DVector<f64>, f64, Side),
    /// An event of another branch.
    Crossing {
        /// The point of that branch.
        point: Box<PathPoint>,
        /// nu of that branch.
        subharmonic: usize,
        /// Which way the new branch is followed.
        side: Side,
        /// In which of several directions it leaves.
        heading: Heading,
        /// Whether the new branch has twice the period.
        is_doubled: bool,
    },
}

impl Source {
    /// The same in the unknowns of the new branch.
    pub fn begin(self, problem: &dyn PeriodicResidual) -> Begin {
        match self {
            Source::Guess(u) => Begin::Guess(u),
            Source::Inside(u, lambda, side) => Begin::Inside(u, lambda, side),
            Source::Crossing {
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
