//! Support of a connection by each solver: its law, its stiffness variation, its transmission error.

use super::closed_form::ClosedForm;
use super::floquet;
use super::integrate::series_refusal;
use crate::system::Mount;

/// Support level of a solver.
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

/// Support of one connection by one solver.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Support {
    /// Name of the solver.
    pub solver: &'static str,
    /// Support level.
    pub reach: Reach,
    /// Explanation, or reason why not.
    pub how: String,
}

/// Support of a connection by all solvers, in a fixed order.
pub fn of(mount: &Mount) -> [Support; 7] {
    let law = mount.element.as_ref();
    let (is_hidden, is_jumping) = (law.has_hidden_jumps(), law.is_discontinuous());
    let yes = |how: &str| (Reach::Yes, how.to_string());
    let limited = |how: &str| (Reach::Limited, how.to_string());
    let no_transition = "no transition matrix: the force may jump where no breakpoint is known";
    let flow = match ClosedForm::Flow.refusal(mount) {
        None if law.least_impact().is_some() => {
            yes("closed form between impacts and in held contact")
        }
        None if law.memory_count() > 0 => yes("closed form between switches, memory included"),
        None if is_jumping => yes("jumps located; a joint that sticks on one is held"),
        None => yes("closed form between switches"),
        Some(reason) => (Reach::No, reason),
    };
    let series = match series_refusal(mount) {
        None if flow.0 == Reach::Yes => yes("the closed form is its case of constant coefficients"),
        None => yes("Taylor series between switches, errors from their last terms"),
        Some(reason) => (Reach::No, reason),
    };
    let quadrature = match ClosedForm::Quadrature.refusal(mount) {
        None => yes("closed form between switches"),
        Some(reason) => (Reach::No, reason),
    };
    let dopri5 = match (is_hidden, is_jumping) {
        _ if law.least_impact().is_some() => (Reach::No, "knows no impacts".to_string()),
        _ if law.evolving().is_some() => {
            yes("memory beside the motion; kinks of its rate under error control")
        }
        _ if law.memory_count() > 0 => yes("instants of stick and slip located"),
        (true, _) => {
            limited("jumps passed under error control, not located; sticking costs many steps")
        }
        (_, true) => limited("jumps located; a joint that rests on one ends it"),
        _ => yes("breakpoints located"),
    };
    let galerkin = match (is_hidden, is_jumping) {
        _ if law.least_impact().is_some() => (
            Reach::No,
            "velocities jump at impacts: Fourier series do not converge".to_string(),
        ),
        _ if law.evolving().is_some() => yes("sampled, the memory followed around the period"),
        _ if law.memory_count() > 0 => match ClosedForm::Quadrature.refusal(mount) {
            None => yes("closed form between the events of the march around the period"),
            Some(reason) => (Reach::No, reason),
        },
        (true, _) => limited("samples miss the instants of jumps: the iteration may stall"),
        (_, true) => yes("sampled, with the instants of jumps as roots"),
        _ => yes("sampled"),
    };
    let shooting = match (is_hidden, flow.0, series.0) {
        (true, ..) => (Reach::No, no_transition.to_string()),
        (_, Reach::Yes, _) => yes("by the exact flow, if every connection admits it"),
        (.., Reach::Yes) => yes("by the series flow, if every connection has a series"),
        _ => yes("by DOPRI5"),
    };
    let multipliers = match is_hidden {
        true => (Reach::No, no_transition.to_string()),
        false if law.evolving().is_some() => yes("by the flow"),
        false if floquet::is_piecewise_constant(mount) => yes("exact exponentials"),
        false => yes("Magnus panels"),
    };
    [
        ("exact flow", flow),
        ("series flow", series),
        ("DOPRI5", dopri5),
        ("Galerkin", galerkin),
        ("exact quadrature", quadrature),
        ("shooting", shooting),
        ("multipliers", multipliers),
    ]
    .map(|(solver, (reach, how))| Support { solver, reach, how })
}
