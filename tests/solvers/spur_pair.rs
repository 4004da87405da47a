//! The gear pair with mesh stiffness that varies and a transmission error, against an independent program: orbits on the sweep
//! up and down, multipliers, folds.

use crate::common::{backlash, reference, shoot};
use crate::crosscheck_series::closely;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::events::EventKind;
use gearlash::solve::integrate::{
    FlowObserver, IntegrationEnd, Integrator, IntegratorChoice, Switch, choose,
};
use gearlash::system::{LoadKind, LoadSource, System};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use std::f64::consts::TAU;

/// Unit of displacement [m].
const LENGTH: f64 = 1e-5;

/// The pair and its unit of frequency [rad/s]: the natural frequency in permanent contact, so that kappa = 1.
struct Pair {
    system: System,
    frequency: f64,
}

fn harmonics(list: &Value, mean: f64, unit: f64) -> Periodic {
    let harmonic = |h: &Value| {
        let (amplitude, phase) = (number(h, "amplitude") / unit, number(h, "phase"));
        Harmonic {
            order: number(h, "order_of_mesh") as usize,
            cos: amplitude * phase.cos(),
            sin: -amplitude * phase.sin(),
        }
    };
    let harmonics = list.as_array().unwrap().iter().map(harmonic).collect();
    Periodic::Fourier { mean, harmonics }
}

fn number(record: &Value, key: &str) -> f64 {
    record[key].as_f64().unwrap()
}

fn pair(parameters: &Value) -> Pair {
    let of = |key: &str| number(parameters, key);
    let (mass, radius) = (of("equivalent_mass"), of("base_radius"));
    let frequency = (of("mean_stiffness") / mass).sqrt();
    let gamma = of("dashpot") / (mass * frequency);
    let force = radius * (of("torque_A") / of("inertia_A") + of("torque_B") / of("inertia_B"));
    let error = harmonics(&parameters["transmission_error"], 0.0, LENGTH);
    let mut mesh = backlash(of("half_gap") / LENGTH);
    mesh.stiffness_variation = Some(harmonics(
        &parameters["relative_stiffness_variation"],
        1.0,
        1.0,
    ));
    mesh.transmission_error = Some(error.clone());
    let load = |direction: f64, series, kind| LoadSource {
        direction: DVector::from_element(1, direction),
        series,
        kind,
    };
    let mean = Periodic::Fourier {
        mean: force / (LENGTH * frequency * frequency),
        harmonics: vec![],
    };
    // The dashpot acts on the rate of the deformation, q' - e'.
    let loads = vec![
        load(1.0, mean, LoadKind::Value),
        load(gamma, error, LoadKind::Rate),
    ];
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let system = System::new(one(gamma), one(1.0), one(1.0), vec![mesh], loads).unwrap();
    Pair { system, frequency }
}

#[derive(Default)]
struct Count(usize);

impl FlowObserver for Count {
    fn switch(&mut self, _: &Switch) {
        self.0 += 1;
    }
}

/// Largest multiplier of a transition matrix of two columns.
fn largest(phi: &DMatrix<f64>) -> f64 {
    let (half, product) = (0.5 * phi.trace(), phi.determinant());
    let square = half * half - product;
    match square > 0.0 {
        true => half.abs() + square.sqrt(),
        false => product.sqrt(),
    }
}

#[test]
fn orbits_multipliers_and_switches_of_the_sweep() {
    let data = reference("spur_pair_dte");
    let case = &data["cases"][0];
    let Pair {
        mut system,
        frequency,
    } = pair(&case["parameters"]);
    let mut count = 0;
    for values in case["sweep_values"].as_array().unwrap() {
        let hertz = number(values, "mesh_frequency_hz");
        system.set_excitation_frequency(TAU * hertz / frequency);
        for direction in ["up", "down"] {
            let orbit = &values[direction];
            let start = [
                number(orbit, "initial_dte") / LENGTH,
                number(orbit, "initial_dte_rate") / (LENGTH * frequency),
            ];
            let mut flow = choose(&system, IntegratorChoice::Auto).unwrap();
            assert_eq!(flow.name(), "series");
            let (mut state, mut phi) = (start, DMatrix::identity(2, 2));
            let mut switches = Count::default();
            let end = flow.advance_with_variation(
                &system,
                (0.0, TAU),
                &mut state,
                &mut phi,
                &mut switches,
            );
            assert_eq!(end, IntegrationEnd::Reached);
            let place = format!("{hertz} Hz, {direction}");
            // The states have twelve digits and are of the order of the largest one, 8.
            for (a, b) in state.iter().zip(&start) {
                assert!((a - b).abs() < 2e-10, "{place}: {state:?}, not {start:?}");
            }
            // Multipliers of the reference are good to about 1e-9: both directions give the same one where there is one orbit.
            let wanted = number(orbit, "largest_multiplier");
            assert!(
                (largest(&phi) - wanted).abs() < 1e-8,
                "{place}: {}",
                largest(&phi)
            );
            assert_eq!(switches.0 as f64, number(orbit, "switchings"), "{place}");
            let mut other = closely(&system);
            let (mut second, mut other_phi) = (start, DMatrix::identity(2, 2));
            other.advance_with_variation(&system, (0.0, TAU), &mut second, &mut other_phi, &mut ());
            let apart = (0..2).map(|i| (state[i] - second[i]).abs());
            assert!(
                apart.fold(0.0, f64::max) < 1e-10,
                "{place}: {state:?} {second:?}"
            );
            assert!(
                (largest(&phi) - largest(&other_phi)).abs() < 1e-9,
                "{place}"
            );
            count += 1;
        }
    }
    assert_eq!(count, 24);
}

#[test]
fn folds_where_the_sweep_jumps() {
    let data = reference("spur_pair_dte");
    let case = &data["cases"][0];
    let Pair { system, frequency } = pair(&case["parameters"]);
    let omega = |hertz: f64| TAU * hertz / frequency;
    let branch = shoot(
        &system,
        (omega(3400.0), omega(1250.0)),
        &[],
        IntegratorChoice::Auto,
        0.1,
    );
    let folds: Vec<f64> = (branch.events.iter())
        .filter(|e| e.kind == EventKind::Fold)
        .map(|e| e.lambda * frequency / TAU)
        .collect();
    let jumps = case["jumps"].as_array().unwrap();
    assert_eq!(folds.len(), jumps.len(), "{folds:?}");
    for jump in jumps {
        let wanted = number(jump, "fold_extrapolated_hz");
        let near = |fold: &f64| (fold / wanted - 1.0).abs() < 1e-5;
        assert!(folds.iter().any(near), "{wanted} Hz is not among {folds:?}");
    }
}
