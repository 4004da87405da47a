//! DOPRI5 against reference values, closed forms and its own invariants.

mod common;

use common::{backlash, floats, load, matrix, reference};
use gearlash::element::{Backlash, Cubic, ImpactDampingLaw, Linear, OneSided, Side};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{
    Dopri5, Dopri5Options, IntegrationEnd, Integrator, Observer, Segment, Switch,
};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{PI, TAU};

/// Remembers what it is shown.
#[derive(Default)]
struct Log {
    switches: Vec<Switch>,
    segments: Vec<(f64, f64, Vec<f64>)>,
}

impl Observer for Log {
    fn segment(&mut self, s: &Segment<'_>) {
        self.segments
            .push((s.tau, s.width, s.coefficients.to_vec()));
    }
    fn switch(&mut self, switch: &Switch) {
        self.switches.push(*switch);
    }
}

fn tight() -> Dopri5Options {
    Dopri5Options {
        relative: 1e-12,
        absolute: 1e-14,
        ..Default::default()
    }
}

fn advance(system: &System, options: Dopri5Options, span: (f64, f64), state: &mut [f64]) -> Log {
    let mut log = Log::default();
    let end = Dopri5::new(system, options).advance(system, span, state, &mut log);
    assert_eq!(end, IntegrationEnd::Reached);
    log
}

fn transition(
    system: &System,
    options: Dopri5Options,
    end: f64,
    state: &mut [f64],
) -> DMatrix<f64> {
    let mut phi = DMatrix::identity(state.len(), state.len());
    let mut integrator = Dopri5::new(system, options);
    let outcome = integrator.advance_with_variation(system, (0.0, end), state, &mut phi, &mut ());
    assert_eq!(outcome, IntegrationEnd::Reached);
    phi
}

/// One coordinate: x'' + gamma x' + kappa f(x) = load.
fn single(gamma: f64, mount: Mount, mean: f64, cos: f64) -> System {
    let one = |x| DMatrix::from_element(1, 1, x);
    System::new(
        one(gamma),
        one(1.0),
        one(1.0),
        vec![mount],
        vec![load(1, 0, mean, cos)],
    )
    .unwrap()
}

/// The system of an entry of `flow_one_period.json`. kappa^(1/2) = [[r + 1, r - 1], [r - 1, r + 1]] / 2.
fn flow_system(entry: &serde_json::Value) -> System {
    let x = if entry["case"] == 1 {
        1.0
    } else {
        0.5 * (1.36_f64.powi(2) - 1.0)
    };
    let (zeta, r) = (entry["zeta"].as_f64().unwrap(), (1.0 + 2.0 * x).sqrt());
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0 + x, x, x, 1.0 + x]);
    let (a, b) = (zeta * (r + 1.0), zeta * (r - 1.0));
    let gamma = DMatrix::from_row_slice(2, 2, &[a, b, b, a]);
    let mounts = floats(&entry["b"]).into_iter().map(backlash).collect();
    let loads = vec![load(2, 0, 0.5, 0.25), load(2, 1, 0.5, 0.0)];
    let mut system = System::new(gamma, kappa, DMatrix::identity(2, 2), mounts, loads).unwrap();
    system.set_excitation_frequency(entry["omega"].as_f64().unwrap());
    system
}

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
fn free_flight_and_impact_times() {
    // No load, no damping: x = v T inside the gap, half a sine of frequency 1 on either flank.
    let (b, v) = (0.3, 0.7);
    let system = single(0.0, backlash(b), 0.0, 0.0);
    let mut state = [0.0, v];
    let log = advance(&system, tight(), (0.0, 20.0), &mut state);
    let contact = b / v;
    let wanted: Vec<f64> = (0..6)
        .flat_map(|k| {
            let begin = contact + k as f64 * (2.0 * contact + PI);
            [begin, begin + PI]
        })
        .filter(|t| *t < 20.0)
        .collect();
    let taus: Vec<f64> = log.switches.iter().map(|s| s.tau).collect();
    assert_eq!(taus.len(), wanted.len());
    for (found, wanted) in taus.iter().zip(&wanted) {
        assert!((found - wanted).abs() < 1e-9, "{found} instead of {wanted}");
    }
    let flanks: Vec<(i8, i8)> = log.switches.iter().map(|s| (s.from, s.to)).collect();
    assert_eq!(flanks[..4], [(0, 1), (1, 0), (0, -1), (-1, 0)]);
    for (k, s) in log.switches.iter().enumerate() {
        let sign = if (k + 1) / 2 % 2 == 0 { 1.0 } else { -1.0 };
        assert!((s.velocity - sign * v).abs() < 1e-9, "{}", s.velocity);
        assert_eq!(s.level.abs(), b);
    }
    // Every segment stays on one side of every breakpoint.
    for (_, _, c) in &log.segments {
        let ends = [c[0], c.iter().sum::<f64>()];
        assert!(
            ends.iter().all(|x| x.abs() <= b + 1e-14) || ends.iter().all(|x| x.abs() >= b - 1e-14)
        );
    }
}

#[test]
fn bilinear_oscillator() {
    // slope 1 for x < 0 and 4 beyond: period pi + pi / 2
    let mount = Mount::new(Box::new(gearlash::element::PiecewiseLinear {
        breakpoints: vec![0.0],
        slopes: vec![1.0, 4.0],
    }));
    let system = single(0.0, mount, 0.0, 0.0);
    let mut state = [0.0, 1.0];
    let log = advance(&system, tight(), (0.0, 15.0 * PI), &mut state);
    assert!(
        state[0].abs() < 1e-9 && (state[1] - 1.0).abs() < 1e-9,
        "{state:?}"
    );
    // ten periods of two switches; the start on the breakpoint is none, the end on it may be one
    let count = log.switches.len();
    assert!(count == 19 || count == 20, "{count}");
}

/// Free flight under a constant load: x = x0 + v T + F T^2 / 2, highest at -v^2 / (2 F) above x0.
#[test]
fn graze_from_both_sides() {
    for sign in [1.0, -1.0] {
        for (height, count) in [(1e-6, 2), (1e-9, 2), (-1e-9, 0), (-1e-6, 0)] {
            let (force, b) = (-sign, 1.0);
            let v = sign * (2.0_f64 * (b + height)).sqrt();
            let system = single(0.0, backlash(b), force, 0.0);
            let mut state = [0.0, v];
            let log = advance(&system, tight(), (0.0, 2.5), &mut state);
            assert_eq!(log.switches.len(), count, "height {height:e}");
        }
        // An exact touch: with or without a pair of switches, the motion is the same.
        let system = single(0.0, backlash(1.0), -sign, 0.0);
        let mut state = [0.0, sign * 2.0_f64.sqrt()];
        let log = advance(&system, tight(), (0.0, 2.5), &mut state);
        assert!(log.switches.len() % 2 == 0);
        assert!((sign * state[0] - (2.0_f64.sqrt() * 2.5 - 3.125)).abs() < 1e-9);
    }
    // From inside the contact: the load holds x near 1.5, the orbit just reaches the breakpoint.
    for (height, count) in [(1e-6, 2), (-1e-6, 0)] {
        let system = single(0.0, backlash(1.0), 0.5, 0.0);
        let mut state = [2.0 + height, 0.0];
        let log = advance(&system, tight(), (0.0, TAU), &mut state);
        assert_eq!(log.switches.len(), count, "height {height:e}");
    }
}

#[test]
fn two_crossings_inside_one_step() {
    // Free flight is a parabola, exact in one step of any length: up through 1 and back, both ends inside the gap.
    let stop = Mount::new(Box::new(OneSided {
        gap: 1.0,
        side: Side::Positive,
    }));
    let system = single(0.0, stop, -0.1, 0.0);
    let loose = Dopri5Options {
        relative: 1e-3,
        absolute: 1e-3,
        ..Default::default()
    };
    let v = 0.2_f64.sqrt() * (1.0 + 1e-4);
    let mut state = [0.0, v];
    let log = advance(&system, loose, (0.0, 2.0 * v / 0.1), &mut state);
    assert_eq!(log.switches.len(), 2);
    assert!(log.segments.iter().any(|s| s.1 > 3.0), "steps are long");
}

#[test]
fn start_on_a_breakpoint_and_restart() {
    for (state, count) in [([1.0, 0.5], 1), ([1.0, -0.5], 1), ([-1.0, -0.5], 1)] {
        let system = single(0.0, backlash(1.0), 0.0, 0.0);
        let mut state = state;
        // to the other end of the contact, or across the gap
        let log = advance(&system, tight(), (0.0, 4.2), &mut state);
        assert_eq!(log.switches.len(), count, "{:?}", log.switches);
        assert!(log.switches[0].tau > 3.0);
    }
    // Stopped at each switch and started again there: the same switches, none twice.
    let entry = &reference("flow_one_period")[2];
    let system = flow_system(entry);
    let whole = advance(&system, tight(), (0.0, TAU), &mut floats(&entry["u"]));
    let mut state = floats(&entry["u"]);
    let mut cuts: Vec<f64> = whole.switches.iter().map(|s| s.tau).collect();
    cuts.push(TAU);
    let (mut begin, mut pieces) = (0.0, Vec::new());
    for cut in cuts {
        pieces.extend(advance(&system, tight(), (begin, cut), &mut state).switches);
        begin = cut;
    }
    assert_eq!(pieces.len(), whole.switches.len());
    for (a, b) in pieces.iter().zip(&whole.switches) {
        assert_eq!((a.connection, a.from, a.to), (b.connection, b.from, b.to));
        assert!((a.tau - b.tau).abs() < 1e-9);
    }
}

#[test]
fn simultaneous_switches() {
    let system = System::new(
        DMatrix::zeros(2, 2),
        DMatrix::identity(2, 2),
        DMatrix::identity(2, 2),
        vec![backlash(1.0), backlash(1.0)],
        vec![load(2, 0, 0.0, 0.1), load(2, 1, 0.0, 0.1)],
    )
    .unwrap();
    let mut state = [0.2, 0.2, 0.9, 0.9];
    let log = advance(&system, tight(), (0.0, TAU), &mut state);
    assert_eq!(state[0], state[1]);
    assert!(log.switches.len() >= 4);
    for pair in log.switches.chunks(2) {
        assert_eq!(pair[0].tau, pair[1].tau);
        assert_eq!((pair[0].connection, pair[1].connection), (0, 1));
    }
}

fn sine(mean: f64, order: usize, cos: f64, sin: f64) -> Periodic {
    Periodic::Fourier {
        mean,
        harmonics: vec![Harmonic { order, cos, sin }],
    }
}

fn impacting(half_gap: f64, law: ImpactDampingLaw) -> Mount {
    Mount::new(Box::new(Backlash {
        half_gap,
        impact_damping: 0.3,
        impact_damping_law: law,
    }))
}

/// Two coordinates, three connections: W is not the identity.
fn loop_system(mounts: Vec<Mount>) -> System {
    let w = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 0.0, 1.0, 0.7, -0.6]);
    let kappa = DMatrix::from_row_slice(2, 3, &[2.0, 0.5, 0.6, 0.4, 1.5, -0.5]);
    let gamma = DMatrix::from_row_slice(2, 2, &[0.08, 0.01, 0.02, 0.06]);
    let loads = vec![load(2, 0, 0.3, 0.4), load(2, 1, 0.2, -0.3)];
    let mut system = System::new(gamma, kappa, w, mounts, loads).unwrap();
    system.set_excitation_frequency(0.83);
    system
}

fn awkward_mounts() -> Vec<Mount> {
    let mut a = impacting(0.2, ImpactDampingLaw::Dissipative);
    a.stiffness_variation = Some(Periodic::Rectangular {
        high: 1.2,
        low: 0.8,
        duty: 0.5,
        phase: 0.4,
        base_order: 3,
    });
    a.transmission_error = Some(sine(0.0, 4, 0.05, 0.02));
    let mut b = Mount::new(Box::new(Cubic { cubic: 0.4 }));
    b.stiffness_variation = Some(sine(1.0, 2, 0.2, 0.1));
    b.transmission_error = Some(Periodic::Table {
        values: vec![0.0, 0.03, -0.02, 0.05, -0.04],
        base_order: 2,
    });
    let mut c = impacting(0.1, ImpactDampingLaw::Literal);
    c.transmission_error = Some(sine(0.01, 1, 0.0, 0.1));
    vec![a, b, c]
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
fn transmission_error_switches_an_idle_mesh() {
    // At rest, open: only e = 0.5 cos(20 phase) moves the deformation, through -0.4 twice a period of it.
    let mut mount = backlash(1.0);
    mount.element = Box::new(OneSided {
        gap: 0.4,
        side: Side::Negative,
    });
    mount.transmission_error = Some(sine(0.0, 20, 0.5, 0.0));
    // a weak mesh: kappa = 0 keeps the mass at rest
    let zero = DMatrix::zeros(1, 1);
    let one = DMatrix::from_element(1, 1, 1.0);
    let system = System::new(
        zero.clone(),
        zero,
        one,
        vec![mount],
        Vec::<LoadSource>::new(),
    )
    .unwrap();
    let log = advance(
        &system,
        Dopri5Options::default(),
        (0.0, TAU),
        &mut [0.0, 0.0],
    );
    assert_eq!(log.switches.len(), 40);
    let first = 0.8_f64.acos() / 20.0;
    assert!((log.switches[0].tau - first).abs() < 1e-12);
    assert!(log.switches.iter().all(|s| s.velocity.abs() > 5.9));
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
    for kind in [LoadKind::Value, LoadKind::Rate] {
        let direction = DVector::from_vec(vec![1.0]);
        let one = DMatrix::from_element(1, 1, 1.0);
        let loads = vec![LoadSource {
            direction,
            series: series.clone(),
            kind,
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
        let quarter = TAU / 4.0;
        let wanted = match kind {
            LoadKind::Value => quarter * (0.5 + 0.75 + 0.4 * 0.5 * (0.5 + 0.1)),
            LoadKind::Rate => 0.1,
        };
        assert!(
            (state[1] - wanted).abs() < 1e-12,
            "{kind:?}: {} {wanted}",
            state[1]
        );
    }
}
