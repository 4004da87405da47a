//! Invariant curves of the stroboscopic map: tori of the flow, attracting or not.
//!
//! ```text
//! P(K(theta); lambda) = K(theta + rho),    <K - K_ref, K_ref'> = 0
//! ```
//!
//! K lives on an odd number of points with trigonometric interpolation between them; unknowns are its values and rho, followed in
//! one parameter by the path follower of branches. What a curve is worth is judged off its points.

mod birth;
mod exponents;
mod follow;
mod locking;
mod point;
mod problem;
mod ring;
mod section;

pub(crate) use birth::{from_event, from_record};
pub(crate) use follow::follow;
pub(crate) use follow::{TorusArm, TorusEnd, TorusOptions};
pub use locking::Locked;
pub(crate) use locking::locking;
pub(crate) use point::TorusPoint;
pub(crate) use problem::{CurveOfTorus, TorusProblem};
