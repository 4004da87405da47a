//! Damped Newton iteration, the only one in the crate.

use super::residual::{Linearisation, Residual};
use super::uninterrupted;
use crate::error::SolveError;
use crate::numeric::factors::Factors;
use crate::numeric::jacobian::JacobianStructure;
use nalgebra::DVector;

/// Settings of the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOptions {
    /// Largest residual allowed, relative to the size of the terms that cancel in it.
    pub tolerance: f64,
    /// Where rounding keeps the residual above: largest Newton step, relative to the unknowns.
    pub step_tolerance: f64,
    /// Limit of iterations.
    pub max_iterations: usize,
    /// Smallest fraction of a step that is tried.
    pub min_damping: f64,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        NewtonOptions {
            tolerance: 1e-10,
            step_tolerance: 1e-10,
            max_iterations: 20,
            min_damping: 1.0 / 64.0,
        }
    }
}

/// End of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NewtonStatus {
    /// The residual is below the tolerance; or Newton steps are below their own tolerance and it hardly falls: the residual is
    /// rounding then.
    Converged,
    /// Too many iterations.
    MaxIterations,
    /// No fraction of the step reduces the residual: a kink or a local minimum.
    Stalled,
    /// The Jacobian cannot be factorised.
    SingularJacobian,
    /// The residual is not finite.
    NotFinite,
}

impl std::fmt::Display for NewtonStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            NewtonStatus::Converged => "converged",
            NewtonStatus::MaxIterations => "no convergence within the allowed iterations",
            NewtonStatus::Stalled => "no step reduces the residual",
            NewtonStatus::SingularJacobian => "the Jacobian is singular",
            NewtonStatus::NotFinite => "the residual is not finite",
        })
    }
}

/// Result of an iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonOutcome {
    /// End of the iteration.
    pub status: NewtonStatus,
    /// Linear systems solved.
    pub iterations: usize,
    /// Last residual relative to the size of its terms.
    pub residual_norm: f64,
}

impl NewtonOutcome {
    /// Outcome for an uncorrected guess.
    pub(super) fn unsolved() -> NewtonOutcome {
        NewtonOutcome {
            status: NewtonStatus::Stalled,
            iterations: 0,
            residual_norm: f64::NAN,
        }
    }

    /// Whether the solution is as good as the tolerance asks or rounding allows.
    pub fn is_converged(&self) -> bool {
        self.status == NewtonStatus::Converged
    }
}

/// Steps below their tolerance after which an iteration has converged: the residual falls by chance then.
pub(super) const SETTLED: usize = 2;

/// Damped Newton iteration; owns its buffers.
#[derive(Debug)]
pub struct Newton {
    options: NewtonOptions,
    work: Linearisation,
    factors: Factors,
    step: DVector<f64>,
    base: DVector<f64>,
}

impl Newton {
    /// Buffers for problems with Jacobians of this shape.
    pub fn new(structure: &JacobianStructure, options: NewtonOptions) -> Newton {
        let zero = DVector::zeros(structure.dim());
        Newton {
            options,
            work: Linearisation {
                has_parameter: false,
                ..Linearisation::new(structure)
            },
            factors: Factors::new(structure),
            step: zero.clone(),
            base: zero,
        }
    }

    /// Improves `u` until R(u, lambda) = 0. Steps are halved until the residual falls: piecewise-linear residuals are only
    /// semismooth, and a full step may cycle between two pieces.
    ///
    /// # Errors
    /// Errors of the problem; failure to converge is a status.
    pub fn solve(
        &mut self,
        problem: &mut dyn Residual,
        u: &mut DVector<f64>,
        lambda: f64,
    ) -> Result<NewtonOutcome, SolveError> {
        problem.linearise(u, lambda, &mut self.work)?;
        let mut norm = self.work.norm();
        let mut settled = 0;
        for iterations in 0..self.options.max_iterations {
            uninterrupted()?;
            let status = match () {
                _ if !norm.is_finite() => NewtonStatus::NotFinite,
                _ if norm <= self.options.tolerance => NewtonStatus::Converged,
                _ if settled == SETTLED => NewtonStatus::Converged,
                _ if !self.find_step() => NewtonStatus::SingularJacobian,
                _ => match self.damped_step(problem, u, lambda, norm)? {
                    Some(smaller) => {
                        settled += usize::from(self.is_at_rounding(u));
                        norm = smaller;
                        continue;
                    }
                    None if self.is_at_rounding(u) => NewtonStatus::Converged,
                    None => NewtonStatus::Stalled,
                },
            };
            // A factorisation that was interrupted looks like a singular matrix.
            uninterrupted()?;
            return Ok(NewtonOutcome {
                status,
                iterations,
                residual_norm: norm,
            });
        }
        let converged = norm <= self.options.tolerance;
        let status = if converged {
            NewtonStatus::Converged
        } else {
            NewtonStatus::MaxIterations
        };
        Ok(NewtonOutcome {
            status,
            iterations: self.options.max_iterations,
            residual_norm: norm,
        })
    }

    /// Linearises at a point, without improving it.
    ///
    /// # Errors
    /// Errors of the problem.
    pub fn visit(
        &mut self,
        problem: &mut dyn Residual,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<(), SolveError> {
        problem.linearise(u, lambda, &mut self.work)
    }

    /// The Newton step at the last point visited; false where the Jacobian is singular.
    fn find_step(&mut self) -> bool {
        self.step.copy_from(&self.work.r);
        self.factors.factorise(&self.work.dr_du)
            && self.factors.solve(&self.work.dr_du, &mut self.step)
    }

    /// Whether the whole Newton step would change `u` by less than the tolerance of steps, relative to its largest part. A residual
    /// that no such step makes smaller is the rounding of the problem.
    fn is_at_rounding(&self, u: &DVector<f64>) -> bool {
        self.step.amax() <= self.options.step_tolerance * u.amax()
    }

    /// Moves `u` by a share of the Newton step that reduces the residual, and returns the new norm.
    fn damped_step(
        &mut self,
        problem: &mut dyn Residual,
        u: &mut DVector<f64>,
        lambda: f64,
        norm: f64,
    ) -> Result<Option<f64>, SolveError> {
        self.base.copy_from(u);
        // At rounding the residual falls by chance: only the whole step is worth a trial.
        let smallest = match self.is_at_rounding(u) {
            true => 1.0,
            false => self.options.min_damping,
        };
        let mut share = 1.0;
        while share >= smallest {
            u.copy_from(&self.base);
            u.axpy(-share, &self.step, 1.0);
            problem.linearise(u, lambda, &mut self.work)?;
            let trial = self.work.norm();
            if trial < (1.0 - 0.1 * share) * norm || trial <= self.options.tolerance {
                return Ok(Some(trial));
            }
            share *= 0.5;
        }
        u.copy_from(&self.base);
        Ok(None)
    }

    /// The linearisation at the last point visited.
    pub fn linearisation(&self) -> &Linearisation {
        &self.work
    }

    /// Solves with the Jacobian of the last point visited; `rhs` becomes the solution. Returns the sign of the determinant,
    /// 0 when the Jacobian is singular.
    pub(crate) fn solve_linear(&mut self, rhs: &mut DVector<f64>) -> i8 {
        let jacobian = &self.work.dr_du;
        if !(self.factors.factorise(jacobian) && self.factors.solve(jacobian, rhs)) {
            return 0;
        }
        self.factors.determinant_sign()
    }

    /// Linear systems that needed row exchanges across all coordinates, elimination by blocks having failed.
    pub fn exchanges(&self) -> usize {
        self.factors.exchanges()
    }
}
