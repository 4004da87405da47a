//! The events of responses with the states at which they happen: where curves in two parameters begin.

use super::trace::Work;
use super::{BranchSettings, Method, Swept};
use crate::error::{Error, SolveError};
use crate::solve::events::EventKind;
use crate::solve::galerkin::Galerkin;
use crate::solve::residual::PeriodicResidual;

/// An event of a response.
#[derive(Debug, Clone)]
pub struct EventState {
    /// Kind.
    pub kind: EventKind,
    /// Excitation frequency over omega_c.
    pub omega: f64,
    /// Full path of the number that is varied, and its value; `None` where that is the frequency.
    pub number: Option<(String, f64)>,
    /// State at phase 0.
    pub state: Vec<f64>,
    /// Excitation periods per orbit period.
    pub subharmonic: usize,
}

/// Runs a response as far as its events, and gives those that were located.
pub(in crate::analysis) fn event_states(
    settings: &BranchSettings,
    swept: &Swept<'_>,
) -> Result<Vec<EventState>, Error> {
    let (settings, _) = settings.resolved(swept);
    let mut work = Work::new(&settings, swept);
    match work.trace_all() {
        Err(Error::Solve(SolveError::Interrupted)) => {}
        traced => traced?,
    }
    let dof = swept.setting.assembly.system.dof();
    let mut list = Vec::new();
    for delivered in &work.delivered {
        let nu = delivered.subharmonic;
        for event in &delivered.events {
            let Some(point) = &event.point else {
                continue;
            };
            let state = match delivered.method {
                Method::Shooting => point.u.as_slice().to_vec(),
                Method::Integration => continue,
                Method::Galerkin => {
                    let size = settings.size_with(swept.harmonics(point.u.len(), nu), nu);
                    let family = swept.family_for(nu)?;
                    let mut galerkin = Galerkin::new(family, event.lambda, size)?;
                    let mut state = vec![0.0; 2 * dof];
                    let orbit = galerkin.orbit(&point.u, event.lambda)?;
                    orbit.state(0.0, &mut state);
                    state
                }
            };
            list.push(EventState {
                kind: event.kind,
                omega: swept.excitation(event.lambda),
                number: swept.number_at(event.lambda),
                state,
                subharmonic: nu,
            });
        }
    }
    Ok(list)
}
