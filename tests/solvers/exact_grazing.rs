//! Switches of the exact flow against a dense scan of the closed form of one coordinate: grazes, starts on a breakpoint, pairs.

use crate::common::backlash;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::integrate::{Exact, FlowObserver, IntegrationEnd, Integrator, Switch};
use gearlash::system::{LoadKind, LoadSource, System};
use nalgebra::{DMatrix, DVector};
use num_complex::Complex;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Length of the cells of the scan in time; the motions below have periods above 2.
const CELL: f64 = 1e-2;

/// A deformation that is less beyond a flank has not passed it: the closed form is no better, nor is the graze that follows
/// from it.
const ROUNDING: f64 = 2e-14;

/// q'' + 2 zeta q' + f(q) = mean + Re(load exp(i w T)), f: backlash of half gap `gap`.
#[derive(Debug, Clone)]
struct Oscillator {
    zeta: f64,
    gap: f64,
    mean: f64,
    load: Complex<f64>,
    frequency: f64,
}

/// A state at a time, between the flanks (0) or on one of them.
#[derive(Debug, Clone, Copy)]
struct At {
    time: f64,
    q: f64,
    v: f64,
    region: i8,
}

impl Oscillator {
    fn draw(random: &mut ChaCha8Rng) -> Oscillator {
        let mut within = |low: f64, high: f64| random.random_range(low..high);
        Oscillator {
            zeta: [0.0, within(0.01, 0.2)][usize::from(within(0.0, 1.0) > 0.3)],
            gap: within(0.1, 1.0),
            mean: within(-0.5, 0.5),
            load: Complex::new(within(-0.6, 0.6), within(-0.6, 0.6)),
            frequency: within(0.3, 3.0),
        }
    }

    /// So many copies that do not feel each other.
    fn system(&self, copies: usize) -> System {
        let eye = DMatrix::identity(copies, copies);
        let harmonics = vec![Harmonic {
            order: 1,
            cos: self.load.re,
            sin: -self.load.im,
        }];
        let loads = vec![LoadSource {
            direction: DVector::from_element(copies, 1.0),
            series: Periodic::Fourier {
                mean: self.mean,
                harmonics,
            },
            kind: LoadKind::Value,
        }];
        let mounts = vec![backlash(self.gap); copies];
        let damping = &eye * (2.0 * self.zeta);
        let mut system = System::new(damping, eye.clone(), eye, mounts, loads).unwrap();
        system.set_excitation_frequency(self.frequency);
        system
    }

    /// [q, v] a while after an instant, in its region for ever.
    fn closed_form(&self, from: &At, while_: f64) -> [f64; 2] {
        let (zeta, w) = (self.zeta, self.frequency);
        let i = Complex::<f64>::i();
        let stiffness = if from.region == 0 { 0.0 } else { 1.0 };
        let z = self.load / (stiffness - w * w + 2.0 * zeta * w * i);
        let forced = |t: f64| {
            let wave = z * (i * w * t).exp();
            [wave.re, (i * w * wave).re]
        };
        let (t, end) = (while_, forced(from.time + while_));
        let begin = forced(from.time);
        if from.region != 0 {
            let middle = f64::from(from.region) * self.gap + self.mean;
            let (x, y) = (from.q - middle - begin[0], from.v - begin[1]);
            let wd = (1.0 - zeta * zeta).sqrt();
            let (decay, (s, c)) = ((-zeta * t).exp(), (wd * t).sin_cos());
            let b = (y + zeta * x) / wd;
            let own = decay * (x * c + b * s);
            let rate = -zeta * own + decay * wd * (b * c - x * s);
            return [middle + end[0] + own, end[1] + rate];
        }
        let (x, y) = (from.q - begin[0], from.v - begin[1]);
        if zeta == 0.0 {
            let own = x + y * t + 0.5 * self.mean * t * t;
            return [own + end[0], y + self.mean * t + end[1]];
        }
        let (drift, decay) = (self.mean / (2.0 * zeta), (-2.0 * zeta * t).exp());
        let own = x + drift * t + (y - drift) * -(-2.0 * zeta * t).exp_m1() / (2.0 * zeta);
        [own + end[0], drift + (y - drift) * decay + end[1]]
    }

    /// Region of a state; on a flank that to which it moves.
    fn region(&self, time: f64, q: f64, v: f64) -> i8 {
        let flank = q.signum();
        let push = self.mean + (self.load * (Complex::i() * self.frequency * time).exp()).re;
        let outwards = flank * if v == 0.0 { push } else { v };
        let is_out = q.abs() > self.gap || (q.abs() == self.gap && outwards > 0.0);
        if is_out { flank as i8 } else { 0 }
    }

    /// How far a deformation is out of a region: beyond 0 it has left, upwards first, downwards second.
    fn beyond(&self, region: i8, q: f64) -> [f64; 2] {
        match region {
            0 => [q - self.gap, -self.gap - q],
            1 => [f64::NEG_INFINITY, self.gap - q],
            _ => [q + self.gap, f64::NEG_INFINITY],
        }
    }

    /// Times and directions of all switches up to a time, and the state there.
    fn scan(&self, q: f64, v: f64, end: f64) -> (Vec<(f64, i8)>, [f64; 2]) {
        let mut at = At {
            time: 0.0,
            q,
            v,
            region: self.region(0.0, q, v),
        };
        let mut switches = Vec::new();
        'region: loop {
            let (mut inside, remaining) = (0.0, end - at.time);
            while inside < remaining {
                let next = (inside + CELL).min(remaining);
                let turn = self.turn(&at, inside, next);
                for after in turn.into_iter().chain([next]) {
                    let beyond = self.beyond(at.region, self.closed_form(&at, after)[0]);
                    for (side, direction) in [(0, 1), (1, -1)] {
                        if beyond[side] > ROUNDING {
                            let out = |t: f64| {
                                self.beyond(at.region, self.closed_form(&at, t)[0])[side] > 0.0
                            };
                            let while_ = bisect(inside, after, out);
                            let level = match (at.region, direction) {
                                (0, d) => f64::from(d) * self.gap,
                                (r, _) => f64::from(r) * self.gap,
                            };
                            let v = self.closed_form(&at, while_)[1];
                            switches.push((at.time + while_, direction));
                            at = At {
                                time: at.time + while_,
                                q: level,
                                v,
                                region: at.region + direction,
                            };
                            continue 'region;
                        }
                    }
                    inside = after;
                }
            }
            return (switches, self.closed_form(&at, end - at.time));
        }
    }

    /// Where the motion turns round in a cell.
    fn turn(&self, at: &At, from: f64, to: f64) -> Option<f64> {
        let is_rising = |t: f64| self.closed_form(at, t)[1] > 0.0;
        let first = is_rising(from);
        (first != is_rising(to)).then(|| bisect(from, to, |t| is_rising(t) != first))
    }
}

/// The last abscissa before a condition holds that holds at `to`.
fn bisect(mut from: f64, mut to: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (from + to);
        if holds(middle) {
            to = middle;
        } else {
            from = middle;
        }
    }
    to
}

#[derive(Default)]
struct Log(Vec<Switch>);

impl FlowObserver for Log {
    fn switch(&mut self, switch: &Switch) {
        self.0.push(*switch);
    }
}

/// Compares a motion from phase 0 with the scan; how many switches.
fn compare(oscillator: &Oscillator, q: f64, v: f64, copies: usize) -> usize {
    let periods = 2.0;
    let (wanted, end) = oscillator.scan(q, v, periods * TAU / oscillator.frequency);
    let system = oscillator.system(copies);
    let mut exact = Exact::new(&system, 10_000).unwrap();
    let mut state: Vec<f64> = [vec![q; copies], vec![v; copies]].concat();
    let mut log = Log::default();
    let ended = exact.advance(&system, (0.0, periods * TAU), &mut state, &mut log);
    assert_eq!(ended, IntegrationEnd::Reached);
    for copy in 0..copies {
        let place = format!("{oscillator:?} from {q:?} {v:?}, copy {copy}");
        let own = log.0.iter().filter(|s| s.connection == copy);
        let found: Vec<(f64, i8)> = own
            .map(|s| (s.tau / oscillator.frequency, s.to - s.from))
            .collect();
        assert_eq!(found.len(), wanted.len(), "{place}\n{found:?}\n{wanted:?}");
        for (a, b) in found.iter().zip(&wanted) {
            // A graze at a rate of 1e-6 magnifies rounding by its reciprocal.
            assert!(
                (a.0 - b.0).abs() < 1e-7 && a.1 == b.1,
                "{place}: {a:?} {b:?}"
            );
        }
        let gap = (state[copy] - end[0])
            .abs()
            .max((state[copies + copy] - end[1]).abs());
        assert!(gap < 1e-8, "{place}: {gap:e}");
    }
    wanted.len()
}

#[test]
fn random_motions_alone_and_in_pairs() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let mut switches = 0;
    for case in 0..200 {
        let oscillator = Oscillator::draw(&mut random);
        let (q, v) = (
            random.random_range(-1.5..1.5),
            random.random_range(-1.0..1.0),
        );
        switches += compare(&oscillator, q, v, 1 + case % 2);
    }
    assert!(switches > 500, "{switches}");
}

/// The gap is put at the first peak of the motion inside it, less or more by a share: two switches in short succession,
/// or none.
#[test]
fn grazes_from_both_sides() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let (mut cases, mut dips) = (0, 0);
    while cases < 80 {
        let wide = Oscillator {
            gap: f64::INFINITY,
            ..Oscillator::draw(&mut random)
        };
        let (q, v) = (
            random.random_range(-0.3..0.3),
            random.random_range(0.1..1.0),
        );
        let at = At {
            time: 0.0,
            q,
            v,
            region: 0,
        };
        let cells = (0..200).map(|k| f64::from(k) * CELL);
        let Some(turn) = cells.filter_map(|t| wide.turn(&at, t, t + CELL)).next() else {
            continue;
        };
        let peak = wide.closed_form(&at, turn)[0];
        if peak < q.abs() + 0.05 {
            continue;
        }
        cases += 1;
        for exponent in [3, 6, 9, 11] {
            for sign in [1.0, -1.0] {
                let share = sign * 10_f64.powi(-exponent);
                let oscillator = Oscillator {
                    gap: peak * (1.0 - share),
                    ..wide.clone()
                };
                let count = compare(&oscillator, q, v, 1);
                dips += usize::from(sign > 0.0 && count >= 2);
            }
        }
    }
    assert!(dips > 200, "{dips}");
}

#[test]
fn starts_on_a_flank_at_rest_or_moving() {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut switches = 0;
    for case in 0..200 {
        let oscillator = Oscillator::draw(&mut random);
        let side = [1.0, -1.0][case % 2];
        let v = [0.0, random.random_range(-0.5..0.5), 1e-6, -1e-6][case / 2 % 4];
        switches += compare(&oscillator, side * oscillator.gap, v, 1 + case % 2);
    }
    assert!(switches > 300, "{switches}");
}

/// Pushed off the breakpoint and drawn back within one step of the series: q - b = A (sin(a) + w T cos(a) - sin(w T + a)) rises
/// first, then falls.
#[test]
fn a_start_at_rest_that_comes_back_at_once() {
    for share in [0.05, 0.1, 0.2, 0.3] {
        let angle = (0.25 - share) * TAU;
        let oscillator = Oscillator {
            zeta: 0.0,
            gap: 1.0,
            mean: 0.0,
            load: Complex::from_polar(1e-3, angle),
            frequency: 3.0,
        };
        assert!(compare(&oscillator, 1.0, 0.0, 1) >= 1);
    }
}
