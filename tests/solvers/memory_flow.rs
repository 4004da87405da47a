//! Sliders, rigid stops and held contacts in the exact flow, against an independent program, closed forms and differences.

use crate::common::{floats, load, matrix, reference};
use gearlash::element::{
    Element, Jenkins, Linear, OneSided, PiecewiseLinear, Preloaded, RigidStop, Side,
};
use gearlash::numeric::eigenvalues::eigenvalues;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::integrate::{
    FlowObserver, IntegrationEnd, Integrator, IntegratorChoice, Switch, SwitchKind, choose,
};
use gearlash::solve::newton::{Newton, NewtonOptions};
use gearlash::solve::residual::{PeriodicResidual, Residual};
use gearlash::solve::shooting::Shooting;
use gearlash::system::{Mount, System};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use std::f64::consts::{PI, TAU};

#[derive(Default)]
struct Log(Vec<Switch>);

impl FlowObserver for Log {
    fn switch(&mut self, switch: &Switch) {
        self.0.push(*switch);
    }
}

/// Connections of the elements of a reference record: a base, sliders and stops in parallel, on one coordinate each.
struct Parts {
    laws: Vec<Box<dyn Element>>,
    columns: Vec<DVector<f64>>,
    rows: Vec<usize>,
}

impl Parts {
    fn add(&mut self, law: impl Element + 'static, column: DVector<f64>, row: usize) {
        self.laws.push(Box::new(law));
        self.columns.push(column);
        self.rows.push(row);
    }
}

pub(crate) fn system(record: &Value) -> System {
    let p = &record["parameters"];
    let (kappa, gamma) = (matrix(&p["kappa"]), matrix(&p["Gam"]));
    let n = kappa.nrows();
    let mut parts = Parts {
        laws: Vec::new(),
        columns: Vec::new(),
        rows: Vec::new(),
    };
    for (i, e) in p["elements"].as_array().unwrap().iter().enumerate() {
        let column: DVector<f64> = kappa.column(i).into();
        let slopes = e.get("slopes").map_or(vec![1.0], floats);
        match e.get("breakpoints").map(floats) {
            Some(breakpoints) => parts.add(
                PiecewiseLinear {
                    breakpoints,
                    slopes,
                },
                column.clone(),
                i,
            ),
            None if slopes[0] != 0.0 => parts.add(Linear {}, &column * slopes[0], i),
            None => {}
        }
        for slider in e
            .get("sliders")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
        {
            let [stiffness, force] = floats(slider)[..] else {
                panic!("a slider is two numbers");
            };
            let slip_force = force / stiffness;
            parts.add(Jenkins { slip_force }, &column * stiffness, i);
        }
        if let Some(stop) = e.get("rigid") {
            let restitution = stop["r"].as_f64().unwrap();
            for (key, side, sign) in [("hi", Side::Positive, 1.0), ("lo", Side::Negative, -1.0)] {
                if let Some(level) = stop.get(key).and_then(Value::as_f64) {
                    let law = RigidStop {
                        gap: sign * level,
                        side: Some(side),
                        restitution,
                        least_impact: 1e-9,
                    };
                    parts.add(law, column.clone(), i);
                }
            }
        }
    }
    let (mean, cos) = (floats(&p["Qm"]), floats(&p["Qa"]));
    let loads = (0..n).map(|i| load(n, i, mean[i], cos[i])).collect();
    let map = DMatrix::from_fn(parts.rows.len(), n, |e, i| {
        f64::from(u8::from(parts.rows[e] == i))
    });
    let stiffness = DMatrix::from_columns(&parts.columns);
    let mounts = parts.laws.into_iter().map(Mount::new).collect();
    let mut system = System::new(gamma, stiffness, map, mounts, loads).unwrap();
    system.set_excitation_frequency(p["omega"].as_f64().unwrap_or(1.0));
    system.set_subharmonic(record["periods"].as_u64().unwrap_or(1) as usize);
    system
}

pub(crate) fn state(record: &Value) -> Vec<f64> {
    let parts = ["q", "v", "z"].map(|key| record.get(key).map_or(Vec::new(), floats));
    parts.concat()
}

fn flow(system: &System) -> Box<dyn Integrator + Send> {
    let flow = choose(system, IntegratorChoice::Exact).unwrap();
    assert_eq!(flow.name(), "exact");
    flow
}

fn gap(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
}

#[test]
fn orbits_close_with_the_multipliers_of_an_independent_program() {
    for record in reference("memory")["orbits"].as_array().unwrap() {
        let name = record["name"].as_str().unwrap();
        let system = system(record);
        let start = state(record);
        let mut end = start.clone();
        let mut phi = DMatrix::identity(start.len(), start.len());
        let mut flow = flow(&system);
        let ended = flow.advance_with_variation(&system, (0.0, TAU), &mut end, &mut phi, &mut ());
        assert_eq!(ended, IntegrationEnd::Reached, "{name}");
        assert!(gap(&start, &end) < 2e-11, "{name}: {start:?} {end:?}");
        let mut plain = start.clone();
        flow.advance(&system, (0.0, TAU), &mut plain, &mut ());
        assert!(gap(&plain, &end) < 1e-12, "{name}");
        // The reference ends a chatter early: differences of this flow give the same multipliers as its transition matrix, 3e-8 off.
        let chatters = record["impacts"].is_string() && start.len() > 2;
        let allowed = if chatters { 1e-7 } else { 1e-9 };
        let found = eigenvalues(&phi).unwrap();
        for mu in record["multipliers"].as_array().unwrap() {
            let [re, im] = floats(mu)[..] else {
                panic!("{name}");
            };
            let nearest = found.iter().map(|x| (x.re - re).hypot(x.im - im));
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert!(nearest < allowed, "{name}: {re} {im} not among {found:?}");
        }
    }
}

#[test]
fn a_slider_decays_through_the_instants_of_the_closed_form() {
    for record in reference("memory")["free_decay"].as_array().unwrap() {
        let mut system = system(record);
        system.set_excitation_frequency(TAU / 60.0);
        let initial = &record["parameters"]["initial"];
        let mut state = ["q", "v", "z"].map(|k| initial[k].as_f64().unwrap());
        let mut log = Log::default();
        let end = flow(&system).advance(&system, (0.0, TAU), &mut state, &mut log);
        assert_eq!(end, IntegrationEnd::Reached);
        let is_switch = |e: &&Value| e["event"] == "sticks" || e["event"] == "starts to slip";
        let events = record["events"].as_array().unwrap().iter();
        for (event, switch) in events.filter(is_switch).zip(&log.0) {
            let time = switch.tau * 60.0 / TAU;
            assert!(
                (time - event["T"].as_f64().unwrap()).abs() < 1e-9,
                "{event} {time}"
            );
            assert!((switch.level - event["q"].as_f64().unwrap()).abs() < 1e-9);
            let sticks = event["event"] == "sticks";
            assert_eq!(switch.to == 0, sticks, "{event}");
            assert_eq!(switch.kind, SwitchKind::Memory);
        }
    }
}

/// A gear pressed against one flank: impact phases, speeds and multipliers in closed form.
#[test]
fn the_loose_gear_follows_its_closed_forms() {
    let mut orbits = 0;
    for case in reference("memory")["loose_gear"].as_array().unwrap() {
        let (r, n) = (
            case["restitution"].as_f64().unwrap(),
            case["n"].as_u64().unwrap() as usize,
        );
        let (mean, omega) = (
            case["Qm"].as_f64().unwrap(),
            case["omega"].as_f64().unwrap(),
        );
        for orbit in case["orbits"].as_array().unwrap() {
            let one = |x| DMatrix::from_element(1, 1, x);
            let law = RigidStop {
                gap: orbit["flank_q"].as_f64().unwrap(),
                side: Some(Side::Positive),
                restitution: r,
                least_impact: 1e-9,
            };
            let loads = vec![load(1, 0, mean, orbit["Qa"].as_f64().unwrap())];
            let mounts = vec![Mount::new(Box::new(law))];
            let mut system = System::new(one(0.0), one(1.0), one(1.0), mounts, loads).unwrap();
            system.set_excitation_frequency(omega);
            system.set_subharmonic(n);
            let at = &orbit["state_at_phase_0"];
            let mut state = vec![at["q"].as_f64().unwrap(), at["v"].as_f64().unwrap()];
            let printed = state.clone();
            let mut flow = flow(&system);
            let gamma = orbit["gamma"].as_f64().unwrap();
            let g0 = n as f64 * PI * (1.0 - r) / (1.0 + r);
            let is_fold = gamma - g0 < 1e-6;
            // The orbit to the last digit: saddles enlarge those that are missing.
            for _ in 0..if is_fold { 0 } else { 3 } {
                let (mut image, mut phi) = (state.clone(), DMatrix::identity(2, 2));
                flow.advance_with_variation(&system, (0.0, TAU), &mut image, &mut phi, &mut ());
                let gap = DVector::from_fn(2, |i, _| image[i] - state[i]);
                let step = (DMatrix::identity(2, 2) - phi).lu().solve(&gap).unwrap();
                (0..2).for_each(|i| state[i] += step[i]);
            }
            assert!(gap(&printed, &state) < 1e-10);
            let start = state.clone();
            let (mut phi, mut log) = (DMatrix::identity(2, 2), Log::default());
            flow.advance_with_variation(&system, (0.0, TAU), &mut state, &mut phi, &mut log);
            let saddle = orbit["branch"].as_str().unwrap().contains("saddle");
            let root = (gamma * gamma - g0 * g0).max(0.0).sqrt() * (1.0 + r).powi(2);
            let trace = 1.0 + r * r + if saddle { root } else { -root };
            // At the fold the root loses half of the digits.
            assert!(gap(&start, &state) < 1e-10, "{orbit}");
            let is_fold = gamma - g0 < 1e-6;
            assert!(
                (phi.trace() - trace).abs() < if is_fold { 1e-5 } else { 1e-10 },
                "{orbit}"
            );
            assert!((phi.determinant() - r * r).abs() < 1e-10);
            let impacts: Vec<_> = log
                .0
                .iter()
                .filter(|s| s.kind == SwitchKind::Impact)
                .collect();
            assert_eq!(impacts.len(), 1);
            let speed = TAU * n as f64 / (1.0 + r) * mean / omega;
            assert!((impacts[0].velocity - speed).abs() < 1e-10);
            let c = (g0 / gamma).min(1.0).acos();
            let phase = 0.5 * PI + if saddle { -c } else { c };
            let found = (impacts[0].tau * n as f64).rem_euclid(TAU);
            assert!((found - phase).abs() < if is_fold { 1e-5 } else { 1e-10 });
            orbits += 1;
        }
    }
    assert!(orbits > 10);
}

fn one(x: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, x)
}

/// Dropped on a stop: the times of flight are a geometric series, and then it rests.
#[test]
fn complete_chatter_takes_the_time_of_its_series() {
    for r in [0.0, 0.3, 0.7, 0.9] {
        let law = RigidStop {
            gap: 1.0,
            side: Some(Side::Positive),
            restitution: r,
            least_impact: 1e-9,
        };
        let mounts = vec![Mount::new(Box::new(law) as Box<dyn Element>)];
        let mut system = System::new(
            one(0.0),
            one(1.0),
            one(1.0),
            mounts,
            vec![load(1, 0, 0.5, 0.0)],
        )
        .unwrap();
        let span = 40.0;
        system.set_excitation_frequency(TAU / span);
        let (mut state, mut log) = (vec![0.0, 0.0], Log::default());
        let end = flow(&system).advance(&system, (0.0, TAU), &mut state, &mut log);
        assert_eq!(end, IntegrationEnd::Reached);
        assert_eq!(state, [1.0, 0.0]);
        let first = 2.0;
        let speed = 0.5 * first;
        let whole = first + 2.0 * r * speed / (0.5 * (1.0 - r));
        let rest = log.0.last().unwrap();
        assert_eq!((rest.kind, rest.to), (SwitchKind::Holding, 1));
        assert!(
            (rest.tau * span / TAU - whole).abs() < 1e-9,
            "{r}: {rest:?}"
        );
    }
}

/// Two coupled coordinates, a stop on a moving flank and a slider.
fn moving(restitution: f64) -> System {
    let kappa = DMatrix::from_row_slice(2, 4, &[1.6, 0.6, 1.6, 0.3, 0.6, 1.8, 0.6, 0.9]);
    let gamma = DMatrix::from_row_slice(2, 2, &[0.08, 0.02, 0.03, 0.11]);
    let map = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0]);
    let stop = RigidStop {
        gap: 0.5,
        side: None,
        restitution,
        least_impact: 1e-9,
    };
    let mut mounts: Vec<Mount> = [
        Box::new(Linear {}) as Box<dyn Element>,
        Box::new(Linear {}),
        Box::new(stop),
        Box::new(Jenkins { slip_force: 0.2 }),
    ]
    .into_iter()
    .map(Mount::new)
    .collect();
    let harmonics = vec![Harmonic {
        order: 2,
        cos: 0.06,
        sin: 0.03,
    }];
    mounts[2].transmission_error = Some(Periodic::Fourier {
        mean: 0.02,
        harmonics,
    });
    let loads = vec![load(2, 0, 0.4, 0.9), load(2, 1, 0.1, -0.5)];
    let mut system = System::new(gamma, kappa, map, mounts, loads).unwrap();
    system.set_excitation_frequency(0.9);
    system
}

/// The transition matrix through impacts on a moving flank is the derivative of the flow.
#[test]
fn the_saltation_matrix_of_a_moving_stop_is_the_derivative() {
    for restitution in [0.4, 0.8] {
        let system = moving(restitution);
        let mut flow = flow(&system);
        let start = [0.1, -0.2, 0.3, 0.25, 0.05];
        let mut log = Log::default();
        let mut state = start.to_vec();
        let mut phi = DMatrix::identity(5, 5);
        let span = (0.0, 4.0);
        flow.advance_with_variation(&system, span, &mut state, &mut phi, &mut log);
        let impacts = log
            .0
            .iter()
            .filter(|s| s.kind == SwitchKind::Impact)
            .count();
        assert!(impacts >= 1 && log.0.len() > impacts, "{:?}", log.0);
        for k in 0..5 {
            let h = 1e-6;
            let image = |step: f64, flow: &mut dyn Integrator| {
                let mut state = start.to_vec();
                state[k] += step;
                flow.advance(&system, span, &mut state, &mut ());
                DVector::from_vec(state)
            };
            let change = (image(h, &mut *flow) - image(-h, &mut *flow)) / (2.0 * h);
            let gap = (change - phi.column(k)).amax();
            assert!(
                gap < 1e-7 * (1.0 + phi.amax()),
                "{restitution} {k}: {gap:e}"
            );
        }
    }
}

/// A stop between two coordinates passes on what it takes: momentum along the other direction does not change.
#[test]
fn several_stops_at_once() {
    // A row of three equal masses between walls: both gaps close at one instant.
    let map = DMatrix::identity(2, 2);
    let kappa = DMatrix::from_row_slice(2, 2, &[2.0, -1.0, -1.0, 2.0]);
    let stop = |restitution| {
        let law = RigidStop {
            gap: 1.0,
            side: Some(Side::Positive),
            restitution,
            least_impact: 1e-9,
        };
        Mount::new(Box::new(law) as Box<dyn Element>)
    };
    let zero = DMatrix::zeros(2, 2);
    let mut system = System::new(zero, kappa, map, vec![stop(0.5), stop(0.5)], vec![]).unwrap();
    system.set_excitation_frequency(TAU / 2.0);
    let mut state = vec![0.0, 0.0, 1.0, 1.0];
    let end = flow(&system).advance(&system, (0.0, TAU), &mut state, &mut ());
    assert_eq!(end, IntegrationEnd::Reached);
    assert!(gap(&state, &[0.5, 0.5, -0.5, -0.5]) < 1e-13, "{state:?}");
}

/// The same deformation stopped twice moves like that behind the more elastic of the stops, derivative included: impacts, chatter,
/// held contact and release.
#[test]
fn parallel_stops_move_like_the_more_elastic_one() {
    let stop = |restitution: f64| {
        let law = RigidStop {
            gap: 0.5,
            side: Some(Side::Positive),
            restitution,
            least_impact: 1e-9,
        };
        Mount::new(Box::new(law) as Box<dyn Element>)
    };
    let spring = || Mount::new(Box::new(Linear {}) as Box<dyn Element>);
    let train = |stops: Vec<Mount>, weights: &[f64]| {
        let count = stops.len() + 1;
        let kappa = DMatrix::from_fn(1, count, |_, k| if k == 0 { 0.3 } else { weights[k - 1] });
        let map = DMatrix::from_element(count, 1, 1.0);
        let mounts = std::iter::once(spring()).chain(stops).collect();
        let mut system =
            System::new(one(0.1), kappa, map, mounts, vec![load(1, 0, 0.2, 0.5)]).unwrap();
        system.set_excitation_frequency(0.2);
        system
    };
    let alone = train(vec![stop(0.3)], &[1.0]);
    let mut others = vec![
        train(vec![stop(0.3), stop(0.3)], &[1.0, 1.0]),
        train(vec![stop(0.3), stop(0.0)], &[1.0, 20.0]),
        train(vec![stop(0.1), stop(0.3), stop(0.3)], &[3.0, 1.0, 0.2]),
    ];
    for together in &mut others {
        let (mut state, mut phi) = (vec![0.1, 0.7], DMatrix::identity(2, 2));
        let (mut other, mut psi) = (state.clone(), phi.clone());
        let (mut one, mut two) = (flow(&alone), flow(together));
        for _ in 0..4 {
            let span = (0.0, TAU);
            let end = one.advance_with_variation(&alone, span, &mut state, &mut phi, &mut ());
            assert_eq!(end, IntegrationEnd::Reached);
            let end = two.advance_with_variation(together, span, &mut other, &mut psi, &mut ());
            assert_eq!(end, IntegrationEnd::Reached);
            assert!(gap(&state, &other) < 1e-12, "{state:?} {other:?}");
            assert!((&phi - &psi).amax() < 1e-10, "{phi} {psi}");
        }
    }
}

/// Three masses in a ring of three stops, two of which decide the third, between springs: energy is kept, no stop is passed and no momentum lost.
#[test]
fn a_ring_of_elastic_stops_keeps_its_energy() {
    let stop = || {
        let law = RigidStop {
            gap: 0.4,
            side: None,
            restitution: 1.0,
            least_impact: 1e-9,
        };
        Mount::new(Box::new(law) as Box<dyn Element>)
    };
    // Masses 1, 1.5 and 2; the ring's arms add up to nothing.
    let arms = DMatrix::from_row_slice(3, 3, &[1.0, -1.0, 0.0, 0.0, 1.0, -1.0, -1.0, 0.0, 1.0]);
    let masses = [1.0, 1.5, 2.0];
    let kappa = DMatrix::from_fn(3, 3, |i, k| arms[(k, i)] / masses[i]);
    let laws = (0..3).map(|_| stop()).collect();
    let zero = DMatrix::zeros(3, 3);
    let mut system = System::new(zero, kappa, arms.clone(), laws, vec![]).unwrap();
    system.set_excitation_frequency(0.1);
    let energy = |s: &[f64]| -> f64 { (0..3).map(|i| masses[i] * s[3 + i] * s[3 + i]).sum() };
    let momentum = |s: &[f64]| -> f64 { (0..3).map(|i| masses[i] * s[3 + i]).sum() };
    // Two stops of the ring are reached at one instant.
    let mut state = vec![0.2, 0.0, -0.2, 0.3, 0.0, -0.3];
    let before = (energy(&state), momentum(&state));
    let mut flow = flow(&system);
    for _ in 0..3 {
        let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
        assert_eq!(end, IntegrationEnd::Reached);
        assert!((energy(&state) / before.0 - 1.0).abs() < 1e-11);
        assert!((momentum(&state) - before.1).abs() < 1e-11);
        let x = &arms * nalgebra::DVector::from_column_slice(&state[..3]);
        assert!(x.amax() <= 0.4 + 1e-11, "{x}");
    }
}

/// Below its preload a joint holds: no chatter, and the derivative forgets its deformation and rate.
#[test]
fn a_preloaded_joint_sticks_to_its_flank() {
    let law = Preloaded {
        half_gap: 0.6,
        preload: 0.4,
    };
    let mounts = vec![Mount::new(Box::new(law) as Box<dyn Element>)];
    let loads = vec![load(1, 0, 0.2, 0.1)];
    let mut system = System::new(one(0.1), one(1.0), one(1.0), mounts, loads).unwrap();
    system.set_excitation_frequency(0.7);
    let mut shooting =
        Shooting::new(FrequencyFamily::new(system), 0.7, IntegratorChoice::Auto).unwrap();
    let mut newton = Newton::new(&shooting.structure(), NewtonOptions::default());
    let mut u = DVector::from_vec(vec![0.6, 0.0]);
    assert!(
        newton
            .solve(&mut shooting, &mut u, 0.7)
            .unwrap()
            .is_converged()
    );
    assert!((u[0] - 0.6).abs() < 1e-12 && u[1].abs() < 1e-12);
    let multipliers = shooting.multipliers(&u, 0.7).unwrap();
    assert!(
        multipliers.iter().all(|mu| mu.norm() < 1e-12),
        "{multipliers:?}"
    );
}

/// A slider that never slips is a number of the state that stays what it is.
#[test]
fn a_slider_that_never_slips_is_neutral() {
    let record = &reference("memory")["orbits"][0];
    let system = system(record);
    let omega = record["parameters"]["omega"].as_f64().unwrap();
    let mut shooting =
        Shooting::new(FrequencyFamily::new(system), omega, IntegratorChoice::Auto).unwrap();
    let mut newton = Newton::new(&shooting.structure(), NewtonOptions::default());
    let mut u = DVector::from_vec(vec![0.0, 0.0, 0.3]);
    assert!(
        newton
            .solve(&mut shooting, &mut u, omega)
            .unwrap()
            .is_converged()
    );
    assert_eq!(u[2], 0.3);
    let survey = shooting
        .survey(&u, omega, gearlash::solve::residual::Extent::Stability)
        .unwrap();
    assert_eq!((survey.neutral, survey.multipliers.len()), (1, 3));
    assert!(survey.multipliers[0].norm() < 1.0);
}

/// A compliant flank with a dashpot that acts in contact only tends to the stop like the root of its stiffness.
#[test]
fn a_stiff_flank_with_contact_damping_tends_to_the_stop() {
    for case in reference("memory")["limit"].as_array().unwrap() {
        let p = &case["parameters"];
        let mut gaps = Vec::new();
        for run in case["linear"]["runs"].as_array().unwrap() {
            let stiffness = run["K"].as_f64().unwrap();
            let stop = OneSided {
                gap: p["elements"][0]["rigid"]["hi"].as_f64().unwrap(),
                side: Side::Positive,
                contact_damping: run["c"].as_f64().unwrap() / stiffness,
            };
            let kappa = DMatrix::from_row_slice(1, 2, &[1.0, stiffness]);
            let map = DMatrix::from_row_slice(2, 1, &[1.0, 1.0]);
            let laws: [Box<dyn Element>; 2] = [Box::new(Linear {}), Box::new(stop)];
            let mounts = laws.into_iter().map(Mount::new).collect();
            let loads = vec![load(1, 0, floats(&p["Qm"])[0], floats(&p["Qa"])[0])];
            let gamma = matrix(&p["Gam"]);
            let mut system = System::new(gamma, kappa, map, mounts, loads).unwrap();
            system.set_excitation_frequency(p["omega"].as_f64().unwrap());
            let mut flow = choose(&system, IntegratorChoice::Auto).unwrap();
            assert_eq!(flow.name(), "series");
            let start = [run["q"].as_f64().unwrap(), run["v"].as_f64().unwrap()];
            let (mut end, mut phi) = (start.to_vec(), DMatrix::identity(2, 2));
            flow.advance_with_variation(&system, (0.0, TAU), &mut end, &mut phi, &mut ());
            assert!(gap(&start, &end) < 1e-9, "{stiffness}: {start:?} {end:?}");
            let found = eigenvalues(&phi).unwrap();
            let wanted = floats(&run["multipliers"][0]);
            let near = found
                .iter()
                .any(|mu| (mu.re - wanted[0]).hypot(mu.im - wanted[1]) < 1e-6);
            assert!(near, "{found:?} {wanted:?}");
            let rigid = ["q", "v"].map(|key| case["rigid"][key].as_f64().unwrap());
            gaps.push(gap(&end, &rigid));
        }
        for pair in gaps.windows(2) {
            // 10^(1/2) a decade.
            assert!(
                (pair[0] / pair[1] / 10.0_f64.sqrt() - 1.0).abs() < 0.1,
                "{gaps:?}"
            );
        }
    }
}
