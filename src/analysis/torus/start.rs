//! Source of the first torus.

use super::road::TorusRoad;
use super::{Torus, TorusStart};
use crate::analysis::bifurcation_curve::{CurveAxis, other};
use crate::analysis::parameter::VariedParameter;
use crate::analysis::{EventState, Fault, Setting, columns, flow};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::solve::attractor::{
    Label, LabelOptions, Lengths, MapSize, RecordStop, Stroboscopic, attractor, rotation,
};
use crate::solve::curve::{Plane, Shots};
use crate::solve::events::EventKind;
use crate::solve::torus::{self, TorusOptions, TorusProblem};

/// Maps of a record from which the first curve is made.
const RECORD: usize = 2000;

/// A first torus: the problem around it, the torus, and excitation periods per map; or why there is none.
pub(super) type FirstMaps<'a> = Result<(TorusProblem<'a>, torus::CurveOfTorus, usize), String>;

/// The share of a value.
///
/// # Errors
/// Errors of the model at this value.
pub(super) fn share(
    setting: &Setting<'_>,
    axis: &CurveAxis,
    written: &Quantity,
) -> Result<f64, String> {
    axis.parameter.check(setting, written)?;
    Ok(axis.share(axis.parameter.value(setting, written)?))
}

/// What is wrong with a start.
pub(super) fn check(setting: &Setting<'_>, axis: &CurveAxis, begin: &TorusStart) -> Vec<Fault> {
    let fault = |key: &str, message: &str| vec![Fault::new(format!("start.{key}"), message)];
    match (&begin.analysis, &begin.attractor) {
        (Some(_), Some(_)) => fault(
            "attractor",
            "a start is an event of an `analysis` or an `attractor`, not both",
        ),
        (None, None) => vec![Fault::new(
            "start",
            "give an `analysis` with a neimark_sacker event, or an `attractor: {value: ..}` that is integrated",
        )],
        (Some(name), None) => other(setting, name)
            .err()
            .map_or(Vec::new(), |message| fault("analysis", &message)),
        (None, Some(attractor)) => {
            let mut faults = Vec::new();
            match share(setting, axis, &attractor.value) {
                Err(message) => faults.extend(fault("attractor.value", &message)),
                Ok(share) if !(-1e-12..=1.0 + 1e-12).contains(&share) => {
                    faults.extend(fault(
                        "attractor.value",
                        "lies outside the range from `from` to `to`",
                    ));
                }
                Ok(_) => {}
            }
            let initial = attractor.initial.iter();
            faults.extend(initial.flat_map(|i| i.check(setting, "start.attractor.initial")));
            faults
        }
    }
}

/// The first torus.
pub(super) fn first<'a>(
    keys: &Torus,
    setting: &'a Setting<'a>,
    (axis, at): (&CurveAxis, f64),
    options: &TorusOptions,
) -> Result<FirstMaps<'a>, Error> {
    match &keys.start.analysis {
        Some(name) => from_event(keys, setting, (axis, at), (name, options)),
        None => from_attractor(keys, setting, (axis, at)),
    }
}

fn from_event<'a>(
    keys: &Torus,
    setting: &'a Setting<'a>,
    (axis, at): (&CurveAxis, f64),
    (name, options): (&str, &TorusOptions),
) -> Result<FirstMaps<'a>, Error> {
    let refused =
        |message: String| columns::refused(setting, Fault::new("start.analysis", message));
    let analysis = other(setting, name).map_err(refused)?;
    let events = analysis.event_states(setting)?.unwrap_or_default();
    let own = |event: &EventState| match (&axis.parameter, &event.number) {
        (VariedParameter::Frequency(_), None) => Some(event.omega),
        (VariedParameter::Number(knob), Some((varied, value))) if knob.name() == varied => {
            Some(*value)
        }
        _ => None,
    };
    let near = keys.start.near.as_ref();
    let near = near.map(|written| axis.parameter.value(setting, written));
    let near = near.transpose().map_err(refused)?;
    let is_kind = |event: &&EventState| event.kind == EventKind::NeimarkSacker;
    let mut list: Vec<(f64, &EventState)> = (events.iter().filter(is_kind))
        .filter_map(|event| Some((own(event)?, event)))
        .collect();
    if let Some(near) = near {
        list.sort_by(|a, b| (a.0 - near).abs().total_cmp(&(b.0 - near).abs()));
    }
    let Some((value, event)) = list.first() else {
        return Ok(Err(format!(
            "{name} has no located neimark_sacker event along {}",
            axis.written
        )));
    };
    let lambda = axis.share(*value);
    if !(-0.05..=1.05).contains(&lambda) {
        return Ok(Err(format!(
            "the event lies outside the range: {}",
            axis.told(*value)
        )));
    }
    let nu = event.subharmonic;
    let road = TorusRoad::new(setting, axis.clone(), at, nu);
    let shots = Shots::new(Box::new(road), [lambda, 0.0], keys.integrator);
    let path = options.path(keys.points);
    let found = torus::from_event(
        shots.map_err(Error::Solve)?,
        (&event.state, lambda),
        keys.points,
        path,
    );
    Ok(match found.map_err(Error::Solve)? {
        Some((problem, first)) => Ok((problem, first, nu)),
        None => Err(format!(
            "no torus was found next to the event at {}",
            axis.told(*value)
        )),
    })
}

fn from_attractor<'a>(
    keys: &Torus,
    setting: &'a Setting<'a>,
    (axis, at): (&CurveAxis, f64),
) -> Result<FirstMaps<'a>, Error> {
    let refused = |fault| columns::refused(setting, fault);
    let Some(begin) = &keys.start.attractor else {
        return Ok(Err("no start".into()));
    };
    let fault = |message: String| refused(Fault::new("start.attractor.value", message));
    let lambda = share(setting, axis, &begin.value)
        .map_err(fault)?
        .clamp(0.0, 1.0);
    let mut road = TorusRoad::new(setting, axis.clone(), at, 1);
    let system = road.system([lambda, 0.0]).map_err(Error::Solve)?;
    let initial = begin.initial.clone().unwrap_or_default();
    let (mut state, _) = initial
        .state(setting, &system, "start.attractor.initial")
        .map_err(refused)?;
    let integrator = flow::integrator(setting, &system, keys.integrator).map_err(refused)?;
    let mut integrator = integrator;
    let mut map = Stroboscopic {
        system: &system,
        integrator: integrator.as_mut(),
    };
    let size = MapSize {
        transient: keys.transient,
        periods: RECORD * keys.subharmonic.unwrap_or(1).clamp(2, 8),
        exponents: Lengths::Followed,
    };
    let labels = LabelOptions {
        extend: 1,
        ..LabelOptions::default()
    };
    let mut keep_going = |_: usize| !setting.control.is_interrupted();
    let found = attractor(&mut map, &mut state, size, labels, &mut keep_going);
    let told = axis.told(axis.value(lambda));
    if let Some(stop) = found.record.stop {
        return Ok(Err(match stop {
            RecordStop::Interrupted => "interrupted".into(),
            stop => format!("the motion at {told}: {}", flow::tell(stop, setting)),
        }));
    }
    if !matches!(found.label, Label::QuasiPeriodic | Label::Undecided) {
        return Ok(Err(format!(
            "the attractor at {told} is no torus: {}",
            found.label
        )));
    }
    let n = state.len();
    let Some(curve) = rotation(&found.record.points, n) else {
        return Ok(Err(format!(
            "the attractor at {told} shows no rotation: {}",
            found.label
        )));
    };
    let nu = match keys.subharmonic {
        None => curve.loops,
        Some(nu) if nu.is_multiple_of(curve.loops) => nu,
        Some(nu) => {
            return Ok(Err(format!(
                "the attractor at {told} consists of {} curves visited in turn: `subharmonic` must be a multiple of that, not {nu}",
                curve.loops
            )));
        }
    };
    let turns = curve.rotation * (nu / curve.loops) as f64;
    let points: Vec<f64> = (found.record.points.chunks_exact(n).step_by(nu))
        .flatten()
        .copied()
        .collect();
    let first = torus::from_record(&points, n, (turns.fract(), lambda), keys.points);
    let road = TorusRoad::new(setting, axis.clone(), at, nu);
    let shots = Shots::new(Box::new(road), [lambda, 0.0], keys.integrator);
    let problem = TorusProblem::new(shots.map_err(Error::Solve)?, &first);
    Ok(Ok((problem, first, nu)))
}
