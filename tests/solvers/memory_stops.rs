//! Rows of bodies with rigid stops between neighbours: whatever happens at once, momentum and energy are balanced.

use gearlash::element::{Element, Linear, Preloaded, RigidStop, Side};
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{
    FlowObserver, IntegrationEnd, Integrator, IntegratorChoice, Segment, choose,
};
use gearlash::system::{LoadKind, LoadSource, Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn one_of(&mut self, list: &[f64]) -> f64 {
        list[(self.next() * list.len() as f64) as usize]
    }
}

const SPRING: f64 = 1.0;
const DAMPING: f64 = 0.1;

/// Bodies 0 to n - 1 in absolute coordinates; body 0 on a spring, a stop on each side between neighbours.
struct Row {
    system: System,
    masses: Vec<f64>,
    gaps: Vec<f64>,
    /// Transmission errors: amplitude and order.
    errors: Vec<(f64, u32)>,
    loads: Vec<(f64, f64)>,
}

impl Row {
    fn new(seed: u64, moves: bool) -> Row {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1);
        let _ = random.next();
        let n = 3 + (random.next() * 4.0) as usize;
        let masses: Vec<f64> = (0..n).map(|_| random.between(0.5, 3.0)).collect();
        let gaps: Vec<f64> = (1..n).map(|_| random.one_of(&[0.25, 0.5, 1.0])).collect();
        let mut map = DMatrix::zeros(n, n);
        let mut kappa = DMatrix::zeros(n, n);
        let mut mounts = vec![Mount::new(Box::new(Linear {}) as Box<dyn Element>)];
        (map[(0, 0)], kappa[(0, 0)]) = (1.0, SPRING / masses[0]);
        let mut errors = Vec::new();
        for k in 1..n {
            (map[(k, k - 1)], map[(k, k)]) = (-1.0, 1.0);
            (kappa[(k - 1, k)], kappa[(k, k)]) = (-1.0 / masses[k - 1], 1.0 / masses[k]);
            let any = random.next();
            let restitution = random.one_of(&[0.0, 0.0, 0.05, 0.3, 0.6, 0.9, any]);
            let mut mount = stop(gaps[k - 1], None, restitution);
            let error = match moves && random.next() < 0.5 {
                true => (random.between(0.01, 0.2), 1 + (random.next() * 3.0) as u32),
                false => (0.0, 1),
            };
            if error.0 > 0.0 {
                mount.transmission_error = Some(periodic(0.0, error.0, error.1));
            }
            errors.push(error);
            mounts.push(mount);
        }
        let mut gamma = DMatrix::zeros(n, n);
        gamma[(0, 0)] = DAMPING / masses[0];
        let sign = random.one_of(&[-1.0, 1.0]);
        let mut loads = vec![(0.0, random.between(0.3, 3.0))];
        loads.extend((1..n).map(|_| {
            let size = random.between(0.02, 0.4);
            (random.one_of(&[sign, sign, -sign]) * size, 0.0)
        }));
        let sources = loads.iter().enumerate().map(|(i, (mean, cos))| {
            let mut direction = DVector::zeros(n);
            direction[i] = 1.0 / masses[i];
            LoadSource {
                direction,
                series: periodic(*mean, *cos, 1),
                kind: LoadKind::Value,
            }
        });
        let mut system = System::new(gamma, kappa, map, mounts, sources.collect()).unwrap();
        system.set_excitation_frequency(random.one_of(&[0.5, 0.9, 1.7]));
        Row {
            system,
            masses,
            gaps,
            errors,
            loads,
        }
    }
}

fn stop(gap: f64, side: Option<Side>, restitution: f64) -> Mount {
    Mount::new(Box::new(RigidStop {
        gap,
        side,
        restitution,
        least_impact: 1e-9,
    }) as Box<dyn Element>)
}

fn periodic(mean: f64, cos: f64, order: u32) -> Periodic {
    let harmonics = vec![Harmonic {
        order: order as usize,
        cos,
        sin: 0.0,
    }];
    Periodic::Fourier { mean, harmonics }
}

/// Four points of Gauss on [0, 1].
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Checks every impact and sums up what comes in.
struct Balance<'a> {
    row: &'a Row,
    last: Vec<f64>,
    impulse_of_loads: f64,
    work_of_loads: f64,
    lost: f64,
    impacts: usize,
    deepest: f64,
    faults: Vec<String>,
}

impl Balance<'_> {
    fn deformation(&self, k: usize, tau: f64, state: &[f64]) -> (f64, f64) {
        let n = self.row.masses.len();
        let (amplitude, order) = self.row.errors[k - 1];
        let (sin, cos) = (f64::from(order) * tau).sin_cos();
        let omega = self.row.system.omega();
        (
            state[k] - state[k - 1] - amplitude * cos,
            state[n + k] - state[n + k - 1] + omega * f64::from(order) * amplitude * sin,
        )
    }

    fn impact(&mut self, tau: f64, before: &[f64], after: &[f64]) {
        let n = self.row.masses.len();
        let jump = |i: usize| after[n + i] - before[n + i];
        if (0..n).all(|i| jump(i) == 0.0) {
            return;
        }
        let largest = before[n..].iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        let momentum: f64 = (0..n).map(|i| self.row.masses[i] * jump(i)).sum();
        if momentum.abs() > 1e-12 * largest {
            self.faults.push(format!("{tau}: momentum {momentum:e}"));
        }
        // Each stop passes on what all bodies behind it get.
        let (mut impulse, mut lost) = (0.0, 0.0);
        for k in (1..n).rev() {
            impulse += self.row.masses[k] * jump(k);
            let (x, rate) = self.deformation(k, tau, before);
            let (_, left) = self.deformation(k, tau, after);
            let is_closed = (x.abs() - self.row.gaps[k - 1]).abs() < 1e-9;
            // Chatter is cut at speeds of 1e-10: what is left of it goes into contact, or out of it.
            let pushes = impulse * x.signum() <= 1e-9 * largest;
            if impulse.abs() > 1e-12 * largest && !(is_closed && pushes) {
                self.faults
                    .push(format!("{tau}: stop {k} at {x} gave {impulse:e}"));
            }
            lost -= 0.5 * impulse * (rate + left);
        }
        // Where one impact causes others at the same instant, the sum over the stops is what is lost.
        if lost < -1e-12 * largest * largest {
            self.faults.push(format!("{tau}: won {lost:e}"));
        }
        self.lost += lost;
        self.impacts += 1;
    }
}

impl FlowObserver for Balance<'_> {
    fn segment(&mut self, segment: &Segment<'_>) {
        let n = self.row.masses.len();
        let omega = self.row.system.omega();
        let mut state = vec![0.0; 2 * n];
        segment.state(0.0, omega, &mut state);
        let last = std::mem::take(&mut self.last);
        self.impact(segment.tau, &last, &state);
        let parts = (segment.width / 0.05).ceil();
        let points =
            (0..parts as usize).flat_map(|p| GAUSS.map(|g| ((p as f64 + g.0) / parts, g.1)));
        for (x, weight) in points {
            segment.state(x, omega, &mut state);
            let tau = segment.tau + x * segment.width;
            let time = weight * segment.width / (parts * omega);
            for k in 1..n {
                let (x, _) = self.deformation(k, tau, &state);
                self.deepest = self.deepest.max(x.abs() - self.row.gaps[k - 1]);
            }
            for (i, (mean, cos)) in self.row.loads.iter().enumerate() {
                let force = mean + cos * tau.cos();
                self.impulse_of_loads += time * force;
                self.work_of_loads += time * force * state[n + i];
            }
            self.impulse_of_loads -= time * (SPRING * state[0] + DAMPING * state[n]);
            self.work_of_loads -= time * DAMPING * state[n] * state[n];
        }
        segment.state(1.0, omega, &mut state);
        self.last = state;
    }
}

fn flow(system: &System) -> Box<dyn Integrator + Send> {
    choose(system, IntegratorChoice::Exact).unwrap()
}

fn run(seed: u64, moves: bool, periods: usize) -> usize {
    let row = Row::new(seed, moves);
    let n = row.masses.len();
    let mut state = vec![0.0; 2 * n];
    let mut flow = flow(&row.system);
    let mut balance = Balance {
        row: &row,
        last: Vec::new(),
        impulse_of_loads: 0.0,
        work_of_loads: 0.0,
        lost: 0.0,
        impacts: 0,
        deepest: 0.0,
        faults: Vec::new(),
    };
    let momentum = |s: &[f64]| -> f64 { (0..n).map(|i| row.masses[i] * s[n + i]).sum() };
    let energy = |s: &[f64]| -> f64 {
        let kinetic: f64 = (0..n)
            .map(|i| 0.5 * row.masses[i] * s[n + i] * s[n + i])
            .sum();
        kinetic + 0.5 * SPRING * s[0] * s[0]
    };
    // Not before the first period: it may begin with an impact of the moving stops.
    flow.advance(&row.system, (0.0, TAU), &mut state, &mut ());
    let begin = (momentum(&state), energy(&state));
    balance.last = state.clone();
    for period in 0..periods {
        let end = flow.advance(&row.system, (0.0, TAU), &mut state, &mut balance);
        assert_eq!(end, IntegrationEnd::Reached, "seed {seed}, period {period}");
    }
    assert!(
        balance.faults.is_empty(),
        "seed {seed}: {:#?}",
        balance.faults
    );
    assert!(balance.deepest < 1e-9, "seed {seed}: {:e}", balance.deepest);
    let gained = momentum(&state) - begin.0;
    assert!(
        (gained - balance.impulse_of_loads).abs() < 1e-8,
        "seed {seed}: momentum {gained} from {}",
        balance.impulse_of_loads
    );
    if !moves {
        let gained = energy(&state) - begin.1;
        let left = balance.work_of_loads - balance.lost;
        assert!(
            (gained - left).abs() < 1e-8,
            "seed {seed}: energy {gained} of {left}"
        );
    }
    balance.impacts
}

#[test]
fn rows_of_stops_balance_momentum_and_energy() {
    let impacts: usize = (0..60).map(|seed| run(seed, seed % 2 == 1, 20)).sum();
    assert!(impacts > 10_000, "{impacts}");
}

/// A body between two others that are pressed together bounces between them ever faster, though no load presses it against either.
#[test]
fn chatter_between_two_stops_ends_in_contact() {
    for restitution in [0.0, 0.3, 0.6] {
        // Body 2 presses with 0.5 towards body 0, which hardly moves; body 1 is free between them.
        let masses = [1e6, 1.0, 1.0];
        let map = DMatrix::from_row_slice(2, 3, &[-1.0, 1.0, 0.0, 0.0, -1.0, 1.0]);
        let kappa = DMatrix::from_fn(3, 2, |i, e| map[(e, i)] / masses[i]);
        let mounts = (0..2).map(|_| stop(0.5, Some(Side::Negative), restitution));
        let mut direction = DVector::zeros(3);
        direction[2] = 1.0;
        let press = LoadSource {
            direction,
            series: periodic(-0.5, 0.0, 1),
            kind: LoadKind::Value,
        };
        let gamma = DMatrix::zeros(3, 3);
        let mut system = System::new(gamma, kappa, map, mounts.collect(), vec![press]).unwrap();
        system.set_excitation_frequency(TAU / 40.0);
        let mut state = vec![0.0; 6];
        let end = flow(&system).advance(&system, (0.0, TAU), &mut state, &mut ());
        assert_eq!(end, IntegrationEnd::Reached, "{restitution}");
        let gaps = [state[1] - state[0] + 0.5, state[2] - state[1] + 0.5];
        let rates = [state[4] - state[3], state[5] - state[4]];
        let largest = gaps
            .iter()
            .chain(&rates)
            .fold(0.0_f64, |m, x| m.max(x.abs()));
        assert!(largest < 1e-12, "{restitution}: {state:?}");
    }
}

/// A joint at rest below its preload cannot carry an impulse: the body behind it keeps its velocity.
#[test]
fn a_joint_at_rest_gives_way_to_an_impact() {
    let masses = [1.0, 2.0];
    let map = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -1.0, 1.0]);
    let kappa = DMatrix::from_fn(2, 2, |i, e| map[(e, i)] / masses[i]);
    let joint = Preloaded {
        half_gap: 0.0,
        preload: 5.0,
    };
    let mounts = vec![
        stop(0.5, Some(Side::Positive), 0.5),
        Mount::new(Box::new(joint) as Box<dyn Element>),
    ];
    let mut system = System::new(DMatrix::zeros(2, 2), kappa, map, mounts, vec![]).unwrap();
    let time = 0.52;
    system.set_excitation_frequency(TAU / time);
    let mut state = vec![0.0, 0.0, 1.0, 1.0];
    let end = flow(&system).advance(&system, (0.0, TAU), &mut state, &mut ());
    assert_eq!(end, IntegrationEnd::Reached);
    // From 0.5 on the joint pulls with 5 and its spring: x'' = -5 (1 + 1/2) - 1.5 x, x = 0, x' = 1.5.
    let (w, t) = (1.5_f64.sqrt(), time - 0.5);
    let x = 5.0 * ((w * t).cos() - 1.0) + 1.5 / w * (w * t).sin();
    let rate = -5.0 * w * (w * t).sin() + 1.5 * (w * t).cos();
    assert!((state[1] - state[0] - x).abs() < 1e-12, "{state:?} {x}");
    assert!(
        (state[3] - state[2] - rate).abs() < 1e-12,
        "{state:?} {rate}"
    );
    assert!((state[2] + 2.0 * state[3] - 1.5).abs() < 1e-12, "{state:?}");
}

/// A joint without play joins two bodies to one, although the side that carries the force changes all the time.
#[test]
fn a_joint_without_play_is_rigid() {
    let one = |x: f64| DMatrix::from_element(1, 1, x);
    let linear = || Mount::new(Box::new(Linear {}) as Box<dyn Element>);
    for restitution in [0.0, 0.5, 0.9] {
        let masses = [1.0, 2.0];
        let map = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, -1.0, 1.0]);
        let kappa = DMatrix::from_fn(2, 2, |i, e| map[(e, i)] / masses[i]);
        let mounts = vec![linear(), stop(0.0, None, restitution)];
        let load = |direction: DVector<f64>| LoadSource {
            direction,
            series: periodic(0.1, 0.7, 1),
            kind: LoadKind::Value,
        };
        let on_first = vec![load(DVector::from_vec(vec![1.0, 0.0]))];
        let mut pair = System::new(DMatrix::zeros(2, 2), kappa, map, mounts, on_first).unwrap();
        let loads = vec![load(DVector::from_vec(vec![1.0 / 3.0]))];
        let mut whole =
            System::new(one(0.0), one(1.0 / 3.0), one(1.0), vec![linear()], loads).unwrap();
        for system in [&mut pair, &mut whole] {
            system.set_excitation_frequency(0.9);
        }
        let (mut two, mut joined) = (vec![0.2, 0.2, 0.3, 0.3], vec![0.2, 0.3]);
        let (mut first, mut second) = (flow(&pair), flow(&whole));
        for period in 0..20 {
            let end = first.advance(&pair, (0.0, TAU), &mut two, &mut ());
            assert_eq!(end, IntegrationEnd::Reached, "{restitution}, {period}");
            second.advance(&whole, (0.0, TAU), &mut joined, &mut ());
            let gaps = [0, 1].map(|i| {
                (two[i] - joined[0])
                    .abs()
                    .max((two[2 + i] - joined[1]).abs())
            });
            assert!(
                gaps.iter().all(|g| *g < 1e-9),
                "{restitution}, {period}: {two:?} {joined:?}"
            );
        }
    }
}
