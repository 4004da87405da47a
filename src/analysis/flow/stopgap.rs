//! DOPRI5 over short pieces behind the contract of the integrators, without switches.

use super::IntegratorChoice;
use crate::analysis::{Fault, Setting};
use crate::solve::integrate::{
    Dopri5, Dopri5Options, IntegrationEnd, Integrator, Observer, Segment,
};
use crate::system::{Scratch, System};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// Pieces of a response period.
const PIECES: f64 = 512.0;

pub(super) fn choose(
    setting: &Setting<'_>,
    system: &System,
    choice: IntegratorChoice,
) -> Result<Box<dyn Integrator + Send>, Fault> {
    let strict = choice == IntegratorChoice::Exact;
    let refused = (system.mounts().iter()).position(|m| !m.element.is_piecewise_affine());
    if let Some(k) = refused.filter(|_| strict) {
        let name = &setting.assembly.connections[k];
        let message = format!(
            "{name}: the law is not piecewise affine, which the exact flow needs; take `auto` or `dopri5`"
        );
        return Err(Fault::new("integrator", message));
    }
    let n = system.dof();
    Ok(Box::new(Stopgap {
        inner: Dopri5::new(system, Dopri5Options::default()),
        scratch: system.scratch(),
        partials: [DMatrix::zeros(n, n), DMatrix::zeros(n, n)],
    }))
}

struct Stopgap {
    inner: Dopri5,
    scratch: Scratch,
    partials: [DMatrix<f64>; 2],
}

impl Stopgap {
    fn rate(&mut self, system: &System, tau: f64, state: &[f64]) -> Vec<f64> {
        let n = system.dof();
        let mut out = vec![0.0; n];
        system.acceleration(tau, state, &mut self.scratch, &mut out);
        out
    }

    /// dPhi/dT at a state.
    fn slope(
        &mut self,
        system: &System,
        tau: f64,
        state: &[f64],
        phi: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let n = system.dof();
        self.rate(system, tau, state);
        let [dq, dv] = &mut self.partials;
        system.acceleration_partials(&self.scratch, dq, dv);
        let lower = &*dq * phi.rows(0, n) + &*dv * phi.rows(n, n);
        let mut out = DMatrix::zeros(2 * n, phi.ncols());
        out.rows_mut(0, n).copy_from(&phi.rows(n, n));
        out.rows_mut(n, n).copy_from(&lower);
        out
    }

    fn run(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        mut phi: Option<&mut DMatrix<f64>>,
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        let (n, om) = (system.dof(), system.omega());
        let count = ((tau.1 - tau.0) / TAU * PIECES).ceil().max(1.0);
        let width = (tau.1 - tau.0) / count;
        for k in 0..count as usize {
            let begin = tau.0 + width * k as f64;
            let before = state.to_vec();
            let middle = begin + 0.5 * width;
            let mut half = state.to_vec();
            for (t0, t1) in [(begin, middle), (middle, begin + width)] {
                let end = self.inner.advance(system, (t0, t1), state);
                if end != IntegrationEnd::Reached {
                    return end;
                }
                if t1 == middle {
                    half.copy_from_slice(state);
                }
            }
            let h = width / om;
            if let Some(phi) = phi.as_deref_mut() {
                let k1 = self.slope(system, begin, &before, phi);
                let k2 = self.slope(system, middle, &half, &(&*phi + &k1 * (0.5 * h)));
                let k3 = self.slope(system, middle, &half, &(&*phi + &k2 * (0.5 * h)));
                let k4 = self.slope(system, begin + width, state, &(&*phi + &k3 * h));
                *phi += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
            }
            let (a, b) = (
                self.rate(system, begin, &before),
                self.rate(system, begin + width, state),
            );
            let mut coefficients = Vec::with_capacity(6 * n);
            for i in 0..n {
                let d = state[i] - before[i] - h * before[n + i] - 0.5 * h * h * a[i];
                let e = h * (state[n + i] - before[n + i]) - h * h * a[i];
                let f = h * h * (b[i] - a[i]);
                coefficients.extend([before[i], h * before[n + i], 0.5 * h * h * a[i]]);
                coefficients.extend([
                    10.0 * d - 4.0 * e + 0.5 * f,
                    -15.0 * d + 7.0 * e - f,
                    6.0 * d - 3.0 * e + 0.5 * f,
                ]);
            }
            observer.segment(&Segment {
                tau: begin,
                width,
                coefficients: &coefficients,
                count: 6,
            });
        }
        IntegrationEnd::Reached
    }
}

impl Integrator for Stopgap {
    fn name(&self) -> &'static str {
        "dopri5"
    }

    fn advance(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        self.run(system, tau, state, None, observer)
    }

    fn advance_with_variation(
        &mut self,
        system: &System,
        tau: (f64, f64),
        state: &mut [f64],
        phi: &mut DMatrix<f64>,
        observer: &mut dyn Observer,
    ) -> IntegrationEnd {
        self.run(system, tau, state, Some(phi), observer)
    }
}
