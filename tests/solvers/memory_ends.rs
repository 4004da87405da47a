//! Motions at stops that cannot go on, or whose forces are not determined: each ends with a reason, and nothing hangs.

use crate::common::load;
use gearlash::element::{Element, Preloaded, RigidStop, Side};
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

/// Two stops in the same direction close at once, and a third joint that is held shares the loop: the forces between them are open, which is
/// said, unless one of them is enough.
#[test]
fn overdetermined_contacts_end_with_the_reason() {
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
            let is_answer = matches!(end, IntegrationEnd::Reached | IntegrationEnd::Locked(_));
            assert!(is_answer, "{end:?}");
            if end != IntegrationEnd::Reached {
                assert!(end.message().contains("not determined"));
                break;
            }
        }
        assert!(state[0].is_finite() && state[0] <= 1.0 + 1e-9);
    }
}
