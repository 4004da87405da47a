//! Periodic responses against the excitation frequency (figures 10 to 15).

mod orbits;
mod trace;

use super::{Analysis, Fault, Setting};
use crate::error::{Error, SolveError};
use crate::quantity::Quantity;
use crate::report::Report;
use crate::solve::continuation::ContinuationOptions;
use crate::solve::family::FrequencyFamily;
use crate::solve::galerkin::{Galerkin, GalerkinOptions};
use crate::solve::integrate::{IntegratorChoice, choose};
use crate::solve::newton::NewtonOptions;
use crate::solve::start::StartMode;
use serde::{Deserialize, Serialize};

/// Settings of `frequency_response`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrequencyResponse {
    /// First excitation frequency.
    pub from: Quantity,
    /// Last excitation frequency.
    pub to: Quantity,
    /// How periodic solutions are computed.
    #[serde(default)]
    pub method: Option<Method>,
    /// Several methods, drawn together; excludes `method`.
    #[serde(default)]
    pub methods: Option<Vec<Method>>,
    /// Integrator of shooting.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// Harmonics of the excitation frequency.
    #[serde(default = "defaults::harmonics")]
    pub harmonics: usize,
    /// Samples a response period, a power of two.
    #[serde(default)]
    pub samples: Option<usize>,
    /// Whether to compute Floquet multipliers and the bifurcations that they show.
    #[serde(default = "defaults::stability")]
    pub stability: bool,
    /// nu, excitation periods in a response period.
    #[serde(default = "defaults::subharmonic")]
    pub subharmonic: usize,
    /// Frequencies to solve exactly, every time the branch passes them.
    #[serde(default)]
    pub marks: Vec<Quantity>,
    /// Which orbits to keep.
    #[serde(default)]
    pub orbits: Orbits,
    /// First step of the path, in arclength; 0.02, or max_step where that is smaller, when absent.
    #[serde(default)]
    pub step: Option<f64>,
    /// Smallest step before the branch is given up.
    #[serde(default = "defaults::min_step")]
    pub min_step: f64,
    /// Largest step.
    #[serde(default = "defaults::max_step")]
    pub max_step: f64,
    /// Points at most.
    #[serde(default = "defaults::max_points")]
    pub max_points: usize,
    /// Largest residual, relative to the size of its terms.
    #[serde(default = "defaults::tolerance")]
    pub tolerance: f64,
    /// Where the search for the first solution begins.
    #[serde(default)]
    pub start: StartMode,
}

mod defaults {
    pub fn harmonics() -> usize {
        12
    }
    pub fn stability() -> bool {
        true
    }
    pub fn subharmonic() -> usize {
        1
    }
    pub fn min_step() -> f64 {
        1e-8
    }
    pub fn max_step() -> f64 {
        0.1
    }
    pub fn max_points() -> usize {
        10_000
    }
    pub fn tolerance() -> f64 {
        1e-10
    }
}

/// First step when none is given.
const FIRST_STEP: f64 = 0.02;

/// How periodic solutions are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Multi-harmonic balance.
    #[default]
    Galerkin,
    /// Fixed points of the Poincaré map.
    Shooting,
}

impl Method {
    /// Word for files.
    pub fn word(self) -> &'static str {
        match self {
            Method::Galerkin => "galerkin",
            Method::Shooting => "shooting",
        }
    }
}

/// Which orbits to keep.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Orbits {
    /// None.
    #[default]
    None,
    /// All points.
    All,
    /// Points solved at marks.
    Marks,
}

impl Serialize for Orbits {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Orbits::None => serializer.serialize_bool(false),
            Orbits::All => serializer.serialize_bool(true),
            Orbits::Marks => serializer.serialize_str("marks"),
        }
    }
}

impl<'de> Deserialize<'de> for Orbits {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged, expecting = "false, true or `marks`")]
        enum Written {
            Flag(bool),
            Word(Marks),
        }
        #[derive(Deserialize)]
        #[serde(rename_all = "snake_case")]
        enum Marks {
            Marks,
        }
        Ok(match Written::deserialize(deserializer)? {
            Written::Flag(false) => Orbits::None,
            Written::Flag(true) => Orbits::All,
            Written::Word(Marks::Marks) => Orbits::Marks,
        })
    }
}

#[typetag::serde(name = "frequency_response")]
impl Analysis for FrequencyResponse {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = Vec::new();
        let mut frequency = |key: String, quantity: &Quantity| match setting.frequency(quantity) {
            Ok(value) => Some(value),
            Err(message) => {
                faults.push(Fault::new(key, message));
                None
            }
        };
        let from = frequency("from".into(), &self.from);
        let to = frequency("to".into(), &self.to);
        let marks: Vec<_> = self
            .marks
            .iter()
            .enumerate()
            .map(|(k, mark)| frequency(format!("marks.{k}"), mark))
            .collect();
        if let (Some(from), Some(to)) = (from, to) {
            let (low, high) = (from.min(to), from.max(to));
            for (k, mark) in marks.iter().enumerate() {
                if mark.is_some_and(|m| m < low || m > high) {
                    let message = format!(
                        "{} lies outside the range from {} to {}",
                        self.marks[k].text, self.from.text, self.to.text
                    );
                    faults.push(Fault::new(format!("marks.{k}"), message));
                }
            }
            if let Err(error) = self.continuation((from, to), 1.0).validate() {
                faults.push(fault_of(error));
            }
        }
        faults.extend(self.check_methods(setting));
        faults.extend(self.check_size(setting));
        faults
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        trace::run(self, setting)
    }
}

impl FrequencyResponse {
    /// The methods asked for, Galerkin when none is named.
    fn methods(&self) -> Vec<Method> {
        match &self.methods {
            Some(list) => list.clone(),
            None => vec![self.method.unwrap_or_default()],
        }
    }

    fn check_methods(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.method.is_some() && self.methods.is_some() {
            faults.push(Fault::new(
                "methods",
                "`method` and `methods` exclude each other",
            ));
        }
        let methods = self.methods();
        let repeated = (1..methods.len()).any(|k| methods[..k].contains(&methods[k]));
        if methods.is_empty() || repeated {
            faults.push(Fault::new("methods", "wanted a list of different methods"));
        }
        if methods.contains(&Method::Shooting)
            && let Err(error) = choose(&setting.assembly.system, self.integrator)
        {
            faults.push(Fault::new("integrator", setting.name_connection(&error)));
        }
        faults
    }

    fn size(&self) -> GalerkinOptions {
        let samples = self.samples.unwrap_or(GalerkinOptions::default_samples(
            self.harmonics,
            self.subharmonic,
        ));
        GalerkinOptions {
            harmonics: self.harmonics,
            samples,
        }
    }

    fn newton(&self) -> NewtonOptions {
        NewtonOptions {
            tolerance: self.tolerance,
            ..NewtonOptions::default()
        }
    }

    fn continuation(&self, range: (f64, f64), weight: f64) -> ContinuationOptions {
        let FrequencyResponse {
            min_step,
            max_step,
            max_points,
            ..
        } = *self;
        ContinuationOptions {
            range,
            step: self.step.unwrap_or(FIRST_STEP.min(max_step)),
            min_step,
            max_step,
            max_points,
            weight,
            newton: self.newton(),
        }
    }

    fn check_size(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.subharmonic == 0 {
            faults.push(Fault::new("subharmonic", "0 must be at least 1"));
            return faults;
        }
        if self.harmonics == 0 || self.harmonics * self.subharmonic > 4096 {
            let message = format!(
                "{} must be at least 1, and at most 4096 with the subharmonic index",
                self.harmonics
            );
            faults.push(Fault::new("harmonics", message));
            return faults;
        }
        if let Some(samples) = self.samples {
            let least = 16 * self.harmonics * self.subharmonic;
            if !samples.is_power_of_two() || samples < least || samples > 1 << 22 {
                let message = format!(
                    "{samples} must be a power of two, at least {least} (16 a harmonic), at most {}",
                    1 << 22
                );
                faults.push(Fault::new("samples", message));
            }
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1e-2) {
            faults.push(Fault::new(
                "tolerance",
                format!("{} must be between 0 and 0.01", self.tolerance),
            ));
        }
        if faults.is_empty() {
            let mut system = setting.assembly.system.clone();
            system.set_subharmonic(self.subharmonic);
            if let Err(error) = Galerkin::new(FrequencyFamily::new(system), 1.0, self.size()) {
                faults.push(fault_of(error));
            }
        }
        faults
    }
}

fn fault_of(error: SolveError) -> Fault {
    match error {
        SolveError::Option {
            name,
            found,
            wanted,
        } => Fault::new(name, format!("{found} must be {wanted}")),
        other => Fault::new("", other.to_string()),
    }
}
