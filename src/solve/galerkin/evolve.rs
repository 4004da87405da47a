//! Laws whose memory has a rate on a trigonometric polynomial: the memory followed around the period, with its partials.
//!
//! ```text
//! dz/dtau = g(x, v, phase, z) / Om,   z(2 pi) = z(0)
//! ```
//!
//! The rule of Runge and Kutta of order 4 goes from sample to sample; where deformation, rate or memory pass a kink of the law, a step ends
//! there. What a step does is linear in small changes of z at its begin, of x and v at its begin, middle and end, and of the frequency:
//! eight numbers, from which the partials by all coefficients follow. The memory at the begin is found by Newton's method; a law that never
//! forgets keeps the one that is given.

use crate::element::evolving::{Evolution, Evolving, Kinks};
use crate::numeric::roots::bracketed;
use std::f64::consts::TAU;

/// Turns at most until the memory is periodic.
const MOST_TURNS: usize = 100;
/// Change of a memory over the period that counts as none.
const CLOSED: f64 = 1e-13;
/// Share of the way into a span at which partials on a kink at its end are taken.
const ASIDE: f64 = 1e-12;
/// Width to which kinks are located.
const NARROW: f64 = 1e-15;
/// Share of a change of the memory that a period has to forget.
const FORGETS: f64 = 1e-9;

/// Partials of the end of a step by: z at its begin; x, v at its begin, in its middle, at its end; the frequency times itself.
type Partials = [f64; 8];

/// Motion at an instant: deformation, rate, phase.
pub(crate) type PhasePoint = [f64; 3];

/// A stretch of time without a kink in deformation or rate.
#[derive(Debug, Clone, Copy)]
struct MemorySpan {
    begin: f64,
    end: f64,
    /// At begin, middle and end.
    motion: [PhasePoint; 3],
    /// Whether a sample stands at its end.
    ends_cell: bool,
}

/// One step of the march, as it was taken.
#[derive(Debug, Clone, Copy)]
struct MarchStep {
    at: [f64; 3],
    partials: Partials,
    ends_cell: bool,
}

/// Follows one memory; owns its buffers.
#[derive(Debug, Default)]
pub(crate) struct Evolve {
    spans: Vec<MemorySpan>,
    steps: Vec<MarchStep>,
    /// Memory at the samples.
    pub memory: Vec<f64>,
    /// Share of a change of the memory at the begin that is left at the samples, and at the end of the period.
    left: Vec<f64>,
    kept: f64,
    /// Partials of the memory at the samples by the coefficients, then by the frequency times itself: one row per sample.
    pub partials: Vec<f64>,
    basis: [Vec<[f64; 2]>; 3],
}

impl Evolve {
    /// Follows the memory of a law around a motion from the memory `given`; `samples` of it are kept.
    pub(crate) fn follow(
        &mut self,
        law: &dyn Evolving,
        (samples, omega): (usize, f64),
        given: f64,
        motion: &dyn Fn(f64) -> PhasePoint,
    ) {
        let kinks = law.kinks();
        self.divide(&kinks, samples, motion);
        let mut start = given;
        for _ in 0..MOST_TURNS {
            let end = self.turn(law, &kinks, omega, (start, motion));
            let (gap, forgets) = (end - start, 1.0 - self.kept);
            if forgets.abs() < FORGETS || gap.abs() <= CLOSED * (1.0 + start.abs()) {
                break;
            }
            start += gap / forgets;
        }
    }

    /// Spans between samples and kinks of deformation and rate.
    fn divide(&mut self, kinks: &Kinks, samples: usize, motion: &dyn Fn(f64) -> PhasePoint) {
        self.spans.clear();
        let tau = |j: usize| j as f64 * TAU / samples as f64;
        let mut here = motion(0.0);
        let mut cuts = Vec::new();
        for j in 0..samples {
            let next = motion(tau(j + 1));
            cuts.clear();
            cuts.push((tau(j), None));
            for (axis, levels) in [&kinks.deformation, &kinks.rate].into_iter().enumerate() {
                for level in levels {
                    let (a, b) = (here[axis] - level, next[axis] - level);
                    if a * b < 0.0 {
                        let gap = |t: f64| motion(t)[axis] - level;
                        cuts.push((passage(gap, (tau(j), a), tau(j + 1)), Some((axis, *level))));
                    }
                }
            }
            cuts.push((tau(j + 1), None));
            cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
            for pair in cuts.windows(2).filter(|pair| pair[1].0 > pair[0].0) {
                let (begin, end) = (pair[0].0, pair[1].0);
                let is_last = end == tau(j + 1);
                let middle = motion(0.5 * (begin + end));
                let mut ends = [here, next];
                for (end, (t, kink)) in ends.iter_mut().zip(pair) {
                    // On a kink the partials are those of the side of the span.
                    if let Some((axis, level)) = kink {
                        *end = motion(*t);
                        end[*axis] = level + ASIDE * (middle[*axis] - level);
                    }
                }
                self.spans.push(MemorySpan {
                    begin,
                    end,
                    motion: [ends[0], middle, ends[1]],
                    ends_cell: is_last,
                });
            }
            here = next;
        }
    }

    /// Once around the period; the memory at its end.
    fn turn(
        &mut self,
        law: &dyn Evolving,
        kinks: &Kinks,
        omega: f64,
        (start, motion): (f64, &dyn Fn(f64) -> PhasePoint),
    ) -> f64 {
        self.steps.clear();
        self.memory.clear();
        self.left.clear();
        self.memory.push(start);
        self.left.push(1.0);
        let (mut z, mut left) = (start, 1.0);
        for k in 0..self.spans.len() {
            let mut span = self.spans[k];
            // Each level is passed once at most.
            for _ in 0..=kinks.memory.len() {
                let side = side_of(z, &kinks.memory);
                let (end, partials) =
                    step(law, (omega, side), z, (span.begin, span.end), &span.motion);
                let passes = |level: &&f64| (z - **level) * (end - **level) < 0.0;
                let cut = kinks.memory.iter().find(passes).and_then(|level| {
                    let gap = |t: f64| {
                        let there = part(&span, (span.begin, t), motion);
                        step(law, (omega, side), z, (span.begin, t), &there).0 - level
                    };
                    let t = passage(gap, (span.begin, z - level), span.end);
                    (t > span.begin && t < span.end).then_some((t, *level))
                });
                let Some((t, level)) = cut else {
                    self.push((span.begin, span.end), partials, span.ends_cell);
                    (z, left) = (end, left * partials[0]);
                    break;
                };
                let there = part(&span, (span.begin, t), motion);
                let partials = step(law, (omega, side), z, (span.begin, t), &there).1;
                self.push((span.begin, t), partials, false);
                (z, left) = (level + ASIDE * (level - z), left * partials[0]);
                span.motion = part(&span, (t, span.end), motion);
                span.begin = t;
            }
            if span.ends_cell {
                self.memory.push(z);
                self.left.push(left);
            }
        }
        self.memory.pop();
        self.left.pop();
        self.kept = left;
        z
    }

    fn push(&mut self, (begin, end): (f64, f64), partials: Partials, ends_cell: bool) {
        self.steps.push(MarchStep {
            at: [begin, 0.5 * (begin + end), end],
            partials,
            ends_cell,
        });
    }

    /// Force at the samples, from the memory last followed; its partials take the place of those of the memory.
    pub(crate) fn respond(
        &mut self,
        law: &dyn Evolving,
        omega: f64,
        motion: &dyn Fn(f64) -> PhasePoint,
        force: &mut [f64],
    ) {
        let samples = self.memory.len();
        let width = self.partials.len() / samples;
        let basis = &mut self.basis[0];
        let rows = self.partials.chunks_exact_mut(width);
        for (j, (row, f)) in rows.zip(force.iter_mut()).enumerate() {
            let tau = j as f64 * TAU / samples as f64;
            let [x, v, phase] = motion(tau);
            let here = law.evolve([x, v, phase, self.memory[j]]);
            let [f_x, f_v, f_z] = here.force_by;
            *f = here.force;
            fill(basis, tau, omega);
            for (d, [x, v]) in row.iter_mut().zip(basis.iter()) {
                *d = f_z * *d + f_x * x + f_v * v;
            }
            row[width - 1] = f_z * row[width - 1] + f_v * v;
        }
    }

    /// Partials of the memory last followed by the coefficients mean, sin 1, cos 1, .. of the deformation.
    pub(crate) fn differentiate(&mut self, coefficients: usize, omega: f64) {
        let width = coefficients + 1;
        self.partials.clear();
        self.partials.resize(width, 0.0);
        let mut row = vec![0.0; width];
        for basis in &mut self.basis {
            basis.resize(coefficients, [0.0; 2]);
        }
        fill(&mut self.basis[2], 0.0, omega);
        let mut last = 0.0;
        for step in &self.steps {
            self.basis.rotate_left(2);
            if step.at[0] != last {
                fill(&mut self.basis[0], step.at[0], omega);
            }
            fill(&mut self.basis[1], step.at[1], omega);
            fill(&mut self.basis[2], step.at[2], omega);
            last = step.at[2];
            let [by_z, by_motion @ .., by_frequency] = step.partials;
            for (k, sum) in row[..coefficients].iter_mut().enumerate() {
                *sum *= by_z;
                for (basis, by) in self.basis.iter().zip(by_motion.as_chunks::<2>().0) {
                    *sum += by[0] * basis[k][0] + by[1] * basis[k][1];
                }
            }
            row[coefficients] = by_z * row[coefficients] + by_frequency;
            if step.ends_cell {
                self.partials.extend_from_slice(&row);
            }
        }
        // The memory at the begin is that at the end.
        self.partials.truncate(width * self.memory.len());
        let forgets = 1.0 - self.kept;
        if forgets.abs() < FORGETS {
            return;
        }
        for (partials, left) in self.partials.chunks_exact_mut(width).zip(&self.left) {
            for (d, end) in partials.iter_mut().zip(&row) {
                *d += left * end / forgets;
            }
        }
    }
}

/// What a change of each coefficient makes of deformation and rate at an instant.
fn fill(basis: &mut [[f64; 2]], tau: f64, omega: f64) {
    basis[0] = [1.0, 0.0];
    let (sin, cos) = tau.sin_cos();
    let (mut s, mut c) = (0.0, 1.0);
    for (k, pair) in basis[1..].chunks_exact_mut(2).enumerate() {
        (s, c) = (s * cos + c * sin, c * cos - s * sin);
        let rate = omega * (k + 1) as f64;
        (pair[0], pair[1]) = ([s, rate * c], [c, -rate * s]);
    }
}

/// Motion at begin, middle and end of a part of a span.
fn part(
    span: &MemorySpan,
    (begin, end): (f64, f64),
    motion: &dyn Fn(f64) -> PhasePoint,
) -> [PhasePoint; 3] {
    let at = |t: f64| match () {
        () if t == span.begin => span.motion[0],
        () if t == span.end => span.motion[2],
        () => motion(t),
    };
    [at(begin), motion(0.5 * (begin + end)), at(end)]
}

/// Between which kinks a memory is, a little inside.
fn side_of(z: f64, kinks: &[f64]) -> [f64; 2] {
    let aside = |level: f64| ASIDE * (level.abs() + (level - z).abs());
    let below = kinks.iter().rev().find(|k| **k < z);
    let above = kinks.iter().find(|k| **k > z);
    [
        below.map_or(f64::NEG_INFINITY, |k| (k + aside(*k)).min(z)),
        above.map_or(f64::INFINITY, |k| (k - aside(*k)).max(z)),
    ]
}

/// The memory at the end of a step, with its partials; all of it on one side of the kinks of the memory.
fn step(
    law: &dyn Evolving,
    (omega, side): (f64, [f64; 2]),
    z: f64,
    (begin, end): (f64, f64),
    motion: &[PhasePoint; 3],
) -> (f64, Partials) {
    let h = end - begin;
    let (mut sum, mut total) = (0.0, [0.0; 8]);
    let (mut rate, mut by) = (0.0, [0.0; 8]);
    for (place, reach, weight) in [(0, 0.0, 1.0), (1, 0.5, 2.0), (1, 0.5, 2.0), (2, 1.0, 1.0)] {
        let [x, v, phase] = motion[place];
        let Evolution {
            rate: g, rate_by, ..
        } = law.evolve([x, v, phase, (z + reach * h * rate).clamp(side[0], side[1])]);
        let [g_x, g_v, g_z] = rate_by.map(|d| d / omega);
        let mut next = by.map(|d| g_z * reach * h * d);
        next[0] += g_z;
        next[1 + 2 * place] += g_x;
        next[2 + 2 * place] += g_v;
        // The rate of the deformation grows with the frequency, the time of a radian falls.
        next[7] += g_v * v - g / omega;
        (rate, by) = (g / omega, next);
        sum += weight * rate;
        total.iter_mut().zip(by).for_each(|(t, d)| *t += weight * d);
    }
    let mut partials = total.map(|t| h / 6.0 * t);
    partials[0] += 1.0;
    (z + h / 6.0 * sum, partials)
}

/// Where a function passes 0 between a and b, which enclose it.
fn passage(f: impl Fn(f64) -> f64, (a, fa): (f64, f64), b: f64) -> f64 {
    let exact = |t: f64| Ok::<f64, std::convert::Infallible>(f(t));
    match f(b) {
        fb if fa * fb < 0.0 => {
            bracketed(exact, (a, fa), (b, fb), NARROW).map_or(b, |found| found.root)
        }
        _ => b,
    }
}

/// A memory with a rate along an orbit.
#[derive(Debug, Clone)]
pub(crate) struct MemoryCourse {
    /// Memory and its derivative, d/dtau, at equal steps.
    knots: Vec<[f64; 2]>,
}

impl MemoryCourse {
    /// Along a motion, from the memory `given`.
    pub(crate) fn new(
        law: &dyn Evolving,
        (samples, omega): (usize, f64),
        given: f64,
        motion: &dyn Fn(f64) -> PhasePoint,
    ) -> MemoryCourse {
        let mut evolve = Evolve::default();
        evolve.follow(law, (samples, omega), given, motion);
        let knot = |(j, z): (usize, &f64)| {
            let [x, v, phase] = motion(j as f64 * TAU / samples as f64);
            [*z, law.evolve([x, v, phase, *z]).rate / omega]
        };
        MemoryCourse {
            knots: evolve.memory.iter().enumerate().map(knot).collect(),
        }
    }

    /// The memory at an instant: a cubic between two knots.
    pub(crate) fn at(&self, tau: f64) -> f64 {
        let count = self.knots.len();
        let h = TAU / count as f64;
        let place = (tau / h).rem_euclid(count as f64);
        let (k, x) = (place as usize % count, place.fract());
        let ([a, da], [b, db]) = (self.knots[k], self.knots[(k + 1) % count]);
        let (left, right) = (1.0 - x, x);
        let ends = left * left * (1.0 + 2.0 * x) * a + right * right * (3.0 - 2.0 * x) * b;
        ends + h * left * x * (left * da - right * db)
    }
}
