//! The first periodic solution of a branch.

use super::continuation::{
    Advance, Continuation, ContinuationOptions, Crossings, PathEnd, Started,
};
use super::equilibrium::{NoEquilibrium, equilibrium};
use super::family::{ExcitationFamily, Family, FrequencyFamily};
use super::galerkin::{Galerkin, GalerkinOptions};
use super::integrate::{Dopri5, Dopri5Options, IntegrationEnd, Integrator};
use super::newton::{Newton, NewtonOptions};
use super::residual::{Linearisation, Residual};
use super::uninterrupted;
use crate::element::{Element, Linear, PiecewiseLinear};
use crate::error::SolveError;
use crate::numeric::factors::Factors;
use crate::numeric::fourier::Fourier;
use crate::system::System;
use nalgebra::DVector;
use std::f64::consts::TAU;

/// First guess of the search for the first solution.
#[derive(
    Debug,
    Clone,
    Copy,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum StartMode {
    /// Linear response in the contact state of the static equilibrium; if that fails, homotopy in the alternating
    /// load, then integration.
    #[default]
    Auto,
    /// Linear response with every connection in contact.
    FullContact,
    /// Response with every connection open.
    Open,
    /// The static equilibrium.
    Rest,
}

/// A first solution, or the failed attempts.
#[derive(Debug, Clone)]
pub enum Start {
    /// Unknowns of the Galerkin residual, and how they were found.
    Found {
        /// Unknowns.
        u: DVector<f64>,
        /// `linear response`, `homotopy in the alternating load`, `integration`.
        how: &'static str,
    },
    /// Every attempt failed; one sentence each.
    Failed(Vec<String>),
}

/// Steps allowed in one period of the last road; more indicate faulty numbers.
const MAX_STEPS: usize = 50_000;

/// The first road of [`find`].
pub const LINEAR: &str = "linear response";

/// Transient periods integrated before an orbit is read, and periods more for as long as it has not settled.
const TRANSIENT_PERIODS: usize = 200;

/// Finds a solution of the Galerkin residual of `system` at an excitation frequency.
///
/// # Errors
/// Options that do not fit the system.
pub fn find(
    system: &System,
    frequency: f64,
    size: GalerkinOptions,
    mode: StartMode,
    newton: NewtonOptions,
) -> Result<Start, SolveError> {
    let mut system = system.clone();
    system.set_reference_frequency(frequency);
    let mut problem = Galerkin::new(FrequencyFamily::new(system.clone()), frequency, size)?;
    let mut solver = Newton::new(&problem.structure(), newton);
    let c = problem.coefficients();
    let rest = equilibrium(&system);
    let mut failures = Vec::new();
    let mut mean = DVector::zeros(problem.dim());
    match &rest {
        Ok(rest) => rest
            .q
            .iter()
            .enumerate()
            .for_each(|(i, q)| mean[i * c] = *q),
        Err(NoEquilibrium::NotCarried { .. }) => {
            failures.push("no static equilibrium: nothing carries the mean load".to_string())
        }
        Err(NoEquilibrium::NotFound) => {
            failures.push("no static equilibrium under the mean load was found".to_string());
        }
    }
    let guess = match mode {
        StartMode::Auto => linear_response(&mut problem, &mean, frequency)?,
        StartMode::Rest => mean.clone(),
        StartMode::FullContact => {
            alternating(&system, Box::new(Linear {}), &mean, frequency, size)?
        }
        StartMode::Open => {
            let open = PiecewiseLinear {
                breakpoints: Vec::new(),
                slopes: vec![0.0],
            };
            alternating(&system, Box::new(open), &mean, frequency, size)?
        }
    };
    let mut u = guess;
    let outcome = solver.solve(&mut problem, &mut u, frequency)?;
    if outcome.is_converged() {
        return Ok(Start::Found { u, how: LINEAR });
    }
    failures.push(format!(
        "Newton's iteration from the linear response: {}",
        outcome.status
    ));
    if mode != StartMode::Auto {
        return Ok(Start::Failed(failures));
    }
    match homotopy(&system, &mean, size, newton)? {
        Ok(u) => {
            return Ok(Start::Found {
                u,
                how: "homotopy in the alternating load",
            });
        }
        Err(reason) => failures.push(format!("homotopy in the alternating load: {reason}")),
    }
    let integrated = integrate(&system, &mean, c, size);
    uninterrupted()?;
    match integrated {
        Ok(mut u) => {
            let outcome = solver.solve(&mut problem, &mut u, frequency)?;
            if outcome.is_converged() {
                return Ok(Start::Found {
                    u,
                    how: "integration",
                });
            }
            failures.push(format!(
                "Newton's iteration from {TRANSIENT_PERIODS} integrated periods: {}",
                outcome.status
            ));
        }
        Err(reason) => failures.push(format!("integration: {reason}")),
    }
    Ok(Start::Failed(failures))
}

/// One Newton step from a constant state: the linear response in its contact state.
fn linear_response<F: Family>(
    problem: &mut Galerkin<F>,
    mean: &DVector<f64>,
    frequency: f64,
) -> Result<DVector<f64>, SolveError> {
    let mut work = Linearisation::of(problem);
    problem.linearise(mean, frequency, &mut work)?;
    // A mean row without stiffness (an open mesh) is held by a weak spring.
    let weak = 1e-6 * work.dr_du.amax();
    for i in (0..problem.dim()).step_by(problem.coefficients()) {
        work.dr_du[(i, i)] += weak;
    }
    let mut factors = Factors::new(&problem.structure());
    let mut step = work.r.clone();
    if factors.factorise(&work.dr_du) && factors.solve(&work.dr_du, &mut step) {
        return Ok(mean - step);
    }
    Ok(mean.clone())
}

/// Alternating response of the system with every law replaced, on the true mean.
fn alternating(
    system: &System,
    law: Box<dyn Element>,
    mean: &DVector<f64>,
    frequency: f64,
    size: GalerkinOptions,
) -> Result<DVector<f64>, SolveError> {
    let mut problem = Galerkin::new(
        FrequencyFamily::new(system.with_laws(law.as_ref())),
        frequency,
        size,
    )?;
    let mut u = linear_response(&mut problem, &DVector::zeros(mean.len()), frequency)?;
    for i in (0..u.len()).step_by(problem.coefficients()) {
        u[i] = mean[i];
    }
    Ok(u)
}

/// Follows the solution from the static equilibrium while the alternating part grows from 0 to 1.
fn homotopy(
    system: &System,
    mean: &DVector<f64>,
    size: GalerkinOptions,
    newton: NewtonOptions,
) -> Result<Result<DVector<f64>, String>, SolveError> {
    let mut problem = Galerkin::new(ExcitationFamily::new(system.clone()), 0.0, size)?;
    let options = ContinuationOptions {
        range: (0.0, 1.0),
        step: 0.05,
        min_step: 1e-5,
        max_step: 0.2,
        max_points: 500,
        weight: 1.0 / mean.norm_squared().max(1e-6),
        newton,
        crossings: Crossings::Expected,
    };
    let mut path = match Continuation::start(&mut problem, mean.clone(), options)? {
        Started::Path(path) => path,
        Started::Failed(outcome) => return Ok(Err(format!("at rest: {}", outcome.status))),
    };
    loop {
        if let Advance::End(end) = path.advance(&mut problem)? {
            let point = path.point();
            return Ok(match end {
                PathEnd::RangeReached if point.lambda == 1.0 => Ok(point.u.clone()),
                other => Err(format!(
                    "{} at {:.3} of the load",
                    other.message(),
                    point.lambda
                )),
            });
        }
    }
}

/// Fourier coefficients of the motion after the transient.
fn integrate(
    system: &System,
    mean: &DVector<f64>,
    c: usize,
    size: GalerkinOptions,
) -> Result<DVector<f64>, String> {
    let n = system.dof();
    let mut integrator = Dopri5::new(
        system,
        Dopri5Options {
            relative: 1e-8,
            absolute: 1e-10,
            max_steps: MAX_STEPS,
            ..Default::default()
        },
    );
    let mut state = vec![0.0; 2 * n];
    (0..n).for_each(|i| state[i] = mean[i * c]);
    let mut advance = |tau: (f64, f64), state: &mut [f64]| match integrator.advance(
        system,
        tau,
        state,
        &mut (),
    ) {
        IntegrationEnd::Reached => Ok(()),
        end => Err(end.message().to_string()),
    };
    for _ in 0..TRANSIENT_PERIODS {
        advance((0.0, TAU), &mut state)?;
    }
    let mut samples = vec![vec![0.0; size.samples]; n];
    let width = TAU / size.samples as f64;
    for j in 0..size.samples {
        samples.iter_mut().zip(&state).for_each(|(s, q)| s[j] = *q);
        advance((j as f64 * width, (j + 1) as f64 * width), &mut state)?;
    }
    let mut u = DVector::zeros(n * c);
    let mut fourier = Fourier::new(size.samples);
    for (block, samples) in u.as_mut_slice().chunks_exact_mut(c).zip(&samples) {
        fourier.to_coefficients(samples, block);
    }
    Ok(u)
}
