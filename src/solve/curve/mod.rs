//! Curves of bifurcations and grazings in two parameters.
//!
//! Unknowns are a periodic orbit u of the flow, the first parameter and, where a condition needs it, one number more; the second
//! parameter is that of the path follower, which is the one of branches.
//!
//! ```text
//! P(u; p1, p2) - u = 0,    g(u, p1, p2, extra) = 0
//! ```
//!
//! g comes from bordered systems, which are smooth where eigenvalues are not; the borders follow along the curve.

mod back;
mod between;
mod beyond;
mod chord;
mod codimension;
mod conditions;
mod corner;
mod correction;
mod defining;
mod end;
mod follow;
mod grazing;
mod meeting;
mod nature;
mod normal_form;
mod passing;
mod relocate;
mod seek;
mod shots;
mod touching;
mod walker;

pub(crate) use codimension::CurveEvent;
pub(crate) use correction::corrected;
pub(crate) use defining::{Defining, Spot};
pub(crate) use end::CurveEnd;
pub(crate) use follow::follow;
pub(crate) use grazing::{Grazing, OrbitsBeside};
pub(crate) use nature::Codimension;
pub use seek::Guess;
pub(crate) use seek::{Guesses, NoStart, seek};
pub(crate) use shots::{Plane, Shots};
pub use walker::Arm;
pub(crate) use walker::{CurveOptions, CurvePoint};

/// Condition along a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveKind {
    /// Multiplier +1, two orbits meet.
    Fold,
    /// Multiplier +1 where two branches cross, as parts that are alike let them.
    BranchPoint,
    /// Multiplier -1.
    PeriodDoubling,
    /// A complex pair on the unit circle.
    NeimarkSacker,
    /// An extremum of a deformation lies on a breakpoint of its law.
    Grazing {
        /// Connection.
        connection: usize,
        /// Breakpoint of its law, counted from below.
        breakpoint: usize,
    },
}

impl CurveKind {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            CurveKind::Fold => "fold",
            CurveKind::BranchPoint => "branch_point",
            CurveKind::PeriodDoubling => "period_doubling",
            CurveKind::NeimarkSacker => "neimark_sacker",
            CurveKind::Grazing { .. } => "grazing",
        }
    }

    /// What the unknown besides the orbit and the first parameter is measured in: a phase in periods.
    pub(super) fn extra_unit(self) -> f64 {
        match self {
            CurveKind::Grazing { .. } => std::f64::consts::TAU,
            _ => 1.0,
        }
    }

    /// Unknowns besides the orbit and the first parameter.
    pub(super) fn extras(self) -> usize {
        match self {
            CurveKind::Fold | CurveKind::PeriodDoubling => 0,
            CurveKind::BranchPoint | CurveKind::NeimarkSacker | CurveKind::Grazing { .. } => 1,
        }
    }
}
