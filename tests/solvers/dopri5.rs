//! DOPRI5 against reference values, closed forms and its own invariants.

use crate::common::{backlash, floats, matrix, reference};
use crate::dopri5_support::*;
use gearlash::element::{Cubic, ImpactDampingLaw, Linear};
use gearlash::numeric::periodic::Periodic;
use gearlash::solve::integrate::{Dopri5, Dopri5Options, IntegrationEnd, Integrator, Segment};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{PI, TAU};

#[test]
fn reference_flow_over_one_period() {
    for entry in reference("flow_one_period").as_array().unwrap() {
        let system = flow_system(entry);
        let wanted = DVector::from_vec(floats(&entry["Pu"]));
        let wanted_phi = matrix(&entry["Phi"]);
        let trace = system.damping().trace();
        for (relative, to, to_phi) in [
            (1e-10, 1e-8, 1e-7),
            (1e-11, 1e-9, 1e-8),
            (1e-12, 1e-10, 1e-9),
        ] {
            let options = Dopri5Options {
                relative,
                absolute: 1e-2 * relative,
                ..Default::default()
            };
            let mut state = floats(&entry["u"]);
            let log = advance(&system, options, (0.0, TAU), &mut state);
            let error = (DVector::from_vec(state) - &wanted).amax();
            assert!(error < to, "state: {error:e} at {relative:e}");
            assert_eq!(
                log.switches.len(),
                entry["nevents"].as_u64().unwrap() as usize
            );

            let mut state = floats(&entry["u"]);
            let phi = transition(&system, options, TAU, &mut state);
            let error = (DVector::from_vec(state) - &wanted).amax();
            assert!(error < to, "state beside Phi: {error:e} at {relative:e}");
            let error = (&phi - &wanted_phi).amax();
            assert!(error < to_phi, "Phi: {error:e} at {relative:e}");
            // Liouville: det Phi = exp(-trace(Gam) T)
            let det = (-trace * TAU / system.omega()).exp();
            let error = (phi.determinant() - det).abs();
            assert!(error < 1e-8, "det Phi: {error:e} at {relative:e}");
        }
    }
}

#[test]
fn phi_against_finite_differences() {
    let mut systems = vec![loop_system(awkward_mounts())];
    systems[0].set_subharmonic(2);
    let mut smooth = Mount::new(Box::new(Cubic { cubic: 0.5 }));
    smooth.stiffness_variation = Some(sine(1.0, 1, 0.3, 0.0));
    smooth.transmission_error = Some(sine(0.0, 2, 0.1, 0.0));
    systems.push(single(0.05, smooth, 0.2, 0.3));
    systems.push(single(
        0.05,
        impacting(0.0, ImpactDampingLaw::Dissipative),
        0.1,
        0.5,
    ));
    for system in &systems {
        let n = system.dof();
        let start: Vec<f64> = (0..2 * n).map(|k| 0.4 - 0.23 * k as f64).collect();
        let mut state = start.clone();
        let phi = transition(system, tight(), TAU, &mut state);
        let step = 1e-5;
        for j in 0..2 * n {
            let ends = [step, -step].map(|d| {
                let mut state = start.clone();
                state[j] += d;
                advance(system, tight(), (0.0, TAU), &mut state);
                DVector::from_vec(state)
            });
            let column = (&ends[0] - &ends[1]) / (2.0 * step);
            // 1e-12 / 1e-5 of the integration, step^2 of the difference: one-sided second derivatives at switches
            let error = (column - phi.column(j)).amax();
            assert!(error < 2e-5 * phi.amax().max(1.0), "column {j}: {error:e}");
        }
    }
}

#[test]
fn variation_composes() {
    let system = loop_system(awkward_mounts());
    let start = [0.4, 0.1, -0.2, 0.3];
    let mut state = start;
    let whole = transition(&system, tight(), TAU, &mut state);
    let (mut state, mut phi) = (start, DMatrix::identity(4, 4));
    let mut integrator = Dopri5::new(&system, tight());
    for k in 0..7 {
        let span = (f64::from(k) * TAU / 7.0, f64::from(k + 1) * TAU / 7.0);
        integrator.advance_with_variation(&system, span, &mut state, &mut phi, &mut ());
    }
    assert!(
        (&phi - &whole).amax() < 1e-9,
        "{:e}",
        (&phi - &whole).amax()
    );
}

/// Work of the loads and of damping over each segment by Gauss quadrature on the dense output.
#[test]
fn energy_balance() {
    let entry = &reference("flow_one_period")[0];
    let system = flow_system(entry);
    let mut state = floats(&entry["u"]);
    let potential = |q: &[f64]| -> f64 {
        let b = floats(&entry["b"]);
        let p: Vec<f64> = q.iter().zip(&b).map(|(q, b)| q - q.clamp(-b, *b)).collect();
        0.5 * p.iter().map(|p| p * p).sum::<f64>()
    };
    // kappa = M^-1 with P = I: multiply by kappa^-1 to get energies.
    let inverse = system.stiffness().clone().try_inverse().unwrap();
    let energy = |s: &[f64]| {
        let v = DVector::from_column_slice(&s[2..]);
        0.5 * v.dot(&(&inverse * &v)) + potential(&s[..2])
    };
    let before = energy(&state);
    let log = advance(&system, tight(), (0.0, TAU), &mut state);
    let nodes = [
        -0.906179845938664,
        -0.5384693101056831,
        0.0,
        0.5384693101056831,
        0.906179845938664,
    ];
    let weights = [
        0.2369268850561891,
        0.4786286704993665,
        0.5688888888888889,
        0.4786286704993665,
        0.2369268850561891,
    ];
    let mut work = 0.0;
    for (tau, width, c) in &log.segments {
        let segment = Segment {
            tau: *tau,
            width: *width,
            coefficients: c,
            count: 6,
        };
        for (x, weight) in nodes.iter().zip(&weights) {
            let x = 0.5 + 0.5 * x;
            let mut s = [0.0; 4];
            segment.state(x, system.omega(), &mut s);
            let v = DVector::from_column_slice(&s[2..]);
            let load = DVector::from_vec(vec![0.5 + 0.25 * (tau + x * width).cos(), 0.5]);
            let power = v.dot(&(&inverse * (load - system.damping() * &v)));
            work += 0.5 * weight * width / system.omega() * power;
        }
    }
    let error = (energy(&state) - before - work).abs();
    assert!(error < 1e-10, "{error:e}");
}

#[test]
fn rectangular_stiffness_in_closed_form() {
    // x'' + s(T) x = 0, s = 1.5 for half a turn, then 0.5.
    let mut mount = Mount::new(Box::new(Linear {}));
    mount.stiffness_variation = Some(Periodic::Rectangular {
        high: 1.5,
        low: 0.5,
        duty: 0.5,
        phase: 0.0,
        base_order: 1,
    });
    let system = single(0.0, mount, 0.0, 0.0);
    let half = |s: f64| {
        let (w, (sin, cos)) = (s.sqrt(), (s.sqrt() * PI).sin_cos());
        DMatrix::from_row_slice(2, 2, &[cos, sin / w, -w * sin, cos])
    };
    let wanted = half(0.5) * half(1.5);
    for turns in [0.0, 40.0] {
        let (mut state, mut phi) = ([0.3, -0.1], DMatrix::identity(2, 2));
        let span = (turns * TAU, (turns + 1.0) * TAU);
        let mut integrator = Dopri5::new(&system, tight());
        integrator.advance_with_variation(&system, span, &mut state, &mut phi, &mut ());
        assert!(
            (&phi - &wanted).amax() < 1e-10,
            "{:e}",
            (&phi - &wanted).amax()
        );
        let end = &wanted * DVector::from_vec(vec![0.3, -0.1]);
        assert!((end - DVector::from_column_slice(&state)).amax() < 1e-10);
    }
}

#[test]
fn calls_depend_on_their_arguments_only() {
    let system = loop_system(awkward_mounts());
    let start = [0.4, 0.1, -0.2, 0.3];
    let mut used = Dopri5::new(&system, Dopri5Options::default());
    let mut elsewhere = [1.0, -2.0, 0.5, 0.1];
    used.advance(&system, (0.3, 9.0), &mut elsewhere, &mut ());
    let (mut a, mut b) = (start, start);
    used.advance(&system, (0.0, TAU), &mut a, &mut ());
    Dopri5::new(&system, Dopri5Options::default()).advance(&system, (0.0, TAU), &mut b, &mut ());
    assert_eq!(a, b);
}

#[test]
fn reasons_to_stop() {
    let system = loop_system(awkward_mounts());
    let run = |system: &System, options: Dopri5Options, span: f64| {
        let mut state = vec![0.4; 2 * system.dof()];
        Dopri5::new(system, options).advance(system, (0.0, span), &mut state, &mut ())
    };
    let few = Dopri5Options {
        max_steps: 5,
        ..Default::default()
    };
    assert_eq!(run(&system, few, TAU), IntegrationEnd::MaxSteps);
    let chatter = Dopri5Options {
        max_switches: 1,
        ..Default::default()
    };
    assert_eq!(run(&system, chatter, TAU), IntegrationEnd::TooManySwitches);
    let softening = single(0.0, Mount::new(Box::new(Cubic { cubic: -1.0 })), 2.0, 0.0);
    assert_eq!(
        run(&softening, Dopri5Options::default(), 50.0),
        IntegrationEnd::Diverged
    );
    let unstable = single(-1.0, Mount::new(Box::new(Linear {})), 0.0, 0.1);
    assert_eq!(
        run(&unstable, Dopri5Options::default(), 2000.0),
        IntegrationEnd::Diverged
    );
}

/// A load that is a table: kinks of its value (and jumps of its rate) end the steps.
#[test]
fn table_loads() {
    let series = Periodic::Table {
        values: vec![0.0, 1.0, 0.5, -0.5],
        base_order: 1,
    };
    let quarter = TAU / 4.0;
    let moved = quarter * (0.5 + 0.75 + 0.4 * 0.5 * (0.5 + 0.1));
    for (kind, wanted) in [(LoadKind::Value, moved), (LoadKind::Rate, 0.1)] {
        let direction = DVector::from_vec(vec![1.0]);
        let one = DMatrix::from_element(1, 1, 1.0);
        let loads = vec![LoadSource {
            direction,
            series: series.clone(),
            kind: kind.clone(),
        }];
        // free: the velocity is the integral of the load, for a rate its change
        let system = System::new(0.0 * &one, 0.0 * &one, one, vec![backlash(1.0)], loads).unwrap();
        let mut state = [0.0, 0.0];
        advance(
            &system,
            Dopri5Options::default(),
            (0.0, 0.6 * TAU),
            &mut state,
        );
        assert!(
            (state[1] - wanted).abs() < 1e-12,
            "{kind:?}: {} {wanted}",
            state[1]
        );
    }
}
