//! Tracing the branches of a frequency response, method by method, and reporting them.

use super::orbits::OrbitTable;
use super::{FrequencyResponse, Method, Orbits};
use crate::analysis::Setting;
use crate::analysis::branch_table::{self, MAX_PANELS, MeasureRecorder, Swept, Traced};
use crate::error::{Diagnostic, Error};
use crate::quantity::Quantity;
use crate::report::{Report, Table, Values};
use crate::solve::branch::{self, Branch, BranchPoint, TraceOptions};
use crate::solve::continuation::PathEnd;
use crate::solve::equilibrium::equilibrium;
use crate::solve::family::FrequencyFamily;
use crate::solve::galerkin::Galerkin;
use crate::solve::residual::PeriodicResidual;
use crate::solve::shooting::Shooting;
use crate::solve::start::{self, Start};
use crate::system::System;
use nalgebra::DVector;
use serde_json::{Value, json};
use std::time::Instant;

/// A branch with what is to be said about it.
struct Delivered {
    method: Method,
    /// Name of the integrator, for shooting.
    integrator: Option<&'static str>,
    branch: Branch,
    failure: Option<String>,
}

/// What a run collects while it goes from method to method.
struct Work<'a> {
    analysis: &'a FrequencyResponse,
    setting: &'a Setting<'a>,
    system: System,
    range: (f64, f64),
    marks: Vec<f64>,
    delivered: Vec<Delivered>,
    orbits: OrbitTable,
    warnings: Vec<String>,
}

/// Runs every method and reports.
pub(super) fn run(analysis: &FrequencyResponse, setting: &Setting<'_>) -> Result<Report, Error> {
    let began = Instant::now();
    let frequency = |q: &Quantity| setting.frequency(q).map_err(|m| input(setting, m));
    let range = (frequency(&analysis.from)?, frequency(&analysis.to)?);
    let marks = analysis
        .marks
        .iter()
        .map(frequency)
        .collect::<Result<Vec<f64>, Error>>()?;
    let mut system = setting.assembly.system.clone();
    system.set_subharmonic(analysis.subharmonic);
    let (delivered, warnings, orbits) = (Vec::new(), Vec::new(), OrbitTable::new(setting));
    let mut work = Work {
        analysis,
        setting,
        system,
        range,
        marks,
        delivered,
        orbits,
        warnings,
    };
    work.trace_all()?;
    let mut report = work.report();
    report.summary.insert(
        "timings".into(),
        json!({ "seconds": began.elapsed().as_secs_f64() }),
    );
    Ok(report)
}

impl Work<'_> {
    fn trace_all(&mut self) -> Result<(), Error> {
        let (size, from) = (self.analysis.size(), self.range.0);
        let found = start::find(
            &self.system,
            from,
            size,
            self.analysis.start,
            self.analysis.newton(),
        )?;
        let system = self.system.clone();
        let family = || FrequencyFamily::new(system.clone());
        let mut galerkin = Galerkin::new(family(), from, size)?;
        for method in self.analysis.methods() {
            let mut shooting = match method {
                Method::Galerkin => None,
                Method::Shooting => Some(Shooting::new(family(), from, self.analysis.integrator)?),
            };
            let integrator = shooting.as_ref().map(|s| s.integrator());
            let (branch, failure) = match &found {
                Start::Failed(reasons) => (
                    None,
                    Some(format!("no first solution: {}", reasons.join("; "))),
                ),
                Start::Found { u, how } => {
                    if *how != start::LINEAR && self.delivered.is_empty() {
                        self.warnings
                            .push(format!("the first solution was found by {how}"));
                    }
                    match &mut shooting {
                        None => self.trace(&mut galerkin, u.clone(), method)?,
                        Some(shooting) => {
                            let mut state = vec![0.0; 2 * self.system.dof()];
                            galerkin.orbit(u, from)?.state(0.0, &mut state);
                            self.trace(shooting, DVector::from_vec(state), method)?
                        }
                    }
                }
            };
            let none = Branch {
                points: Vec::new(),
                events: Vec::new(),
                end: PathEnd::MaxPoints,
            };
            let branch = branch.unwrap_or(none);
            let failure = failure.or_else(|| early_end(&branch));
            self.delivered.push(Delivered {
                method,
                integrator,
                branch,
                failure,
            });
        }
        Ok(())
    }

    /// One branch; what keeps it from starting is the second value.
    fn trace(
        &mut self,
        problem: &mut dyn PeriodicResidual,
        guess: DVector<f64>,
        method: Method,
    ) -> Result<(Option<Branch>, Option<String>), Error> {
        let mut continuation = self.analysis.continuation(self.range, weight(&self.system));
        if method == Method::Shooting {
            // The flow is good to rounding, and so shall the fixed point be.
            continuation.newton.tolerance *= SHOOTING_TOLERANCE;
            continuation.weight *= 0.5;
        }
        let options = TraceOptions {
            continuation,
            marks: self.marks.clone(),
            stability: self.analysis.stability,
        };
        let mut recorder =
            MeasureRecorder::new(self.setting, self.analysis.size().samples, self.range);
        let branch = match branch::trace(problem, guess, &options, &mut recorder)? {
            Ok(branch) => branch,
            Err(outcome) => {
                return Ok((
                    None,
                    Some(format!(
                        "the first point cannot be corrected: {}",
                        outcome.status
                    )),
                ));
            }
        };
        self.warn(&branch, &recorder.pulling);
        let kept = |p: &BranchPoint| match self.analysis.orbits {
            Orbits::None => false,
            Orbits::All => true,
            Orbits::Marks => p.is_mark,
        };
        for (index, point) in branch.points.iter().enumerate().filter(|(_, p)| kept(p)) {
            let orbit = problem.orbit(&point.unknowns, point.lambda)?;
            self.orbits.add(
                (self.delivered.len(), index),
                problem.system_at(point.lambda)?,
                &orbit,
            );
        }
        Ok((Some(branch), None))
    }

    fn warn(&mut self, branch: &Branch, pulling: &[bool]) {
        let list = &mut self.warnings;
        for (name, _) in self
            .setting
            .assembly
            .connections
            .iter()
            .zip(pulling)
            .filter(|(_, pulls)| **pulls)
        {
            list.push(format!(
                "{name}: the contact pulls somewhere on the branch (1 + beta v < 0): impact damping is beyond its range"
            ));
        }
        for event in branch.events.iter().filter(|e| !e.is_located()) {
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
        let missed = self
            .marks
            .iter()
            .zip(&self.analysis.marks)
            .filter(|(mark, _)| !passed(**mark));
        for (_, written) in missed.filter(|_| branch.end == PathEnd::RangeReached) {
            list.push(format!("the mark {} could not be solved", written.text));
        }
    }

    fn report(self) -> Report {
        let Work {
            analysis,
            setting,
            delivered,
            ..
        } = &self;
        let swept = match setting.is_si() {
            true => Swept {
                unit: "rad/s".into(),
                factor: setting.assembly.scales.frequency,
            },
            false => Swept {
                unit: String::new(),
                factor: 1.0,
            },
        };
        let traced: Vec<Traced<'_>> = delivered
            .iter()
            .map(|d| Traced {
                branch: &d.branch,
                method: d.method.word(),
            })
            .collect();
        let events = branch_table::events(setting, &swept, &traced);
        let mut report = Report {
            figure: Some(branch_table::figure(setting, &traced)),
            ..Report::default()
        };
        report.summary.insert(
            "options".into(),
            serde_json::to_value(analysis).unwrap_or(Value::Null),
        );
        let branches: Vec<Value> = delivered
            .iter()
            .enumerate()
            .map(|(k, d)| d.as_value(k))
            .collect();
        report
            .summary
            .insert("branches".into(), Value::Array(branches));
        report
            .summary
            .insert("events".into(), rows_as_json(&events));
        report
            .tables
            .push(branch_table::points(setting, &swept, &traced));
        report.tables.extend(branch_table::multipliers(&traced));
        report.tables.push(events);
        let count = setting.assembly.connections.len();
        if count > MAX_PANELS {
            report.caption = format!(
                "Shown are the first {MAX_PANELS} of {count} connections; the table has all of them."
            );
        }
        let failures: Vec<String> = delivered
            .iter()
            .filter_map(|d| d.complaint(delivered.len()))
            .collect();
        report.ended_early = (!failures.is_empty()).then(|| failures.join("; "));
        report.warnings = self.warnings.clone();
        if self.analysis.orbits != Orbits::None {
            report.tables.push(self.orbits.finish(self.setting));
        }
        report
    }
}

impl Delivered {
    /// Why the branch ended early, with the method in front where there are several.
    fn complaint(&self, methods: usize) -> Option<String> {
        let failure = self.failure.as_ref()?;
        Some(if methods > 1 {
            format!("{}: {failure}", self.method.word())
        } else {
            failure.clone()
        })
    }

    fn as_value(&self, number: usize) -> Value {
        let end = &self.branch.end;
        json!({
            "branch": number,
            "method": self.method.word(),
            "integrator": self.integrator,
            "points": self.branch.points.len(),
            "end": {
                "reason": if self.branch.points.is_empty() { "no_start" } else { end.reason() },
                "message": self.failure.clone().unwrap_or_else(|| end.message()),
            },
        })
    }
}

/// Share of the tolerance that shooting's corrector is held to.
const SHOOTING_TOLERANCE: f64 = 1e-2;

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

fn input(setting: &Setting<'_>, message: String) -> Error {
    let path = format!("analyses.{}", setting.name);
    Error::Input(vec![Diagnostic {
        location: None,
        path,
        message,
        help: None,
    }])
}
