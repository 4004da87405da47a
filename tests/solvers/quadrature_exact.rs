//! Forces integrated in closed form between switching instants: against fine sampling, against differences, against reference
//! solutions.

use crate::common;
use crate::common::{backlash, floats, load, reference};
use gearlash::element::{
    Backlash, Cubic, Element, ImpactDampingLaw, Linear, OneSided, PiecewiseLinear, Preloaded, Side,
};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::postprocess::measures::Meter;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{Linearisation, PeriodicResidual, Residual};
use gearlash::solve::start::{self, Start, StartMode};
use gearlash::system::{Mount, System};
use nalgebra::{DMatrix, DVector};
use std::time::{Duration, Instant};

fn fourier(mean: f64, harmonics: &[(usize, f64, f64)]) -> Periodic {
    let one = |&(order, cos, sin): &(usize, f64, f64)| Harmonic { order, cos, sin };
    let harmonics = harmonics.iter().map(one).collect();
    Periodic::Fourier { mean, harmonics }
}

/// A loop: every continuous piecewise-affine law, variations by harmonics and by steps, a transmission error of a higher order
/// than the harmonics kept.
fn everything() -> System {
    let gamma = DMatrix::from_row_slice(2, 2, &[0.2, 0.05, -0.03, 0.3]);
    let kappa = DMatrix::from_row_slice(2, 4, &[2.0, 0.5, 0.3, 0.2, 0.4, 1.5, -0.6, 0.1]);
    let w = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 0.0, 1.0, 0.7, -0.4, 0.5, 0.5]);
    let one_sided = OneSided {
        gap: 0.1,
        side: Side::Negative,
        contact_damping: 0.0,
    };
    let staged = PiecewiseLinear {
        breakpoints: vec![-0.4, 0.1, 0.35],
        slopes: vec![1.2, 0.3, 0.7, 2.0],
    };
    let mut mounts = vec![
        backlash(0.3),
        Mount::new(Box::new(one_sided)),
        Mount::new(Box::new(staged)),
        Mount::new(Box::new(Linear {})),
    ];
    mounts[0].stiffness_variation = Some(fourier(1.0, &[(1, 0.1, 0.0), (3, 0.0, 0.05)]));
    mounts[0].transmission_error = Some(fourier(0.02, &[(2, 0.03, -0.02), (9, 0.004, 0.01)]));
    mounts[1].stiffness_variation = Some(Periodic::Rectangular {
        high: 1.1,
        low: 0.95,
        duty: 1.0 / 3.0,
        phase: 0.4,
        base_order: 2,
    });
    System::new(gamma, kappa, w, mounts, vec![load(2, 0, 0.4, 0.3)]).unwrap()
}

fn galerkin(system: &System, harmonics: usize, samples: usize) -> Galerkin<FrequencyFamily> {
    let size = GalerkinOptions { harmonics, samples };
    Galerkin::new(FrequencyFamily::new(system.clone()), 0.9, size).unwrap()
}

fn exact(system: &System, harmonics: usize) -> Galerkin<FrequencyFamily> {
    let samples = GalerkinOptions::default_samples(harmonics, system.subharmonic());
    galerkin(system, harmonics, samples)
        .with_exact_quadrature(0.9)
        .unwrap()
}

/// Coefficients that fall like those of a motion with kinks in its acceleration.
fn motion(dim: usize, coefficients: usize) -> DVector<f64> {
    DVector::from_fn(dim, |k, _| {
        let order = ((k % coefficients) as f64 / 2.0).ceil();
        0.8 * ((k * k + 1) as f64).sin() / (1.0 + order.powi(3))
    })
}

fn linearised(problem: &mut dyn Residual, u: &DVector<f64>) -> Linearisation {
    let mut out = Linearisation::new(&problem.structure());
    problem.linearise(u, 0.9, &mut out).unwrap();
    out
}

#[test]
fn equals_sampling_without_end() {
    for subharmonic in [1, 2] {
        let mut system = everything();
        system.set_subharmonic(subharmonic);
        let mut closed = exact(&system, 6);
        let u = motion(closed.dim(), closed.coefficients());
        let closed = linearised(&mut closed, &u);
        // A kink of the force and a step of the variation alias like 1/m^2, a kink's step of the slope like 1/m.
        for (samples, tolerance, of_slopes) in [(1 << 12, 1e-6, 4e-2), (1 << 18, 1e-10, 6e-4)] {
            let sampled = linearised(&mut galerkin(&system, 6, samples), &u);
            let gap = (&closed.r - &sampled.r).amax();
            assert!(gap < tolerance, "nu {subharmonic}, {samples}: {gap:e}");
            let gap = (closed.dr_du.to_dense() - sampled.dr_du.to_dense()).amax();
            assert!(gap < of_slopes, "nu {subharmonic}, {samples}: {gap:e}");
        }
        let mut constant = system.clone();
        constant = without_variation(&constant);
        let closed = linearised(&mut exact(&constant, 6), &u);
        for (samples, tolerance) in [(1 << 12, 1e-6), (1 << 18, 1e-10)] {
            let sampled = linearised(&mut galerkin(&constant, 6, samples), &u);
            let gap = (&closed.r - &sampled.r).amax();
            assert!(gap < tolerance, "nu {subharmonic}, {samples}: {gap:e}");
        }
    }
}

fn without_variation(system: &System) -> System {
    let mut mounts = system.mounts().to_vec();
    mounts.iter_mut().for_each(|m| m.stiffness_variation = None);
    let mut copy = System::new(
        system.damping().clone(),
        system.stiffness().clone(),
        system.element_map().clone(),
        mounts,
        system.loads().to_vec(),
    )
    .unwrap();
    copy.set_subharmonic(system.subharmonic());
    copy
}

#[test]
fn the_jacobian_is_the_derivative() {
    let mut jumping = everything();
    let mut mounts = jumping.mounts().to_vec();
    let preloaded = Preloaded {
        half_gap: 0.25,
        preload: 0.1,
    };
    mounts[0].element = Box::new(preloaded);
    jumping = System::new(
        jumping.damping().clone(),
        jumping.stiffness().clone(),
        jumping.element_map().clone(),
        mounts,
        jumping.loads().to_vec(),
    )
    .unwrap();
    for system in [everything(), jumping] {
        let mut problem = exact(&system, 5);
        let u = motion(problem.dim(), problem.coefficients());
        let jacobian = linearised(&mut problem, &u).dr_du.to_dense();
        let h = 1e-5;
        for k in 0..u.len() {
            let shifted = |problem: &mut dyn Residual, sign: f64| {
                let mut v = u.clone();
                v[k] += sign * h;
                linearised(problem, &v).r
            };
            let difference = (shifted(&mut problem, 1.0) - shifted(&mut problem, -1.0)) / (2.0 * h);
            // The second derivative jumps where a crossing is slow: first order in h there.
            let gap = (difference - jacobian.column(k)).amax();
            assert!(gap < 1e-6, "column {k}: {gap:e}");
        }
    }
}

#[test]
fn other_laws_are_refused_with_a_reason() {
    let damped = Backlash {
        half_gap: 0.3,
        impact_damping: 0.2,
        impact_damping_law: ImpactDampingLaw::Dissipative,
        contact_damping: 0.0,
    };
    let table = Periodic::Table {
        values: vec![0.9, 1.1, 1.0],
        base_order: 1,
    };
    let mut varied = backlash(0.3);
    varied.stiffness_variation = Some(table.clone());
    let mut wavy = backlash(0.3);
    wavy.transmission_error = Some(table);
    let law = |law: Box<dyn Element>| Mount::new(law);
    for (mount, wanted) in [
        (law(Box::new(damped)), "piecewise-affine"),
        (law(Box::new(Cubic { cubic: 0.1 })), "piecewise-affine"),
        (varied, "stiffness variation"),
        (wavy, "transmission error"),
    ] {
        let mut mounts = everything().mounts().to_vec();
        mounts[2] = mount;
        let base = everything();
        let system = System::new(
            base.damping().clone(),
            base.stiffness().clone(),
            base.element_map().clone(),
            mounts,
            base.loads().to_vec(),
        )
        .unwrap();
        let error = galerkin(&system, 6, 1024).with_exact_quadrature(0.9);
        let message = error.err().expect("refused").to_string();
        assert!(message.contains(wanted), "{message}");
        assert!(message.contains('2'), "names the connection: {message}");
    }
}

/// The solution at a frequency, from another one nearby.
fn solve(problem: &mut dyn Residual, u: &DVector<f64>, omega: f64) -> DVector<f64> {
    let options = NewtonOptions {
        tolerance: 1e-13,
        ..NewtonOptions::default()
    };
    let mut u = u.clone();
    let mut newton = Newton::new(&problem.structure(), options);
    let outcome = newton.solve(problem, &mut u, omega).unwrap();
    assert!(outcome.residual_norm < 1e-12, "{outcome:?}");
    u
}

/// Figure 11 at a frequency with a single solution: Galerkin solution with 12 harmonics and default sampling.
fn first(system: &System, omega: f64, harmonics: usize) -> DVector<f64> {
    let size = GalerkinOptions {
        harmonics,
        samples: 1024,
    };
    let found = start::find(
        system,
        omega,
        size,
        StartMode::Auto,
        NewtonOptions::default(),
    );
    match found.unwrap() {
        Start::Found { u, .. } => u,
        Start::Failed(reasons) => panic!("{reasons:?}"),
    }
}

#[test]
fn coefficients_of_solutions_agree_with_fine_sampling() {
    let data = reference("fig11_case1");
    let system = common::system(&data["system"]);
    for omega in [1.8, 1.3, 1.2, 1.1] {
        for harmonics in [12, 40] {
            let u = first(&system, omega, harmonics);
            let closed = solve(&mut exact(&system, harmonics), &u, omega);
            // 16384 samples alias by up to 4e-9 themselves, like 1/m^2: what is left with more is a share of that.
            for (samples, tolerance) in [(1 << 14, 5e-9), (1 << 16, 3e-10), (1 << 18, 2e-11)] {
                let sampled = solve(&mut galerkin(&system, harmonics, samples), &u, omega);
                let gap = (&closed - &sampled).amax();
                assert!(
                    gap < tolerance,
                    "omega {omega}, H = {harmonics}, m = {samples}: {gap:e}"
                );
            }
        }
    }
}

#[test]
fn only_truncation_is_left() {
    let data = reference("fig11_case1");
    let system = common::system(&data["system"]);
    for solution in data["solutions"].as_array().unwrap() {
        let Some(omega) = solution["omega"].as_f64().filter(|w| *w > 1.05) else {
            continue;
        };
        let mut problem = exact(&system, 40);
        let u = solve(&mut problem, &first(&system, omega, 40), omega);
        let orbit = problem.orbit(&u, omega).unwrap();
        let mut at = system.clone();
        at.set_excitation_frequency(omega);
        let measures = Meter::new(1024).measure(&at, &orbit);
        for (m, rms) in measures.iter().zip(floats(&solution["q_rms"])) {
            let error = (m.rms / rms - 1.0).abs();
            // Sampled at 1024 points the same solutions err by up to 8e-6.
            assert!(error < 1e-6, "omega {omega}: {error:e}");
        }
    }
}

#[test]
fn costs_less_than_the_sampling_that_is_as_good() {
    let system = common::system(&reference("fig11_case1")["system"]);
    let time = |problem: &mut dyn Residual| {
        let u = motion(problem.dim(), problem.dim() / 2);
        let mut out = Linearisation::new(&problem.structure());
        problem.linearise(&u, 0.9, &mut out).unwrap();
        let once = |_| {
            let begin = Instant::now();
            problem.linearise(&u, 0.9, &mut out).unwrap();
            begin.elapsed()
        };
        (0..20).map(once).min().unwrap_or(Duration::ZERO)
    };
    for harmonics in [12, 40] {
        let closed = time(&mut exact(&system, harmonics));
        let sampled = time(&mut galerkin(&system, harmonics, 1 << 14));
        assert!(closed < sampled, "{harmonics}: {closed:?}, {sampled:?}");
    }
}
