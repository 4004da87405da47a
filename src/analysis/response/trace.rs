//! Method by method from a first solution along the parameter.

use super::crossings::{self, Crossings};
use super::guarded::Guarded;
use super::integration;
use super::orbits::OrbitTable;
use super::report::{self, Delivered, Ending};
use super::verify::Verification;
use super::{BranchSettings, Method, Swept};
use crate::analysis::branch_table::MeasureRecorder;
use crate::error::Error;
use crate::report::{Report, Table};
use crate::solve::branch::{self, Begin, Branch, TraceOptions};
use crate::solve::continuation::{PathEnd, PathPoint, Side};
use crate::solve::equilibrium::equilibrium;
use crate::solve::family::Family;
use crate::solve::floquet::Spectrum;
use crate::solve::galerkin::Galerkin;
use crate::solve::residual::PeriodicResidual;
use crate::solve::shooting::Shooting;
use crate::solve::start::{self, Start};
use crate::system::System;
use nalgebra::DVector;
use serde_json::{Value, json};
use std::time::Instant;

/// Runs every method and reports; `options` are the settings as they go to the results.
pub(in crate::analysis) fn run(
    settings: &BranchSettings,
    swept: &Swept<'_>,
    options: Value,
) -> Result<Report, Error> {
    let began = Instant::now();
    let mut work = Work {
        settings,
        swept,
        delivered: Vec::new(),
        orbits: OrbitTable::new(swept.setting),
        verification: Verification::new(),
        warnings: Vec::new(),
        crossings: Crossings::default(),
    };
    work.trace_all()?;
    let Work {
        delivered,
        orbits,
        verification,
        warnings,
        ..
    } = work;
    let orbits = settings.orbits.are_kept().then_some(orbits);
    let verification = settings.verify.is_asked_for().then_some(&verification);
    let mut report = report::assemble(swept, &delivered, orbits, verification);
    if settings.branches.limits().is_some() {
        report.tables.push(report::branches(&delivered));
    }
    report.warnings = warnings;
    let seconds = began.elapsed().as_secs_f64();
    for (key, value) in [
        ("options", options),
        ("timings", json!({ "seconds": seconds })),
    ] {
        report.summary.insert(key.into(), value);
    }
    Ok(report)
}

/// Tables of a run without rows: those whose columns are known before it.
pub(in crate::analysis) fn tables(settings: &BranchSettings, swept: &Swept<'_>) -> Vec<Table> {
    let methods = settings.methods().into_iter();
    let delivered: Vec<Delivered> = methods.map(|m| Delivered::new(m, 1)).collect();
    let orbits = OrbitTable::new(swept.setting);
    let orbits = settings.orbits.are_kept().then_some(orbits);
    let verification = settings.verify.is_asked_for().then(Verification::new);
    let mut tables = report::assemble(swept, &delivered, orbits, verification.as_ref()).tables;
    if settings.branches.limits().is_some() {
        tables.push(report::branches(&delivered));
    }
    tables
}

/// What a run collects while it goes from method to method.
pub(super) struct Work<'a> {
    pub settings: &'a BranchSettings,
    pub swept: &'a Swept<'a>,
    pub delivered: Vec<Delivered>,
    orbits: OrbitTable,
    verification: Verification,
    pub warnings: Vec<String>,
    /// Of the branches of the present method.
    pub crossings: Crossings,
}

/// Where a branch of periodic solutions begins.
pub(super) enum Source {
    /// A guess at the first value of the range.
    Guess(DVector<f64>),
    /// An event of another branch.
    Crossing {
        /// The point of that branch.
        point: Box<PathPoint>,
        /// Which way the new branch is followed.
        side: Side,
        /// Whether the new branch has twice the period.
        is_doubled: bool,
    },
}

impl Source {
    /// The same in the unknowns of the new branch.
    fn begin(self, problem: &dyn PeriodicResidual) -> Begin {
        match self {
            Source::Guess(u) => Begin::Guess(u),
            Source::Crossing {
                mut point,
                side,
                is_doubled,
            } => {
                if is_doubled {
                    point.u = problem.in_doubled_period(&point.u);
                    point.tangent_u = problem.in_doubled_period(&point.tangent_u);
                }
                Begin::Crossing(point, side)
            }
        }
    }
}

/// The first periodic solution, as the Galerkin method sees it.
struct First<'a> {
    galerkin: Galerkin<Box<dyn Family + 'a>>,
    found: Start,
}

/// Distance in which the end of a model explains the end of a branch.
const BORDER: f64 = 1e-4;

impl<'a> Work<'a> {
    fn trace_all(&mut self) -> Result<(), Error> {
        let mut first = None;
        for method in self.settings.methods() {
            if method == Method::Integration {
                self.integrate();
                continue;
            }
            let first = match &mut first {
                Some(first) => first,
                None => first.insert(self.first()?),
            };
            let number = self.delivered.len();
            let delivered = self.primary(method, first)?;
            self.delivered.push(delivered);
            self.follow_crossings(method, number)?;
            self.crossings = Crossings::default();
        }
        Ok(())
    }

    /// Looks for the first solution at the beginning of the range.
    fn first(&mut self) -> Result<First<'a>, Error> {
        let (settings, from) = (self.settings, self.swept.range.0);
        let galerkin = Galerkin::new(self.swept.family()?, from, settings.size())?;
        let mut galerkin = settings.with_quadrature(galerkin, from)?;
        let system = galerkin.system_at(from)?;
        let found = start::find(
            system,
            system.excitation_frequency(),
            settings.size(),
            settings.start,
            settings.newton(),
        )?;
        if let Start::Found { how, .. } = &found
            && *how != start::LINEAR
        {
            self.warnings
                .push(format!("the first solution was found by {how}"));
        }
        Ok(First { galerkin, found })
    }

    /// The branch from the first solution.
    fn primary(&mut self, method: Method, first: &mut First<'_>) -> Result<Delivered, Error> {
        let from = self.swept.range.0;
        let mut delivered = Delivered::new(method, self.settings.subharmonic);
        let mut u = match &first.found {
            Start::Found { u, .. } => u.clone(),
            Start::Failed(reasons) => {
                let message = format!("no first solution: {}", reasons.join("; "));
                delivered.end = Ending::early("no_start", message);
                return Ok(delivered);
            }
        };
        if method == Method::Shooting {
            let orbit = first.galerkin.orbit(&u, from)?;
            u = DVector::zeros(2 * first.galerkin.system_at(from)?.dof());
            orbit.state(0.0, u.as_mut_slice());
        }
        self.follow(Source::Guess(u), &mut delivered)?;
        Ok(delivered)
    }

    /// Follows one branch of periodic solutions and verifies it where that is asked for.
    pub(super) fn follow(
        &mut self,
        source: Source,
        delivered: &mut Delivered,
    ) -> Result<(), Error> {
        let (settings, swept) = (self.settings, self.swept);
        let from = swept.range.0;
        let family = swept.family_for(delivered.subharmonic)?;
        if delivered.method == Method::Galerkin {
            let galerkin = Galerkin::new(family, from, settings.size_for(delivered.subharmonic))?;
            let mut galerkin = settings.with_quadrature(galerkin, from)?;
            self.trace(&mut galerkin, source, delivered)?;
            if settings.verify.is_asked_for() {
                let given = (settings, swept);
                let (number, newton) = (self.delivered.len(), settings.shooting_newton());
                let points = &delivered.points;
                self.verification
                    .add(given, &mut galerkin, number, points, newton)?;
            }
            return Ok(());
        }
        let mut shooting = Shooting::new(family, from, settings.integrator)?;
        delivered.note_integrator(shooting.integrator());
        self.trace(&mut shooting, source, delivered)?;
        // Along some parameters the law stops being piecewise affine.
        delivered.note_integrator(shooting.integrator());
        Ok(())
    }

    /// Follows one branch.
    fn trace(
        &mut self,
        problem: &mut dyn PeriodicResidual,
        source: Source,
        delivered: &mut Delivered,
    ) -> Result<(), Error> {
        let (settings, swept) = (self.settings, self.swept);
        let problem = &mut Guarded(problem);
        let (from, to) = swept.range;
        let weight = weight(problem.system_at(from)?).min(weight(problem.system_at(to)?));
        let mut continuation = settings.continuation(swept.range, weight);
        if delivered.method == Method::Shooting {
            continuation.newton = settings.shooting_newton();
            continuation.weight *= 0.5;
        }
        let options = TraceOptions {
            continuation,
            marks: swept.marks.clone(),
            stability: settings.stability,
            known: settings.branches.limits().map(|_| self.crossings.places()),
        };
        let samples = settings.size_for(delivered.subharmonic).samples;
        let mut recorder = MeasureRecorder::new(swept, samples);
        if settings.stability && swept.spectrum() == Spectrum::All {
            recorder = recorder.with_multiplier_estimates();
        }
        let begin = source.begin(problem);
        let branch = match branch::trace(problem, begin, &options, &mut recorder)? {
            Ok(branch) => branch,
            Err(outcome) => {
                let message = match delivered.origin {
                    Some(_) => format!("no other branch found at the event: {}", outcome.status),
                    None => format!("the first point cannot be corrected: {}", outcome.status),
                };
                delivered.end = Ending::early("no_start", message);
                return Ok(());
            }
        };
        let side = delivered.origin.and_then(|_| crossings::ending(branch.end));
        delivered.end = side.unwrap_or_else(|| self.ending(problem, &branch));
        (delivered.points, delivered.events) = (branch.points, branch.events);
        self.warn(delivered, branch.end, &recorder.pulling);
        self.explain(delivered.method, branch.exchanges);
        let number = self.delivered.len();
        if settings.branches.limits().is_some() {
            let met = self.crossings.add(problem, number, delivered, branch.end)?;
            if let Some(met) = met {
                delivered.end.message = format!("the branch returned onto branch {met}");
            }
        }
        let points = delivered.points.iter().enumerate();
        for (index, point) in points.filter(|(_, p)| settings.orbits.keeps(p.is_mark)) {
            let orbit = problem.orbit(&point.unknowns, point.lambda)?;
            let system = problem.system_at(point.lambda)?;
            self.orbits.add((number, index), system, &orbit);
        }
        Ok(())
    }

    /// Why a branch ended.
    fn ending(&self, problem: &mut Guarded<'_>, branch: &Branch) -> Ending {
        let (end, points) = (branch.end, branch.points.as_slice());
        let (mut reason, mut message) = (end.reason(), end.message());
        match end {
            PathEnd::RangeReached | PathEnd::Closed | PathEnd::Joined { .. } => {
                return Ending {
                    reason,
                    message,
                    is_early: false,
                };
            }
            PathEnd::StepTooSmall { .. } => {
                // The steps may have ended where there is no model any more; difference quotients reach a little further.
                if let [.., before, last] = points {
                    let onwards = (last.lambda - before.lambda).signum();
                    let beyond = [1.0, 1e3, 1e6].map(|k| k * self.settings.min_step);
                    let lost = |step: &f64| {
                        let there = last.lambda + onwards * step.min(BORDER);
                        problem.system_at(there).err()
                    };
                    if let Some(error) = beyond.iter().find_map(lost) {
                        (reason, message) = ("no_model", error.to_string());
                    }
                }
            }
            _ => {}
        }
        Ending::early(reason, report::early_message(self.swept, &message, points))
    }

    /// The attractors along the range.
    fn integrate(&mut self) {
        let (settings, swept) = (self.settings, self.swept);
        let mut recorder = MeasureRecorder::new(swept, 1);
        let number = self.delivered.len();
        let orbits = &mut self.orbits;
        let mut keep = |index: usize, system: &System, orbit: &_| {
            orbits.add((number, index), system, orbit);
        };
        let (delivered, warnings) = integration::follow(settings, swept, &mut recorder, &mut keep);
        self.warnings.extend(warnings);
        self.warn(&delivered, PathEnd::MaxPoints, &recorder.pulling);
        self.delivered.push(delivered);
    }

    /// What was computed in another way than for most systems.
    fn explain(&mut self, method: Method, exchanges: usize) {
        let dof = self.swept.setting.assembly.system.dof();
        if self.settings.stability && self.swept.spectrum() == Spectrum::Leading {
            let which = match method {
                Method::Galerkin => format!(
                    "of the {} multipliers those of largest modulus are computed, by Arnoldi's method, down to the inside of \
                     the unit circle; ",
                    2 * dof
                ),
                _ => String::new(),
            };
            self.warnings.push(format!(
                "{dof} coordinates: {which}the averaged estimates (multiplier_estimates) are left out"
            ));
        }
        if exchanges > 0 {
            self.warnings.push(format!(
                "{exchanges} linear systems were solved by dense elimination with row exchanges across all coordinates: \
                 elimination by blocks lost too many digits"
            ));
        }
    }

    fn warn(&mut self, delivered: &Delivered, end: PathEnd, pulling: &[bool]) {
        let (swept, list) = (self.swept, &mut self.warnings);
        let connections = &swept.setting.assembly.connections;
        for (name, _) in connections.iter().zip(pulling).filter(|(_, pulls)| **pulls) {
            list.push(format!(
                "{name}: the contact pulls somewhere on the branch (1 + beta v < 0): impact damping is beyond its range"
            ));
        }
        for event in delivered.events.iter().filter(|e| !e.is_located()) {
            let (low, high) = event.bracket;
            list.push(format!(
                "a {} between {} and {} could not be located",
                event.kind.word(),
                swept.place(low),
                swept.place(high),
            ));
        }
        // Side branches live on a part of the range.
        if end != PathEnd::RangeReached || delivered.origin.is_some() {
            return;
        }
        for (mark, written) in swept.marks.iter().zip(&self.settings.marks) {
            let is_solved = |p: &branch::BranchPoint| {
                p.is_mark && (p.lambda - mark).abs() <= 1e-12 * mark.abs()
            };
            if !delivered.points.iter().any(is_solved) {
                list.push(format!("the mark {} could not be solved", written.text));
            }
        }
    }
}

/// Weight of the unknowns in the arclength: a change of the deformations by their own size counts like a change of the
/// parameter by 1 (the frequency by omega_c, any other by its range).
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
