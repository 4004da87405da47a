//! The laws beyond the plain ones against closed forms: energy under friction, rest and free motion under a preload.

use crate::common::load;
use gearlash::element::{Element, Linear, Preloaded, TanhFriction};
use gearlash::solve::equilibrium::equilibrium;
use gearlash::solve::integrate::{
    Dopri5, Dopri5Options, Exact, IntegrationEnd, Integrator, MAX_SWITCHES,
};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};

fn tight() -> Dopri5Options {
    Dopri5Options {
        relative: 1e-12,
        absolute: 1e-14,
        ..Default::default()
    }
}

/// x'' + gamma x' + sum of laws = mean + cos part cos(omega T), every law on the same coordinate.
fn single(gamma: f64, laws: Vec<Box<dyn Element>>, mean: f64, cos: f64) -> System {
    let e = laws.len();
    System::new(
        DMatrix::from_element(1, 1, gamma),
        DMatrix::from_element(1, e, 1.0),
        DMatrix::from_element(e, 1, 1.0),
        laws.into_iter().map(Mount::new).collect(),
        vec![load(1, 0, mean, cos)],
    )
    .unwrap()
}

fn preloaded(half_gap: f64, preload: f64) -> Box<dyn Element> {
    Box::new(Preloaded { half_gap, preload })
}

/// A mass that slides freely: v' = -F tanh(v / v0), hence sinh(v / v0) falls like exp(-F t / v0).
#[test]
fn friction_alone_brakes_as_the_closed_form_says() {
    let (force, velocity) = (0.3, 0.2);
    let system = single(
        0.0,
        vec![Box::new(TanhFriction { force, velocity })],
        0.0,
        0.0,
    );
    let mut state = [0.0, 1.5];
    Dopri5::new(&system, tight()).advance(&system, (0.0, 4.0), &mut state, &mut ());
    let expected =
        velocity * ((1.5_f64 / velocity).sinh() * (-4.0 * force / velocity).exp()).asinh();
    assert!(
        (state[1] - expected).abs() < 1e-11,
        "{} {expected}",
        state[1]
    );
}

/// An oscillator with friction loses the work of friction, and with v0 -> 0 the amplitude falls by 4 F a cycle (Coulomb).
#[test]
fn friction_takes_energy_out_like_coulomb() {
    let force = 0.01;
    let energy = |s: &[f64; 2]| 0.5 * (s[0] * s[0] + s[1] * s[1]);
    for (velocity, tolerance) in [(1e-3, 2e-4), (1e-4, 1e-6)] {
        let friction = TanhFriction { force, velocity };
        let system = single(0.0, vec![Box::new(Linear {}), Box::new(friction)], 0.0, 0.0);
        let mut state = [1.0, 0.0];
        let mut integrator = Dopri5::new(&system, tight());
        let mut last = energy(&state);
        for cycle in 1..=3 {
            let end = integrator.advance(&system, (0.0, TAU), &mut state, &mut ());
            assert_eq!(end, IntegrationEnd::Reached);
            let now = energy(&state);
            assert!(now < last, "the energy falls");
            last = now;
            let amplitude = (2.0 * now).sqrt();
            let coulomb = 1.0 - 4.0 * force * f64::from(cycle);
            assert!(
                (amplitude - coulomb).abs() < tolerance,
                "{velocity}: {amplitude} {coulomb}"
            );
        }
    }
}

#[test]
fn a_preloaded_joint_rests_where_load_and_preload_balance() {
    for (half_gap, preload, mean, expected, flank) in [
        (0.6, 0.2, 0.5, 0.9, 1),
        (0.6, 0.2, -0.5, -0.9, -1),
        // Less load than preload: it rests on the flank itself.
        (0.6, 0.2, 0.1, 0.6, 1),
        (0.0, 0.2, 0.1, 0.0, 1),
        (0.0, 0.2, 0.7, 0.5, 1),
        (0.0, 0.2, -0.7, -0.5, -1),
    ] {
        let system = single(0.0, vec![preloaded(half_gap, preload)], mean, 0.0);
        let rest = equilibrium(&system).expect("there is one");
        assert!(
            (rest.q[0] - expected).abs() < 1e-5,
            "{half_gap} {preload} {mean}: {}",
            rest.q[0]
        );
        assert!(rest.is_unique);
        if expected != 0.0 {
            assert_eq!(rest.flank, [flank], "{half_gap} {preload} {mean}");
        }
    }
}

/// Free motion between the two flanks: coasting through the gap, half a turn of the oscillator about q = b - F0 beyond it.
#[test]
fn a_preloaded_joint_swings_with_the_period_of_the_closed_form() {
    let (half_gap, preload, speed) = (0.4, 0.25_f64, 0.8_f64);
    // On the flank: x = q - b, x'' = -(x + F0), x(0) = 0, x'(0) = v: circle about -F0 of radius (v^2 + F0^2)^(1/2).
    let angle = PI - 2.0 * preload.atan2(speed);
    let period = 4.0 * half_gap / speed + 2.0 * angle;
    let system = single(0.0, vec![preloaded(half_gap, preload)], 0.0, 0.0);
    let start = [0.1, speed];
    let mut exact = Exact::new(&system, MAX_SWITCHES).unwrap();
    let mut dopri5 = Dopri5::new(&system, tight());
    for (integrator, tolerance) in [
        (&mut exact as &mut dyn Integrator, 1e-13),
        (&mut dopri5, 1e-10),
    ] {
        let mut state = start;
        let end = integrator.advance(&system, (0.0, period), &mut state, &mut ());
        assert_eq!(end, IntegrationEnd::Reached);
        let gap = (0..2)
            .map(|i| (state[i] - start[i]).abs())
            .fold(0.0, f64::max);
        assert!(gap < tolerance, "{}: {gap:e}", integrator.name());
    }
}

/// The saltation matrix: Phi against central differences of the flow, with jumps passed in both directions.
#[test]
fn transition_matrices_across_jumps_equal_differences() {
    let kappa = DMatrix::from_row_slice(2, 3, &[2.0, 0.5, 0.6, 0.4, 1.5, -0.5]);
    let w = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.7, -0.6]);
    let gamma = DMatrix::from_row_slice(2, 2, &[0.08, 0.01, 0.02, 0.06]);
    let mounts = [
        preloaded(0.1, 0.3),
        preloaded(0.0, 0.2),
        Box::new(Linear {}),
    ];
    let loads = vec![load(2, 0, 0.3, 0.9), load(2, 1, 0.2, -0.8)];
    let mounts = mounts.into_iter().map(Mount::new).collect();
    let mut system = System::new(gamma, kappa, w, mounts, loads).unwrap();
    system.set_excitation_frequency(0.83);
    let start = [0.5, -0.3, 0.2, 0.4];
    let exact = || Box::new(Exact::new(&system, MAX_SWITCHES).unwrap()) as Box<dyn Integrator>;
    let dopri5 = || Box::new(Dopri5::new(&system, tight())) as Box<dyn Integrator>;
    let mut found = Vec::new();
    for mut integrator in [exact(), dopri5()] {
        let mut flow = |start: [f64; 4]| {
            let mut state = start;
            let end = integrator.advance(&system, (0.0, TAU), &mut state, &mut ());
            assert_eq!(end, IntegrationEnd::Reached);
            state
        };
        let differences = DMatrix::from_fn(4, 4, |i, j| {
            let h = 1e-5;
            let [mut ahead, mut behind] = [start, start];
            ahead[j] += h;
            behind[j] -= h;
            (flow(ahead)[i] - flow(behind)[i]) / (2.0 * h)
        });
        let mut phi = DMatrix::identity(4, 4);
        let mut state = start;
        integrator.advance_with_variation(&system, (0.0, TAU), &mut state, &mut phi, &mut ());
        let gap = (&phi - &differences).amax() / phi.amax();
        assert!(
            gap < 1e-7,
            "{}: {gap:e}\n{phi}{differences}",
            integrator.name()
        );
        // Saltation matrices have determinant 1: Liouville's formula holds across jumps.
        let trace = system.damping().trace() * TAU / system.omega();
        assert!(
            (phi.determinant() / (-trace).exp() - 1.0).abs() < 1e-7,
            "det Phi"
        );
        found.push(phi);
    }
    let gap = (&found[0] - &found[1]).amax() / found[0].amax();
    assert!(gap < 1e-8, "exact flow against DOPRI5: {gap:e}");
}

/// A joint pressed against its preload rests on its flank: the exact flow holds it there, DOPRI5 says that it does not.
#[test]
fn a_joint_below_its_preload_is_held_by_the_flow() {
    let system = single(0.5, vec![preloaded(0.6, 0.4)], 0.2, 0.0);
    let long = (0.0, 100.0 * TAU);
    let mut state = [0.0, 0.0];
    let mut exact = Exact::new(&system, 10_000).unwrap();
    assert_eq!(
        exact.advance(&system, long, &mut state, &mut ()),
        IntegrationEnd::Reached
    );
    assert!(
        (state[0] - 0.6).abs() < 1e-12 && state[1].abs() < 1e-12,
        "{state:?}"
    );
    let mut state = [0.0, 0.0];
    let mut other = Dopri5::new(&system, Dopri5Options::default());
    let end = other.advance(&system, long, &mut state, &mut ());
    assert_eq!(end, IntegrationEnd::Sticks(0));
    assert!((state[0] - 0.6).abs() < 1e-3);
}
