//! Where a curve begins.

use super::plane::{Axes, Grounds};
use super::{BifurcationCurve, CurveEventKind, CurveStart};
use crate::analysis::parameter::VariedParameter;
use crate::analysis::read::parts;
use crate::analysis::saved::SavedReference;
use crate::analysis::{Analysis, EventState, Fault, Setting, columns, flow};
use crate::error::{Error, did_you_mean};
use crate::solve::curve::{CurveKind, Defining, Guess, Guesses, NoStart, Plane, Spot, seek};
use crate::solve::events::EventKind;

/// Random states from which orbits are looked for.
const STATES: usize = 60;

/// What is wrong with a start.
pub(super) fn check(
    setting: &Setting<'_>,
    axes: &Axes,
    (key, begin): (&str, &CurveStart),
) -> Vec<Fault> {
    let mut faults = Vec::new();
    let fault = |part: &str, message: String| Fault::new(format!("{key}.{part}"), message);
    if begin.point.is_some() != begin.results.is_some() {
        let message = "a saved point needs `results` (a folder), `analysis` and `point`";
        faults.push(Fault::new(key, message));
    }
    match (&begin.analysis, &begin.at) {
        _ if begin.results.is_some() => {
            let found = saved(setting, axes, begin);
            faults.extend(found.err().map(|message| fault("results", message)));
        }
        (Some(_), Some(_)) => {
            let message =
                "a start is either an event of an analysis or a guess `at` values, not both";
            faults.push(fault("at", message.into()));
        }
        (None, None) => {
            let message =
                "give the `analysis` that has the event, or values of both parameters in `at`";
            faults.push(Fault::new(key, message));
        }
        (Some(name), None) => {
            if let Err(message) = other(setting, name) {
                faults.push(fault("analysis", message));
            }
        }
        (None, Some(_)) => {
            if begin.near.is_some() {
                let message = "applies to events of an `analysis`; with `at` leave it out";
                faults.push(fault("near", message.into()));
            }
            faults.extend(guess(setting, axes, (key, begin)).err());
        }
    }
    match (&begin.initial, &begin.at) {
        (Some(_), None) => {
            let message = "belongs to values in `at`; an event or a saved point has its own state";
            faults.push(fault("initial", message.into()));
        }
        (Some(initial), Some(_)) => {
            faults.extend(initial.check(setting, &format!("{key}.initial")));
        }
        (None, _) => {}
    }
    let names = &setting.assembly.connections;
    match (&begin.connection, begin.kind) {
        (Some(name), CurveEventKind::Grazing) if !names.contains(name) => {
            let hint = did_you_mean(name, names.iter().map(String::as_str));
            faults.push(fault(
                "connection",
                format!("no connection is called `{name}`; {hint}"),
            ));
        }
        (Some(_), kind) if kind != CurveEventKind::Grazing => {
            let message = "applies to grazings only; bifurcations belong to the whole system";
            faults.push(fault("connection", message.into()));
        }
        _ => {}
    }
    faults
}

/// Shares of the parameters at a guess.
fn guess(
    setting: &Setting<'_>,
    axes: &Axes,
    (key, begin): (&str, &CurveStart),
) -> Result<[f64; 2], Fault> {
    let at = begin.at.iter().flatten();
    let mut shares = [f64::NAN; 2];
    for (name, written) in at {
        let fault = |message: String| Fault::new(format!("{key}.at.{name}"), message);
        let parameter = VariedParameter::find(setting, name).map_err(fault)?;
        let of = axes
            .list
            .iter()
            .position(|axis| axis.parameter.name() == parameter.name());
        let Some(k) = of else {
            let known = axes.list.iter().map(|axis| axis.written.as_str());
            let message = format!(
                "is not one of the parameters; {}",
                did_you_mean(name, known)
            );
            return Err(fault(message));
        };
        let checked = parameter.check(setting, written);
        let value = checked.and_then(|()| parameter.value(setting, written));
        shares[k] = axes.list[k].share(value.map_err(fault)?);
        if !(-1e-9..=1.0 + 1e-9).contains(&shares[k]) {
            let message = format!("{} lies outside the range", written.text);
            return Err(Fault::new(format!("{key}.at.{name}"), message));
        }
    }
    match shares.iter().position(|share| share.is_nan()) {
        None => Ok(shares),
        Some(k) => {
            let message = format!("no value of {}", axes.list[k].written);
            Err(Fault::new(format!("{key}.at"), message))
        }
    }
}

/// An analysis of the same file that has events.
pub(in crate::analysis) fn other(
    setting: &Setting<'_>,
    name: &str,
) -> Result<Box<dyn Analysis>, String> {
    let path = format!("analyses.{name}");
    let all = setting
        .model
        .document()
        .get("analyses")
        .and_then(|node| node.as_map("analyses").ok());
    let entry = all.and_then(|map| map.get(name).map(|entry| (map, &entry.node)));
    let Some((_, node)) = entry else {
        let known: Vec<&str> =
            all.map_or(Vec::new(), |map| map.keys().map(String::as_str).collect());
        let hint = did_you_mean(name, known);
        return Err(format!("no analysis is called `{name}`; {hint}"));
    };
    let parts = parts(node, &path).map_err(|mistake| mistake.message)?;
    if !["frequency_response", "parameter_response"].contains(&parts.kind.as_str()) {
        return Err(format!(
            "`{name}` is a {}; only `frequency_response` and `parameter_response` have events",
            parts.kind
        ));
    }
    let analysis = parts.own.read::<Box<dyn Analysis>>(&path);
    let analysis = analysis.map_err(|mistake| mistake.message)?;
    match analysis.check(setting).into_iter().next() {
        None => Ok(analysis),
        Some(fault) => Err(format!("{path}.{}: {}", fault.key, fault.message)),
    }
}

/// A point of other results: shares of the parameters and the state. A parameter that the results do not have is as in the model.
fn saved(
    setting: &Setting<'_>,
    axes: &Axes,
    begin: &CurveStart,
) -> Result<([f64; 2], Vec<f64>), String> {
    let (Some(folder), Some(point)) = (&begin.results, begin.point) else {
        return Err("no `point`".into());
    };
    let Some(analysis) = &begin.analysis else {
        return Err("no `analysis`".into());
    };
    let wanted = SavedReference {
        folder,
        analysis,
        branch: begin.branch as i64,
        point: point as i64,
    };
    let row = wanted.read()?;
    let mut p = [f64::NAN; 2];
    for (k, axis) in axes.list.iter().enumerate() {
        let value = row.value(setting, &axis.parameter)?;
        p[k] = axis.share(value);
        if !(-1e-9..=1.0 + 1e-9).contains(&p[k]) {
            return Err(format!(
                "the point lies outside the range: {}",
                axis.told(value)
            ));
        }
    }
    Ok((p, row.state(setting)?))
}

/// A first point: the defining system there, or why there is none.
pub(super) fn first<'a>(
    keys: &BifurcationCurve,
    setting: &'a Setting<'a>,
    (axes, marks): (&Axes, &[f64]),
    (key, begin): (&str, &CurveStart),
) -> Result<Result<(Defining<'a>, Spot), String>, Error> {
    let refused = |fault| columns::refused(setting, fault);
    let (p, states, nu) = match &begin.analysis {
        _ if begin.results.is_some() => match saved(setting, axes, begin) {
            Ok((p, state)) => (p, vec![state], keys.subharmonic),
            Err(reason) => return Ok(Err(reason)),
        },
        None => {
            let p = guess(setting, axes, (key, begin)).map_err(refused)?;
            (p, Vec::new(), keys.subharmonic)
        }
        Some(name) => {
            let analysis = other(setting, name);
            let analysis = analysis
                .map_err(|message| refused(Fault::new(format!("{key}.analysis"), message)))?;
            let events = analysis.event_states(setting)?.unwrap_or_default();
            match nearest(setting, axes, begin, events) {
                Ok((p, event)) => (p, vec![event.state], event.subharmonic),
                Err(reason) => return Ok(Err(reason)),
            }
        }
    };
    let mut grounds = Grounds::new(setting, axes.clone(), nu).with_marks(marks);
    let system = grounds.system(p).map_err(Error::Solve)?;
    let (rest, _) = flow::rest(&system);
    let levels = system.breakpoints().into_iter().flatten();
    let reach = 2.0 * levels.fold(0.5_f64, |m, b| m.max(b.abs()));
    // What connections remember stays what the static equilibrium leaves.
    let moves = |k: usize| if k < 2 * system.dof() { reach } else { 0.0 };
    let widths = (0..rest.len()).map(moves).collect();
    let (states, count) = match &begin.initial {
        Some(initial) => {
            let own = initial.state(setting, &system, &format!("{key}.initial"));
            (vec![own.map_err(refused)?.0], 0)
        }
        None => (states, STATES),
    };
    let guesses = Guesses {
        states,
        spread: (rest, widths),
        count,
    };
    let wanted = match begin.kind {
        CurveEventKind::Fold => Guess::Event(CurveKind::Fold),
        CurveEventKind::BranchPoint => Guess::Event(CurveKind::BranchPoint),
        CurveEventKind::PeriodDoubling => Guess::Event(CurveKind::PeriodDoubling),
        CurveEventKind::NeimarkSacker => Guess::Event(CurveKind::NeimarkSacker),
        CurveEventKind::Grazing => {
            let names = setting.assembly.connections.iter();
            let own = begin.connection.as_ref();
            Guess::Touch(own.and_then(|name| names.clone().position(|n| n == name)))
        }
    };
    let found = seek(Box::new(grounds), (wanted, p), &guesses, keys.integrator);
    Ok(found
        .map_err(Error::Solve)?
        .map_err(|reason| told(axes, begin.kind, p, reason)))
}

/// The event of an analysis that a start means, with its place.
fn nearest(
    setting: &Setting<'_>,
    axes: &Axes,
    begin: &CurveStart,
    events: Vec<EventState>,
) -> Result<([f64; 2], EventState), String> {
    let names = &setting.assembly.connections;
    let is_kind = |event: &EventState| match (event.kind, begin.kind) {
        (EventKind::Fold, CurveEventKind::Fold)
        | (EventKind::BranchPoint, CurveEventKind::BranchPoint)
        | (EventKind::PeriodDoubling, CurveEventKind::PeriodDoubling)
        | (EventKind::NeimarkSacker, CurveEventKind::NeimarkSacker) => true,
        (EventKind::Grazing { connection, .. }, CurveEventKind::Grazing) => {
            let wanted = begin.connection.as_ref();
            wanted.is_none_or(|name| *name == names[connection])
        }
        _ => false,
    };
    let own = |event: &EventState| match &event.number {
        None => event.omega,
        Some((_, value)) => *value,
    };
    let near = begin.near.as_ref().map(|written| match events.first() {
        Some(EventState { number: None, .. }) => setting.frequency(written),
        _ => Ok(written.value),
    });
    let near = near.transpose()?;
    let mut list: Vec<EventState> = events.into_iter().filter(is_kind).collect();
    if let Some(near) = near {
        list.sort_by(|a, b| (own(a) - near).abs().total_cmp(&(own(b) - near).abs()));
    }
    let Some(event) = list.into_iter().next() else {
        let analysis = begin.analysis.as_deref().unwrap_or_default();
        return Err(format!("{analysis} has no located {}", word(begin.kind)));
    };
    let mut p = [f64::NAN; 2];
    for (share, axis) in p.iter_mut().zip(&axes.list) {
        let value = match (&axis.parameter, &event.number) {
            (VariedParameter::Frequency(_), _) => Some(event.omega),
            (VariedParameter::Number(knob), Some((varied, value))) if knob.name() == varied => {
                Some(*value)
            }
            (VariedParameter::Number(knob), _) => Some(setting.model.get(knob)),
        };
        let Some(value) = value else {
            return Err(format!(
                "{} has no value in the model as written",
                axis.written
            ));
        };
        *share = axis.share(value);
        if !(-1e-9..=1.0 + 1e-9).contains(share) {
            return Err(format!(
                "the event lies outside the range: {}",
                axis.told(value)
            ));
        }
    }
    Ok((p, event))
}

/// Why there is no first point, in words.
fn told(axes: &Axes, kind: CurveEventKind, p: [f64; 2], reason: NoStart) -> String {
    let place = |p: [f64; 2]| {
        let both = [0, 1].map(|k| axes.list[k].told(axes.list[k].value(p[k])));
        both.join(", ")
    };
    let (word, here) = (word(kind), place(p));
    match reason {
        NoStart::NoOrbit => format!("no periodic orbit was found at {here}"),
        NoStart::NoEvent { orbits, nearest } => {
            let other = nearest.map_or(String::new(), |q| {
                format!("; the nearest one met is at {}", place(q))
            });
            format!("none of {orbits} periodic orbits at {here} is near a {word}{other}")
        }
    }
}

fn word(kind: CurveEventKind) -> &'static str {
    match kind {
        CurveEventKind::Fold => "fold",
        CurveEventKind::BranchPoint => "branch point",
        CurveEventKind::PeriodDoubling => "period doubling",
        CurveEventKind::NeimarkSacker => "Neimark-Sacker event",
        CurveEventKind::Grazing => "grazing",
    }
}
