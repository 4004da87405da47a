//! Laws whose memory has a rate: the series flow and DOPRI5 against an independent program, closed forms and differences.

use crate::common::load;
use gearlash::element::{Backlash, Element, ImpactDampingLaw};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::integrate::{IntegrationEnd, Integrator, IntegratorChoice, choose};
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{PeriodicResidual, Residual};
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
    let extent = gearlash::solve::residual::Extent::Stability;
    let survey = shooting.survey(&u, 0.8, extent).unwrap();
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
