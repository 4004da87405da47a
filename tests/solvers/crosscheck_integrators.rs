//! Exact flow against DOPRI5 on random trains: trees and loops, random gaps, loads and damping, rectangular stiffness.

use crate::common::{backlash, load};
use gearlash::element::{OneSided, PiecewiseLinear, Side};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{
    Dopri5, Dopri5Options, Exact, FlowObserver, IntegrationEnd, Integrator, Switch,
};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use std::f64::consts::TAU;

/// The switches of a motion.
#[derive(Default)]
pub struct Switches(pub Vec<Switch>);

impl FlowObserver for Switches {
    fn switch(&mut self, switch: &Switch) {
        self.0.push(*switch);
    }
}

/// A train of n coordinates with all its numbers drawn from `x`, values in 0..1; `mount` makes connection j.
pub fn train(
    n: usize,
    is_loop: bool,
    x: &[f64],
    mount: impl Fn(usize, &mut dyn FnMut(f64, f64) -> f64) -> Mount,
) -> System {
    let mut next = x.iter().cycle().copied();
    let mut draw = |low: f64, high: f64| low + (high - low) * next.next().unwrap();
    let e = n + usize::from(is_loop);
    // A chain of inertias: kappa = P M^-1 B^T K, similar to a symmetric positive matrix.
    let inertia: Vec<f64> = (0..=n).map(|_| draw(0.5, 2.0)).collect();
    let b = DMatrix::from_fn(e, n + 1, |j, i| match () {
        _ if j == n => {
            [1.0, if n % 2 == 1 { 1.0 } else { -1.0 }][usize::from(i == n)]
                * f64::from(u8::from(i == 0 || i == n))
        }
        _ => f64::from(u8::from(i == j || i == j + 1)),
    });
    let stiffness: Vec<f64> = (0..e).map(|_| draw(0.5, 1.5)).collect();
    let p = b.rows(0, n).into_owned();
    let right = &p.transpose() * (&p * p.transpose()).try_inverse().unwrap();
    let map = &b * &right;
    let minv_bt = DMatrix::from_fn(n + 1, e, |i, j| b[(j, i)] / inertia[i]);
    let kappa = DMatrix::from_fn(n, e, |i, j| {
        (p.row(i) * minv_bt.column(j))[(0, 0)] * stiffness[j]
    });
    let gamma = &kappa * &map * draw(0.0, 0.2);
    let mounts = (0..e).map(|j| mount(j, &mut draw)).collect();
    let loads = (0..n)
        .map(|i| load(n, i, draw(-0.3, 0.5), draw(0.0, 0.5)))
        .collect();
    let mut system = System::new(gamma, kappa, map, mounts, loads).unwrap();
    system.set_excitation_frequency(draw(0.3, 2.0));
    system
}

/// Laws and excitations of the exact flow.
fn mount(j: usize, draw: &mut dyn FnMut(f64, f64) -> f64) -> Mount {
    match j % 4 {
        1 => Mount::new(Box::new(PiecewiseLinear {
            breakpoints: vec![-draw(0.2, 1.0), draw(0.1, 1.0)],
            slopes: vec![1.0, draw(0.0, 0.3), draw(0.5, 1.5)],
        })),
        3 => Mount::new(Box::new(OneSided {
            gap: draw(0.0, 0.5),
            side: Side::Negative,
            contact_damping: 0.0,
        })),
        _ => {
            let mut mount = backlash(draw(0.05, 1.0));
            if draw(0.0, 1.0) > 0.6 {
                let (high, low) = (1.2, 0.8);
                mount.stiffness_variation = Some(Periodic::Rectangular {
                    high,
                    low,
                    duty: 0.5,
                    phase: draw(0.0, 6.0),
                    base_order: 2,
                });
            }
            if draw(0.0, 1.0) > 0.6 {
                let harmonics = vec![Harmonic {
                    order: 2,
                    cos: draw(0.0, 0.2),
                    sin: draw(0.0, 0.2),
                }];
                mount.transmission_error = Some(Periodic::Fourier {
                    mean: 0.0,
                    harmonics,
                });
            }
            mount
        }
    }
}

fn compare(system: &System, x: &[f64]) -> Result<(), String> {
    let n = system.dof();
    let start: Vec<f64> = (0..2 * n)
        .map(|k| 2.0 * x[(7 * k + 3) % x.len()] - 1.0)
        .collect();
    let (mut a, mut b) = (start.clone(), start);
    let (mut phi_a, mut phi_b) = (
        DMatrix::identity(2 * n, 2 * n),
        DMatrix::identity(2 * n, 2 * n),
    );
    let (mut seen_a, mut seen_b) = (Switches::default(), Switches::default());
    let mut exact = Exact::new(system, 1000).map_err(|e| e.to_string())?;
    let end = exact.advance_with_variation(system, (0.0, TAU), &mut a, &mut phi_a, &mut seen_a);
    let options = Dopri5Options {
        relative: 1e-12,
        absolute: 1e-14,
        ..Dopri5Options::default()
    };
    let mut dopri5 = Dopri5::new(system, options);
    let end_b = dopri5.advance_with_variation(system, (0.0, TAU), &mut b, &mut phi_b, &mut seen_b);
    if (end, end_b) != (IntegrationEnd::Reached, IntegrationEnd::Reached) {
        return Err(format!("{end:?} {end_b:?}"));
    }
    if seen_a.0.len() != seen_b.0.len() {
        return Err(format!(
            "{} switches against {}",
            seen_a.0.len(),
            seen_b.0.len()
        ));
    }
    let gap = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    let phi_gap = (&phi_a - &phi_b).amax();
    let same = seen_a
        .0
        .iter()
        .zip(&seen_b.0)
        .all(|(s, t)| (s.tau - t.tau).abs() < 1e-8);
    if gap > 1e-9 || phi_gap > 1e-6 || !same {
        return Err(format!(
            "state {gap:e}, Phi {phi_gap:e}, same instants: {same}"
        ));
    }
    // det Phi = exp(-trace(Gam) T) for laws that do not depend on velocity.
    let exponent = -system.damping().trace() * TAU / system.omega();
    let determinant = phi_a.determinant() / exponent.exp();
    if (determinant - 1.0).abs() > 1e-8 && exponent > -15.0 {
        return Err(format!("det Phi off by {:e}", determinant - 1.0));
    }
    Ok(())
}

#[test]
fn random_trains_over_one_period() {
    let config = Config {
        cases: 150,
        rng_seed: RngSeed::Fixed(1995),
        failure_persistence: None,
        ..Config::default()
    };
    let numbers = proptest::collection::vec(0.0..1.0_f64, 97);
    TestRunner::new(config)
        .run(
            &(2..9_usize, proptest::bool::ANY, numbers),
            |(n, is_loop, x)| {
                let system = train(n, is_loop, &x, mount);
                compare(&system, &x).map_err(proptest::test_runner::TestCaseError::fail)
            },
        )
        .unwrap();
}
