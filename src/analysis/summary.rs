//! The stretch of motion on an attractor that is measured.

use super::{Setting, flow};
use crate::solve::attractor::{Attractor, Label, RecordStop};
use crate::solve::integrate::{IntegrationEnd, IntegratorOptions};
use crate::solve::orbit::Orbit;
use crate::solve::segment_orbit::SegmentOrbit;
use crate::system::System;
use std::f64::consts::TAU;

/// Why nothing is measured.
pub(super) enum Unmeasured {
    /// The integrator does not take the system.
    Refused(String),
    /// The motion was not followed to its end.
    Stopped(RecordStop),
}

/// An attractor as one response period of its system: a period n attractor over its n periods, any other over as many periods as the record
/// has, from its first point on. `last` is the state at its end.
pub(super) fn measured(
    setting: &Setting<'_>,
    (mut system, options): (System, impl Into<IntegratorOptions>),
    attractor: &Attractor,
    last: &[f64],
) -> Result<(System, Orbit), Unmeasured> {
    let points = &attractor.record.points;
    let (periods, mut state) = match (&attractor.cycle, attractor.label) {
        (Some(cycle), _) => (cycle.period, cycle.points[..last.len()].to_vec()),
        (None, Label::Period(n)) => (n, last.to_vec()),
        (None, _) => (points.len() / last.len(), points[..last.len()].to_vec()),
    };
    system.set_subharmonic(periods);
    let integrator = flow::integrator(setting, &system, options);
    let mut integrator = integrator.map_err(|fault| Unmeasured::Refused(fault.message))?;
    let mut orbit = SegmentOrbit::new(system.omega(), periods, system.dof());
    let width = TAU / periods as f64;
    for k in 0..periods {
        if setting.control.is_interrupted() {
            return Err(Unmeasured::Stopped(RecordStop::Interrupted));
        }
        let span = (k as f64 * width, (k + 1) as f64 * width);
        let end = integrator.advance(&system, span, &mut state, &mut orbit);
        if end != IntegrationEnd::Reached {
            return Err(Unmeasured::Stopped(RecordStop::of(end, k + 1)));
        }
    }
    Ok((system, Orbit::Segments(orbit)))
}
