//! Square nonlinear systems with one parameter, and those among them whose zeros are periodic orbits.

use super::floquet::SteadyExponents;
use super::orbit::Orbit;
use crate::error::SolveError;
use crate::numeric::jacobian::{Jacobian, JacobianStructure};
use crate::system::System;
use nalgebra::DVector;
use num_complex::Complex;

/// A residual with its derivatives; the buffers are reused.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// R(u, lambda).
    pub r: DVector<f64>,
    /// dR/du.
    pub dr_du: Jacobian,
    /// dR/dlambda.
    pub dr_dlambda: DVector<f64>,
    /// Size of the terms that cancel in R: the reference for a small residual.
    pub magnitude: f64,
    /// Whether dR/dlambda is wanted; elsewhere it may hold anything.
    pub has_parameter: bool,
}

impl Linearisation {
    /// Buffers for a problem.
    pub fn of(problem: &(impl Residual + ?Sized)) -> Linearisation {
        Linearisation::new(&problem.structure())
    }

    /// Buffers for a Jacobian of this shape.
    pub fn new(structure: &JacobianStructure) -> Linearisation {
        let dim = structure.dim();
        Linearisation {
            r: DVector::zeros(dim),
            dr_du: Jacobian::new(structure),
            dr_dlambda: DVector::zeros(dim),
            magnitude: 1.0,
            has_parameter: true,
        }
    }

    /// Largest residual over the magnitude; NaN as soon as one of them is.
    pub fn norm(&self) -> f64 {
        // `amax` passes over NaN as long as some other row has a number, such as the arclength equation.
        let larger = |m: f64, x: &f64| {
            if x.is_nan() || x.abs() > m {
                x.abs()
            } else {
                m
            }
        };
        // At rest without any load every term vanishes.
        self.r.iter().fold(0.0, larger) / self.magnitude.max(f64::MIN_POSITIVE)
    }
}

/// A square nonlinear system with one parameter. `&mut self`: the implementor owns its workspace.
pub trait Residual {
    /// Number of unknowns and equations.
    fn dim(&self) -> usize;

    /// Shape of the Jacobian.
    fn structure(&self) -> JacobianStructure {
        JacobianStructure::Dense(self.dim())
    }

    /// R and its derivatives at (u, lambda); writes every entry of `out` that is wanted. Allocates only when `out` has another shape.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn linearise(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError>;

    /// Unknowns, or a change of them, of any size that the problem has had, in the present one.
    fn in_present_size(&self, u: &DVector<f64>) -> DVector<f64> {
        u.clone()
    }
}

/// The size of a problem that may change it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Size {
    /// Harmonics of the excitation frequency.
    pub harmonics: usize,
    /// Number of times the samples are doubled.
    pub doublings: u32,
}

/// Resolution required for a solution; `size` is the better resolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// It is adequate, or there is no better one.
    Suits,
    /// A smaller one suffices.
    Wastes {
        /// The smaller one.
        size: Size,
    },
    /// The error is close to the limit.
    Strains {
        /// The larger one.
        size: Size,
    },
    /// The error is too large.
    Fails {
        /// The larger one.
        size: Size,
    },
}

/// Requested data of one solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// The motion.
    Motion,
    /// The motion and its multipliers.
    Stability,
}

/// Data of one solution.
#[derive(Debug, Clone)]
pub struct Survey {
    /// The orbit.
    pub orbit: Orbit,
    /// Extrema (tau, deformation) in the order of time, the first one repeated a period later; one list per connection, empty
    /// for a law without breakpoints or memory and where nothing moves.
    pub extrema: Vec<Vec<(f64, f64)>>,
    /// Breakpoints of every law at this parameter.
    pub breakpoints: Vec<Vec<f64>>,
    /// Floquet multipliers over one response period, or one of its equal parts where the problem is restricted to them, by decreasing
    /// modulus; empty if not requested or not available.
    pub multipliers: Vec<Complex<f64>>,
    /// All characteristic exponents of an orbit along which the variational equation has constant coefficients, as far as the
    /// method knows.
    pub exponents: Option<SteadyExponents>,
    /// Number of further multipliers that are 1 by construction: memories that do not change on this orbit. The list has a 0 for
    /// each, so that its length does not change where a slider begins to slip.
    pub neutral: usize,
    /// Connection of every slider, and by how much the span of what it follows exceeds what it can hold without slipping.
    pub slips: Vec<(usize, f64)>,
}

/// Every slider of a system with its excess, from the extrema of deformations; none where nothing moves.
pub fn slips(system: &System, extrema: &[Vec<(f64, f64)>]) -> Vec<(usize, f64)> {
    let mut list = Vec::new();
    for (connection, (mount, extrema)) in system.mounts().iter().zip(extrema).enumerate() {
        let values = extrema.iter().map(|(_, x)| *x);
        // NaN where nothing moves.
        let low = values.clone().fold(f64::NAN, f64::min);
        let high = values.fold(f64::NAN, f64::max);
        let own = mount.element.slip_excess(low, high);
        list.extend(own.into_iter().map(|excess| (connection, excess)));
    }
    list
}

/// A residual whose zeros are periodic orbits, with the data for stability and post-processing.
pub trait PeriodicResidual: Residual {
    /// The system at a parameter.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn system_at(&mut self, lambda: f64) -> Result<&System, SolveError>;

    /// The orbit of a solution.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn orbit(&mut self, u: &DVector<f64>, lambda: f64) -> Result<Orbit, SolveError>;

    /// The orbit of a solution with its extrema and its multipliers.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn survey(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
        extent: Extent,
    ) -> Result<Survey, SolveError>;

    /// What sampling of the forces leaves in the residual at a solution; `None` where nothing is sampled.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn aliasing(
        &mut self,
        _u: &DVector<f64>,
        _lambda: f64,
    ) -> Result<Option<DVector<f64>>, SolveError> {
        Ok(None)
    }

    /// Present size; zeros if there is only one size.
    fn size(&self) -> Size {
        Size::default()
    }

    /// Changes the size; solutions are converted by [`Residual::in_present_size`].
    ///
    /// # Errors
    /// The problem cannot be made in this size.
    fn resize(&mut self, _size: Size) -> Result<(), SolveError> {
        Ok(())
    }

    /// Resolution required for a solution, compared with the present size.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn fit(&mut self, _u: &DVector<f64>, _lambda: f64) -> Result<Fit, SolveError> {
        Ok(Fit::Suits)
    }

    /// Most equal parts of the response period in which both everything that excites and this orbit repeat themselves.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn equal_parts(&mut self, _u: &DVector<f64>, _lambda: f64) -> Result<usize, SolveError> {
        Ok(1)
    }

    /// Restricts the problem to orbits that repeat themselves in a number of equal parts of the response period, and returns the number
    /// so far. Multipliers are those of one part: at -1, where orbits of two parts branch off, the problem stays regular.
    fn restrict(&mut self, _parts: usize) -> usize {
        1
    }

    /// Unknowns of an orbit that repeats itself after half the period, from those (or a change of those) in the problem with
    /// half the subharmonic index and as many samples per excitation period.
    fn in_doubled_period(&self, half: &DVector<f64>) -> DVector<f64>;

    /// Floquet multipliers over one response period, by decreasing modulus.
    ///
    /// # Errors
    /// The system cannot be made at this parameter.
    fn multipliers(
        &mut self,
        u: &DVector<f64>,
        lambda: f64,
    ) -> Result<Vec<Complex<f64>>, SolveError> {
        Ok(self.survey(u, lambda, Extent::Stability)?.multipliers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_row_hides_behind_another() {
        for r in [
            [f64::NAN, 0.5, 1.0],
            [0.5, f64::NAN, 1.0],
            [0.5, 1.0, f64::NAN],
        ] {
            let mut work = Linearisation::new(&JacobianStructure::Dense(3));
            work.r.copy_from_slice(&r);
            assert!(work.norm().is_nan(), "{r:?}");
        }
        let mut work = Linearisation::new(&JacobianStructure::Dense(3));
        work.r.copy_from_slice(&[0.5, -2.0, 1.0]);
        work.magnitude = 4.0;
        assert_eq!(work.norm(), 0.5);
    }
}
