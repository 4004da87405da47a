//! What the analyses in the time domain share: their settings resolved, the state at rest, and the Poincaré map.

use super::cost::{Cost, Period};
use super::{Fault, Initial, Setting, limits};
use crate::postprocess::attractor::{self, Label};
use crate::postprocess::lyapunov::{Exponents, Lyapunov};
use crate::quantity::Quantity;
use crate::solve::equilibrium::{NoEquilibrium, equilibrium};
use crate::solve::integrate::{self, IntegrationEnd, Integrator, IntegratorChoice};
use crate::system::System;
use std::f64::consts::TAU;

/// The integrator that an analysis asked for, for a system of its setting.
///
/// # Errors
/// The exact flow for a system that does not admit it: a fault of the key `integrator`.
pub fn integrator(
    setting: &Setting<'_>,
    system: &System,
    choice: IntegratorChoice,
) -> Result<Box<dyn Integrator + Send>, Fault> {
    integrate::choose(system, choice)
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

/// What is wrong with the settings of motions at a frequency, from initial states with their keys.
pub fn check_motions(
    setting: &Setting<'_>,
    at: &Quantity,
    states: &[(String, Initial)],
    choice: IntegratorChoice,
) -> Vec<Fault> {
    let mut faults: Vec<Fault> = frequency(setting, "at", at).err().into_iter().collect();
    for (key, state) in states {
        faults.extend(state.check(setting, key));
    }
    faults.extend(integrator(setting, &setting.assembly.system, choice).err());
    faults
}

/// A motion about to start: a system at its excitation frequency, its integrator and a state at phase 0.
pub struct Motion {
    /// The system.
    pub system: System,
    /// What advances the state.
    pub integrator: Box<dyn Integrator + Send>,
    /// [q; v].
    pub state: Vec<f64>,
    /// What is to be said about the state.
    pub warning: Option<String>,
}

impl Motion {
    /// At a frequency, from an initial state with its key.
    ///
    /// # Errors
    /// The first of the faults that [`check_motions`] finds.
    pub fn new(
        setting: &Setting<'_>,
        at: &Quantity,
        (key, initial): (&str, &Initial),
        choice: IntegratorChoice,
    ) -> Result<Motion, Fault> {
        let mut system = setting.assembly.system.clone();
        system.set_reference_frequency(frequency(setting, "at", at)?);
        let integrator = integrator(setting, &system, choice)?;
        let (state, warning) = initial.state(setting, &system, key)?;
        Ok(Motion {
            system,
            integrator,
            state,
            warning,
        })
    }
}

/// Why a motion was not followed to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// Somebody asked for it.
    Interrupted,
    /// The integration ended, in this period, counted from 1.
    Failed(IntegrationEnd, usize),
}

impl Stop {
    /// Of an integration that ended in a period.
    pub fn of(end: IntegrationEnd, period: usize) -> Stop {
        match end {
            IntegrationEnd::Interrupted => Stop::Interrupted,
            end => Stop::Failed(end, period),
        }
    }
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Stop::Interrupted => f.write_str("interrupted"),
            Stop::Failed(end, period) => write!(f, "{} in period {period}", end.message()),
        }
    }
}

/// Static equilibrium at rest, [q; v], 2n values, with a warning where there is none or several: motion then starts undeformed, or
/// in the middle of the gap.
pub fn rest(system: &System) -> (Vec<f64>, Option<String>) {
    let n = system.dof();
    let mut state = vec![0.0; 2 * n];
    let found = match equilibrium(system) {
        Ok(found) => found,
        Err(NoEquilibrium::NotCarried { .. }) => {
            let warning = "there is no static equilibrium (nothing carries the mean load): motion starts from q = 0, v = 0; \
                           `initial` chooses another state";
            return (state, Some(warning.into()));
        }
        Err(NoEquilibrium::NotFound) => {
            let warning = "no static equilibrium was found: motion starts from q = 0, v = 0; `initial` chooses another state";
            return (state, Some(warning.into()));
        }
    };
    state[..n].copy_from_slice(found.q.as_slice());
    let warning = "the static equilibrium is not unique: motion starts from the middle of the gap";
    (state, (!found.is_unique).then(|| warning.into()))
}

/// How long a Poincaré map runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapSize {
    /// Periods of the excitation before the record begins.
    pub transient: usize,
    /// Periods recorded.
    pub periods: usize,
    /// Whether Lyapunov exponents are computed.
    pub exponents: Lengths,
}

/// Points recorded at most.
const MAX_POINTS: usize = 50_000_000;

impl MapSize {
    /// What so many records take.
    pub fn cost(&self, setting: &Setting<'_>, period: Period, records: usize) -> Cost {
        let [records, periods, transient] =
            [records, self.periods, self.transient].map(|n| n as f64);
        let watched = match self.exponents {
            Lengths::Followed => (periods + (ALIGNMENT as f64).min(transient)) * period.varied,
            Lengths::Ignored => periods * period.plain,
        };
        let key = if self.transient > self.periods {
            "transient"
        } else {
            "periods"
        };
        let columns = 4.0 + 2.0 * setting.assembly.system.dof() as f64;
        Cost::table(records * periods, columns, "periods")
            .lasting(records * (transient * period.plain + watched), key)
    }

    /// At least one period, no more than the limits, and no more points than fit into so many records.
    pub fn check(&self, records: usize) -> Option<Fault> {
        let periods = self.periods;
        let lengths = [("periods", periods, 1), ("transient", self.transient, 0)];
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
}

/// Whether small deviations are followed along with the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lengths {
    /// They are, and give the Lyapunov exponents.
    Followed,
    /// They are not.
    Ignored,
}

impl Lengths {
    /// What a key `lyapunov` says.
    pub fn wanted(lyapunov: bool) -> Lengths {
        match lyapunov {
            true => Lengths::Followed,
            false => Lengths::Ignored,
        }
    }
}

/// Periods, before the record begins, over which the frame of deviations turns into place.
const ALIGNMENT: usize = 50;

/// Record of a Poincaré map.
#[derive(Debug, Clone)]
pub struct MapRecord {
    /// States at phase 0 after each recorded period, 2n values each.
    pub points: Vec<f64>,
    /// Lyapunov exponents over the record, in units of omega_c.
    pub exponents: Option<Exponents>,
    /// Why the record is shorter than asked for.
    pub stop: Option<Stop>,
}

impl MapRecord {
    /// Kind of the attractor of the system recorded; a record that failed before its end says nothing.
    pub fn label(&self, system: &System) -> Label {
        if matches!(self.stop, Some(Stop::Failed(..))) {
            return Label::Undecided;
        }
        match attractor::label(&self.points, 2 * system.dof(), self.exponents.as_ref()) {
            Label::QuasiPeriodic if attractor::excludes_tori(system) => Label::Undecided,
            label => label,
        }
    }
}

/// States at phase 0 of the excitation, period after period, from `state` = [q; v] at phase 0, which ends as the last state.
///
/// `keep_going` is asked before each period with its number. Every period is integrated over the same phases, so that the phase does not lose digits with time.
pub fn poincare(
    integrator: &mut dyn Integrator,
    system: &System,
    state: &mut [f64],
    size: MapSize,
    keep_going: &mut dyn FnMut(usize) -> bool,
) -> MapRecord {
    let span = (0.0, TAU / system.subharmonic() as f64);
    let mut deviations = (size.exponents == Lengths::Followed).then(|| Lyapunov::new(state.len()));
    let mut points = Vec::with_capacity(size.periods * state.len());
    let mut stop = None;
    for period in 1..=size.transient + size.periods {
        if !keep_going(period) {
            stop = Some(Stop::Interrupted);
            break;
        }
        let follows = period + ALIGNMENT > size.transient;
        let end = match deviations.as_mut().filter(|_| follows) {
            Some(d) => {
                let frame = d.frame_mut();
                integrator.advance_with_variation(system, span, state, frame, &mut ())
            }
            None => integrator.advance(system, span, state, &mut ()),
        };
        let is_finite = end == IntegrationEnd::Interrupted || state.iter().all(|x| x.is_finite());
        if end != IntegrationEnd::Reached || !is_finite {
            let end = if is_finite {
                end
            } else {
                IntegrationEnd::Diverged
            };
            stop = Some(Stop::of(end, period));
            break;
        }
        let is_recorded = period > size.transient;
        if is_recorded {
            points.extend_from_slice(state);
        }
        if let Some(d) = deviations.as_mut().filter(|_| follows) {
            if is_recorded { d.count() } else { d.skip() }
        }
    }
    let length = TAU / system.excitation_frequency();
    MapRecord {
        points,
        exponents: deviations.and_then(|d| d.exponents(length)),
        stop,
    }
}
