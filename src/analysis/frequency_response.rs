//! Periodic responses against the excitation frequency (figures 10 to 15).

use super::branch_table::{self, MAX_PANELS, MeasureRecorder, Swept, Traced};
use super::{Analysis, Fault, Setting};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Column, Report, Table, Values};
use crate::solve::branch::{self, Branch, TraceOptions};
use crate::solve::continuation::{ContinuationOptions, PathEnd};
use crate::solve::equilibrium::equilibrium;
use crate::solve::family::FrequencyFamily;
use crate::solve::galerkin::{Galerkin, GalerkinOptions};
use crate::solve::newton::NewtonOptions;
use crate::solve::residual::PeriodicResidual;
use crate::solve::start::{self, Start, StartMode};
use crate::system::System;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::time::Instant;

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
    pub method: Method,
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
        faults.extend(self.check_size(setting));
        faults
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let began = Instant::now();
        let frequency = |q: &Quantity| setting.frequency(q).map_err(|m| input(setting, m));
        let range = (frequency(&self.from)?, frequency(&self.to)?);
        let marks = self
            .marks
            .iter()
            .map(frequency)
            .collect::<Result<Vec<f64>, Error>>()?;
        let mut system = setting.assembly.system.clone();
        system.set_subharmonic(self.subharmonic);
        let mut recorder = MeasureRecorder::new(setting, self.size().samples, range);
        let mut warnings = Vec::new();
        let found = start::find(&system, range.0, self.size(), self.start, self.newton())?;
        let mut problem =
            Galerkin::new(FrequencyFamily::new(system.clone()), range.0, self.size())?;
        let (branch, failure) = match found {
            Start::Failed(reasons) => (
                None,
                Some(format!("no first solution: {}", reasons.join("; "))),
            ),
            Start::Found { u, how } => {
                if how != start::LINEAR {
                    warnings.push(format!("the first solution was found by {how}"));
                }
                let options = TraceOptions {
                    continuation: self.continuation(range, weight(&system)),
                    marks,
                    stability: self.stability,
                };
                match branch::trace(&mut problem, u, &options, &mut recorder)? {
                    Ok(branch) => (Some(branch), None),
                    Err(outcome) => (
                        None,
                        Some(format!(
                            "the first point cannot be corrected: {}",
                            outcome.status
                        )),
                    ),
                }
            }
        };
        let branch = branch.unwrap_or(Branch {
            points: Vec::new(),
            events: Vec::new(),
            end: PathEnd::MaxPoints,
        });
        let failure = failure.or_else(|| early_end(&branch));
        warnings.extend(self.warnings(setting, &branch, &recorder.pulling));
        let mut report = self.report(setting, &branch, &mut problem, failure)?;
        report.warnings = warnings;
        report.summary.insert(
            "timings".into(),
            json!({ "seconds": began.elapsed().as_secs_f64() }),
        );
        Ok(report)
    }
}

impl FrequencyResponse {
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

    fn warnings(&self, setting: &Setting<'_>, branch: &Branch, pulling: &[bool]) -> Vec<String> {
        let mut list = Vec::new();
        for (name, pulls) in setting.assembly.connections.iter().zip(pulling) {
            if *pulls {
                list.push(format!(
                    "{name}: the contact pulls somewhere on the branch (1 + beta v < 0): impact damping is beyond its range"
                ));
            }
        }
        for event in branch.events.iter().filter(|e| !e.located) {
            let (low, high) = event.bracket;
            list.push(format!(
                "a {} between {low} and {high} could not be located",
                event.kind.word()
            ));
        }
        let passed = |mark: f64| {
            branch
                .points
                .iter()
                .any(|p| p.is_mark && (p.lambda - mark).abs() <= 1e-12 * mark)
        };
        for mark in &self.marks {
            if setting.frequency(mark).is_ok_and(|m| !passed(m))
                && branch.end == PathEnd::RangeReached
            {
                list.push(format!("the mark {} could not be solved", mark.text));
            }
        }
        list
    }

    fn report(
        &self,
        setting: &Setting<'_>,
        branch: &Branch,
        problem: &mut dyn PeriodicResidual,
        failure: Option<String>,
    ) -> Result<Report, Error> {
        let scales = &setting.assembly.scales;
        let swept = match setting.is_si() {
            true => Swept {
                unit: "rad/s".into(),
                factor: scales.frequency,
            },
            false => Swept {
                unit: String::new(),
                factor: 1.0,
            },
        };
        let traced = [Traced {
            branch,
            method: "galerkin",
        }];
        let mut tables = vec![branch_table::points(setting, &swept, &traced)];
        tables.extend(branch_table::multipliers(&traced));
        let events = branch_table::events(setting, &swept, &traced);
        let mut report = Report {
            figure: Some(branch_table::figure(setting)),
            ..Report::default()
        };
        report.summary.insert(
            "options".into(),
            serde_json::to_value(self).unwrap_or(Value::Null),
        );
        report.summary.insert(
            "branches".into(),
            json!([{
                "branch": 0,
                "method": "galerkin",
                "points": branch.points.len(),
                "end": {
                    "reason": if branch.points.is_empty() { "no_start" } else { branch.end.reason() },
                    "message": failure.clone().unwrap_or_else(|| branch.end.message()),
                },
            }]),
        );
        report
            .summary
            .insert("events".into(), rows_as_json(&events));
        tables.push(events);
        if self.orbits != Orbits::None {
            tables.push(self.orbit_table(setting, branch, problem)?);
        }
        let count = setting.assembly.connections.len();
        if count > MAX_PANELS {
            report.caption = format!(
                "Shown are the first {MAX_PANELS} of {count} connections; the table has all of them."
            );
        }
        report.tables = tables;
        report.ended_early = failure;
        Ok(report)
    }

    /// 256 rows an orbit: deformations, their rates and forces.
    fn orbit_table(
        &self,
        setting: &Setting<'_>,
        branch: &Branch,
        problem: &mut dyn PeriodicResidual,
    ) -> Result<Table, Error> {
        let e = setting.assembly.connections.len();
        let (mut numbers, mut series) = (vec![Vec::new(); 2], vec![Vec::new(); 1 + 3 * e]);
        let kept = |p: &branch::BranchPoint| self.orbits == Orbits::All || p.is_mark;
        for (index, point) in branch.points.iter().enumerate().filter(|(_, p)| kept(p)) {
            let orbit = problem.orbit(&point.unknowns, point.lambda)?;
            let system = problem.system_at(point.lambda)?;
            let (mut state, mut scratch) = (vec![0.0; 2 * system.dof()], system.scratch());
            for row in 0..ORBIT_ROWS {
                let tau = std::f64::consts::TAU * row as f64 / ORBIT_ROWS as f64;
                orbit.state(tau, &mut state);
                system.respond(tau, &state, &mut scratch);
                numbers[0].push(0);
                numbers[1].push(index as i64);
                series[0].push(tau);
                for k in 0..e {
                    series[1 + k].push(scratch.deformation[k]);
                    series[1 + e + k].push(scratch.rate[k]);
                    series[1 + 2 * e + k].push(scratch.response[k].f);
                }
            }
        }
        Ok(orbit_columns(setting, numbers, series))
    }
}

/// Rows of an orbit in the orbits file.
const ORBIT_ROWS: usize = 256;

fn orbit_columns(setting: &Setting<'_>, numbers: Vec<Vec<i64>>, series: Vec<Vec<f64>>) -> Table {
    let scales = &setting.assembly.scales;
    let mut columns: Vec<Column> = ["branch", "point"]
        .into_iter()
        .zip(numbers)
        .map(|(name, values)| Column {
            name: name.into(),
            unit: String::new(),
            values: Values::Integer(values),
        })
        .collect();
    let mut described = vec![("tau".to_string(), "rad".to_string(), 1.0)];
    for kind in ["q", "v", "f"] {
        for (k, connection) in setting.assembly.connections.iter().enumerate() {
            let (x, force) = setting.model.units_of(k);
            let (l, w, stiffness) = (
                scales.displacement[k],
                scales.frequency,
                scales.stiffness[k],
            );
            let (unit, factor) = match kind {
                "q" => (x.to_string(), l),
                "v" => (format!("{x}/s"), l * w),
                _ => (force.to_string(), stiffness * l),
            };
            let (unit, factor) = if setting.is_si() {
                (unit, factor)
            } else {
                (String::new(), 1.0)
            };
            described.push((format!("{kind}.{connection}"), unit, factor));
        }
    }
    columns.extend(
        described
            .into_iter()
            .zip(series)
            .map(|((name, unit, factor), values)| Column {
                name,
                unit,
                values: Values::Float(values.into_iter().map(|x| x * factor).collect()),
            }),
    );
    Table {
        name: "orbits".into(),
        columns,
    }
}

/// Weight of the unknowns in the arclength: a change of the deformations by their own size counts like a change of the
/// frequency by omega_c.
fn weight(system: &System) -> f64 {
    let rest = equilibrium(system);
    let size = system
        .mounts()
        .iter()
        .enumerate()
        .fold(0.0_f64, |size, (e, mount)| {
            let breakpoint = mount
                .element
                .breakpoints()
                .iter()
                .fold(0.0_f64, |b, x| b.max(x.abs()));
            let at_rest = rest.as_ref().map_or(0.0, |r| r.deformation[e].abs());
            size.max(breakpoint).max(at_rest)
        });
    let size = if size > 0.0 { size } else { 1.0 };
    1.0 / (system.dof() as f64 * size * size)
}

fn early_end(branch: &Branch) -> Option<String> {
    match branch.end {
        PathEnd::RangeReached | PathEnd::Closed => None,
        end => {
            let last = branch.points.last().map_or(f64::NAN, |p| p.frequency);
            Some(format!(
                "{} at omega/omega_c = {last:.6} after {} points",
                end.message(),
                branch.points.len()
            ))
        }
    }
}

fn rows_as_json(table: &Table) -> Value {
    let cell = |values: &Values, row: usize| match values {
        Values::Float(v) => json!(v[row].is_finite().then_some(v[row])),
        Values::Integer(v) => json!(v[row]),
        Values::Text(v) => json!(v[row]),
    };
    let row = |r: usize| -> Value {
        Value::Object(
            table
                .columns
                .iter()
                .map(|c| (c.name.clone(), cell(&c.values, r)))
                .collect(),
        )
    };
    Value::Array((0..table.rows()).map(row).collect())
}

fn fault_of(error: crate::error::SolveError) -> Fault {
    match error {
        crate::error::SolveError::Option {
            name,
            found,
            wanted,
        } => Fault::new(name, format!("{found} must be {wanted}")),
        other => Fault::new("", other.to_string()),
    }
}

fn input(setting: &Setting<'_>, message: String) -> Error {
    let path = format!("analyses.{}", setting.name);
    Error::Input(vec![crate::error::Diagnostic {
        location: None,
        path,
        message,
        help: None,
    }])
}
