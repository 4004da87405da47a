//! Static equilibrium under the mean load.

use crate::element::{Element, Response};
use crate::numeric::dense::Lu;
use crate::system::System;
use nalgebra::{DMatrix, DVector};

/// Where the train rests.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Relative coordinates, n values.
    pub q: DVector<f64>,
    /// Deformations W q - mean(e), e values.
    pub deformation: Vec<f64>,
    /// Flank on which each connection rests: -1, 0 (open) or 1.
    pub flank: Vec<i8>,
    /// False when some motion meets no stiffness there: the point is then the middle of the gap.
    pub is_unique: bool,
}

/// Springs to the middle of every gap, relative to the reference stiffness, removed step by step: they pick the middle of
/// the gap where no load decides.
const SOFTENING: [f64; 6] = [1.0, 1e-1, 1e-2, 1e-4, 1e-7, 1e-11];
const MAX_ITERATIONS: usize = 200;
/// Further iterations for every connection: a step may end at each of its kinks.
const KINKS_EACH: usize = 4;
/// Smallest share of a Newton step that is tried: a step may have to end on the narrow ramp of a jump.
const SMALLEST_SHARE: f64 = 1e-9;
/// How far behind a kink a step ends, relative to the displacement there.
const KINK_CROSSING: f64 = 1e-10;
/// Residual relative to the load and to the stiffness of a displacement.
const TOLERANCE: f64 = 1e-9;

/// Nonlinear static equilibrium kappa f(W q - mean(e), 0) = mean load, by a damped Newton iteration on a sequence of
/// softer and softer auxiliary springs. `None` when there is none (a friction law alone cannot carry a load).
///
/// Stiffness variation counts with its mean, 1; laws that depend on the phase are read at phase 0. A force that jumps takes
/// every value in between at its breakpoint: a connection may rest there (to within 1e-5 of the breakpoint).
pub fn equilibrium(system: &System) -> Option<Equilibrium> {
    let mut problem = Statics::new(system);
    let mut q = DVector::zeros(system.dof());
    for auxiliary in SOFTENING {
        q = problem.solve(q, auxiliary)?;
    }
    let exact = problem.solve(q.clone(), 0.0);
    let is_unique = exact.is_some();
    let q = exact.unwrap_or(q);
    problem.evaluate(&q, 0.0);
    if problem.r.amax() > 1e-8 * problem.magnitude {
        return None;
    }
    let deformation = problem.deformation(&q);
    let flank = (system.mounts().iter().zip(&deformation))
        .map(|(m, x)| flank(m.element.as_ref(), *x))
        .collect();
    Some(Equilibrium {
        q,
        deformation,
        flank,
        is_unique,
    })
}

/// Flank at a deformation; on a jump of the force the one that it leads to.
fn flank(element: &dyn Element, x: f64) -> i8 {
    match ramp(element, x) {
        Some((low, high)) if element.flank(low) == 0 => element.flank(high),
        Some((low, _)) => element.flank(low),
        None => element.flank(x),
    }
}

/// Half width of the ramp that stands for a jump, relative to its breakpoint.
const RAMP: f64 = 1e-5;

/// Both ends of the ramp that stands for the jump at a breakpoint.
fn ramp_at(breakpoint: f64) -> (f64, f64) {
    let half = RAMP * breakpoint.abs().max(1e-3);
    (breakpoint - half, breakpoint + half)
}

/// Both ends of the ramp around a breakpoint where the force jumps, if x lies on one.
fn ramp(element: &dyn Element, x: f64) -> Option<(f64, f64)> {
    if !element.is_discontinuous() {
        return None;
    }
    let mut ends = element.breakpoints().into_iter().map(ramp_at);
    ends.find(|(low, high)| x > *low && x < *high)
}

/// Deformations at which the slope of the static response changes.
fn kinks(element: &dyn Element) -> Vec<f64> {
    let breakpoints = element.breakpoints();
    if !element.is_discontinuous() {
        return breakpoints;
    }
    let ends = breakpoints.into_iter().map(ramp_at);
    ends.flat_map(|(low, high)| [low, high]).collect()
}

/// Static response of a law, jumps as ramps.
fn respond(element: &dyn Element, x: f64) -> Response {
    let Some((low, high)) = ramp(element, x) else {
        return element.eval(x, 0.0, 0.0);
    };
    let [begin, end] = [low, high].map(|x| element.eval(x, 0.0, 0.0).f);
    let slope = (end - begin) / (high - low);
    Response {
        f: begin + slope * (x - low),
        df_dq: slope,
        df_dv: 0.0,
    }
}

struct Statics<'a> {
    system: &'a System,
    load: DVector<f64>,
    error: Vec<f64>,
    r: DVector<f64>,
    jacobian: DMatrix<f64>,
    magnitude: f64,
    lu: Lu,
}

impl<'a> Statics<'a> {
    fn new(system: &'a System) -> Self {
        let n = system.dof();
        let mean_error =
            |m: &crate::system::Mount| m.transmission_error.as_ref().map_or(0.0, |e| e.mean());
        Statics {
            system,
            load: system.mean_load(),
            error: system.mounts().iter().map(mean_error).collect(),
            r: DVector::zeros(n),
            jacobian: DMatrix::zeros(n, n),
            magnitude: 1.0,
            lu: Lu::new(n),
        }
    }

    fn deformation(&self, q: &DVector<f64>) -> Vec<f64> {
        let x = self.system.element_map() * q;
        x.iter().zip(&self.error).map(|(x, e)| x - e).collect()
    }

    /// r = kappa (f + auxiliary x) - load with its Jacobian.
    fn evaluate(&mut self, q: &DVector<f64>, auxiliary: f64) {
        let system = self.system;
        self.r.copy_from(&self.load);
        self.r.neg_mut();
        self.jacobian.fill(0.0);
        self.magnitude = self.load.amax();
        let breakpoint = |m: &crate::system::Mount| {
            m.element
                .breakpoints()
                .iter()
                .fold(0.0_f64, |b, x| b.max(x.abs()))
        };
        for (e, (x, mount)) in self
            .deformation(q)
            .into_iter()
            .zip(system.mounts())
            .enumerate()
        {
            let response = respond(mount.element.as_ref(), x);
            let kappa = system.stiffness().column(e);
            self.r.axpy(response.f + auxiliary * x, &kappa, 1.0);
            self.magnitude = self
                .magnitude
                .max(kappa.amax() * x.abs().max(breakpoint(mount)));
            for (j, w) in system
                .element_map()
                .row(e)
                .iter()
                .enumerate()
                .filter(|(_, w)| **w != 0.0)
            {
                self.jacobian
                    .column_mut(j)
                    .axpy(w * (response.df_dq + auxiliary), &kappa, 1.0);
            }
        }
        self.magnitude = self.magnitude.max(f64::MIN_POSITIVE);
    }

    fn solve(&mut self, mut q: DVector<f64>, auxiliary: f64) -> Option<DVector<f64>> {
        self.evaluate(&q, auxiliary);
        for _ in 0..MAX_ITERATIONS + KINKS_EACH * self.system.element_count() {
            let is_small = self.r.amax() <= TOLERANCE * self.magnitude;
            if !self.is_regular() {
                return None;
            }
            let mut step = self.r.clone();
            self.lu.solve(&mut step);
            if is_small && step.amax() <= 1e-12 * (q.amax() + f64::MIN_POSITIVE) {
                return Some(q);
            }
            q = match self.advance(&q, &step, auxiliary) {
                Some(next) => next,
                None => return is_small.then_some(q),
            };
        }
        None
    }

    /// q - share step with a smaller residual; `None` when no share has one.
    ///
    /// Full and halved steps first. Where the residual grows beyond the nearest kink of a law, halving would creep towards that
    /// kink for ever: the step then ends just behind it, and the next one sees the slope there (Katzenelson's method,
    /// Bell Syst. Tech. J. 44 (1965): of piecewise affine equations whose Jacobians have determinants of one sign, as with rising laws,
    /// it finds the solution).
    fn advance(
        &mut self,
        base: &DVector<f64>,
        step: &DVector<f64>,
        auxiliary: f64,
    ) -> Option<DVector<f64>> {
        let norm = self.r.norm();
        let mut kink = self.nearest_kink(base, step);
        let mut share = 1.0;
        while share >= SMALLEST_SHARE {
            let behind = kink.take_if(|kink| share < *kink);
            let q = base - step * behind.unwrap_or(share);
            self.evaluate(&q, auxiliary);
            let allowed = match behind {
                Some(_) => norm * (1.0 + KINK_CROSSING),
                None => norm * (1.0 - 1e-4 * share),
            };
            if self.r.norm() < allowed {
                return Some(q);
            }
            if behind.is_none() {
                share *= 0.5;
            }
        }
        None
    }

    /// Share of a step that ends just behind the first breakpoint that any deformation passes; `None` when it passes none.
    fn nearest_kink(&self, base: &DVector<f64>, step: &DVector<f64>) -> Option<f64> {
        let (from, change) = (self.deformation(base), self.system.element_map() * step);
        let mut nearest: Option<f64> = None;
        for ((x, dx), mount) in from.iter().zip(change.iter()).zip(self.system.mounts()) {
            for b in kinks(mount.element.as_ref()) {
                // x - share dx = b, and a little further: the breakpoint itself may count to either side.
                let beyond = KINK_CROSSING * (b.abs() + x.abs()) / dx.abs();
                let share = (x - b) / dx;
                if share > -beyond && share < 1.0 && beyond.is_finite() {
                    let behind = share.max(0.0) + beyond;
                    nearest = Some(nearest.map_or(behind, |n| n.min(behind)));
                }
            }
        }
        nearest
    }

    /// Factorises the Jacobian; false when some motion meets no stiffness.
    fn is_regular(&mut self) -> bool {
        let scale = self.jacobian.amax();
        scale > 0.0 && self.lu.factorise(&self.jacobian) && self.lu.smallest_pivot() > 1e-13 * scale
    }
}
