//! Series flow against DOPRI5 on random trains: stiffness that varies, transmission errors, impact damping, cubic laws, formulas.

use crate::common::{backlash, load};
use crate::crosscheck_integrators::{Switches, train};
use gearlash::element::{
    Backlash, Cubic, Element, Expression, ImpactDampingLaw, Linear, Preloaded, TanhFriction,
};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{
    Dopri5, Dopri5Options, Exact, IntegrationEnd, Integrator, Switch,
};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestRunner};
use std::f64::consts::TAU;

type Draw<'a> = dyn FnMut(f64, f64) -> f64 + 'a;

fn harmonics(mean: f64, size: f64, draw: &mut Draw<'_>) -> Periodic {
    let harmonic = |order| Harmonic {
        order,
        cos: draw(-size, size),
        sin: draw(-size, size),
    };
    let harmonics = [1, 2, 5].map(harmonic).to_vec();
    Periodic::Fourier { mean, harmonics }
}

fn table(mean: f64, size: f64, draw: &mut Draw<'_>) -> Periodic {
    let mut values: Vec<f64> = (0..6).map(|_| draw(-size, size)).collect();
    let own = values.iter().sum::<f64>() / 6.0;
    values.iter_mut().for_each(|v| *v += mean - own);
    Periodic::Table {
        values,
        base_order: 1,
    }
}

fn law(draw: &mut Draw<'_>) -> Box<dyn Element> {
    let formula = |text: &str, parameters: &[(&str, f64)]| -> Box<dyn Element> {
        Box::new(Expression::new(text, parameters).unwrap())
    };
    let b = draw(0.1, 0.8);
    match (8.0 * draw(0.0, 1.0)) as usize {
        0 => Box::new(Cubic { cubic: b }),
        1 => Box::new(TanhFriction {
            force: 0.2,
            velocity: b,
        }),
        2 => formula(
            "(abs(q) > b)*(q - b*sign(q))*(1 + d*sign(q)*v)",
            &[("b", b), ("d", 0.1)],
        ),
        3 => formula("q + b*sin(q)*exp(-v^2) + 0.1*cos(phase)*q", &[("b", b)]),
        4 => formula(
            "sinh(b*q)/b + atan(v)/5 + log(2 + cos(q))/9 + sqrt(1 + v^2) - 1",
            &[("b", b)],
        ),
        5 => Box::new(Preloaded {
            half_gap: b,
            preload: 0.05,
        }),
        literal => Box::new(Backlash {
            half_gap: b,
            impact_damping: draw(0.02, 0.2),
            impact_damping_law: match literal {
                6 => ImpactDampingLaw::Literal,
                _ => ImpactDampingLaw::Dissipative,
            },
            contact_damping: 0.0,
        }),
    }
}

fn mount(j: usize, draw: &mut Draw<'_>) -> Mount {
    let mut mount = match j % 3 {
        0 => backlash(draw(0.05, 1.0)),
        _ => Mount::new(law(draw)),
    };
    mount.stiffness_variation = match draw(0.0, 1.0) {
        x if x < 0.4 => Some(harmonics(1.0, 0.1, draw)),
        x if x < 0.6 => Some(table(1.0, 0.3, draw)),
        _ => None,
    };
    mount.transmission_error = match draw(0.0, 1.0) {
        x if x < 0.4 => Some(harmonics(0.0, 0.1, draw)),
        x if x < 0.6 => Some(table(0.0, 0.2, draw)),
        _ => None,
    };
    mount
}

/// State, transition matrix and switches after a period.
fn period(
    integrator: &mut dyn Integrator,
    system: &System,
    start: &[f64],
) -> (IntegrationEnd, Vec<f64>, DMatrix<f64>, Vec<Switch>) {
    let mut state = start.to_vec();
    let mut phi = DMatrix::identity(start.len(), start.len());
    let mut seen = Switches::default();
    let end =
        integrator.advance_with_variation(system, (0.0, TAU), &mut state, &mut phi, &mut seen);
    (end, state, phi, seen.0)
}

fn compare(system: &System, x: &[f64]) -> Result<(), String> {
    let n = system.dof();
    let start: Vec<f64> = (0..2 * n)
        .map(|k| 2.0 * x[(7 * k + 3) % x.len()] - 1.0)
        .collect();
    let mut flow = Exact::new(system, 1000).map_err(|e| e.to_string())?;
    let (end, state, phi, seen) = period(&mut flow, system, &start);
    let mut dopri5 = closely(system);
    let (other_end, other, other_phi, other_seen) = period(&mut dopri5, system, &start);
    if (end, other_end) != (IntegrationEnd::Reached, IntegrationEnd::Reached) {
        return Err(format!("{end:?} {other_end:?}"));
    }
    if seen.len() != other_seen.len() {
        return Err(format!("{} switches, not {}", seen.len(), other_seen.len()));
    }
    let gaps = state.iter().zip(&other).map(|(a, b)| (a - b).abs());
    let gap = gaps.fold(0.0, f64::max) / state.iter().fold(1.0, |m, x| x.abs().max(m));
    let phi_gap = (&phi - &other_phi).amax() / phi.amax().max(1.0);
    let mut pairs = seen.iter().zip(&other_seen);
    let same = pairs.all(|(s, t)| s.connection == t.connection && (s.tau - t.tau).abs() < 1e-9);
    if gap > 1e-10 || phi_gap > 1e-9 || !same {
        return Err(format!(
            "state {gap:e}, Phi {phi_gap:e}, same switches: {same}"
        ));
    }
    Ok(())
}

#[test]
fn random_trains_with_everything_over_one_period() {
    let config = Config {
        cases: 200,
        rng_seed: RngSeed::Fixed(2026),
        failure_persistence: None,
        ..Config::default()
    };
    let numbers = proptest::collection::vec(0.0..1.0_f64, 131);
    TestRunner::new(config)
        .run(
            &(1..7_usize, proptest::bool::ANY, numbers),
            |(n, is_loop, x)| {
                let system = train(n, is_loop && n > 1, &x, mount);
                compare(&system, &x).map_err(TestCaseError::fail)
            },
        )
        .unwrap();
}

/// A motion at rest has no terms of its own; the deviations from it need theirs.
#[test]
fn deviations_from_rest_take_no_more_steps_than_motions() {
    let one = |x| DMatrix::from_element(1, 1, x);
    let mounts = vec![Mount::new(
        Box::new(Cubic { cubic: 1.0 }) as Box<dyn Element>
    )];
    let system = System::new(one(0.2), one(1.0), one(1.0), mounts, vec![]).unwrap();
    let mut flow = Exact::new(&system, 10).unwrap();
    let (end, state, phi, _) = period(&mut flow, &system, &[0.0, 0.0]);
    assert_eq!((end, state), (IntegrationEnd::Reached, vec![0.0, 0.0]));
    assert!(flow.effort() < 20, "{} steps", flow.effort());
    // q'' + 0.2 q' + q = 0 over 2 pi.
    let damped = (1.0_f64 - 0.01).sqrt();
    let shrink = (-0.1 * TAU).exp();
    let wanted = shrink * ((damped * TAU).cos() + 0.1 / damped * (damped * TAU).sin());
    assert!((phi[(0, 0)] - wanted).abs() < 1e-11);
}

/// Where a force has a pole the terms of the series grow without bound: the run ends before it, and says where.
#[test]
fn a_pole_on_the_path_ends_the_motion() {
    let one = |x| DMatrix::from_element(1, 1, x);
    for (force, start, pole) in [("-1/(1 - q)^2", 0.3, 1.0), ("0.2 + sqrt(q)", 0.3, 0.0)] {
        let law = Expression::new(force, &[]).unwrap();
        let mounts = vec![Mount::new(Box::new(law) as Box<dyn Element>)];
        let mut system = System::new(one(0.1), one(1.0), one(1.0), mounts, vec![]).unwrap();
        system.set_excitation_frequency(0.1);
        let mut state = [start, 0.0];
        let mut flow = Exact::new(&system, 10).unwrap();
        match flow.advance(&system, (0.0, TAU), &mut state, &mut ()) {
            IntegrationEnd::NotAnalytic(at) => {
                assert!(
                    at.connection == 0 && (at.deformation - pole).abs() < 1e-6,
                    "{at:?}"
                );
                assert!(state.iter().all(|x| x.is_finite()) && at.share > 0.0);
            }
            end => panic!("{force}: {end:?} at {state:?}"),
        }
    }
}

pub fn closely(system: &System) -> Dopri5 {
    let options = Dopri5Options {
        relative: 1e-13,
        absolute: 1e-15,
        ..Dopri5Options::default()
    };
    Dopri5::new(system, options)
}

/// A weight that friction holds most of the time: the friction, which turns within 1e-4 of the velocities, takes short steps. The
/// integrator says how many and for which connection, and finds the same motion as DOPRI5.
#[test]
fn steep_forces_take_short_steps_and_are_named() {
    let mounts = vec![
        Mount::new(Box::new(Linear {}) as Box<dyn Element>),
        Mount::new(Box::new(TanhFriction {
            force: 0.5,
            velocity: 1e-4,
        })),
    ];
    let kappa = DMatrix::from_row_slice(1, 2, &[1.0, 1.0]);
    let map = DMatrix::from_row_slice(2, 1, &[1.0, 1.0]);
    let damping = DMatrix::from_element(1, 1, 0.1);
    let mut system = System::new(damping, kappa, map, mounts, vec![load(1, 0, 0.0, 0.4)]).unwrap();
    system.set_excitation_frequency(0.3);
    let start = [0.5, 0.0];
    let mut flow = Exact::new(&system, 1000).unwrap();
    let (mut state, mut other) = (start, start);
    let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
    assert_eq!(end, IntegrationEnd::Reached);
    let strain = flow.strain().unwrap().steps.unwrap();
    assert!(strain.connection == 1 && strain.steps > 1000, "{strain:?}");
    assert!(
        strain.shortest > 0.0 && strain.shortest < 1e-3,
        "{strain:?}"
    );
    closely(&system).advance(&system, (0.0, TAU), &mut other, &mut ());
    let apart = (0..2).map(|i| (state[i] - other[i]).abs());
    assert!(apart.fold(0.0, f64::max) < 1e-9, "{state:?}, not {other:?}");
}

/// Where tanh has saturated, or an exponential is far below rounding, the coefficients of a series say nothing of what comes: the
/// turn of the force must not be stepped over.
#[test]
fn forces_that_hide_in_small_exponentials_are_found() {
    for force in [
        "q + 0.3*tanh(v/1e-2)",
        "q + 0.3*tanh(v/1e-4)",
        "q + 0.2*(1 + 0.5*exp(-(v/2e-3)^2))*tanh(v/1e-3)",
        "q + 0.4*exp(-((q - 0.2)/4e-3)^2)",
        "q + 0.3*v/cosh(v/1e-2)",
        "q + 0.3/cosh((v - 0.1)/1e-4)^2",
    ] {
        let law = Expression::new(force, &[]).unwrap();
        let mounts = vec![Mount::new(Box::new(law) as Box<dyn Element>)];
        let one = |x| DMatrix::from_element(1, 1, x);
        let mut system = System::new(
            one(0.1),
            one(1.0),
            one(1.0),
            mounts,
            vec![load(1, 0, 0.1, 0.4)],
        )
        .unwrap();
        system.set_excitation_frequency(0.3);
        let (mut state, mut other) = ([0.5, 0.2], [0.5, 0.2]);
        let mut flow = Exact::new(&system, 1000).unwrap();
        let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
        assert_eq!((flow.name(), end), ("series", IntegrationEnd::Reached));
        let options = Dopri5Options {
            relative: 1e-13,
            absolute: 1e-15,
            max_step: 2e-4,
            ..Dopri5Options::default()
        };
        let mut dopri5 = Dopri5::new(&system, options);
        dopri5.advance(&system, (0.0, TAU), &mut other, &mut ());
        let apart = (0..2).map(|i| (state[i] - other[i]).abs());
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 1e-9, "{force}: {state:?}, not {other:?}");
    }
}

/// Stiffnesses of 1e9 beside 1e4: the fast mode takes the steps, and is named.
#[test]
fn a_fast_mode_beside_a_slow_one_is_named() {
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -1.0, 1e7]);
    let damping = DMatrix::from_diagonal_element(2, 2, 0.1);
    let linear = || Mount::new(Box::new(Linear {}) as Box<dyn Element>);
    let loads = vec![load(2, 0, 0.0, 1.0)];
    let identity = DMatrix::identity(2, 2);
    let mut system =
        System::new(damping, kappa, identity, vec![linear(), linear()], loads).unwrap();
    system.set_excitation_frequency(0.5);
    let mut flow = Exact::new(&system, 10).unwrap();
    assert!(flow.strain().is_none());
    let mut state = [0.0; 4];
    let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
    assert_eq!((flow.name(), end), ("exact", IntegrationEnd::Reached));
    assert_eq!(
        flow.strain().and_then(|s| s.steps).map(|s| s.connection),
        Some(1)
    );
}
