//! The search for solutions that no branch has reached yet, at one value of the parameter.
//!
//! Every random state is a guess for a fixed point of the flow without integration, which also finds unstable orbits, and after some
//! periods, which finds what attracts. Solutions are told apart by the exact flow, so that truncation makes no two of one.

use super::delivered::Delivered;
use super::starts::{StartSearch, Starts};
use super::{BranchSettings, Method, Swept};
use crate::analysis::flow;
use crate::error::{Error, SolveError};
use crate::numeric::fourier::Fourier;
use crate::solve::attractor::{Lengths, MapSize, Stroboscopic, poincare, scatter};
use crate::solve::family::Family;
use crate::solve::galerkin::Galerkin;
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::orbit::{FourierOrbit, Orbit};
use crate::solve::place::Place;
use crate::solve::residual::{PeriodicResidual, Residual};
use crate::solve::shooting::Shooting;
use crate::system::System;
use nalgebra::DVector;
use std::f64::consts::TAU;

/// Periods of the excitation after which a motion is a guess: at once and early, when it may still pass by an unstable orbit, and
/// when it has come to what attracts it.
const GUESSES: [usize; 6] = [0, 1, 2, 4, 8, 40];
/// Iterations of the corrector from a guess; random states are far from anything.
const ITERATIONS: usize = 50;
/// Smallest share of its step.
const DAMPING: f64 = 1.0 / 1024.0;
/// Orbits of the flow that differ by less, relative to their size, are one: the corrector leaves 1e-12.
const SAME_ORBIT: f64 = 1e-6;

/// Trial steps of the integrator in one period of a transient, at most: whatever needs more runs away.
const LONGEST: usize = 200_000;
/// Periods of integration that one guess is worth, variations included.
const PATIENCE: usize = 300;
/// Trial steps that a period is worth at least.
const FEWEST: usize = 200;

/// A solution that a start led to.
pub(super) struct FoundSolution {
    /// Description of the start.
    pub origin: String,
    state: DVector<f64>,
    place: Place,
}

/// Looks for solutions at one value.
pub(super) struct Hunt<'a> {
    settings: &'a BranchSettings,
    swept: &'a Swept<'a>,
    lambda: f64,
    shooting: Shooting<Box<dyn Family + 'a>>,
    newton: Newton,
    /// Trial steps of the integrator that one guess is worth.
    allowance: usize,
    /// Solutions on branches, and how many of the branches were looked at.
    known: Vec<Place>,
    seen: usize,
}

impl<'a> Hunt<'a> {
    pub(super) fn new(
        (settings, swept): (&'a BranchSettings, &'a Swept<'a>),
        lambda: f64,
        first: usize,
    ) -> Result<Hunt<'a>, SolveError> {
        let family = swept.family_for(settings.subharmonic)?;
        let shooting = Shooting::new(family, lambda, settings.flow())?;
        let newton = NewtonOptions {
            max_iterations: ITERATIONS,
            min_damping: DAMPING,
            ..settings.shooting_newton()
        };
        Ok(Hunt {
            newton: Newton::new(&shooting.structure(), newton),
            allowance: usize::MAX,
            settings,
            swept,
            lambda,
            shooting,
            known: Vec::new(),
            seen: first,
        })
    }

    /// The different solutions that the states of one value lead to.
    pub(super) fn search(
        &mut self,
        starts: &Starts,
        (method, value): (Method, usize),
    ) -> Result<(StartSearch, Vec<FoundSolution>), Error> {
        let mut search = StartSearch::new(method, self.lambda);
        let (mut found, mut shorter) = (Vec::<FoundSolution>::new(), Vec::<Place>::new());
        let place = self.swept.place(self.lambda);
        for start in 0..starts.count {
            if self.swept.setting.control.is_interrupted() {
                break;
            }
            let state = self.random_state(starts, value * starts.count + start)?;
            let guesses = self.guesses(state)?;
            for (guess, periods) in guesses.into_iter().zip(GUESSES) {
                search.guesses += 1;
                let Some((state, orbit)) = self.refined(guess)? else {
                    continue;
                };
                search.converged += 1;
                let is_known = |place: &Place| place.gap(&orbit) < SAME_ORBIT;
                if found.iter().any(|f| is_known(&f.place)) || shorter.iter().any(is_known) {
                    continue;
                }
                if orbit.period(SAME_ORBIT) < orbit.subharmonic() {
                    shorter.push(orbit);
                    continue;
                }
                let origin = format!("start {} at {place}", start + 1);
                let origin = match periods {
                    0 => origin,
                    1 => format!("{origin}, after 1 period"),
                    _ => format!("{origin}, after {periods} periods"),
                };
                found.push(FoundSolution {
                    origin,
                    state,
                    place: orbit,
                });
            }
        }
        (search.solutions, search.shorter) = (found.len(), shorter.len());
        Ok((search, found))
    }

    /// A random state around the static equilibrium.
    fn random_state(&self, starts: &Starts, stream: usize) -> Result<Vec<f64>, Error> {
        let (mut state, _) = flow::rest(&self.system()?);
        let widths = vec![starts.reach; state.len()];
        scatter(starts.seed, stream, &widths, &mut state);
        Ok(state)
    }

    /// The system at the value.
    pub(super) fn system(&self) -> Result<System, SolveError> {
        let no_system = |reason| SolveError::NoSystem { reason };
        self.swept.system(self.lambda).map_err(no_system)
    }

    /// The solution near a state.
    pub(super) fn near(
        &mut self,
        state: DVector<f64>,
    ) -> Result<Option<FoundSolution>, SolveError> {
        let refined = self.refined(state)?;
        Ok(refined.map(|(state, place)| FoundSolution {
            origin: String::new(),
            state,
            place,
        }))
    }

    /// Different orbits that the state of a solution at another value of the parameter leads to, first what attracts it.
    pub(super) fn behind(
        &mut self,
        method: Method,
        unknowns: &DVector<f64>,
    ) -> Result<Vec<FoundSolution>, Error> {
        let state = self.state(method, unknowns)?;
        let mut guesses = self.guesses(state.as_slice().to_vec())?;
        guesses.reverse();
        let mut list = Vec::<FoundSolution>::new();
        for guess in guesses {
            let Some((state, place)) = self.refined(guess)? else {
                continue;
            };
            if list.iter().all(|f| f.place.gap(&place) >= SAME_ORBIT) {
                list.push(FoundSolution {
                    origin: String::new(),
                    state,
                    place,
                });
            }
        }
        Ok(list)
    }

    /// A state, and where it is after some periods, as far as it gets.
    fn guesses(&mut self, mut state: Vec<f64>) -> Result<Vec<DVector<f64>>, Error> {
        let setting = self.swept.setting;
        let system = self.system()?;
        let mut guesses = vec![DVector::from_column_slice(&state)];
        let Ok(mut integrator) = flow::integrator(setting, &system, self.settings.flow()) else {
            return Ok(guesses);
        };
        integrator.allow(LONGEST);
        let size = MapSize {
            transient: 0,
            periods: GUESSES[GUESSES.len() - 1],
            exponents: Lengths::Ignored,
        };
        let mut keep_going = |_: usize| !setting.control.is_interrupted();
        let mut map = Stroboscopic {
            system: &system,
            integrator: integrator.as_mut(),
        };
        let record = poincare(&mut map, &mut state, size, &mut keep_going);
        self.allowance = match integrator.effort() {
            0 => usize::MAX,
            steps => PATIENCE * self.settings.subharmonic * steps.max(FEWEST),
        };
        let after = |periods: &usize| record.points.chunks_exact(state.len()).nth(periods - 1);
        let later = GUESSES[1..].iter().filter_map(after);
        guesses.extend(later.map(DVector::from_column_slice));
        Ok(guesses)
    }

    /// The orbit of the flow near a state at phase 0.
    fn refined(
        &mut self,
        guess: DVector<f64>,
    ) -> Result<Option<(DVector<f64>, Place)>, SolveError> {
        let (mut u, lambda) = (guess, self.lambda);
        self.shooting.allow(self.allowance);
        let outcome = self.newton.solve(&mut self.shooting, &mut u, lambda)?;
        self.shooting.allow(usize::MAX);
        if !outcome.is_converged() {
            return Ok(None);
        }
        let place = Place::of(&mut self.shooting, &u, lambda)?;
        Ok(Some((u, place)))
    }

    /// State at phase 0 of a solution of a method.
    fn state(&mut self, method: Method, u: &DVector<f64>) -> Result<DVector<f64>, SolveError> {
        if method == Method::Shooting {
            return Ok(u.clone());
        }
        let system = self.shooting.system_at(self.lambda)?;
        let length = u.len() / system.dof();
        let orbit = FourierOrbit {
            coefficients: u
                .as_slice()
                .chunks_exact(length)
                .map(<[f64]>::to_vec)
                .collect(),
            omega: system.omega(),
            subharmonic: system.subharmonic(),
        };
        let mut state = DVector::zeros(system.state_size());
        orbit.state(0.0, state.as_mut_slice());
        Ok(state)
    }

    /// Whether a solution lies on one of the branches; all of them have a point at this value wherever they pass it.
    pub(super) fn is_known(
        &mut self,
        delivered: &[Delivered],
        found: &FoundSolution,
    ) -> Result<bool, SolveError> {
        let fresh = &delivered[self.seen..];
        self.seen = delivered.len();
        let nu = self.settings.subharmonic;
        for branch in fresh.iter().filter(|d| d.subharmonic == nu) {
            let lambda = self.lambda;
            for point in branch.points.iter().filter(|p| p.lambda == lambda) {
                let state = self.state(branch.method, &point.unknowns)?;
                let refined = self.refined(state)?;
                self.known.extend(refined.map(|(_, place)| place));
            }
        }
        let mut places = self.known.iter();
        Ok(places.any(|place| place.gap(&found.place) < SAME_ORBIT))
    }

    /// The solution in the unknowns of a method; `None` where its corrector leads elsewhere.
    pub(super) fn unknowns(
        &mut self,
        method: Method,
        found: &FoundSolution,
    ) -> Result<Option<DVector<f64>>, Error> {
        if method == Method::Shooting {
            return Ok(Some(found.state.clone()));
        }
        let (settings, lambda) = (self.settings, self.lambda);
        let size = settings.size_with(settings.harmonics.first(), settings.subharmonic);
        let family = self.swept.family_for(settings.subharmonic)?;
        let galerkin = Galerkin::new(family, lambda, size)?;
        let mut galerkin = settings.with_quadrature(galerkin, lambda)?;
        let orbit = self.shooting.orbit(&found.state, lambda)?;
        let mut u = series(
            &orbit,
            galerkin.dim(),
            galerkin.coefficients(),
            size.samples,
        );
        let mut newton = Newton::new(&galerkin.structure(), settings.newton());
        if !newton.solve(&mut galerkin, &mut u, lambda)?.is_converged() {
            return Ok(None);
        }
        let state = self.state(method, &u)?;
        let refined = self.refined(state)?;
        let is_same = refined.is_some_and(|(_, place)| place.gap(&found.place) < SAME_ORBIT);
        Ok(is_same.then_some(u))
    }
}

/// Fourier coefficients of an orbit, coordinate by coordinate.
fn series(orbit: &Orbit, dim: usize, coefficients: usize, samples: usize) -> DVector<f64> {
    let n = dim / coefficients;
    let mut state = vec![0.0; 2 * n];
    let mut values = vec![vec![0.0; samples]; n];
    for j in 0..samples {
        orbit.state(TAU * j as f64 / samples as f64, &mut state);
        values.iter_mut().zip(&state).for_each(|(v, q)| v[j] = *q);
    }
    let (mut u, mut fourier) = (DVector::zeros(dim), Fourier::new(samples));
    let blocks = u.as_mut_slice().chunks_exact_mut(coefficients);
    for (block, values) in blocks.zip(&values) {
        fourier.to_coefficients(values, block);
    }
    u
}
