//! Motions at stops that cannot go on, whose forces are not determined, or that never come to rest: each goes on or ends with a reason, and nothing hangs.

use crate::common::load;
use gearlash::element::{Element, Linear, Preloaded, RigidStop, Side};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::postprocess::measures::Meter;
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::integrate::{IntegrationEnd, Integrator, IntegratorChoice, choose};
use gearlash::solve::residual::PeriodicResidual;
use gearlash::solve::shooting::Shooting;
use gearlash::system::{Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

fn one(x: f64) -> DMatrix<f64> {
    DMatrix::from_element(1, 1, x)
}

fn stop(gap: f64, side: Side, restitution: f64) -> Mount {
    let law = RigidStop {
        gap,
        side: Some(side),
        restitution,
        least_impact: 1e-9,
    };
    Mount::new(Box::new(law) as Box<dyn Element>)
}

/// q'' = mean + 0.01 cos(Om T) between stops on one coordinate.
fn between(stops: Vec<Mount>, mean: f64) -> System {
    let (rows, count) = (DMatrix::from_element(stops.len(), 1, 1.0), stops.len());
    let columns = DMatrix::from_element(1, count, 1.0);
    let loads = vec![load(1, 0, mean, 0.01)];
    let mut system = System::new(one(0.0), columns, rows, stops, loads).unwrap();
    system.set_excitation_frequency(0.5);
    system
}

fn flow(system: &System) -> Box<dyn Integrator + Send> {
    choose(system, IntegratorChoice::Exact).unwrap()
}

/// Impacts that lose a thousandth of their speed die out after tens of thousands: a reason, or rest on the stop.
#[test]
fn chatter_near_restitution_one_ends() {
    for restitution in [0.99, 0.999, 0.9999, 1.0] {
        let system = between(vec![stop(1.0, Side::Positive, restitution)], 0.5);
        let (mut flow, mut state) = (flow(&system), vec![0.0, 0.0]);
        let mut ends = Vec::new();
        for _ in 0..60 {
            ends.push(flow.advance(&system, (0.0, TAU), &mut state, &mut ()));
        }
        let is_answer = |end: &IntegrationEnd| {
            matches!(
                end,
                IntegrationEnd::Reached | IntegrationEnd::TooManySwitches
            )
        };
        assert!(ends.iter().all(is_answer), "{restitution}: {ends:?}");
        assert!(state[0] <= 1.0 + 1e-9, "{restitution}: {state:?}");
    }
}

/// No room between two stops: the train rests there, and the load rests on the stop that it presses.
#[test]
fn stops_without_room_hold() {
    for (first, second) in [(0.0, 0.0), (0.5, 0.7)] {
        let stops = vec![
            stop(0.0, Side::Positive, first),
            stop(0.0, Side::Negative, second),
        ];
        let system = between(stops, 0.5);
        let mut state = vec![0.0, 0.0];
        let end = flow(&system).advance(&system, (0.0, TAU), &mut state, &mut ());
        assert_eq!(end, IntegrationEnd::Reached);
        assert!(state.iter().all(|x| x.abs() < 1e-12), "{state:?}");
        let family = FrequencyFamily::new(system.clone());
        let mut shooting = Shooting::new(family, 0.5, IntegratorChoice::Exact).unwrap();
        let orbit = shooting.orbit(&DVector::zeros(2), 0.5).unwrap();
        let measures = Meter::new(64).measure(&system, &orbit);
        let forces = [measures[0].force_mean, measures[1].force_mean];
        assert!(
            (forces[0] - 0.5).abs() < 1e-12 && forces[1] == 0.0,
            "{forces:?}"
        );
    }
}

/// Two stops that take turns in the same direction: the balance of a period does not say which of them carries how much.
#[test]
fn shares_of_parallel_stops_are_not_guessed() {
    let stops = vec![
        stop(1.0, Side::Positive, 0.5),
        stop(0.0, Side::Negative, 0.5),
    ];
    let mut system = between(stops, 0.0);
    system = system.with_loads(vec![load(1, 0, 0.0, 3.0)]);
    let (mut flow, mut state) = (flow(&system), vec![0.5, 0.0]);
    for _ in 0..20 {
        flow.advance(&system, (0.0, TAU), &mut state, &mut ());
    }
    let mut shooting = Shooting::new(
        FrequencyFamily::new(system.clone()),
        0.5,
        IntegratorChoice::Exact,
    )
    .unwrap();
    let orbit = shooting.orbit(&DVector::from_vec(state), 0.5).unwrap();
    let measures = Meter::new(64).measure(&system, &orbit);
    assert!(measures.iter().all(|m| m.force_mean.is_nan()));
}

/// Two stops in the same direction close at once, and a joint that is held shares its deformation with a stop: the motion is that of one
/// contact, and it goes on.
#[test]
fn overdetermined_contacts_are_held() {
    let preloaded = Mount::new(Box::new(Preloaded {
        half_gap: 0.6,
        preload: 2.0,
    }) as Box<dyn Element>);
    let laws = vec![
        vec![
            stop(1.0, Side::Positive, 0.0),
            stop(1.0, Side::Positive, 0.0),
        ],
        vec![preloaded, stop(0.6, Side::Positive, 0.3)],
    ];
    for stops in laws {
        let system = between(stops, 0.5);
        let (mut flow, mut state) = (flow(&system), vec![0.0, 0.0]);
        for _ in 0..10 {
            let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
            assert_eq!(end, IntegrationEnd::Reached);
        }
        assert!(state[0] <= 1.0 + 1e-9 && state[1].abs() < 1e-9, "{state:?}");
    }
}

/// A stop that moves against another one: nothing keeps within both, which is said.
#[test]
fn stops_that_contradict_each_other_end_with_the_reason() {
    let mut moving = stop(0.0, Side::Negative, 0.3);
    moving.transmission_error = Some(Periodic::Fourier {
        mean: 0.0,
        harmonics: vec![Harmonic {
            order: 1,
            cos: 0.0,
            sin: 0.1,
        }],
    });
    let system = between(vec![stop(0.0, Side::Positive, 0.3), moving], 0.5);
    let (mut flow, mut state) = (flow(&system), vec![0.0, 0.0]);
    let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
    assert!(matches!(end, IntegrationEnd::Locked(_)), "{end:?}");
    assert!(end.message().contains("contradict"), "{end:?}");
}

/// q'' = p cos(Om T) - f of a preloaded joint that is thrown off its jump and that nothing damps: it bounces with ever the same invariant
/// v^3 (1/a + 1/b), millions of times a period, and what is averaged does not show in the slow motion of its neighbour.
#[test]
fn an_undamped_bounce_goes_on() {
    let joint = || {
        Mount::new(Box::new(Preloaded {
            half_gap: 0.0,
            preload: 2.0,
        }) as Box<dyn Element>)
    };
    let spring = || Mount::new(Box::new(Linear {}) as Box<dyn Element>);
    // A mass on a spring, and another on it through the joint.
    let arms = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -1.0, 1.0]);
    let kappa = DMatrix::from_row_slice(2, 2, &[1.0, -0.5, 0.0, 5.0]);
    let train = |speed: f64| {
        let loads = vec![load(2, 0, 0.1, 0.4)];
        let mounts = vec![spring(), joint()];
        let damping = DMatrix::from_row_slice(2, 2, &[0.02, 0.0, 0.0, 0.0]);
        let mut system = System::new(damping, kappa.clone(), arms.clone(), mounts, loads).unwrap();
        system.set_excitation_frequency(0.05);
        (system, vec![0.3, 0.3, 0.1, 0.1 + speed])
    };
    let run = |speed: f64| {
        let (system, mut state) = train(speed);
        let mut flow = flow(&system);
        for _ in 0..3 {
            let end = flow.advance(&system, (0.0, TAU), &mut state, &mut ());
            assert_eq!(end, IntegrationEnd::Reached);
        }
        (state, flow.strain().and_then(|s| s.bounces))
    };
    let (still, none) = run(0.0);
    assert!(none.is_none());
    let (bouncing, averaged) = run(3e-3);
    // From 776 367 passages by an independent program.
    let reference = 0.502507133944;
    assert!((bouncing[0] - reference).abs() < 1e-7, "{bouncing:?}");
    let averaged = averaged.unwrap();
    assert!(
        averaged.connection == 1 && averaged.height < 1e-6,
        "{averaged:?}"
    );
    assert!(
        (still[0] - bouncing[0]).abs() < 1e-5,
        "{still:?} {bouncing:?}"
    );
    assert!(
        (still[2] - bouncing[2]).abs() < 1e-5,
        "{still:?} {bouncing:?}"
    );
}
