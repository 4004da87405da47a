//! What the analyses in the time domain share: their settings resolved, the state at rest, and the limits of labels.

use super::cost::{Cost, Period};
use super::{Fault, Initial, Setting, limits};
use crate::quantity::Quantity;
use crate::solve::attractor::{ALIGNMENT, LabelOptions, Lengths, MapSize, RecordStop};
use crate::solve::equilibrium::{NoEquilibrium, equilibrium};
use crate::solve::integrate::{
    self, IntegrationEnd, Integrator, IntegratorChoice, IntegratorOptions, Strain,
};
use crate::system::System;

/// The integrator requested by an analysis, for a system of its setting.
///
/// # Errors
/// The exact flow for a system that does not admit it: a fault of the key `integrator`.
pub fn integrator(
    setting: &Setting<'_>,
    system: &System,
    options: impl Into<IntegratorOptions>,
) -> Result<Box<dyn Integrator + Send>, Fault> {
    integrate::choose(system, options)
        .map_err(|error| Fault::new("integrator", setting.name_connection(&error)))
}

/// The excitation frequency under a key of the settings, over omega_c.
///
/// # Errors
/// A fault of that key.
pub fn frequency(setting: &Setting<'_>, key: &str, written: &Quantity) -> Result<f64, Fault> {
    let value = setting.frequency(written);
    value.map_err(|message| Fault::new(key, message))
}

/// Errors in the settings of motions at a frequency, from initial states with their keys.
pub fn check_motions(
    setting: &Setting<'_>,
    at: &Quantity,
    states: &[(String, Initial)],
    options: impl Into<IntegratorOptions>,
) -> Vec<Fault> {
    let options = options.into();
    let mut faults: Vec<Fault> = frequency(setting, "at", at).err().into_iter().collect();
    faults.extend(check_tolerance(options));
    for (key, state) in states {
        faults.extend(state.check(setting, key));
    }
    faults.extend(integrator(setting, &setting.assembly.system, options).err());
    faults
}

/// The integrator that an analysis asks for with its key `flow_tolerance`.
pub fn options(choice: IntegratorChoice, flow_tolerance: Option<f64>) -> IntegratorOptions {
    let default = IntegratorOptions::from(choice);
    IntegratorOptions {
        flow_tolerance: flow_tolerance.unwrap_or(default.flow_tolerance),
        ..default
    }
}

/// Local errors of the series flow that make sense.
const TOLERANCES: (f64, f64) = (1e-15, 1e-3);

/// What is wrong with the key `flow_tolerance`.
pub fn check_tolerance(options: IntegratorOptions) -> Option<Fault> {
    let IntegratorOptions {
        choice,
        flow_tolerance,
    } = options;
    let message = if !(TOLERANCES.0..=TOLERANCES.1).contains(&flow_tolerance) {
        format!(
            "{flow_tolerance} must be from {:e} to {:e}",
            TOLERANCES.0, TOLERANCES.1
        )
    } else if choice == IntegratorChoice::Dopri5 && options != choice.into() {
        "it belongs to the series flow; `integrator: dopri5` has an error control of its own".into()
    } else {
        return None;
    };
    Some(Fault::new("flow_tolerance", message))
}

/// A motion about to start: a system at its excitation frequency, its integrator and a state at phase 0.
pub struct PreparedMotion {
    /// The system.
    pub system: System,
    /// Integrator.
    pub integrator: Box<dyn Integrator + Send>,
    /// [q; v; z].
    pub state: Vec<f64>,
    /// Warning about the state.
    pub warning: Option<String>,
}

impl PreparedMotion {
    /// At a frequency, from an initial state with its key.
    ///
    /// # Errors
    /// The first of the faults that [`check_motions`] finds.
    pub fn new(
        setting: &Setting<'_>,
        at: &Quantity,
        (key, initial): (&str, &Initial),
        options: impl Into<IntegratorOptions>,
    ) -> Result<PreparedMotion, Fault> {
        let mut system = setting.assembly.system.clone();
        system.set_reference_frequency(frequency(setting, "at", at)?);
        let integrator = integrator(setting, &system, options)?;
        let (state, warning) = initial.state(setting, &system, key)?;
        Ok(PreparedMotion {
            system,
            integrator,
            state,
            warning,
        })
    }
}

/// Why a motion ended, with the name of the connection, its state and the time where a force is not analytic, in the units of the
/// report.
pub fn tell(stop: RecordStop, setting: &Setting<'_>) -> String {
    if let RecordStop::Failed(
        IntegrationEnd::Locked(connection) | IntegrationEnd::Sticks(connection),
        _,
    ) = stop
    {
        return format!("{}: {stop}", setting.assembly.connections[connection]);
    }
    let RecordStop::Failed(IntegrationEnd::NotAnalytic(at), period) = stop else {
        return stop.to_string();
    };
    let scales = &setting.assembly.scales;
    let name = &setting.assembly.connections[at.connection];
    let time = ((period - 1) as f64 + at.share) * at.period;
    let (l, w) = match setting.is_si() {
        true => (scales.displacement[at.connection], scales.frequency),
        false => (1.0, 1.0),
    };
    let (q, v) = (at.deformation * l, at.rate * l * w);
    let clock = if setting.is_si() { "t" } else { "T" };
    format!(
        "{name}: {stop}, at {clock} = {:.9e}, deformation {q:.9e}, rate {v:.9e}",
        time / w
    )
}

/// What is to be said about the steps of an integrator of this name: which connection made them short, and which one bounced too fast to
/// be followed.
pub fn labour(name: &str, strain: Option<Strain>, setting: &Setting<'_>) -> Option<String> {
    let strain = strain?;
    let connections = &setting.assembly.connections;
    let short = strain.steps.map(|s| {
        format!(
            "{name} flow: up to {} steps per excitation period, the shortest {:.1e} of it, because the force of {} changes \
             that fast; a softer or smoother law is integrated sooner",
            s.steps, s.shortest, connections[s.connection],
        )
    });
    let bounces = strain.bounces.map(|b| {
        let (scale, unit) = match setting.is_si() {
            true => (
                setting.assembly.scales.displacement[b.connection],
                setting.model.units_of(b.connection).0,
            ),
            false => (1.0, "(dimensionless)"),
        };
        format!(
            "{name} flow: {} bounces on the jump of its force ({} passages per response period and more); excursions shorter than {:.1e} of \
             an excitation period and lower than {:.1e} {unit} count as rest on the jump, which leaves the force averaged over them \
             unchanged; damping of this connection ends them",
            connections[b.connection], b.passages, b.longest, scale * b.height,
        )
    });
    let texts: Vec<String> = short.into_iter().chain(bounces).collect();
    (!texts.is_empty()).then(|| texts.join("; "))
}

/// The more laborious one of two.
pub fn harder(one: Option<Strain>, other: Option<Strain>) -> Option<Strain> {
    let all = || one.into_iter().chain(other);
    let steps = all().filter_map(|s| s.steps);
    let bounces = all().filter_map(|s| s.bounces);
    let strain = Strain {
        steps: steps.max_by_key(|s| s.steps),
        bounces: bounces.max_by(|a, b| a.longest.total_cmp(&b.longest)),
    };
    (strain != Strain::default()).then_some(strain)
}

/// Static equilibrium at rest, [q; v; z], with a warning where there is none or several: motion then starts undeformed, or
/// in the middle of the gap.
pub fn rest(system: &System) -> (Vec<f64>, Option<String>) {
    let n = system.dof();
    let mut state = vec![0.0; system.state_size()];
    if let Some(still) = system.still() {
        state[n..2 * n].copy_from_slice(&still.rates);
    }
    let found = match equilibrium(system) {
        Ok(found) => found,
        Err(NoEquilibrium::NotCarried { .. }) => {
            let warning = "there is no static equilibrium (nothing carries the mean load): the motion starts from q = \
                           0, v = 0; set `initial` to choose another state";
            return (state, Some(warning.into()));
        }
        Err(NoEquilibrium::NotFound) => {
            let warning = "no static equilibrium was found: the motion starts from q = 0, v = 0; set `initial` to \
                           choose another state";
            return (state, Some(warning.into()));
        }
    };
    state[..n].copy_from_slice(found.q.as_slice());
    state[2 * n..].copy_from_slice(&system.memory_at_rest(found.q.as_slice()));
    let warning =
        "the static equilibrium is not unique: the motion starts from the middle of the gap";
    (state, (!found.is_unique).then(|| warning.into()))
}

/// Points recorded at most.
const MAX_POINTS: usize = 50_000_000;

/// Cost of this number of records.
pub fn cost(size: MapSize, setting: &Setting<'_>, period: Period, records: usize) -> Cost {
    let [records, periods, transient] = [records, size.periods, size.transient].map(|n| n as f64);
    let watched = match size.exponents {
        Lengths::Followed | Lengths::ForLabels => {
            (periods + (ALIGNMENT as f64).min(transient)) * period.varied
        }
        Lengths::Ignored => periods * period.plain,
    };
    let key = if size.transient > size.periods {
        "transient"
    } else {
        "periods"
    };
    let columns = 4.0 + 2.0 * setting.assembly.system.dof() as f64;
    Cost::table(records * periods, columns, "periods")
        .lasting(records * (transient * period.plain + watched), key)
}

/// At least one period, no more than the limits, and no more points than fit into this number of records.
pub fn check_size(size: MapSize, records: usize) -> Option<Fault> {
    let periods = size.periods;
    let lengths = [("periods", periods, 1), ("transient", size.transient, 0)];
    let beyond = |(key, found, least)| limits::check(key, found, least, limits::PERIODS);
    if let Some(fault) = lengths.into_iter().find_map(beyond) {
        return Some(fault);
    }
    (periods.saturating_mul(records) > MAX_POINTS).then(|| {
        let message =
            format!("{periods} in each of {records} runs are more than {MAX_POINTS} points");
        Fault::new("periods", message)
    })
}

/// Keys that say how far labels go.
#[derive(Debug, Clone, Copy, Default)]
pub struct LabelKeys {
    /// `longest_period`.
    pub longest_period: Option<usize>,
    /// `extend`.
    pub extend: Option<usize>,
}

/// Longest period that may be looked for.
const MAX_PERIOD: usize = 100_000;

impl LabelKeys {
    /// The limits, with defaults for what is absent.
    pub fn options(self) -> LabelOptions {
        let default = LabelOptions::default();
        LabelOptions {
            longest_period: self.longest_period.unwrap_or(default.longest_period),
            extend: self.extend.unwrap_or(default.extend),
            ..default
        }
    }

    /// Errors in them.
    pub fn check(self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let longest = self.options().longest_period;
        if !(1..=MAX_PERIOD).contains(&longest) {
            let message = format!("{longest} must be from 1 to {MAX_PERIOD}");
            faults.push(Fault::new("longest_period", message));
        }
        if self.extend == Some(0) {
            let message = "0 must be at least 1; 1 labels the record without extending it";
            faults.push(Fault::new("extend", message));
        }
        faults
    }
}
