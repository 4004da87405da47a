//! Several trajectories in closed form: a step of each in every operation.
//!
//! The steps are those of [`Exact`](super::Exact) without a transition matrix, operation by operation, so that every trajectory is the same to the bit. Numbers
//! of different trajectories stand side by side, and the processor works on as many at a time as it has room for. Roots of
//! different trajectories are polished together as well; what is left (regions, passages that an outline does not decide) is
//! done one after the other.

mod crossings;

use super::Exact;
use super::decay::{MAX_REACH, NEGLIGIBLE, SIZE_TERMS};
use super::recursion::RECIPROCAL;
use super::series::{is_next_turn, within_turn};
use super::tables::LaneTables;
use crate::numeric::bernstein::{Direction, evaluate_each};
use crate::numeric::roots::root_below;
use crate::numeric::taylor::COUNT;
use crate::solve::integrate::{Flight, Status};
use crate::system::System;
use crossings::LaneCrossing;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::TAU;

/// Trajectories side by side.
const LANES: usize = 8;
/// A number of each of them.
type Each = [f64; LANES];

/// The trajectories.
#[derive(Debug, Clone)]
pub(crate) struct Lanes<const N: usize> {
    tables: LaneTables<N>,
    tau: Each,
    q: [Each; N],
    v: [Each; N],
    coupled: [[Each; N]; N],
    constant: [Each; N],
    pace: Each,
    /// Region of every connection and its borders.
    region: Vec<[usize; LANES]>,
    low: Vec<Each>,
    high: Vec<Each>,
    /// Steps since the begin of the period.
    steps: [usize; LANES],
    load: [[Each; COUNT]; N],
    motion: [[Each; COUNT]; N],
    powers: [Each; COUNT],
    scaled: [Each; COUNT],
}

/// Steps in a period beyond which it is left to the integrator.
const MOST_STEPS: usize = 5_000;

impl<const N: usize> Flight for Lanes<N> {
    fn places(&self) -> usize {
        LANES
    }

    fn start(&mut self, lane: usize, state: &[f64]) -> bool {
        let (q, v) = state.split_at(N);
        let rates = v.iter().map(|v| v.abs() * self.tables.unit);
        let size = q.iter().map(|q| q.abs()).chain(rates).fold(0.0, f64::max);
        for i in 0..N {
            (self.q[i][lane], self.v[i][lane]) = (q[i], v[i]);
        }
        (self.tau[lane], self.steps[lane]) = (0.0, 0);
        let mut stands = false;
        for (line, region) in self.tables.lines.iter().zip(&mut self.region) {
            let x = q[line.connection];
            region[lane] = 0;
            for level in &line.breakpoints {
                let tolerance = line.tolerance(*level, size);
                region[lane] += usize::from(x - level > tolerance);
                stands |= (x - level).abs() <= tolerance;
            }
        }
        self.enter(lane);
        !stands
    }

    fn step(&mut self, status: &mut [Status]) {
        // Whatever instructions the processor has: products and sums are the same.
        Arch::new().dispatch(LaneStep {
            lanes: self,
            status,
        });
    }

    fn state(&self, lane: usize, out: &mut [f64]) {
        for i in 0..N {
            (out[i], out[N + i]) = (self.q[i][lane], self.v[i][lane]);
        }
    }
}

/// A step as the processor takes it.
struct LaneStep<'a, const N: usize> {
    lanes: &'a mut Lanes<N>,
    status: &'a mut [Status],
}

impl<const N: usize> WithSimd for LaneStep<'_, N> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.lanes.advance(simd, self.status);
    }
}

impl Exact {
    /// Places for several trajectories: for up to four coordinates that are deformations of broken-line laws, without transmission
    /// errors, memory, impacts or corners of the excitation.
    pub(super) fn side_by_side(mut self, system: &System) -> Option<Box<dyn Flight>> {
        let is_plain = self.name == "exact"
            && system.course().is_none()
            && self.series.errors.is_none()
            && self.kinks.is_empty()
            && !self.regions.has_automata();
        if !is_plain {
            return None;
        }
        self.prepare(system);
        Some(match system.dof() {
            1 => Box::new(Lanes::new(self.tables::<1>(system)?)),
            2 => Box::new(Lanes::new(self.tables::<2>(system)?)),
            3 => Box::new(Lanes::new(self.tables::<3>(system)?)),
            4 => Box::new(Lanes::new(self.tables::<4>(system)?)),
            _ => return None,
        })
    }
}

impl<const N: usize> Lanes<N> {
    /// Empty places.
    pub fn new(tables: LaneTables<N>) -> Lanes<N> {
        let zero = [0.0; LANES];
        let count = tables.lines.len();
        let mut lanes = Lanes {
            tables,
            tau: zero,
            q: [zero; N],
            v: [zero; N],
            coupled: [[zero; N]; N],
            constant: [zero; N],
            pace: zero,
            region: vec![[0; LANES]; count],
            low: vec![zero; count],
            high: vec![zero; count],
            steps: [0; LANES],
            load: [[zero; COUNT]; N],
            motion: [[zero; COUNT]; N],
            powers: [zero; COUNT],
            scaled: [zero; COUNT],
        };
        (0..LANES).for_each(|lane| lanes.enter(lane));
        lanes
    }

    /// Takes over the equation for the regions of a lane.
    fn enter(&mut self, lane: usize) {
        let mut number = 0;
        for (k, line) in self.tables.lines.iter().enumerate() {
            let region = self.region[k][lane];
            number += line.stride * region;
            let below = region.checked_sub(1).map(|r| line.breakpoints[r]);
            let above = line.breakpoints.get(region).copied();
            self.low[k][lane] = below.unwrap_or(f64::NEG_INFINITY);
            self.high[k][lane] = above.unwrap_or(f64::INFINITY);
        }
        let variant = &self.tables.variants[number];
        for i in 0..N {
            for j in 0..N {
                self.coupled[i][j][lane] = variant.coupled[i][j];
            }
            self.constant[i][lane] = variant.constant[i];
        }
        self.pace[lane] = variant.pace;
    }

    /// A step of every lane.
    #[inline(always)]
    fn advance<S: Simd>(&mut self, simd: S, status: &mut [Status]) {
        self.expand_loads();
        self.recur(simd);
        let (step, whole) = self.lengths();
        let crossings = self.crossings(simd, &step);
        let mut theta = step;
        for l in 0..LANES {
            theta[l] = crossings[l].map_or(theta[l], |c| c.theta);
        }
        for i in 0..N {
            let slope;
            (self.q[i], slope) = evaluate_each(simd, &self.motion[i], &theta);
            for (v, slope) in self.v[i].iter_mut().zip(&slope) {
                *v = slope / self.tables.unit;
            }
        }
        for (l, status) in status.iter_mut().enumerate() {
            *status = self.close(l, theta[l], crossings[l], whole[l]);
        }
    }

    /// What follows a step of a lane.
    #[inline(always)]
    fn close(
        &mut self,
        l: usize,
        theta: f64,
        crossing: Option<LaneCrossing>,
        whole: bool,
    ) -> Status {
        let (tau, end) = (self.tau[l], self.tables.period);
        let next = match crossing {
            None if whole => end,
            _ => (tau + theta * self.tables.per_theta).min(end),
        };
        let mut is_finite = true;
        for i in 0..N {
            is_finite &= self.q[i][l].abs() <= f64::MAX && self.v[i][l].abs() <= f64::MAX;
        }
        self.steps[l] += 1;
        if !is_finite || (crossing.is_none() && next <= tau) || self.steps[l] > MOST_STEPS {
            return Status::Lost;
        }
        self.tau[l] = next;
        if let Some(c) = crossing {
            let region = &mut self.region[c.line][l];
            *region = match c.direction {
                Direction::Up => *region + 1,
                Direction::Down => *region - 1,
            };
            self.enter(l);
        }
        match next >= end {
            true => Status::Arrived,
            false => Status::Flying,
        }
    }

    /// Taylor coefficients of the loads, with what the regions add.
    #[inline(always)]
    fn expand_loads(&mut self) {
        let LaneTables { period, turns, .. } = self.tables;
        let phase = self.tau.map(|tau| {
            let phase = within_turn(turns * tau);
            let middle = phase + turns * (0.5 * (tau + period) - tau);
            match is_next_turn(phase, middle) {
                true => phase - TAU,
                false => phase,
            }
        });
        for (load, mean) in self.load.iter_mut().zip(self.tables.mean) {
            *load = [[0.0; LANES]; COUNT];
            load[0] = [mean; LANES];
        }
        for term in &self.tables.orders {
            let (mut sin, mut cos) = ([0.0; LANES], [0.0; LANES]);
            for l in 0..LANES {
                let (s, c) = (term.order * phase[l]).sin_cos();
                (sin[l], cos[l]) = (term.scale * s, term.scale * c);
            }
            for (i, load) in self.load.iter_mut().enumerate() {
                let (a, b) = (term.cos[i], term.sin[i]);
                if a == 0.0 && b == 0.0 {
                    continue;
                }
                let (mut even, mut odd) = ([0.0; LANES], [0.0; LANES]);
                for l in 0..LANES {
                    even[l] = a * cos[l] + b * sin[l];
                    odd[l] = b * cos[l] - a * sin[l];
                }
                let pattern = [even, odd, even.map(|x| -x), odd.map(|x| -x)];
                for (k, out) in load.iter_mut().enumerate() {
                    let (power, wave) = (term.powers[k], &pattern[k % 4]);
                    for l in 0..LANES {
                        out[l] += wave[l] * power;
                    }
                }
            }
        }
        for (load, constant) in self.load.iter_mut().zip(&self.constant) {
            for l in 0..LANES {
                load[0][l] += constant[l];
            }
        }
    }

    /// Coefficients of the motion, of as many lanes at a time as a register holds.
    #[inline(always)]
    fn recur<S: Simd>(&mut self, simd: S) {
        let number = |x: f64| simd.splat_f64s(x);
        let unit = number(self.tables.unit);
        for part in 0..LANES / S::F64_LANES {
            let zero = number(0.0);
            let (mut now, mut rate) = ([zero; N], [zero; N]);
            let mut coupled = [[zero; N]; N];
            for i in 0..N {
                now[i] = part_of::<S>(&self.q[i], part);
                rate[i] = simd.mul_f64s(part_of::<S>(&self.v[i], part), unit);
                put::<S>(&mut self.motion[i][0], part, now[i]);
                put::<S>(&mut self.motion[i][1], part, rate[i]);
                for (own, each) in coupled[i].iter_mut().zip(&self.coupled[i]) {
                    *own = part_of::<S>(each, part);
                }
            }
            for k in 0..COUNT - 2 {
                let mut next = [zero; N];
                for i in 0..N {
                    let mut sum = part_of::<S>(&self.load[i][k], part);
                    for j in 0..N {
                        sum = simd.sub_f64s(sum, simd.mul_f64s(coupled[i][j], now[j]));
                    }
                    sum = simd.mul_f64s(sum, number(RECIPROCAL[k + 1]));
                    for (damping, rate) in self.tables.damping[i].iter().zip(&rate) {
                        let damping = number(damping * RECIPROCAL[k + 1]);
                        sum = simd.sub_f64s(sum, simd.mul_f64s(damping, *rate));
                    }
                    next[i] = sum;
                    let own = simd.mul_f64s(sum, number(RECIPROCAL[k + 2]));
                    put::<S>(&mut self.motion[i][k + 2], part, own);
                }
                for (now, motion) in now.iter_mut().zip(&self.motion) {
                    *now = part_of::<S>(&motion[k + 1], part);
                }
                rate = next;
            }
        }
    }

    /// Length of every step, and whether it reaches the end of the period.
    #[inline(always)]
    fn lengths(&self) -> (Each, [bool; LANES]) {
        let (mut last, mut size) = ([0.0; LANES], [f64::MIN_POSITIVE; LANES]);
        for motion in &self.motion {
            let mut power = [1.0; LANES];
            for c in &motion[..SIZE_TERMS] {
                for l in 0..LANES {
                    size[l] = larger(size[l], power[l] * c[l].abs());
                    power[l] *= self.pace[l];
                }
            }
            for l in 0..LANES {
                let (a, b) = (motion[COUNT - 2][l].abs(), motion[COUNT - 1][l].abs());
                last[l] = larger(last[l], larger(a, self.pace[l] * b));
            }
        }
        let (mut step, mut whole) = ([0.0; LANES], [true; LANES]);
        for l in 0..LANES {
            let pace = self.pace[l];
            let power = match pace == 1.0 {
                true => 1.0,
                false => pace.powi(COUNT as i32 - 2),
            };
            let ratio = NEGLIGIBLE * size[l] / ((COUNT - 1) as f64 * (power * last[l]));
            let degree = if ratio < 1.0 { COUNT - 3 } else { COUNT - 2 };
            let reach = pace * root_below(ratio, 1.0 / degree as f64).min(MAX_REACH);
            let remaining = (self.tables.period - self.tau[l]) / self.tables.per_theta;
            whole[l] = remaining <= reach * (1.0 + 1e-12);
            step[l] = if whole[l] { remaining } else { reach };
        }
        (step, whole)
    }
}

/// As many of the lanes as a register holds.
#[inline(always)]
fn part_of<S: Simd>(each: &Each, part: usize) -> S::f64s {
    S::as_simd_f64s(each).0[part]
}

/// Writes as many of the lanes as a register holds.
#[inline(always)]
fn put<S: Simd>(each: &mut Each, part: usize, value: S::f64s) {
    S::as_mut_simd_f64s(each).0[part] = value;
}

#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
