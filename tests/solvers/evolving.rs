//! Laws whose memory has a rate: the series flow and DOPRI5 against an independent program, closed forms and differences.

use crate::common::load;
use gearlash::element::{Backlash, Element, ImpactDampingLaw};
use gearlash::numeric::fourier::Fourier;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::postprocess::measures::Meter;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::{IntegrationEnd, Integrator, IntegratorChoice, choose};
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{Extent, Linearisation, PeriodicResidual, Residual};
use gearlash::solve::shooting::Shooting;
use gearlash::system::{Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// The worked example of docs/plugins.md.
#[path = "../../examples/custom_element/src/bouc_wen.rs"]
mod bouc_wen;
use bouc_wen::BoucWen;

fn one(x: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, x)
}

fn law(exponent: f64, shape: f64, hardening: f64, yield_deformation: f64) -> BoucWen {
    BoucWen {
        yield_deformation,
        hardening,
        exponent,
        shape,
    }
}

/// q'' + 0.05 q' + f = 0.2 + 0.9 cos(Om T)
fn oscillator(law: BoucWen, frequency: f64) -> System {
    let mounts = vec![Mount::new(Box::new(law) as Box<dyn Element>)];
    let loads = vec![load(1, 0, 0.2, 0.9)];
    let mut system = System::new(one(0.05), one(1.0), one(1.0), mounts, loads).unwrap();
    system.set_excitation_frequency(frequency);
    system
}

fn integrator(system: &System, choice: IntegratorChoice) -> Box<dyn Integrator + Send> {
    choose(system, choice).unwrap()
}

fn gap(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
}

/// scipy's DOP853 at rtol 1e-13, cut at every kink; T = 30 from (0.3, 0.1, 0).
#[test]
fn motions_agree_with_an_independent_program() {
    let cases = [
        (
            law(1.0, 0.5, 0.1, 0.4),
            [
                0.42259732965631724,
                -0.9387467037779138,
                -0.39980555941150747,
            ],
        ),
        (
            law(2.0, 0.6, 0.05, 0.5),
            [2.4137845941113456, -0.7998208238379503, -0.4999957973894617],
        ),
        (
            law(3.0, 0.8, 0.0, 0.7),
            [10.019568966184535, -0.04118059893612251, -0.697576030569396],
        ),
    ];
    for (law, wanted) in cases {
        let system = oscillator(law, 0.8);
        for (choice, allowed) in [
            (IntegratorChoice::Auto, 2e-10),
            (IntegratorChoice::Dopri5, 1e-7),
        ] {
            let mut flow = integrator(&system, choice);
            let mut state = [0.3, 0.1, 0.0];
            let span = (0.0, 0.8 * 30.0);
            let end = flow.advance(&system, span, &mut state, &mut ());
            assert_eq!(end, IntegrationEnd::Reached);
            let gap = gap(&state, &wanted);
            assert!(gap < allowed, "{}: {gap:e} {state:?}", flow.name());
        }
    }
}

/// Two coupled coordinates: a Bouc-Wen joint with varying stiffness under a transmission error, and a clearance.
fn train() -> System {
    let kappa = DMatrix::from_row_slice(2, 2, &[1.6, -0.7, -0.6, 1.3]);
    let gamma = DMatrix::from_row_slice(2, 2, &[0.08, 0.02, 0.03, 0.11]);
    let backlash = Backlash {
        half_gap: 0.3,
        impact_damping: 0.0,
        impact_damping_law: ImpactDampingLaw::Dissipative,
        contact_damping: 0.0,
    };
    let mut mounts = vec![
        Mount::new(Box::new(law(2.0, 0.7, 0.2, 0.5)) as Box<dyn Element>),
        Mount::new(Box::new(backlash)),
    ];
    let series = |mean, cos, sin| Periodic::Fourier {
        mean,
        harmonics: vec![Harmonic { order: 2, cos, sin }],
    };
    mounts[0].stiffness_variation = Some(series(1.0, 0.2, 0.1));
    mounts[0].transmission_error = Some(series(0.0, 0.05, -0.02));
    let loads = vec![load(2, 0, 0.3, 0.8), load(2, 1, 0.2, -0.4)];
    let map = DMatrix::identity(2, 2);
    let mut system = System::new(gamma, kappa, map, mounts, loads).unwrap();
    system.set_excitation_frequency(0.9);
    system
}

/// The transition matrix of both integrators is the derivative of the flow, which both agree on.
#[test]
fn transition_matrices_are_derivatives() {
    let system = train();
    let start = [0.4, -0.1, 0.2, 0.3, 0.15];
    let image = |start: &[f64], choice| {
        let mut state = start.to_vec();
        let mut flow = integrator(&system, choice);
        let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
        assert_eq!(end, IntegrationEnd::Reached);
        state
    };
    let mut ends = Vec::new();
    for (choice, allowed) in [
        (IntegratorChoice::Auto, 1e-8),
        (IntegratorChoice::Dopri5, 1e-6),
    ] {
        let (mut state, mut phi) = (start.to_vec(), DMatrix::identity(5, 5));
        let mut flow = integrator(&system, choice);
        flow.advance_with_variation(&system, (0.0, TAU), &mut state, &mut phi, &mut ());
        assert!(gap(&state, &image(&start, choice)) < 1e-8);
        let step = 1e-6;
        for column in 0..5 {
            let beside = |sign: f64| {
                let mut moved = start;
                moved[column] += sign * step;
                image(&moved, IntegratorChoice::Auto)
            };
            let (low, high) = (beside(-1.0), beside(1.0));
            for row in 0..5 {
                let difference = (high[row] - low[row]) / (2.0 * step);
                let gap = (phi[(row, column)] - difference).abs();
                assert!(
                    gap < allowed,
                    "{} {row} {column}: {gap:e} {difference}",
                    flow.name()
                );
            }
        }
        ends.push(state);
    }
    assert!(gap(&ends[0], &ends[1]) < 1e-8, "{ends:?}");
}

/// Shooting finds the orbit that the motion settles on, its memory included; no multiplier is 1.
#[test]
fn shooting_finds_the_steady_motion() {
    let system = oscillator(law(1.0, 0.5, 0.1, 0.4), 0.8);
    let mut flow = integrator(&system, IntegratorChoice::Auto);
    let mut state = [0.3, 0.1, 0.0];
    for _ in 0..80 {
        flow.advance(&system, (0.0, TAU), &mut state, &mut ());
    }
    let steady = state;
    let family = FrequencyFamily::new(system);
    let mut shooting = Shooting::new(family, 0.8, IntegratorChoice::Auto).unwrap();
    let mut newton = Newton::new(&shooting.structure(), NewtonOptions::default());
    let mut u = DVector::from_column_slice(&[steady[0] + 0.02, steady[1], steady[2]]);
    let solved = newton.solve(&mut shooting, &mut u, 0.8).unwrap();
    assert!(solved.is_converged());
    assert!(gap(u.as_slice(), &steady) < 1e-9, "{u} {steady:?}");
    let survey = shooting.survey(&u, 0.8, Extent::Stability).unwrap();
    assert_eq!(survey.multipliers.len(), 3);
    assert_eq!(survey.neutral, 0);
    assert!(survey.multipliers.iter().all(|m| m.norm() < 0.95));
}

/// At rest under a load that was applied once, the force of the first loading carries it: z = Y (1 - exp(-q/Y)).
#[test]
fn the_static_equilibrium_is_that_of_the_first_loading() {
    let mut system = oscillator(law(1.0, 0.5, 0.1, 0.4), 0.8);
    let rest = gearlash::solve::equilibrium::equilibrium(&system).unwrap();
    let q = rest.q[0];
    let z = 0.4 * (1.0 - (-q / 0.4).exp());
    assert!((0.1 * q + 0.9 * z - 0.2).abs() < 1e-10, "{q}");
    let memory = system.memory_at_rest(rest.q.as_slice());
    assert!((memory[0] - z).abs() < 1e-11);
    // It stays there.
    system = system.with_loads(vec![load(1, 0, 0.2, 0.0)]);
    let mut state = [q, 0.0, memory[0]];
    let mut flow = integrator(&system, IntegratorChoice::Auto);
    flow.advance(&system, (0.0, TAU), &mut state, &mut ());
    assert!(gap(&state, &[q, 0.0, z]) < 1e-9, "{state:?}");
}

/// The steady motion by shooting, and the Galerkin problem with the series of it.
fn both_methods(
    system: &System,
    frequency: f64,
    size: GalerkinOptions,
) -> (
    Shooting<FrequencyFamily>,
    DVector<f64>,
    Galerkin<FrequencyFamily>,
    DVector<f64>,
) {
    let family = || FrequencyFamily::new(system.clone());
    let mut flow = integrator(system, IntegratorChoice::Auto);
    let mut state = vec![0.0; system.state_size()];
    for _ in 0..60 {
        flow.advance(system, (0.0, TAU), &mut state, &mut ());
    }
    let mut shooting = Shooting::new(family(), frequency, IntegratorChoice::Auto).unwrap();
    let mut newton = Newton::new(&shooting.structure(), NewtonOptions::default());
    let mut steady = DVector::from_vec(state);
    let solved = newton.solve(&mut shooting, &mut steady, frequency).unwrap();
    assert!(solved.is_converged());
    let orbit = shooting.orbit(&steady, frequency).unwrap();
    let galerkin = Galerkin::new(family(), frequency, size).unwrap();
    let mut fourier = Fourier::new(size.samples);
    let mut u = DVector::zeros(galerkin.dim());
    let blocks = u.as_mut_slice().chunks_exact_mut(galerkin.coefficients());
    for (i, block) in blocks.enumerate() {
        let at = |j: usize| orbit.coordinate(i, TAU * j as f64 / size.samples as f64)[0];
        let samples: Vec<f64> = (0..size.samples).map(at).collect();
        fourier.to_coefficients(&samples, block);
    }
    (shooting, steady, galerkin, u)
}

/// The memory is followed around the period: r.m.s. within 1e-5 of shooting at 40 harmonics, with the same energy lost and the same
/// multipliers.
#[test]
fn the_galerkin_method_finds_the_steady_motion() {
    let laws = [
        law(1.0, 0.5, 0.1, 0.4),
        law(2.0, 0.6, 0.05, 0.5),
        law(3.0, 0.8, 0.1, 0.7),
    ];
    let mut systems: Vec<(System, f64)> = laws
        .into_iter()
        .map(|law| (oscillator(law, 0.8), 0.8))
        .collect();
    systems.push((train(), 0.9));
    let size = GalerkinOptions {
        harmonics: 40,
        samples: 2048,
    };
    for (k, (system, frequency)) in systems.into_iter().enumerate() {
        let (mut shooting, steady, mut galerkin, mut u) = both_methods(&system, frequency, size);
        u *= 1.01;
        let mut newton = Newton::new(&galerkin.structure(), NewtonOptions::default());
        let solved = newton.solve(&mut galerkin, &mut u, frequency).unwrap();
        assert!(
            solved.is_converged() && solved.iterations <= 8,
            "{k}: {solved:?}"
        );
        let exact = shooting
            .survey(&steady, frequency, Extent::Stability)
            .unwrap();
        let series = galerkin.survey(&u, frequency, Extent::Stability).unwrap();
        let wanted = Meter::new(2048).measure(&system, &exact.orbit);
        let found = Meter::new(2048).measure(&system, &series.orbit);
        for (a, b) in found.iter().zip(&wanted) {
            assert!(
                (a.rms / b.rms - 1.0).abs() < 1e-5,
                "{k}: {} {}",
                a.rms,
                b.rms
            );
            let loss = 1e-4 * wanted[0].loss.abs();
            assert!((a.loss - b.loss).abs() < loss, "{k}: {} {}", a.loss, b.loss);
            let force = 1e-4 * b.force_std;
            assert!((a.force_mean - b.force_mean).abs() < force, "{k}: {a:?}");
        }
        assert_eq!(series.multipliers.len(), exact.multipliers.len());
        let [a, b] = [&series, &exact].map(|s| s.multipliers[0].norm());
        assert!((a - b).abs() < 1e-3, "{k}: {a} {b}");
    }
}

/// Partials by every coefficient and by the frequency, memory included, are the derivatives.
#[test]
fn the_jacobian_of_a_followed_memory_is_the_derivative() {
    let size = GalerkinOptions {
        harmonics: 6,
        samples: 256,
    };
    let system = train();
    let (_, _, mut galerkin, u) = both_methods(&system, 0.9, size);
    let (mut here, mut there) = (Linearisation::of(&galerkin), Linearisation::of(&galerkin));
    galerkin.linearise(&u, 0.9, &mut here).unwrap();
    let jacobian = here.dr_du.to_dense();
    let h = 1e-6;
    let mut difference = |u: [&DVector<f64>; 2], frequency: [f64; 2]| {
        galerkin.linearise(u[1], frequency[1], &mut there).unwrap();
        let high = there.r.clone();
        galerkin.linearise(u[0], frequency[0], &mut there).unwrap();
        (high - &there.r) / (2.0 * h)
    };
    for k in 0..u.len() {
        let (mut low, mut high) = (u.clone(), u.clone());
        low[k] -= h;
        high[k] += h;
        let gap = (difference([&low, &high], [0.9; 2]) - jacobian.column(k)).amax();
        // The sampled clearance has no exact derivative where a sample changes its side.
        assert!(gap < 1e-5, "{k}: {gap:e}");
    }
    let gap = (difference([&u, &u], [0.9 - h, 0.9 + h]) - &here.dr_dlambda).amax();
    assert!(gap < 1e-6, "{gap:e}");
}
