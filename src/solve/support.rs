//! What each solver can do with a connection: its law, its stiffness variation, its transmission error.

use super::floquet;
use super::integrate::exact_flow_needs;
use crate::system::Mount;

/// How far a solver goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reach {
    /// All the way.
    Yes,
    /// With a reservation.
    Limited,
    /// Not at all: refused before anything runs.
    No,
}

/// What one solver does with one connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Support {
    /// Name of the solver.
    pub solver: &'static str,
    /// How far it goes.
    pub reach: Reach,
    /// How, or why not.
    pub how: &'static str,
}

/// What every solver does with a connection, always in the same order.
pub fn of(mount: &Mount) -> [Support; 5] {
    let law = mount.element.as_ref();
    let (is_hidden, is_jumping) = (law.has_hidden_jumps(), law.is_discontinuous());
    let no_transition = "no transition matrix: the force may jump where no breakpoint is known";
    let exact = match exact_flow_needs(mount) {
        None if is_jumping => (
            Reach::Yes,
            "jumps located; a joint that sticks on one ends it",
        ),
        None => (Reach::Yes, "closed form between switches"),
        Some(need) => (Reach::No, need),
    };
    let dopri5 = match (is_hidden, is_jumping) {
        (true, _) => (
            Reach::Limited,
            "jumps passed under error control, not located; sticking costs many steps",
        ),
        (_, true) => (
            Reach::Yes,
            "jumps located; a joint that sticks on one ends it",
        ),
        _ => (Reach::Yes, "breakpoints located"),
    };
    let galerkin = match (is_hidden, is_jumping) {
        (true, _) => (
            Reach::Limited,
            "samples miss the instants of jumps: the iteration may stall",
        ),
        (_, true) => (Reach::Yes, "sampled, with the instants of jumps as roots"),
        _ => (Reach::Yes, "sampled"),
    };
    let shooting = match (is_hidden, exact.0) {
        (true, _) => (Reach::No, no_transition),
        (_, Reach::Yes) => (
            Reach::Yes,
            "by the exact flow, if every connection admits it",
        ),
        _ => (Reach::Yes, "by DOPRI5"),
    };
    let multipliers = match is_hidden {
        true => (Reach::No, no_transition),
        false if floquet::is_piecewise_constant(mount) => (Reach::Yes, "exact exponentials"),
        false => (Reach::Yes, "Magnus panels"),
    };
    [
        ("exact flow", exact),
        ("DOPRI5", dopri5),
        ("Galerkin", galerkin),
        ("shooting", shooting),
        ("multipliers", multipliers),
    ]
    .map(|(solver, (reach, how))| Support { solver, reach, how })
}
