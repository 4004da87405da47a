//! The exact flow against states and transition matrices of an independent program, closed forms and identities.

use crate::common::{backlash, floats, load, matrix, reference};
use gearlash::element::{Linear, OneSided, Side};
use gearlash::numeric::periodic::Periodic;
use gearlash::solve::integrate::{
    Exact, FlowObserver, IntegrationEnd, Integrator, IntegratorChoice, Segment, Switch, choose,
};
use gearlash::system::{Mount, System};
use nalgebra::DMatrix;
use std::f64::consts::{PI, TAU};

#[derive(Default)]
struct Log {
    switches: Vec<Switch>,
    segments: usize,
    /// Largest gap between the state at a segment's begin and the one before.
    gap: f64,
    last: Option<Vec<f64>>,
}

impl FlowObserver for Log {
    fn segment(&mut self, segment: &Segment<'_>) {
        let n = segment.coefficients.len() / segment.count;
        let mut state = vec![0.0; 2 * n];
        segment.state(0.0, 1.0, &mut state);
        if let Some(last) = &self.last {
            self.gap = (0..n).fold(self.gap, |m, i| m.max((last[i] - state[i]).abs()));
        }
        segment.state(1.0, 1.0, &mut state);
        self.last = Some(state);
        self.segments += 1;
    }

    fn switch(&mut self, switch: &Switch) {
        self.switches.push(*switch);
    }
}

pub fn idler(case: i64, zeta: f64, gaps: &[f64]) -> System {
    let x = if case == 1 {
        1.0
    } else {
        (1.36_f64.powi(2) - 1.0) / 2.0
    };
    let r = (1.0 + 2.0 * x).sqrt();
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0 + x, x, x, 1.0 + x]);
    let gamma = DMatrix::from_row_slice(2, 2, &[r + 1.0, r - 1.0, r - 1.0, r + 1.0]) * zeta;
    let mounts = gaps.iter().map(|b| backlash(*b)).collect();
    let loads = vec![load(2, 0, 0.5, 0.25), load(2, 1, 0.5, 0.0)];
    System::new(gamma, kappa, DMatrix::identity(2, 2), mounts, loads).unwrap()
}

#[test]
fn one_period_of_the_reverse_idler() {
    let mut worst = (0.0_f64, 0.0_f64);
    for entry in reference("flow_one_period").as_array().unwrap() {
        let mut system = idler(
            entry["case"].as_i64().unwrap(),
            entry["zeta"].as_f64().unwrap(),
            &floats(&entry["b"]),
        );
        system.set_excitation_frequency(entry["omega"].as_f64().unwrap());
        let mut exact = Exact::new(&system, 1000).unwrap();
        let mut state = floats(&entry["u"]);
        let mut phi = DMatrix::identity(4, 4);
        let mut log = Log::default();
        let end = exact.advance_with_variation(&system, (0.0, TAU), &mut state, &mut phi, &mut log);
        assert_eq!(end, IntegrationEnd::Reached);
        let gap = state
            .iter()
            .zip(floats(&entry["Pu"]))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        let phi_gap = (&phi - matrix(&entry["Phi"])).amax();
        worst = (worst.0.max(gap), worst.1.max(phi_gap));
        assert_eq!(
            log.switches.len() as i64,
            entry["nevents"].as_i64().unwrap()
        );
        assert!(log.gap < 1e-13, "segments join: {:e}", log.gap);
        // The plain flow takes other steps and must say the same.
        let mut plain = floats(&entry["u"]);
        exact.advance(&system, (0.0, TAU), &mut plain, &mut ());
        assert!(plain.iter().zip(&state).all(|(a, b)| (a - b).abs() < 1e-12));
        let trace = system.damping().trace() * TAU / system.omega();
        assert!(
            (phi.determinant() / (-trace).exp() - 1.0).abs() < 1e-11,
            "det Phi"
        );
    }
    assert!(
        worst.0 < 1e-12 && worst.1 < 1e-12,
        "state {:e}, Phi {:e}",
        worst.0,
        worst.1
    );
}

#[test]
fn ten_periods_of_the_chaotic_attractor() {
    // P3: x = (1.355^2 - 1)/2, zeta = 0.0285, Q_a1 = 0.215, Om = 1.2, from rest.
    let x = (1.355_f64.powi(2) - 1.0) / 2.0;
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0 + x, x, x, 1.0 + x]);
    let gamma = DMatrix::from_row_slice(2, 2, &[2.355, 0.355, 0.355, 2.355]) * 0.0285;
    let loads = vec![load(2, 0, 0.5, 0.215), load(2, 1, 0.5, 0.0)];
    let mounts = vec![backlash(1.0), backlash(1.0)];
    let mut system = System::new(gamma, kappa, DMatrix::identity(2, 2), mounts, loads).unwrap();
    system.set_excitation_frequency(1.2);
    let mut exact = Exact::new(&system, 1000).unwrap();
    let mut state = vec![0.0; 4];
    assert_eq!(
        exact.advance(&system, (0.0, 10.0 * TAU), &mut state, &mut ()),
        IntegrationEnd::Reached
    );
    for (found, expected) in
        state
            .iter()
            .zip([0.58825073954, 0.82527974846, 0.17936863666, 0.18405848575])
    {
        assert!((found - expected).abs() < 1e-10, "{found} {expected}");
    }
}

fn one(x: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, x)
}

#[test]
fn free_flight_and_undamped_rebounds() {
    // x'' + (x - 1)+ = 0 between two stops at -1 and 1: flight of 2/v and half a cosine of pi in each contact.
    let mut system =
        System::new(one(0.0), one(1.0), one(1.0), vec![backlash(1.0)], vec![]).unwrap();
    system.set_excitation_frequency(1.0);
    let speed = 0.5;
    let period = 2.0 * (2.0 / speed + PI);
    let mut exact = Exact::new(&system, 1000).unwrap();
    let mut state = vec![0.0, speed];
    let mut log = Log::default();
    exact.advance(&system, (0.0, 5.0 * period), &mut state, &mut log);
    assert!(
        state[0].abs() < 1e-12 && (state[1] - speed).abs() < 1e-13,
        "{state:?}"
    );
    assert_eq!(log.switches.len(), 20);
    let first = &log.switches[0];
    assert!((first.tau - 2.0).abs() < 1e-14 && (first.velocity - speed).abs() < 1e-14);
    assert_eq!((first.from, first.to, first.level), (0, 1, 1.0));
}

#[test]
fn resonance_without_damping() {
    // x'' + x = cos t from rest: x = t sin(t) / 2.
    let mut system = System::new(
        one(0.0),
        one(1.0),
        one(1.0),
        vec![Mount::new(Box::new(Linear {}))],
        vec![load(1, 0, 0.0, 1.0)],
    )
    .unwrap();
    system.set_excitation_frequency(1.0);
    let mut state = vec![0.0, 0.0];
    Exact::new(&system, 10)
        .unwrap()
        .advance(&system, (0.0, 7.0), &mut state, &mut ());
    assert!((state[0] - 3.5 * 7.0_f64.sin()).abs() < 1e-13);
    assert!((state[1] - 0.5 * (7.0_f64.sin() + 7.0 * 7.0_f64.cos())).abs() < 1e-13);
}

#[test]
fn a_graze_is_no_switch_and_a_dip_is_two() {
    // Free flight under a constant pull: x = -T^2/2 + v T rises to v^2/2 and falls; the stop is at 0.5.
    let stop = || {
        Mount::new(Box::new(OneSided {
            gap: 0.5,
            side: Side::Positive,
            contact_damping: 0.0,
        }))
    };
    let mut system = System::new(
        one(0.0),
        one(1.0),
        one(1.0),
        vec![stop()],
        vec![load(1, 0, -1.0, 0.0)],
    )
    .unwrap();
    system.set_excitation_frequency(1.0);
    for (speed, switches) in [(1.0 - 1e-7, 0), (1.0 + 1e-7, 2)] {
        let mut log = Log::default();
        let mut state = vec![0.0, speed];
        Exact::new(&system, 10)
            .unwrap()
            .advance(&system, (0.0, 2.2), &mut state, &mut log);
        assert_eq!(log.switches.len(), switches, "speed {speed}");
    }
}

#[test]
fn a_start_on_a_breakpoint_does_not_fire() {
    let mut system =
        System::new(one(0.0), one(1.0), one(1.0), vec![backlash(1.0)], vec![]).unwrap();
    system.set_excitation_frequency(1.0);
    let mut exact = Exact::new(&system, 1000).unwrap();
    for (speed, first) in [(0.5, PI), (-0.5, 4.0)] {
        let mut log = Log::default();
        let mut state = vec![1.0, speed];
        exact.advance(&system, (0.0, 4.5), &mut state, &mut log);
        assert_eq!(log.switches.len(), 1, "{:?}", log.switches);
        assert!(
            (log.switches[0].tau - first).abs() < 1e-14,
            "{:?}",
            log.switches
        );
        // Stopping on the breakpoint and going on is the same motion.
        let mut halted = vec![1.0, speed];
        exact.advance(&system, (0.0, first), &mut halted, &mut ());
        exact.advance(&system, (first, 4.5), &mut halted, &mut ());
        assert!((halted[0] - state[0]).abs() < 1e-13 && (halted[1] - state[1]).abs() < 1e-13);
    }
}

#[test]
fn two_meshes_switch_at_one_instant() {
    // Two equal uncoupled oscillators: every switch is double.
    let kappa = DMatrix::identity(2, 2);
    let mounts = vec![backlash(0.7), backlash(0.7)];
    let loads = vec![load(2, 0, 0.2, 0.4), load(2, 1, 0.2, 0.4)];
    let mut system = System::new(
        DMatrix::identity(2, 2) * 0.1,
        kappa,
        DMatrix::identity(2, 2),
        mounts,
        loads,
    )
    .unwrap();
    system.set_excitation_frequency(0.7);
    let mut log = Log::default();
    let mut state = vec![0.0; 4];
    let end = Exact::new(&system, 1000).unwrap().advance(
        &system,
        (0.0, 40.0 * TAU),
        &mut state,
        &mut log,
    );
    assert_eq!(end, IntegrationEnd::Reached);
    assert_eq!((state[0], state[2]), (state[1], state[3]));
    let of = |e: usize| {
        log.switches
            .iter()
            .filter(|s| s.connection == e)
            .map(|s| s.tau)
            .collect::<Vec<_>>()
    };
    assert!(of(0).len() > 40);
    assert_eq!(of(0).len(), of(1).len());
    assert!(of(0).iter().zip(of(1)).all(|(a, b)| (a - b).abs() < 1e-12));
}

#[test]
fn rectangular_stiffness_is_cut_at_its_steps() {
    // x'' + s(t) x = 0 with s = 1.44 and 0.64: products of rotations.
    let mut mount = Mount::new(Box::new(Linear {}));
    mount.stiffness_variation = Some(Periodic::Rectangular {
        high: 1.44,
        low: 0.64,
        duty: 0.45,
        phase: 0.0,
        base_order: 1,
    });
    let mut system = System::new(one(0.0), one(1.0), one(1.0), vec![mount], vec![]).unwrap();
    system.set_excitation_frequency(0.9);
    let turn = |w: f64, t: f64| {
        DMatrix::from_row_slice(
            2,
            2,
            &[
                (w * t).cos(),
                (w * t).sin() / w,
                -w * (w * t).sin(),
                (w * t).cos(),
            ],
        )
    };
    let period = TAU / 0.9;
    let expected = turn(0.8, 0.55 * period) * turn(1.2, 0.45 * period);
    let mut phi = DMatrix::identity(2, 2);
    let mut state = vec![0.3, -0.2];
    Exact::new(&system, 10).unwrap().advance_with_variation(
        &system,
        (0.0, TAU),
        &mut state,
        &mut phi,
        &mut (),
    );
    assert!((&phi - &expected).amax() < 1e-13);
    let moved = expected * nalgebra::DVector::from_column_slice(&[0.3, -0.2]);
    assert!((state[0] - moved[0]).abs() < 1e-13 && (state[1] - moved[1]).abs() < 1e-13);
}

#[test]
fn laws_that_are_not_affine_are_named() {
    let law = gearlash::element::Cubic { cubic: 0.1 };
    let mounts = vec![backlash(1.0), Mount::new(Box::new(law))];
    let eye = DMatrix::identity(2, 2);
    let system = System::new(eye.clone(), eye.clone(), eye, mounts, vec![]).unwrap();
    let error = choose(&system, IntegratorChoice::Exact).err().unwrap();
    let error = error.to_string();
    assert!(
        error.contains("connection 1") && error.contains("piecewise-affine"),
        "{error}"
    );
    // It has a series, and `auto` says which of the two ran.
    let flow = choose(&system, IntegratorChoice::Auto).unwrap();
    assert_eq!(flow.name(), "series");
    let affine = System::new(one(0.1), one(1.0), one(1.0), vec![backlash(1.0)], vec![]).unwrap();
    let flow = choose(&affine, IntegratorChoice::Auto).unwrap();
    assert_eq!(flow.name(), "exact");
}

#[test]
fn chatter_ends_with_a_reason() {
    let mut system =
        System::new(one(0.0), one(1.0), one(1.0), vec![backlash(1e-6)], vec![]).unwrap();
    system.set_excitation_frequency(0.01);
    let mut state = vec![0.0, 1.0];
    let end = Exact::new(&system, 50)
        .unwrap()
        .advance(&system, (0.0, TAU), &mut state, &mut ());
    assert_eq!(end, IntegrationEnd::TooManySwitches);
}
