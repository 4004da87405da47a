//! Loads on the harmonics of tau: order k of the excitation enters harmonic nu k.

use crate::solve::residual::Linearisation;
use crate::system::{LoadKind, System};
use nalgebra::DVector;

/// Projection of the loads whose amplitudes do not depend on the speed: values, and what grows with the frequency.
pub(super) fn coefficients(system: &System, c: usize, values: &mut [f64], rates: &mut [f64]) {
    values.fill(0.0);
    rates.fill(0.0);
    let mut series = vec![0.0; c];
    let nu = system.subharmonic();
    for load in system.loads() {
        let target = match load.kind {
            LoadKind::Value | LoadKind::Timed(_) => {
                load.series.coefficients(nu, &mut series);
                &mut *values
            }
            LoadKind::Rate => {
                load.series.derivative_coefficients(nu, &mut series);
                &mut *rates
            }
            LoadKind::Orders { .. } | LoadKind::Acceleration => continue,
        };
        add(target, c, &load.direction, (1.0, &series));
    }
}

/// Takes the loads whose amplitudes depend on the speed off the residual, with dR/domega.
///
/// ```text
/// R -= direction g(revolutions omega) series,    dR/domega -= direction revolutions g' series
/// R -= direction omega^2 d(series)/dphase,       dR/domega -= direction 2 omega d(series)/dphase
/// ```
pub(super) fn add_growing(system: &System, c: usize, series: &mut [f64], out: &mut Linearisation) {
    let (speed, omega) = (system.reference_frequency(), system.excitation_frequency());
    let nu = system.subharmonic();
    for load in system.loads() {
        let (factor, slope) = match &load.kind {
            LoadKind::Orders { growth, .. } => {
                load.series.coefficients(nu, series);
                let slope = growth.slope(speed) * system.revolutions() as f64;
                (growth.factor(speed), slope)
            }
            LoadKind::Acceleration => {
                load.series.derivative_coefficients(nu, series);
                (omega * omega, 2.0 * omega)
            }
            _ => continue,
        };
        add(out.r.as_mut_slice(), c, &load.direction, (-factor, series));
        let target = out.dr_dlambda.as_mut_slice();
        add(target, c, &load.direction, (-slope, series));
    }
}

/// Adds a multiple of a series along a direction.
fn add(target: &mut [f64], c: usize, direction: &DVector<f64>, (factor, series): (f64, &[f64])) {
    for (block, direction) in target.chunks_exact_mut(c).zip(direction.iter()) {
        let pairs = block.iter_mut().zip(series);
        pairs.for_each(|(d, s)| *d += factor * direction * s);
    }
}
