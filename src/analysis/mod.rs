//! The analyses of a model file: one file per analysis type.
//!
//! An analysis is checked against the assembled model before anything runs, then runs and returns a report.

mod basins;
mod bifurcation_curve;
mod bifurcation_diagram;
mod branch_figure;
mod branch_table;
mod build;
mod columns;
pub mod cost;
mod effective_frequencies;
mod event_table;
pub mod flow;
mod frequency_response;
mod initial;
mod limits;
mod link;
mod map_table;
mod modes;
mod multiplier_table;
mod operating_point;
pub mod parameter;
mod parameter_response;
pub mod parameter_study;
mod poincare_map;
mod rattle_figure;
pub mod read;
mod regime_map;
mod response;
mod run_up;
mod saved;
mod sections;
mod summary;
mod time_history;
mod torus;
mod transient;

pub use crate::postprocess::effective_stiffness::frequencies_at_rest;
pub use basins::Basins;
pub use bifurcation_curve::BifurcationCurve;
pub use bifurcation_diagram::{BifurcationDiagram, Seeds, StartBox, SweepDirection};
pub use effective_frequencies::EffectiveFrequencies;
pub use event_table::EVENTS;
pub use frequency_response::FrequencyResponse;
pub use initial::Initial;
pub use link::Link;
pub use modes::Modes;
pub use operating_point::OperatingPoint;
pub use parameter_response::ParameterResponse;
pub use parameter_study::ParameterStudy;
pub use poincare_map::PoincareMap;
pub use regime_map::RegimeMap;
pub use response::{EventState, Method, Orbits, ResponseTable, TableChoice};
pub use run_up::{ReportedOrder, RunUp};
pub use time_history::TimeHistory;
pub use torus::Torus;
pub use transient::SpeedProfile;

use crate::assembly::Assembly;
use crate::error::{Error, SolveError};
use crate::interrupt::Interrupt;
use crate::machine;
use crate::measure::ReportedUnits;
use crate::model::{Model, ReportUnits, Structure};
use crate::quantity::{Quantity, UnitDimension};
use crate::report::{Report, Table};
use cost::Cost;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

/// One analysis of a model file, named by `type:`.
#[typetag::serde(tag = "type")]
pub trait Analysis: std::fmt::Debug + Send + Sync {
    /// Errors in the settings that can be detected before anything runs: key and message.
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault>;

    /// Runs the analysis. A numerical outcome is part of the report, never an error.
    ///
    /// # Errors
    /// Misuse that `check` could not detect.
    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error>;

    /// Estimated cost of a run, for settings that passed `check`.
    fn cost(&self, _setting: &Setting<'_>) -> Cost {
        Cost::default()
    }

    /// Tables of a run, with all columns and no rows, for the `collect` of a parameter study.
    fn tables(&self, _setting: &Setting<'_>) -> Vec<Table> {
        Vec::new()
    }

    /// Whether it accepts loads that are functions of time; periodic methods do not.
    fn takes_functions_of_time(&self) -> bool {
        false
    }

    /// Tables beside the model file that it reads.
    fn files(&self, _setting: &Setting<'_>) -> Vec<PathBuf> {
        Vec::new()
    }

    /// Events of a response with their states; `None` if the analysis has none.
    ///
    /// # Errors
    /// As [`Analysis::run`].
    fn event_states(&self, _setting: &Setting<'_>) -> Result<Option<Vec<EventState>>, Error> {
        Ok(None)
    }

    /// The study, if the analysis is one; its runs are distributed one by one.
    fn study(&self) -> Option<&ParameterStudy> {
        None
    }
}

/// Errors of an analysis under a model: its settings, and loads that it does not accept.
pub fn check(analysis: &dyn Analysis, setting: &Setting<'_>) -> Vec<Fault> {
    let mut faults = analysis.check(setting);
    let Structure::Train(train) = &setting.model.structure else {
        return faults;
    };
    let free = train
        .loads
        .iter()
        .find_map(|(body, load)| Some((body, load.free_orders().next()?)));
    if let Some((body, order)) = free.filter(|_| !analysis.takes_functions_of_time()) {
        let message = format!(
            "order {order} in loads.{body} has no common period with the other orders (at most 10000 revolutions): periodic \
             methods need one, time_history with `duration` and run_up do not"
        );
        faults.push(Fault::new("", message));
    }
    let timed = train.loads.iter().find(|(_, load)| load.has_profile());
    if let Some((body, _)) = timed.filter(|_| !analysis.takes_functions_of_time()) {
        let message = format!(
            "loads.{body}.profile is a function of time, which no periodic motion can follow: use a time_history with \
             `duration`, or a run_up; or remove it for this analysis, set: {{loads.{body}.profile: null}}"
        );
        faults.push(Fault::new("", message));
    }
    let moved = train
        .moved_over_time()
        .and_then(|motion| train.bodies.get_index(motion.body));
    if let Some((body, _)) = moved.filter(|_| !analysis.takes_functions_of_time()) {
        let message = format!(
            "the motion of `{body}` is a function of time, which no periodic motion can follow: use a time_history with \
             `duration`, or give the motion over the cycle"
        );
        faults.push(Fault::new("", message));
    }
    faults
}

/// Message for a panic, which ends only the analysis in which it occurs.
pub fn panicked(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    format!("internal error: {text}; please report it with the model file")
}

/// A key of an analysis and the error in its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// Key, with an index where the value is a list: `marks.2`.
    pub key: String,
    /// Found and expected values.
    pub message: String,
}

impl Fault {
    /// A fault of one key.
    pub fn new(key: impl Into<String>, message: impl Into<String>) -> Fault {
        Fault {
            key: key.into(),
            message: message.into(),
        }
    }
}

/// Returns the JSON schema of the settings of an analysis.
pub type SettingsSchema = fn(&mut SchemaGenerator) -> Schema;

/// The analysis types, what each is for, and the schema of its settings.
pub const TYPES: &[(&str, &str, SettingsSchema)] = &[
    (
        "modes",
        "natural frequencies against the effective stiffness",
        Modes::json_schema,
    ),
    (
        "effective_frequencies",
        "natural frequencies against the amplitude of a one-harmonic motion",
        EffectiveFrequencies::json_schema,
    ),
    (
        "frequency_response",
        "periodic responses against the excitation frequency, with stability",
        FrequencyResponse::json_schema,
    ),
    (
        "parameter_response",
        "periodic responses at a fixed frequency against any number of the model",
        ParameterResponse::json_schema,
    ),
    (
        "time_history",
        "motion against time, with switches and absolute accelerations",
        TimeHistory::json_schema,
    ),
    (
        "operating_point",
        "the attractor at one frequency with all measured quantities, in one row",
        OperatingPoint::json_schema,
    ),
    (
        "run_up",
        "order tracks, spectra and rattle while the speed changes",
        RunUp::json_schema,
    ),
    (
        "poincare_map",
        "states at phase 0 of the excitation, period after period",
        PoincareMap::json_schema,
    ),
    (
        "bifurcation_diagram",
        "states at phase 0 of the excitation against a parameter, with Lyapunov exponents",
        BifurcationDiagram::json_schema,
    ),
    (
        "bifurcation_curve",
        "curves of bifurcations and grazings in two numbers of the model",
        BifurcationCurve::json_schema,
    ),
    (
        "regime_map",
        "labels and measures of attractors over a grid of two numbers of the model",
        RegimeMap::json_schema,
    ),
    (
        "torus",
        "invariant curves of the stroboscopic map against one number of the model",
        Torus::json_schema,
    ),
    (
        "basins",
        "which initial state ends at which attractor, over a grid of states",
        Basins::json_schema,
    ),
    (
        "parameter_study",
        "many runs of another analysis over a grid, a list or a random sample of parameters",
        ParameterStudy::json_schema,
    ),
];

/// The model under which an analysis runs, with its `set:` applied.
pub struct Setting<'a> {
    /// Name of the analysis.
    pub name: &'a str,
    /// The model.
    pub model: &'a Model,
    /// The assembled system.
    pub assembly: &'a Assembly,
    /// Interruption and progress.
    pub control: &'a dyn Control,
}

/// Writes page and manifest of the finished analyses and returns the names of the others; `None` if the run is already doing
/// so.
pub type Emergency = Box<dyn FnOnce() -> Option<Result<Vec<String>, Error>> + Send>;

/// Interface between a running analysis and its caller: interruption, memory, progress.
pub trait Control: Send + Sync {
    /// Whether to stop at the next opportunity.
    fn is_interrupted(&self) -> bool {
        false
    }

    /// Flag that reaches into long computations, raised together with [`Control::is_interrupted`].
    fn interrupt(&self) -> Interrupt {
        Interrupt::default()
    }

    /// Reason of an interruption that the user did not request.
    fn reason(&self) -> Option<String> {
        None
    }

    /// Memory limit in bytes; `None`: no limit.
    fn memory(&self) -> Option<u64> {
        machine::available_memory()
    }

    /// Stores the function that writes the finished results if the process must end before the run.
    fn in_emergency(&self, _conclude: Emergency) {}

    /// Progress of an analysis: fraction done, 0..1, and a description.
    fn progress(&self, _analysis: &str, _share: f64, _words: &str) {}
}

/// An observer from a closure. It receives the name of the analysis, the fraction done (0..1) and a description, and returns
/// whether to continue.
///
/// ```
/// use gearlash::analysis::Observer;
///
/// let observer = Observer::new(|analysis, share, words| {
///     println!("{analysis}: {:3.0} % {words}", 100.0 * share);
///     share < 0.5
/// });
/// ```
#[derive(Debug)]
pub struct Observer<F> {
    tell: F,
    interrupt: Interrupt,
}

impl<F: Fn(&str, f64, &str) -> bool + Send + Sync> Observer<F> {
    /// Observer that calls a function on the computing thread.
    pub fn new(tell: F) -> Observer<F> {
        Observer {
            tell,
            interrupt: Interrupt::default(),
        }
    }
}

impl<F: Fn(&str, f64, &str) -> bool + Send + Sync> Control for Observer<F> {
    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }

    fn interrupt(&self) -> Interrupt {
        self.interrupt.clone()
    }

    fn progress(&self, analysis: &str, share: f64, words: &str) {
        if !(self.tell)(analysis, share, words) {
            self.interrupt.request();
        }
    }
}

/// A flag that reaches into long computations.
impl Control for Interrupt {
    fn is_interrupted(&self) -> bool {
        self.is_requested()
    }

    fn interrupt(&self) -> Interrupt {
        self.clone()
    }
}

/// A flag that is looked at between periods and points.
impl Control for AtomicBool {
    fn is_interrupted(&self) -> bool {
        self.load(Ordering::Relaxed)
    }
}

impl Setting<'_> {
    /// Units of the results.
    pub fn units(&self) -> ReportedUnits<'_> {
        ReportedUnits::new(self.model, self.assembly)
    }

    /// Whether results are in SI units.
    pub fn is_si(&self) -> bool {
        self.model.report_units == ReportUnits::Si
    }

    /// A solver's complaint with the connection's name in place of its number.
    pub fn name_connection(&self, error: &SolveError) -> String {
        match error {
            SolveError::Unsupported { connection, reason } => {
                format!("{}: {reason}", self.assembly.connections[*connection])
            }
            other => other.to_string(),
        }
    }

    /// An excitation frequency over omega_c.
    ///
    /// # Errors
    /// A bare number in an SI report, a unit in a reduced model, a wrong unit, zero or less.
    pub fn frequency(&self, quantity: &Quantity) -> Result<f64, String> {
        let is_reduced = matches!(self.model.structure, Structure::Reduced(_));
        let value = match quantity.dimension {
            None if self.is_si() => {
                return Err(format!(
                    "the bare number {} is ambiguous in an SI report; give a frequency with a unit, such as `{} Hz`, \
                     `rpm` or `rad/s`",
                    quantity.text, quantity.text
                ));
            }
            None => quantity.value,
            Some(_) if is_reduced => {
                return Err(format!(
                    "`{}` has a unit, but a reduced model is nondimensional; give omega/omega_c",
                    quantity.text
                ));
            }
            Some(_) => quantity.si(UnitDimension::FREQUENCY)? / self.assembly.scales.frequency,
        };
        // The equation of motion holds the square of the frequency, and its reciprocal is the period.
        let is_usable = value > 0.0 && (value * value).is_normal() && (1.0 / value).is_normal();
        if is_usable {
            Ok(value)
        } else {
            Err(format!(
                "{} must be a frequency > 0, with a finite square",
                quantity.text
            ))
        }
    }
}
