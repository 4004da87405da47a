//! Sliders in the Galerkin method: their automata followed around the period, against orbits of an independent program.

use crate::common::{floats, reference};
use crate::memory_flow::{state, system};
use gearlash::numeric::fourier::Fourier;
use gearlash::postprocess::measures::Meter;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::IntegratorChoice;
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{Extent, Linearisation, PeriodicResidual, Residual};
use gearlash::solve::shooting::Shooting;
use nalgebra::DVector;
use serde_json::Value;
use std::f64::consts::TAU;

/// Samples of an orbit of which its Fourier coefficients are made.
const SAMPLES: usize = 1024;

fn slides(record: &Value) -> bool {
    !floats(&record["energy"]).is_empty() && floats(&record["energy"]).iter().any(|e| *e > 0.0)
}

/// The Galerkin residual of a record, and the series of its orbit.
fn problem(record: &Value, harmonics: usize) -> (Galerkin<FrequencyFamily>, DVector<f64>, f64) {
    let system = system(record);
    let omega = record["parameters"]["omega"].as_f64().unwrap();
    let n = system.dof();
    let family = || FrequencyFamily::new(system.clone());
    let mut shooting = Shooting::new(family(), omega, IntegratorChoice::Auto).unwrap();
    let start = state(record);
    let orbit = shooting
        .orbit(&DVector::from_vec(start.clone()), omega)
        .unwrap();
    let at_sample = |j: usize| {
        let mut at = vec![0.0; start.len()];
        orbit.state(TAU * j as f64 / SAMPLES as f64, &mut at);
        at
    };
    let states: Vec<Vec<f64>> = (0..SAMPLES).map(at_sample).collect();
    let coordinate = |i: usize| states.iter().map(|at| at[i]).collect();
    let samples: Vec<Vec<f64>> = (0..n).map(coordinate).collect();
    let size = GalerkinOptions {
        harmonics,
        samples: SAMPLES,
    };
    let galerkin = Galerkin::new(family(), omega, size).unwrap();
    let galerkin = galerkin.with_exact_quadrature(omega).unwrap();
    let mut u = DVector::zeros(galerkin.dim());
    let mut fourier = Fourier::new(SAMPLES);
    let c = galerkin.coefficients();
    for (block, samples) in u.as_mut_slice().chunks_exact_mut(c).zip(&samples) {
        fourier.to_coefficients(samples, block);
    }
    (galerkin, u, omega)
}

#[test]
fn forty_harmonics_give_the_r_m_s_of_orbits_with_sliders() {
    let data = reference("memory");
    let mut count = 0;
    for record in data["orbits"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|r| slides(r))
    {
        let name = record["name"].as_str().unwrap();
        let (mut galerkin, mut u, omega) = problem(record, 40);
        let mut newton = Newton::new(&galerkin.structure(), NewtonOptions::default());
        let outcome = newton.solve(&mut galerkin, &mut u, omega).unwrap();
        assert!(
            outcome.is_converged() && outcome.iterations <= 8,
            "{name}: {outcome:?}"
        );
        let survey = galerkin.survey(&u, omega, Extent::Stability).unwrap();
        let system = galerkin.system_at(omega).unwrap();
        let measures = Meter::new(SAMPLES).measure(system, &survey.orbit);
        let wanted = floats(&record["rms"]);
        let base = measures[0].rms;
        assert!(
            (base / wanted[0] - 1.0).abs() < 1e-5,
            "{name}: {base} {wanted:?}"
        );
        // Energies in units of their sliders' stiffness, from the truncated series.
        let losses: f64 = measures.iter().map(|m| m.loss).filter(|l| *l > 1e-4).sum();
        assert!(losses > 0.0, "{name}");
        let largest = &record["multipliers"][0];
        let wanted = largest[0]
            .as_f64()
            .unwrap()
            .hypot(largest[1].as_f64().unwrap());
        let never = floats(&record["energy"]).contains(&0.0);
        if !never {
            let found = survey.multipliers[0].norm();
            assert!((found - wanted).abs() < 2e-3, "{name}: {found} {wanted}");
            assert_eq!(survey.neutral, 0, "{name}");
        }
        count += 1;
    }
    assert!(count > 12, "{count}");
}

/// Where a memory is set it changes with the motion: the Jacobian knows.
#[test]
fn the_jacobian_with_sliders_is_the_derivative() {
    let data = reference("memory");
    for record in data["orbits"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|r| slides(r))
        .step_by(3)
    {
        let (mut galerkin, u, omega) = problem(record, 8);
        let (mut here, mut there) = (Linearisation::of(&galerkin), Linearisation::of(&galerkin));
        galerkin.linearise(&u, omega, &mut here).unwrap();
        let jacobian = here.dr_du.to_dense();
        for k in 0..u.len() {
            let h = 1e-6;
            let mut shifted = u.clone();
            shifted[k] += h;
            galerkin.linearise(&shifted, omega, &mut there).unwrap();
            let mut change = there.r.clone();
            shifted[k] -= 2.0 * h;
            galerkin.linearise(&shifted, omega, &mut there).unwrap();
            change -= &there.r;
            let gap = (change / (2.0 * h) - jacobian.column(k)).amax();
            // Instants move like roots of quadratics near extrema: second derivatives of some 1e1 times h.
            assert!(gap < 1e-4, "{} {k}: {gap:e}", record["name"]);
        }
    }
}
