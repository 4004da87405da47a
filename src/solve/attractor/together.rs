//! Transients of several motions of one system, gone through together.

use super::record::{ALIGNMENT, HeadStart, KEPT};
use crate::solve::ensemble::{Ensemble, Next, Visit};
use crate::solve::integrate::IntegrationEnd;
use crate::system::System;

/// Takes motions through their transient up to where deviations have to go along; each state ends where its motion is taken over.
///
/// `None`, and the state as it was, where a motion cannot be followed that far: on its own it says why. `keep_going` is asked after every
/// period of each.
pub fn head_starts(
    ensemble: &mut Ensemble,
    system: &System,
    states: &mut [Vec<f64>],
    transient: usize,
    keep_going: &mut dyn FnMut() -> bool,
) -> Vec<Option<HeadStart>> {
    let periods = transient.saturating_sub(ALIGNMENT);
    let mut found: Vec<Option<HeadStart>> = vec![Some(HeadStart::default()); states.len()];
    let starts = states.concat();
    let mut visit = |visit: Visit<'_>| {
        let own = &mut found[visit.trajectory];
        let is_finite = visit.state.iter().all(|x| x.is_finite());
        let Some(head) = own.as_mut().filter(|_| is_finite && keep_going()) else {
            *own = None;
            return Next::Stop;
        };
        head.periods = visit.period;
        if visit.period + KEPT > transient {
            head.points.extend_from_slice(visit.state);
        }
        if visit.period == periods {
            states[visit.trajectory].copy_from_slice(visit.state);
        }
        Next::GoOn
    };
    let ends = ensemble.run(system, &starts, periods, &mut visit);
    for (head, end) in found.iter_mut().zip(ends) {
        if end != IntegrationEnd::Reached {
            *head = None;
        }
    }
    found
}
