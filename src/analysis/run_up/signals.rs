//! Signals of a run-up: deformations, rates, forces, dynamic transmission errors, absolute accelerations.

use crate::analysis::{Fault, Setting, columns};
use crate::error::did_you_mean;
use crate::measure::ColumnHeading;
use crate::postprocess::connection::is_clearance;
use crate::system::{Scratch, System};

/// Recorded quantities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// `q.c`: deformation.
    Deformation(usize),
    /// `v.c`: its rate.
    Rate(usize),
    /// `f.c`: force without the parallel damper.
    Force(usize),
    /// `dte.c`: deformation plus transmission error.
    Transmission(usize),
    /// `acceleration.body`.
    Acceleration(usize),
}

/// Kinds of signals by the word in front.
const KINDS: [&str; 5] = ["q", "v", "f", "dte", "acceleration"];

/// A signal by its name.
pub fn find(setting: &Setting<'_>, name: &str) -> Result<Signal, String> {
    let bodies: Vec<String> = (columns::accelerations(setting).into_iter())
        .map(|h| h.name.trim_start_matches("acceleration.").to_owned())
        .collect();
    let Some((kind, of)) = name.split_once('.') else {
        return Err(format!(
            "`{name}` is no signal: wanted q.c, v.c, f.c, dte.c of a connection c, or acceleration.BODY"
        ));
    };
    let names: &[String] = match kind {
        "acceleration" => &bodies,
        _ => &setting.assembly.connections,
    };
    let place = names.iter().position(|n| n == of);
    let known = || {
        let help = did_you_mean(of, names.iter().map(String::as_str));
        format!("`{name}`: nothing is called `{of}`; {help}")
    };
    match kind {
        "q" => place.map(Signal::Deformation).ok_or_else(known),
        "v" => place.map(Signal::Rate).ok_or_else(known),
        "f" => place.map(Signal::Force).ok_or_else(known),
        "dte" => place.map(Signal::Transmission).ok_or_else(known),
        "acceleration" => place.map(Signal::Acceleration).ok_or_else(known),
        _ => Err(format!("`{name}`: {}", did_you_mean(kind, KINDS))),
    }
}

/// The requested signals; default: the deformations of all connections with gaps, or of all connections if none has a gap.
pub fn chosen(setting: &Setting<'_>, names: Option<&[String]>) -> Result<Vec<Signal>, Vec<Fault>> {
    let Some(names) = names else {
        let mounts = setting.assembly.system.mounts();
        let all = 0..mounts.len();
        let gaps: Vec<usize> = (all.clone())
            .filter(|k| is_clearance(mounts[*k].element.as_ref()))
            .collect();
        let list = if gaps.is_empty() { all.collect() } else { gaps };
        return Ok(list.into_iter().map(Signal::Deformation).collect());
    };
    let (mut list, mut faults) = (Vec::new(), Vec::new());
    for (k, name) in names.iter().enumerate() {
        match find(setting, name) {
            Ok(signal) if list.contains(&signal) => {
                faults.push(Fault::new(
                    format!("signals.{k}"),
                    format!("`{name}` is named twice"),
                ));
            }
            Ok(signal) => list.push(signal),
            Err(message) => faults.push(Fault::new(format!("signals.{k}"), message)),
        }
    }
    if names.is_empty() {
        faults.push(Fault::new(
            "signals",
            "none: wanted at least one, such as q.mesh_1",
        ));
    }
    if faults.is_empty() {
        Ok(list)
    } else {
        Err(faults)
    }
}

impl Signal {
    /// Name, unit and factor.
    pub fn heading(self, setting: &Setting<'_>) -> ColumnHeading {
        let units = setting.units();
        let names = &setting.assembly.connections;
        match self {
            Signal::Deformation(k) => units.displacement(format!("q.{}", names[k]), k),
            Signal::Rate(k) => units.rate(format!("v.{}", names[k]), k),
            Signal::Force(k) => units.force(format!("f.{}", names[k]), k),
            Signal::Transmission(k) => units.displacement(format!("dte.{}", names[k]), k),
            Signal::Acceleration(body) => columns::accelerations(setting).swap_remove(body),
        }
    }

    /// The connection whose deformation decides about it.
    pub fn connection(self) -> Option<usize> {
        match self {
            Signal::Deformation(k) | Signal::Force(k) | Signal::Transmission(k) => Some(k),
            Signal::Rate(_) | Signal::Acceleration(_) => None,
        }
    }
}

/// Values of signals at states; owns its buffers.
pub struct SignalProbe<'a> {
    setting: &'a Setting<'a>,
    system: &'a System,
    signals: &'a [Signal],
    scratch: Scratch,
    needs_bodies: bool,
    /// Whether the force of each connection is a function of time: a stop has impulses.
    has_force: Vec<bool>,
}

impl<'a> SignalProbe<'a> {
    pub fn new(
        setting: &'a Setting<'a>,
        system: &'a System,
        signals: &'a [Signal],
    ) -> SignalProbe<'a> {
        let is_absolute = |s: &Signal| matches!(s, Signal::Acceleration(_));
        SignalProbe {
            setting,
            system,
            signals,
            scratch: system.scratch(),
            needs_bodies: signals.iter().any(is_absolute),
            has_force: (system.mounts().iter())
                .map(|m| m.element.least_impact().is_none())
                .collect(),
        }
    }

    /// Values of all signals at a state, nondimensional but for accelerations, which are SI.
    pub fn read(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        let mut bodies = None;
        if self.needs_bodies {
            let assembly = self.setting.assembly;
            bodies = assembly.body_accelerations(self.system, time, state, &mut self.scratch);
        } else {
            self.system.respond(time, state, &mut self.scratch);
        }
        let has_impulses = self.has_force.contains(&false);
        for (out, signal) in out.iter_mut().zip(self.signals) {
            *out = match *signal {
                Signal::Force(k) if !self.has_force[k] => f64::NAN,
                Signal::Acceleration(_) if has_impulses => f64::NAN,
                Signal::Deformation(k) => self.scratch.deformation[k],
                Signal::Rate(k) => self.scratch.rate[k],
                Signal::Force(k) => self.scratch.response[k].f,
                Signal::Transmission(k) => {
                    let error = self.system.mounts()[k].transmission_error.as_ref();
                    let phase = self.system.moment(time).phase;
                    self.scratch.deformation[k] + error.map_or(0.0, |e| e.value(phase))
                }
                Signal::Acceleration(body) => bodies.as_ref().map_or(f64::NAN, |b| b[body]),
            };
        }
    }
}
