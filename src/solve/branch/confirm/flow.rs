//! The flow's own branch beside a point of another method's branch: fixed points of the Poincaré map in planes
//!
//! ```text
//! P(u, lambda) = u,    <t, x - x_0> = s,    x = (u, lambda)
//! ```
//!
//! in the metric of the arclength, `<a, b> = weight a_u . b_u + a_lambda b_lambda`.

use super::distance;
use crate::error::SolveError;
use crate::numeric::jacobian::JacobianStructure;
use crate::solve::events::is_outside;
use crate::solve::family::Family;
use crate::solve::floquet;
use crate::solve::integrate::{FlowObserver, Switch};
use crate::solve::newton::{Newton, NewtonOptions};
use crate::solve::orbit::Orbit;
use crate::solve::residual::{Linearisation, PeriodicResidual, Residual};
use crate::solve::shooting::{Image, Shooting};
use crate::system::System;
use nalgebra::DVector;
use num_complex::Complex;

/// Iterations of the corrector: the start is the state of a nearby orbit.
const ITERATIONS: usize = 12;
/// Smallest share of its step.
const DAMPING: f64 = 1.0 / 16.0;
/// Residual of orbits between which an event is sought: what it leaves of a multiplier is far below the width of a located event.
const ROUGH: f64 = 1e-10;

/// Distance of a multiplier from the circle at which it counts as neither inside nor outside: what the flow leaves of one that
/// stands on it.
const UNDECIDED: f64 = 1e-7;

/// Accuracy of an orbit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Care {
    /// To the tolerance of the corrector.
    Fine,
    /// As well as multipliers and extrema need.
    Rough,
}

/// A periodic orbit of the flow.
#[derive(Debug, Clone)]
pub(super) struct FlowPoint {
    /// State at phase 0, then the parameter.
    pub x: DVector<f64>,
    /// Floquet multipliers by falling modulus.
    pub multipliers: Vec<Complex<f64>>,
    /// Passages of breakpoints per response period, by connection.
    pub switches: Vec<usize>,
    /// Iterations of the corrector.
    pub iterations: usize,
    /// Distance of the eigenvalues of the map from 1: the corrector is singular at 0. NaN where it is not known.
    pub from_singular: f64,
}

impl FlowPoint {
    /// The parameter.
    pub fn lambda(&self) -> f64 {
        self.x[self.x.len() - 1]
    }

    /// State at phase 0.
    pub fn state(&self) -> DVector<f64> {
        self.x.rows(0, self.x.len() - 1).into_owned()
    }

    /// Multipliers outside the unit circle.
    pub fn unstable(&self) -> usize {
        let outside = |mu: &&Complex<f64>| is_outside(**mu);
        self.multipliers.iter().filter(outside).count()
    }

    /// Whether every multiplier is inside or outside the unit circle, beyond the rounding of the flow.
    pub(crate) fn is_decided(&self) -> bool {
        distance(&self.multipliers) > UNDECIDED
    }
}

/// Planes across a direction.
#[derive(Debug, Clone)]
pub(super) struct ConfirmingPlane {
    /// x_0.
    pub base: DVector<f64>,
    /// t, of unit length.
    pub tangent: DVector<f64>,
    /// dP/dlambda at x_0; it only steers the corrector.
    slope: DVector<f64>,
}

/// Fixed points of the Poincaré map, and what is known of them.
pub(super) struct ConfirmingFlow<'a, F: Family> {
    pub shooting: &'a mut Shooting<F>,
    fine: Newton,
    rough: Newton,
    weight: f64,
    passed: Passed,
    /// Response periods taken so far.
    pub periods: f64,
    /// Passages of breakpoints in them.
    pub passages: f64,
}

impl<'a, F: Family> ConfirmingFlow<'a, F> {
    /// Buffers; `newton`: tolerances of the corrector.
    pub fn new(
        shooting: &'a mut Shooting<F>,
        weight: f64,
        newton: NewtonOptions,
    ) -> ConfirmingFlow<'a, F> {
        let options = NewtonOptions {
            max_iterations: ITERATIONS,
            min_damping: DAMPING,
            ..newton
        };
        let rough = NewtonOptions {
            tolerance: options.tolerance.max(ROUGH),
            ..options
        };
        let structure = JacobianStructure::Dense(shooting.dim() + 1);
        ConfirmingFlow {
            fine: Newton::new(&structure, options),
            rough: Newton::new(&structure, rough),
            shooting,
            weight,
            passed: Passed::default(),
            periods: 0.0,
            passages: 0.0,
        }
    }

    /// The inner product of the arclength.
    pub fn dot(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        dot(self.weight, a, b)
    }

    /// Distance in the metric of the arclength.
    pub fn distance(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        let gap = a - b;
        self.dot(&gap, &gap).sqrt()
    }

    /// The plane of a parameter value.
    pub fn level(&self, base: DVector<f64>) -> ConfirmingPlane {
        let n = base.len() - 1;
        let mut tangent = DVector::zeros(n + 1);
        tangent[n] = 1.0;
        ConfirmingPlane {
            base,
            tangent,
            slope: DVector::zeros(n),
        }
    }

    /// Planes across a direction; `None` where it has no length or there is no flow.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn across(
        &mut self,
        base: DVector<f64>,
        direction: DVector<f64>,
    ) -> Result<Option<ConfirmingPlane>, SolveError> {
        let n = base.len() - 1;
        let length = self.dot(&direction, &direction).sqrt();
        let mut slope = DVector::zeros(n);
        let state = &base.as_slice()[..n];
        match self.shooting.slope(state, base[n], &mut slope) {
            Err(SolveError::NoSystem { .. }) => return Ok(None),
            other => other?,
        }
        let is_defined = length > 0.0 && slope.iter().all(|x| x.is_finite());
        Ok(is_defined.then(|| ConfirmingPlane {
            tangent: direction / length,
            base,
            slope,
        }))
    }

    /// The orbit of the flow in a plane, from a guess; `None` when the corrector fails.
    ///
    /// # Errors
    /// Errors of the flow.
    pub fn at(
        &mut self,
        plane: &ConfirmingPlane,
        s: f64,
        guess: DVector<f64>,
        care: Care,
    ) -> Result<Option<FlowPoint>, SolveError> {
        let mut x = guess;
        let lambda = x[x.len() - 1];
        let mut section = ConfirmingSection {
            shooting: self.shooting,
            passed: &mut self.passed,
            weight: self.weight,
            plane,
            s,
        };
        let newton = match care {
            Care::Fine => &mut self.fine,
            Care::Rough => &mut self.rough,
        };
        let outcome = newton.solve(&mut section, &mut x, lambda)?;
        let images = (outcome.iterations + 1) as f64;
        let periods = images / self.shooting.parts() as f64;
        self.periods += periods;
        self.passages += images * self.passed.0.iter().sum::<usize>() as f64;
        if !outcome.is_converged() {
            return Ok(None);
        }
        let parts = self.shooting.parts();
        let own = self.shooting.multipliers_of_image();
        let gaps = own.iter().map(|mu| (mu - 1.0).norm());
        let from_singular = gaps.fold(f64::INFINITY, f64::min);
        Ok((!own.is_empty()).then(|| FlowPoint {
            x,
            from_singular,
            multipliers: floquet::whole(own, parts),
            switches: self.passed.0.iter().map(|count| parts * count).collect(),
            iterations: outcome.iterations,
        }))
    }

    /// The system at a parameter.
    ///
    /// # Errors
    /// The system cannot be made there.
    pub fn system_at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        self.shooting.system_at(lambda)
    }

    /// Extrema (tau, deformation) of one connection, the first one repeated a period later.
    ///
    /// # Errors
    /// The system cannot be made there.
    pub fn extrema(
        &mut self,
        point: &FlowPoint,
        connection: usize,
    ) -> Result<Vec<(f64, f64)>, SolveError> {
        let orbit = self.shooting.orbit(&point.state(), point.lambda())?;
        let system = self.shooting.system_at(point.lambda())?;
        Ok(match orbit {
            Orbit::Segments(orbit) => orbit.extrema_of(system, connection),
            Orbit::Fourier(orbit) => orbit.deformation(system, connection).extrema(),
        })
    }
}

/// The inner product of the arclength.
pub(super) fn dot(weight: f64, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
    let n = a.len() - 1;
    weight * a.rows(0, n).dot(&b.rows(0, n)) + a[n] * b[n]
}

/// Counts passages of breakpoints.
#[derive(Debug, Default)]
struct Passed(Vec<usize>);

impl FlowObserver for Passed {
    fn wants_segments(&self) -> bool {
        false
    }

    fn switch(&mut self, switch: &Switch) {
        if self.0.len() <= switch.connection {
            self.0.resize(switch.connection + 1, 0);
        }
        self.0[switch.connection] += 1;
    }
}

/// Fixed points in one plane; the unknowns are the state and the parameter.
struct ConfirmingSection<'a, F: Family> {
    shooting: &'a mut Shooting<F>,
    passed: &'a mut Passed,
    weight: f64,
    plane: &'a ConfirmingPlane,
    s: f64,
}

impl<F: Family> Residual for ConfirmingSection<'_, F> {
    fn dim(&self) -> usize {
        self.plane.base.len()
    }

    fn linearise(
        &mut self,
        x: &DVector<f64>,
        _lambda: f64,
        out: &mut Linearisation,
    ) -> Result<(), SolveError> {
        let n = x.len() - 1;
        let (state, lambda) = (&x.as_slice()[..n], x[n]);
        self.passed.0.fill(0);
        let image = match self.shooting.image(state, lambda, self.passed) {
            // There is no system, or no flow to the end of the period: nothing solves here.
            Err(SolveError::NoSystem { .. }) | Ok(None) => {
                out.r.fill(f64::NAN);
                return Ok(());
            }
            Err(error) => return Err(error),
            Ok(Some(image)) => image,
        };
        let Image { state: end, phi } = image;
        let ConfirmingPlane {
            base,
            tangent,
            slope,
        } = self.plane;
        out.magnitude = end.iter().chain(state).fold(0.0, |m, x| x.abs().max(m));
        let mut jacobian = out.dr_du.block_mut(n + 1, (0, 0));
        for c in 0..n {
            let column = jacobian.column(c);
            column[..n].copy_from_slice(phi.column(c).as_slice());
            column[c] -= 1.0;
            column[n] = self.weight * tangent[c];
        }
        let column = jacobian.column(n);
        column[..n].copy_from_slice(slope.as_slice());
        column[n] = tangent[n];
        for (k, x) in end.iter().enumerate() {
            out.r[k] = x - state[k];
        }
        out.r[n] = dot(self.weight, tangent, &(x - base)) - self.s;
        Ok(())
    }
}
