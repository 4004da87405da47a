//! No window of changed stability is missed: random trains, their unstable multipliers counted on a fine grid by a flow of the
//! test's own, apart from the search for events.
//!
//! `GEARLASH_TRAINS=500 cargo test --release --test solvers windows -- --nocapture` runs more of them.

use crate::common::{backlash, load, shoot, trace_options};
use gearlash::element::Linear;
use gearlash::numeric::periodic::{Harmonic, Periodic};
use gearlash::solve::branch::{self, Begin, Branch, BranchPoint, Recorder};
use gearlash::solve::events::{BifurcationEvent, EventKind};
use gearlash::solve::family::FrequencyFamily;
use gearlash::solve::galerkin::{Galerkin, GalerkinOptions};
use gearlash::solve::integrate::{IntegrationEnd, IntegratorChoice, choose};
use gearlash::solve::orbit::Orbit;
use gearlash::system::{Mount, System};
use nalgebra::linalg::Schur;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use std::f64::consts::TAU;

/// Half of the stability resolution, relative to the frequency.
const GRID: f64 = 0.5e-3;
/// Trains of a default run, and the variable that asks for more.
const TRAINS: (usize, &str) = (24, "GEARLASH_TRAINS");
/// Multipliers nearer to the circle are not counted on either side.
const CLEAR: f64 = 1e-6;

/// Iterations for the eigenvalues of a small matrix.
const ITERATIONS: usize = 1000;

struct Draw(ChaCha8Rng);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    fn log(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }
}

/// kappa of a chain, or of equal parts side by side.
fn stiffness(draw: &mut Draw, n: usize, is_twin: bool) -> DMatrix<f64> {
    if is_twin {
        return DMatrix::identity(n, n);
    }
    DMatrix::from_fn(n, n, |i, j| match i.abs_diff(j) {
        0 => draw.between(0.9, 2.0),
        1 => -0.35,
        _ => 0.0,
    })
    .symmetric_part()
}

/// 2 zeta kappa^(1/2).
fn modal_damping(kappa: &DMatrix<f64>, zeta: f64) -> DMatrix<f64> {
    let eigen = kappa.clone().symmetric_eigen();
    let roots = DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| 2.0 * zeta * x.sqrt()));
    &eigen.eigenvectors * roots * eigen.eigenvectors.transpose()
}

/// Meshes that never separate, without loads: the motion is rest, its stability Hill's equation.
fn parametric(draw: &mut Draw) -> System {
    let (n, is_twin) = (1 + draw.below(3), draw.below(4) == 0);
    let kappa = stiffness(draw, n, is_twin);
    let damping = modal_damping(&kappa, draw.log(0.002, 0.05));
    let amplitude = draw.log(0.03, 0.4);
    let order = 1 + draw.below(3);
    let phase = |draw: &mut Draw| if is_twin { 0.0 } else { draw.between(0.0, TAU) };
    let mount = |draw: &mut Draw| {
        let phase = phase(draw);
        Mount {
            stiffness_variation: Some(Periodic::Fourier {
                mean: 1.0,
                harmonics: vec![Harmonic {
                    order,
                    cos: amplitude * phase.cos(),
                    sin: amplitude * phase.sin(),
                }],
            }),
            ..Mount::new(Box::new(Linear {}))
        }
    };
    let mounts = (0..n).map(|_| mount(draw)).collect();
    System::new(damping, kappa, DMatrix::identity(n, n), mounts, vec![]).unwrap()
}

/// One or two meshes with clearance, or two equal ones.
fn rattling(draw: &mut Draw) -> System {
    let (n, is_twin) = (1 + draw.below(2), draw.below(4) == 0);
    let n = if is_twin { 2 } else { n };
    let kappa = stiffness(draw, n, is_twin);
    let damping = modal_damping(&kappa, draw.log(0.02, 0.08));
    let (mean, cos) = (draw.between(0.1, 0.6), draw.between(0.1, 0.35));
    let gap = draw.log(0.1, 1.0);
    let gaps = (0..n).map(|i| if i == 0 || is_twin { 1.0 } else { gap });
    let alternating = |i: usize| if i == 0 || is_twin { cos } else { 0.0 };
    let loads = (0..n).map(|i| load(n, i, mean, alternating(i))).collect();
    let mounts = gaps.map(backlash).collect();
    System::new(damping, kappa, DMatrix::identity(n, n), mounts, loads).unwrap()
}

/// Multipliers outside the circle: at least and at most; `None` where the iteration for them does not end.
fn outside(phi: &DMatrix<f64>) -> Option<(usize, usize)> {
    let schur = Schur::try_new(phi.clone(), f64::EPSILON, ITERATIONS)?;
    let list = schur.complex_eigenvalues();
    let beyond = |radius: f64| list.iter().filter(|mu| mu.norm() > radius).count();
    Some((beyond(1.0 + CLEAR), beyond(1.0 - CLEAR)))
}

/// Most coordinates of a train.
const MOST: usize = 3;
/// Steps per period.
const STEPS: usize = 400;

/// q'' + Gam q' + kappa diag(s) q = 0, integrated by the classical Runge-Kutta rule of fourth order.
struct Hill {
    n: usize,
    damping: [[f64; MOST]; MOST],
    stiffness: [[f64; MOST]; MOST],
    /// s at every half step.
    varied: Vec<[f64; MOST]>,
}

impl Hill {
    fn new(system: &System) -> Hill {
        let n = system.dof();
        let rows = |m: &DMatrix<f64>| {
            let mut rows = [[0.0; MOST]; MOST];
            for (i, row) in rows.iter_mut().enumerate().take(n) {
                (0..n).for_each(|j| row[j] = m[(i, j)]);
            }
            rows
        };
        let varied = (0..=2 * STEPS).map(|k| {
            let phase = TAU * k as f64 / (2 * STEPS) as f64;
            let mut s = [1.0; MOST];
            for (s, mount) in s.iter_mut().zip(system.mounts()) {
                let variation = mount.stiffness_variation.as_ref();
                *s = variation.map_or(1.0, |v| v.value(phase));
            }
            s
        });
        Hill {
            n,
            damping: rows(system.damping()),
            stiffness: rows(system.stiffness()),
            varied: varied.collect(),
        }
    }

    fn slope(&self, y: &[[f64; MOST]; 2], s: &[f64; MOST]) -> [[f64; MOST]; 2] {
        let mut slope = [y[1], [0.0; MOST]];
        for (i, a) in slope[1].iter_mut().enumerate().take(self.n) {
            for j in 0..self.n {
                *a -= self.damping[i][j] * y[1][j] + self.stiffness[i][j] * s[j] * y[0][j];
            }
        }
        slope
    }

    fn phi(&self, omega: f64) -> DMatrix<f64> {
        let n = self.n;
        let h = TAU / omega / STEPS as f64;
        let ahead = |y: &[[f64; MOST]; 2], k: &[[f64; MOST]; 2], h: f64| {
            let mut next = *y;
            for (next, k) in next.iter_mut().flatten().zip(k.iter().flatten()) {
                *next += h * k;
            }
            next
        };
        let mut phi = DMatrix::zeros(2 * n, 2 * n);
        for c in 0..2 * n {
            let mut y = [[0.0; MOST]; 2];
            y[c / n][c % n] = 1.0;
            for step in self.varied.windows(3).step_by(2) {
                let k1 = self.slope(&y, &step[0]);
                let k2 = self.slope(&ahead(&y, &k1, 0.5 * h), &step[1]);
                let k3 = self.slope(&ahead(&y, &k2, 0.5 * h), &step[1]);
                let k4 = self.slope(&ahead(&y, &k3, h), &step[2]);
                for (k, share) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
                    y = ahead(&y, &k, share * h / 6.0);
                }
            }
            (0..2 * n).for_each(|r| phi[(r, c)] = y[r / n][r % n]);
        }
        phi
    }
}

/// Phi of the orbit near a state, by Newton's iteration on the exact flow; `None` where it goes elsewhere.
fn flow(system: &mut System, omega: f64, guess: &DVector<f64>, reach: f64) -> Option<DMatrix<f64>> {
    system.set_excitation_frequency(omega);
    let mut exact = choose(system, IntegratorChoice::Exact).ok()?;
    let size = guess.len();
    let mut u = guess.clone();
    for _ in 0..12 {
        let mut state = u.as_slice().to_vec();
        let mut phi = DMatrix::identity(size, size);
        let end = exact.advance_with_variation(system, (0.0, TAU), &mut state, &mut phi, &mut ());
        if end != IntegrationEnd::Reached {
            return None;
        }
        let r = DVector::from_vec(state) - &u;
        if r.amax() < 1e-11 * (1.0 + u.amax()) {
            return ((&u - guess).norm() <= reach).then_some(phi);
        }
        u -= (phi - DMatrix::identity(size, size)).lu().solve(&r)?;
    }
    None
}

struct Nothing;

impl Recorder for Nothing {
    fn record(&mut self, _: f64, _: &System, _: &Orbit, _: &mut Vec<f64>) {}
}

fn at_rest(system: &System, range: (f64, f64)) -> Branch {
    let size = GalerkinOptions {
        harmonics: 15,
        samples: 512,
    };
    let family = FrequencyFamily::new(system.clone());
    let mut problem = Galerkin::new(family, range.0, size).unwrap();
    let begin = Begin::Guess(DVector::zeros(31 * system.dof()));
    let options = trace_options(system, range, &[], 0.1);
    branch::trace(&mut problem, begin, &options, &mut Nothing)
        .unwrap()
        .unwrap()
}

fn count(point: &BranchPoint) -> i64 {
    point
        .multipliers
        .iter()
        .filter(|mu| mu.norm() > 1.0 + 1e-9)
        .count() as i64
}

fn change(event: &BifurcationEvent) -> i64 {
    event
        .unstable
        .map_or(0, |(before, behind)| behind as i64 - before as i64)
}

/// What one train brought.
#[derive(Default, Debug)]
struct Score {
    windows: usize,
    missed: usize,
    checked: usize,
    unresolved: usize,
    without_reference: usize,
}

impl Score {
    fn add(&mut self, other: &Score) {
        self.windows += other.windows;
        self.missed += other.missed;
        self.checked += other.checked;
        self.unresolved += other.unresolved;
        self.without_reference += other.without_reference;
    }
}

/// Compares a branch with counts on a grid; `reference` counts at a frequency, given the two points around it.
fn judge(
    branch: &Branch,
    mut reference: impl FnMut(f64, (&BranchPoint, &BranchPoint)) -> Option<(usize, usize)>,
) -> Score {
    let mut score = Score {
        unresolved: branch
            .events
            .iter()
            .filter(|e| e.kind == EventKind::Unresolved)
            .count(),
        ..Score::default()
    };
    // Length of the present run of grid points at which the branch says something else, and the last reference.
    let (mut wrong, mut last) = (0, None);
    for (k, pair) in branch.points.windows(2).enumerate() {
        let (a, b) = (&pair[0], &pair[1]);
        let events: Vec<_> = branch
            .events
            .iter()
            .filter(|e| e.after_point == k)
            .collect();
        // The counts of neighbouring points and what the events say of them, without any grid.
        let told: i64 = events.iter().map(|e| change(e)).sum();
        assert!(
            score.unresolved > 0 || count(a) + told == count(b),
            "{} to {}: {} to {}, events {told:+}",
            a.lambda,
            b.lambda,
            count(a),
            count(b)
        );
        if events.iter().any(|e| e.kind == EventKind::Fold) {
            continue;
        }
        let sign = (b.lambda - a.lambda).signum();
        let first = (a.lambda.ln() / GRID * sign).floor() as i64 + 1;
        let end = (b.lambda.ln() / GRID * sign).floor() as i64;
        for number in first..=end {
            let omega = (number as f64 * sign * GRID).exp();
            let passed = events.iter().filter(|e| (e.lambda - omega) * sign < 0.0);
            let told = count(a) + passed.map(|e| change(e)).sum::<i64>();
            let Some((least, most)) = reference(omega, (a, b)) else {
                score.without_reference += 1;
                continue;
            };
            score.checked += 1;
            if least == most && last != Some(least) {
                score.windows += usize::from(last.is_some());
                last = Some(least);
            }
            wrong = match (least as i64..=most as i64).contains(&told) {
                true => 0,
                false => wrong + 1,
            };
            // Two points of the grid in a row may be as wide as the resolution.
            if wrong == 2 && is_wide(omega, sign, told, &mut |x| reference(x, (a, b))) {
                score.missed += 1;
                let told_of = events.iter().map(|e| (e.kind.word(), e.lambda, e.unstable));
                let told_of: Vec<_> = told_of.collect();
                eprintln!("missed at {omega}: {told} told, {least} there; {told_of:?}");
            }
        }
    }
    score
}

/// Whether the stretch around a frequency and its neighbour behind, in which the reference says something else than was told, is as
/// wide as the resolution: its ends by bisection.
fn is_wide(
    omega: f64,
    sign: f64,
    told: i64,
    reference: &mut dyn FnMut(f64) -> Option<(usize, usize)>,
) -> bool {
    let mut is_wrong = |x: f64| {
        let known = reference(x).map(|(least, most)| (least as i64..=most as i64).contains(&told));
        known == Some(false)
    };
    let mut end = |inside: f64, step: f64| {
        let (mut low, mut high) = (0.0, step);
        if is_wrong(inside * f64::exp(high)) {
            return high;
        }
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            match is_wrong(inside * f64::exp(middle)) {
                true => low = middle,
                false => high = middle,
            }
        }
        low
    };
    let ahead = end(omega, sign * GRID).abs();
    let behind = end(omega * f64::exp(-sign * GRID), -sign * GRID).abs();
    ahead + GRID + behind >= 2.0 * GRID
}

fn trains() -> usize {
    std::env::var(TRAINS.1)
        .ok()
        .and_then(|x| x.parse().ok())
        .unwrap_or(TRAINS.0)
}

#[test]
fn no_window_of_a_parametrically_excited_train_is_missed() {
    let mut total = Score::default();
    for seed in 0..trains() / 2 {
        let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed as u64));
        let system = parametric(&mut draw);
        let from = draw.between(2.6, 4.2);
        let branch = at_rest(&system, (from, 0.45));
        let hill = Hill::new(&system);
        let score = judge(&branch, |omega, _| outside(&hill.phi(omega)));
        if score.missed + score.unresolved > 0 {
            eprintln!("parametric train {seed}: {score:?}");
        }
        total.add(&score);
    }
    eprintln!("parametric trains: {total:?}");
    assert!(total.windows > trains() / 2, "{total:?}");
    assert_eq!((total.missed, total.unresolved), (0, 0), "{total:?}");
}

#[test]
fn no_window_of_a_rattling_train_is_missed() {
    let mut total = Score::default();
    for seed in 0..trains() / 2 {
        let mut draw = Draw(ChaCha8Rng::seed_from_u64(1_000_000 + seed as u64));
        let mut system = rattling(&mut draw);
        let from = draw.between(1.8, 2.6);
        let range = (from, draw.between(0.35, 0.6));
        let branch = shoot(&system, range, &[], IntegratorChoice::Exact, 0.1);
        let score = judge(&branch, |omega, (a, b)| {
            let share = (omega - a.lambda) / (b.lambda - a.lambda);
            let chord = &b.unknowns - &a.unknowns;
            let guess = &a.unknowns + &chord * share;
            flow(&mut system, omega, &guess, 0.5 * chord.norm()).and_then(|phi| outside(&phi))
        });
        if score.missed + score.unresolved > 0 {
            eprintln!("rattling train {seed}: {score:?}");
        }
        total.add(&score);
    }
    eprintln!("rattling trains: {total:?}");
    assert!(total.windows > trains() / 2, "{total:?}");
    assert_eq!((total.missed, total.unresolved), (0, 0), "{total:?}");
}
