//! Impacts: sliders beside rigid stops, whose rate an impact turns, so that what slipped sticks from that instant on; joints without play.

use crate::common::load;
use gearlash::element::{Element, Jenkins, Linear, RigidStop, Side};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{
    FlowObserver, IntegrationEnd, IntegratorChoice, Switch, SwitchKind, choose,
};
use gearlash::system::{Mount, System};
use nalgebra::{DMatrix, DVector};

const SPRING: f64 = 0.3;
const SLIDER: f64 = 0.6;
const LIMIT: f64 = 0.15;
const LEVEL: f64 = 0.4;
const RESTITUTION: f64 = 0.7;
const MOVES: f64 = 0.05;
const LOAD: f64 = 0.5;
const SPEED: f64 = 0.6;
const MASSES: [f64; 2] = [1.0, 0.7];
/// Springs on both masses, a slider between them, a moving stop before the first.
const ARMS: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [1.0, -1.0], [1.0, 0.0]];

fn train() -> System {
    let spring = || Mount::new(Box::new(Linear {}) as Box<dyn Element>);
    let slider = Mount::new(Box::new(Jenkins { slip_force: LIMIT }) as Box<dyn Element>);
    let law = RigidStop {
        gap: LEVEL,
        side: Some(Side::Positive),
        restitution: RESTITUTION,
        least_impact: 1e-9,
    };
    let mut stop = Mount::new(Box::new(law) as Box<dyn Element>);
    stop.transmission_error = Some(Periodic::Fourier {
        mean: 0.0,
        harmonics: vec![Harmonic {
            order: 2,
            cos: 0.0,
            sin: MOVES,
        }],
    });
    let weights = [SPRING, SPRING, SLIDER, 1.0];
    let map = DMatrix::from_fn(4, 2, |k, i| ARMS[k][i]);
    let kappa = DMatrix::from_fn(2, 4, |i, k| weights[k] * ARMS[k][i] / MASSES[i]);
    let mounts = vec![spring(), spring(), slider, stop];
    let mut system = System::new(
        DMatrix::zeros(2, 2),
        kappa,
        map,
        mounts,
        vec![load(2, 0, 0.0, LOAD)],
    )
    .unwrap();
    system.set_excitation_frequency(SPEED);
    system
}

#[derive(Default)]
struct Log(Vec<Switch>);

impl FlowObserver for Log {
    fn switch(&mut self, switch: &Switch) {
        self.0.push(*switch);
    }
}

const START: [f64; 5] = [0.1, -0.1, 0.9, 0.1, 0.05];
/// In phases; a few impacts, some of them while the slider slips.
const END: f64 = 9.0;

/// The same by small steps of the definition: the slider takes up what it can, the stop reverses what comes.
fn by_steps(count: usize) -> [f64; 5] {
    let h = END / SPEED / count as f64;
    let [mut x, mut y, mut v, mut w, mut z] = START;
    let level = |t: f64| LEVEL + MOVES * (2.0 * SPEED * t).sin();
    let rate = |t: f64| 2.0 * SPEED * MOVES * (2.0 * SPEED * t).cos();
    for k in 0..count {
        let t = h * k as f64;
        z = z.clamp(x - y - LIMIT, x - y + LIMIT);
        let friction = SLIDER * (x - y - z);
        v += h * (LOAD * (SPEED * (t + 0.5 * h)).cos() - (SPRING * x + friction) / MASSES[0]);
        w += h * (friction - SPRING * y) / MASSES[1];
        (x, y) = (x + h * v, y + h * w);
        let beyond = x - level(t + h);
        if beyond > 0.0 && v > rate(t + h) {
            v = rate(t + h) - RESTITUTION * (v - rate(t + h));
            x -= (1.0 + RESTITUTION) * beyond;
        }
    }
    [x, y, v, w, z]
}

#[test]
fn a_slider_sticks_where_an_impact_turns_it() {
    let system = train();
    let mut flow = choose(&system, IntegratorChoice::Exact).unwrap();
    let (mut state, mut log) = (START.to_vec(), Log::default());
    let end = flow.advance(&system, (0.0, END), &mut state, &mut log);
    assert_eq!(end, IntegrationEnd::Reached);
    let impacts = (log.0.iter()).filter(|s| s.kind == SwitchKind::Impact);
    let turned = |impact: &&Switch| {
        (log.0.iter()).any(|s| s.kind == SwitchKind::Memory && s.tau == impact.tau)
    };
    assert!(impacts.filter(turned).count() > 0, "{:?}", log.0);
    let steps = by_steps(2_000_000);
    let gaps = state.iter().zip(steps).map(|(a, b)| (a - b).abs());
    assert!(gaps.fold(0.0, f64::max) < 1e-4, "{state:?} {steps:?}");
}

#[test]
fn its_transition_matrix_is_the_derivative() {
    let system = train();
    let mut flow = choose(&system, IntegratorChoice::Exact).unwrap();
    let (mut state, mut phi) = (START.to_vec(), DMatrix::identity(5, 5));
    flow.advance_with_variation(&system, (0.0, END), &mut state, &mut phi, &mut ());
    let h = 1e-6;
    for k in 0..5 {
        let mut image = |step: f64| {
            let mut state = START.to_vec();
            state[k] += step;
            flow.advance(&system, (0.0, END), &mut state, &mut ());
            DVector::from_vec(state)
        };
        let change = (image(h) - image(-h)) / (2.0 * h);
        let gap = (change - phi.column(k)).amax();
        assert!(gap < 1e-7 * (1.0 + phi.amax()), "{k}: {gap:e} {phi}");
    }
}

/// Masses of a train of three bodies, of which two are joined without play.
const BODIES: [f64; 3] = [1.0, 3.0, 2.0];
/// Way before the first impact.
const WAY: f64 = 0.1;

/// Stops as (row, distance, restitution), on both sides.
fn stops(list: &[([f64; 3], f64, f64)], loads: [f64; 3]) -> System {
    let mount = |(_, gap, restitution): &([f64; 3], f64, f64)| {
        Mount::new(Box::new(RigidStop {
            gap: *gap,
            side: None,
            restitution: *restitution,
            least_impact: 1e-9,
        }) as Box<dyn Element>)
    };
    let map = DMatrix::from_fn(list.len(), 3, |k, i| list[k].0[i]);
    let kappa = DMatrix::from_fn(3, list.len(), |i, k| list[k].0[i] / BODIES[i]);
    let load = |i: usize| load(3, i, loads[i] / BODIES[i], 0.0);
    let mut system = System::new(
        DMatrix::zeros(3, 3),
        kappa,
        map,
        list.iter().map(mount).collect(),
        vec![load(0), load(1), load(2)],
    )
    .unwrap();
    system.set_excitation_frequency(1.0);
    system
}

fn velocities_after(system: &System, state: [f64; 6], time: f64) -> [f64; 3] {
    let mut state = state.to_vec();
    let mut flow = choose(system, IntegratorChoice::Exact).unwrap();
    let end = flow.advance(system, (0.0, time), &mut state, &mut ());
    assert_eq!(end, IntegrationEnd::Reached);
    [state[3], state[4], state[5]]
}

fn assert_close(found: [f64; 3], wanted: [f64; 3]) {
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
    }
}

/// 1 hits 3 and 2, which a joint without play (two parallel stops) makes one body of 5: with v = 1 against -0.2 and restitution r
/// the momentum is 0 and the velocities -r and r / 5. Whatever the joint's own restitution: its rate is 0 before and after.
#[test]
fn a_joint_without_play_is_hit_as_one_body() {
    for (r, loads) in [
        (0.0, [0.0; 3]),
        (0.6, [0.0; 3]),
        (0.6, [0.0, 0.3, -0.3]),
        (0.6, [0.0, -0.3, 0.3]),
    ] {
        let system = stops(
            &[
                ([1.0, -1.0, 0.0], WAY, r),
                ([0.0, 1.0, -1.0], 0.0, 0.815),
                ([0.0, 1.0, -1.0], 0.0, 0.5),
            ],
            loads,
        );
        for sign in [1.0, -1.0] {
            let state = [0.0, 0.0, 0.0, sign, -0.2 * sign, -0.2 * sign];
            let wanted = [-r * sign, 0.2 * r * sign, 0.2 * r * sign];
            assert_close(velocities_after(&system, state, 0.15), wanted);
        }
    }
}

/// The same where the body behind the joint is the one that is hit, by a wall: all of them turn.
#[test]
fn bodies_joined_without_play_turn_at_a_wall_together() {
    let system = stops(
        &[
            ([1.0, -1.0, 0.0], 0.0, 0.05),
            ([0.0, 1.0, -1.0], 0.0, 0.3),
            ([0.0, 0.0, 1.0], WAY, 0.9),
        ],
        [0.0; 3],
    );
    let after = velocities_after(&system, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0], 0.15);
    assert_close(after, [-0.9; 3]);
}
