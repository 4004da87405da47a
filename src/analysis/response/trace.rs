//! Method by method from a first solution along the parameter.

use super::accuracy::{self, Accuracies};
use super::crossings::{self, Apart, Crossings};
use super::delivered::{Delivered, Ending};
use super::guarded::Guarded;
use super::integration;
use super::orbits::OrbitTable;
use super::report;
use super::source::BranchSource;
use super::starts::{self, StartSearch};
use super::verify::Verification;
use super::{BranchSettings, Method, Swept};
use crate::analysis::branch_table::MeasureRecorder;
use crate::analysis::flow;
use crate::error::{Error, SolveError};
use crate::report::{Report, Table};
use crate::solve::branch::{self, TraceOptions};
use crate::solve::continuation::PathEnd;
use crate::solve::equilibrium::equilibrium;
use crate::solve::family::Family;
use crate::solve::galerkin::Galerkin;
use crate::solve::galerkin::adaptive::{Adaptive, Sizes};
use crate::solve::residual::PeriodicResidual;
use crate::solve::shooting::Shooting;
use crate::solve::start::{self, Start};
use crate::system::{Mount, System};
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
    let (settings, sampled_for) = settings.resolved(swept);
    let settings = &settings;
    let mut work = Work::new(settings, swept);
    match work.trace_all() {
        // Earlier results are kept.
        Err(Error::Solve(SolveError::Interrupted)) => work.note_interruption(),
        traced => traced?,
    }
    let Work {
        delivered,
        orbits,
        verification,
        accuracies,
        warnings,
        searches,
        ..
    } = work;
    let orbits = settings.orbits.are_kept().then_some(orbits);
    let verification = verification.has_message().then_some(&verification);
    let accuracies = accuracy::is_asked_for(settings).then_some((settings, &accuracies));
    let mut report = report::assemble(swept, &delivered, orbits, verification, accuracies);
    if let Some(verification) = verification.filter(|_| settings.lists_points()) {
        report.tables.push(verification.table(swept));
    }
    if settings.has_side_branches() {
        report.tables.push(report::branches(&delivered));
    }
    if settings.starts.is_some() {
        starts::report(&searches, swept, &mut report);
    }
    report.warnings = warnings;
    let insufficient = accuracies.and_then(|(_, a)| a.complaint(settings, swept));
    report.warnings.extend(insufficient);
    if settings.has_galerkin() {
        let value = json!({ "used": settings.quadrature, "sampled_because": sampled_for });
        report.summary.insert("quadrature".into(), value);
    }
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
    let accuracies = Accuracies::default();
    let accuracies = accuracy::is_asked_for(settings).then_some((settings, &accuracies));
    let mut tables = report::assemble(swept, &delivered, orbits, None, accuracies).tables;
    if settings.lists_points() {
        tables.push(Verification::new().table(swept));
    }
    if settings.has_side_branches() {
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
    pub verification: Verification,
    accuracies: Accuracies,
    pub warnings: Vec<String>,
    /// Deformation of every connection beyond which a branch is unbounded.
    pub(super) bounds: Vec<f64>,
    /// Results of random starts.
    pub searches: Vec<StartSearch>,
    /// Of the branches of the present method.
    pub crossings: Crossings,
    /// Directions in which branches have left the present crossing.
    pub arms: Vec<DVector<f64>>,
}

/// The first periodic solution, as the Galerkin method sees it.
struct FirstSolution<'a> {
    galerkin: Galerkin<Box<dyn Family + 'a>>,
    found: Start,
}

impl<'a> Work<'a> {
    /// Nothing yet.
    pub fn new(settings: &'a BranchSettings, swept: &'a Swept<'a>) -> Work<'a> {
        Work {
            settings,
            swept,
            delivered: Vec::new(),
            orbits: OrbitTable::new(swept.setting),
            verification: Verification::new(),
            accuracies: Accuracies::default(),
            warnings: Vec::new(),
            bounds: Vec::new(),
            searches: Vec::new(),
            crossings: Crossings::default(),
            arms: Vec::new(),
        }
    }

    /// Method by method.
    pub(super) fn trace_all(&mut self) -> Result<(), Error> {
        let mut first = None;
        for method in self.settings.methods() {
            if method == Method::Integration {
                self.integrate();
                continue;
            }
            let number = self.delivered.len();
            match self.settings.start.saved() {
                Some(point) => self.follow_saved(method, point)?,
                None => self.follow_primary(method, &mut first)?,
            }
            self.follow_crossings(method, number)?;
            self.follow_starts(method, number)?;
            self.crossings = Crossings::default();
        }
        Ok(())
    }

    /// The branch from the beginning of the range, and what goes on behind its ends.
    fn follow_primary(
        &mut self,
        method: Method,
        first: &mut Option<FirstSolution<'a>>,
    ) -> Result<(), Error> {
        let delivered = match first {
            _ if self.starts_by_flow(method) => self.settled(method)?,
            Some(first) => self.primary(method, first)?,
            None => {
                let found = first.insert(self.first()?);
                self.primary(method, found)?
            }
        };
        self.delivered.push(delivered);
        self.follow_behind_breaks(method)?;
        self.follow_behind_poles(method)
    }

    /// Looks for the first solution at the beginning of the range.
    fn first(&mut self) -> Result<FirstSolution<'a>, Error> {
        let (settings, from) = (self.settings, self.swept.range.0);
        let galerkin = Galerkin::new(self.swept.family()?, from, settings.size())?;
        let mut galerkin = settings.with_quadrature(galerkin, from)?;
        let system = galerkin.system_at(from)?;
        let found = start::find(
            system,
            system.reference_frequency(),
            settings.size(),
            settings.start.guess(),
            settings.newton(),
        )?;
        self.bounds = sizes(system);
        if let Start::Found { u, how } = &found {
            if *how != start::LINEAR {
                self.warnings
                    .push(format!("the first solution was found by {how}"));
            }
            let orbit = galerkin.fourier_orbit(u, from)?;
            let system = galerkin.system_at(from)?;
            for (e, size) in self.bounds.iter_mut().enumerate() {
                let series = orbit.deformation(system, e).series();
                *size = size.max(series.iter().map(|a| a.abs()).sum());
            }
        }
        for size in &mut self.bounds {
            *size = settings.bound * size.max(1.0);
        }
        Ok(FirstSolution { galerkin, found })
    }

    /// The branch from the first solution.
    fn primary(
        &mut self,
        method: Method,
        first: &mut FirstSolution<'_>,
    ) -> Result<Delivered, Error> {
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
            u = DVector::zeros(first.galerkin.system_at(from)?.state_size());
            orbit.state(0.0, u.as_mut_slice());
        }
        self.follow(BranchSource::Guess(u), &mut delivered)?;
        Ok(delivered)
    }

    /// Follows one branch of periodic solutions and verifies it on request. An interruption leaves the points that
    /// it has.
    pub(super) fn follow(
        &mut self,
        source: BranchSource,
        delivered: &mut Delivered,
    ) -> Result<(), Error> {
        match self.follow_whole(source, delivered) {
            Err(Error::Solve(SolveError::Interrupted)) if !delivered.points.is_empty() => Ok(()),
            followed => followed,
        }
    }

    fn follow_whole(
        &mut self,
        source: BranchSource,
        delivered: &mut Delivered,
    ) -> Result<(), Error> {
        if delivered.method == Method::Galerkin {
            return self.follow_series(source, delivered);
        }
        let (settings, swept) = (self.settings, self.swept);
        let family = swept.family_for(delivered.subharmonic)?;
        let from = swept.range.0;
        let mut shooting = Shooting::new(family, from, settings.flow())?;
        delivered.note_integrator(shooting.integrator());
        self.trace(&mut shooting, source, delivered)?;
        // Along some parameters the law stops being piecewise affine.
        delivered.note_integrator(shooting.integrator());
        let labour = flow::labour(shooting.integrator(), shooting.strain(), swept.setting);
        self.warnings.extend(labour);
        Ok(())
    }

    /// Follows a branch with the Galerkin method and estimates the errors of its points on request.
    fn follow_series(
        &mut self,
        source: BranchSource,
        delivered: &mut Delivered,
    ) -> Result<(), Error> {
        let (settings, swept) = (self.settings, self.swept);
        let (from, nu) = (swept.range.0, delivered.subharmonic);
        let options = |harmonics| settings.size_with(harmonics, nu);
        let make = |size| {
            let galerkin = Galerkin::new(swept.family_for(nu)?, from, size)?;
            settings.with_quadrature(galerkin, from)
        };
        let sizes = Sizes {
            options: &options,
            problem: &make,
        };
        let first = self
            .harmonics(&source)
            .unwrap_or(settings.harmonics.first());
        let newton = settings.newton();
        let doublings = match settings.resolution() {
            None => {
                self.trace(&mut make(options(first))?, source, delivered)?;
                0
            }
            Some(mut resolution) => {
                // No larger than the memory holds: what is missing then is reported as any missing accuracy.
                while resolution.most > resolution.least.max(first)
                    && !settings.fits(swept.setting, resolution.most * nu / settings.subharmonic)
                {
                    resolution.most /= 2;
                }
                resolution.most = resolution.most.max(resolution.least).max(first);
                let mut galerkin = Adaptive::new(sizes, resolution, newton, (first, nu))?;
                self.trace(&mut galerkin, source, delivered)?;
                galerkin.finest()
            }
        };
        if accuracy::is_asked_for(settings) {
            let (given, number) = ((settings, swept), self.delivered.len());
            let judged = (&*delivered, &self.verification);
            self.accuracies
                .add(given, sizes, (number, doublings), judged)?;
        }
        Ok(())
    }

    /// Harmonics of the excitation frequency of the orbit at which a branch begins.
    fn harmonics(&self, source: &BranchSource) -> Option<usize> {
        let BranchSource::Crossing {
            point, subharmonic, ..
        } = source
        else {
            return None;
        };
        Some(self.swept.harmonics(point.u.len(), *subharmonic))
    }

    /// Follows one branch.
    fn trace(
        &mut self,
        problem: &mut dyn PeriodicResidual,
        source: BranchSource,
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
            resolution: swept.resolution(settings.stability_resolution),
            known: settings.branches.limits().map(|_| self.crossings.places()),
            bounds: self.bounds.clone(),
        };
        let samples = settings.size_for(delivered.subharmonic).samples;
        let mut recorder = MeasureRecorder::new(swept, samples);
        let begin = source.begin(problem);
        let arms = match delivered.origin {
            Some(_) => self.arms.as_slice(),
            None => &[],
        };
        let mut apart = Apart::new(&mut recorder, arms);
        let traced = branch::trace(problem, begin, &options, &mut apart)?;
        delivered.is_twin = apart.is_twin;
        if delivered.is_twin {
            return Ok(());
        }
        self.arms.extend(apart.arm);
        let mut branch = match traced {
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
        if delivered.method == Method::Galerkin {
            let begins_at_crossing = delivered.origin.is_some();
            self.confirm(problem, (&mut branch, begins_at_crossing), &mut recorder)?;
        }
        let side = crossings::ending(branch.end).filter(|_| delivered.is_side());
        delivered.end = side.unwrap_or_else(|| self.ending(problem, &branch));
        (delivered.points, delivered.events) = (branch.points, branch.events);
        delivered.refuted = branch.refuted;
        self.warn(delivered, branch.end, &recorder.pulling);
        self.explain(delivered.method, branch.exchanges);
        let number = self.delivered.len();
        if settings.branches.limits().is_some() {
            let met = self.crossings.add(problem, number, delivered, branch.end)?;
            if let Some(met) = met {
                delivered.end.message = format!("the branch returned to branch {met}");
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

    /// The attractors along the range.
    fn integrate(&mut self) {
        let (settings, swept) = (self.settings, self.swept);
        for values in integration::sweeps(settings, swept) {
            let mut recorder = MeasureRecorder::new(swept, 1);
            let number = self.delivered.len();
            let orbits = &mut self.orbits;
            let mut keep = |index: usize, system: &System, orbit: &_| {
                orbits.add((number, index), system, orbit);
            };
            let sweep = (settings, values);
            let (delivered, warnings) = integration::follow(sweep, swept, &mut recorder, &mut keep);
            self.warnings.extend(warnings);
            self.warn(&delivered, PathEnd::MaxPoints, &recorder.pulling);
            self.delivered.push(delivered);
        }
    }
}

/// Weight of the unknowns in the arclength: a change of the deformations by their own size counts like a change of the
/// parameter by 1 (the frequency by omega_c, any other by its range).
pub(super) fn weight(system: &System) -> f64 {
    let size = sizes(system).into_iter().fold(0.0, f64::max);
    let size = if size > 0.0 { size } else { 1.0 };
    1.0 / (system.dof() as f64 * size * size)
}

/// Size of every deformation: its largest breakpoint or its value at rest.
pub(super) fn sizes(system: &System) -> Vec<f64> {
    let rest = equilibrium(system).ok();
    let mounts = system.mounts().iter().enumerate();
    let size = |(e, mount): (usize, &Mount)| {
        let breakpoints = mount.element.breakpoints();
        let breakpoint = breakpoints.iter().fold(0.0_f64, |b, x| b.max(x.abs()));
        let at_rest = rest.as_ref().map_or(0.0, |r| r.deformation[e].abs());
        breakpoint.max(at_rest)
    };
    mounts.map(size).collect()
}
