//! The equation of motion as a recursion for Taylor coefficients, in units of time that suit the system.

use crate::numeric::periodic::Periodic;
use crate::solve::affine::AffineLaw;
use crate::system::{LoadKind, System};
use std::f64::consts::TAU;

/// Degree of the Taylor polynomials of q.
pub const DEGREE: usize = 22;
/// Coefficients a coordinate.
pub const COUNT: usize = DEGREE + 1;

/// A sum of harmonics with vector coefficients, as Taylor series at any phase.
#[derive(Debug, Clone, Default)]
struct Harmonics {
    /// Order, cosine vector, sine vector.
    terms: Vec<(f64, Vec<f64>, Vec<f64>)>,
    /// w^k / k! for each term.
    powers: Vec<[f64; COUNT]>,
    mean: Vec<f64>,
}

impl Harmonics {
    fn new(size: usize) -> Harmonics {
        Harmonics {
            mean: vec![0.0; size],
            ..Harmonics::default()
        }
    }

    fn add(&mut self, index: usize, factor: f64, series: &Periodic, kind: LoadKind) {
        let Periodic::Fourier { mean, harmonics } = series else {
            return;
        };
        if kind == LoadKind::Value {
            self.mean[index] += factor * mean;
        }
        let size = self.mean.len();
        for h in harmonics {
            let order = h.order as f64;
            let (cos, sin) = match kind {
                LoadKind::Value => (h.cos, h.sin),
                LoadKind::Rate => (order * h.sin, -order * h.cos),
            };
            let position = self
                .terms
                .iter()
                .position(|t| t.0 == order)
                .unwrap_or_else(|| {
                    self.terms.push((order, vec![0.0; size], vec![0.0; size]));
                    self.terms.len() - 1
                });
            self.terms[position].1[index] += factor * cos;
            self.terms[position].2[index] += factor * sin;
        }
    }

    fn prepare(&mut self, frequency: f64) {
        self.powers = self
            .terms
            .iter()
            .map(|(order, _, _)| {
                let mut list = [1.0; COUNT];
                for k in 1..COUNT {
                    list[k] = list[k - 1] * order * frequency / k as f64;
                }
                list
            })
            .collect();
    }

    /// Writes the coefficients at a phase; layout as the coordinates'.
    fn expand(&self, phase: f64, out: &mut [f64]) {
        for (i, block) in out.chunks_exact_mut(COUNT).enumerate() {
            block.fill(0.0);
            block[0] = self.mean[i];
        }
        for ((order, cos, sin), powers) in self.terms.iter().zip(&self.powers) {
            let (s, c) = (order * phase).sin_cos();
            for (i, block) in out.chunks_exact_mut(COUNT).enumerate() {
                let (even, odd) = (cos[i] * c + sin[i] * s, sin[i] * c - cos[i] * s);
                if even == 0.0 && odd == 0.0 {
                    continue;
                }
                let pattern = [even, odd, -even, -odd];
                block
                    .iter_mut()
                    .zip(powers)
                    .enumerate()
                    .for_each(|(k, (b, p))| *b += pattern[k % 4] * p);
            }
        }
    }
}

/// One nonzero entry of a matrix.
#[derive(Debug, Clone, Copy)]
struct Entry {
    row: usize,
    column: usize,
    value: f64,
}

fn entries(matrix: &nalgebra::DMatrix<f64>, factor: f64) -> Vec<Entry> {
    let all =
        (0..matrix.nrows()).flat_map(|row| (0..matrix.ncols()).map(move |column| (row, column)));
    all.map(|(row, column)| Entry {
        row,
        column,
        value: factor * matrix[(row, column)],
    })
    .filter(|e| e.value != 0.0)
    .collect()
}

/// Entries of kappa W and what each connection adds to them.
fn couple(stiffness: &[Entry], map: &[Entry]) -> (Vec<Entry>, Vec<Entry>) {
    let (mut coupled, mut links): (Vec<Entry>, Vec<Entry>) = (Vec::new(), Vec::new());
    let mut known = std::collections::HashMap::new();
    for s in stiffness {
        for w in map.iter().filter(|w| w.row == s.column) {
            let target = *known.entry((s.row, w.column)).or_insert_with(|| {
                coupled.push(Entry {
                    row: s.row,
                    column: w.column,
                    value: 0.0,
                });
                coupled.len() - 1
            });
            links.push(Entry {
                row: target,
                column: s.column,
                value: s.value * w.value,
            });
        }
    }
    (coupled, links)
}

/// The recursion with its tables and buffers.
#[derive(Debug, Clone)]
pub struct Series {
    /// Unit of time h in omega_c t: theta = T / h.
    pub unit: f64,
    damping: Vec<Entry>,
    stiffness: Vec<Entry>,
    map: Vec<Entry>,
    loads: Harmonics,
    rates: Harmonics,
    errors: Option<Harmonics>,
    /// Excitation frequency for which the powers were made.
    frequency: f64,
    load: Vec<f64>,
    rate: Vec<f64>,
    error: Vec<f64>,
    /// Coefficients of q, n blocks.
    pub q: Vec<f64>,
    /// Coefficients of the deformations, e blocks.
    pub deformation: Vec<f64>,
    /// h^2 kappa diag(slope) W of the current regions.
    coupled: Vec<Entry>,
    /// What each product kappa_ie W_ej adds: target in `coupled`, connection e, value.
    links: Vec<Entry>,
    /// -h^2 kappa offset of the current regions.
    constant: Vec<f64>,
    slope: Vec<f64>,
    /// W is the identity and there is no transmission error.
    is_plain: bool,
    is_rate_free: bool,
}

impl Series {
    /// Tables of a system. The unit of time is the reciprocal of a bound on its highest frequency.
    pub fn new(system: &System, laws: &[AffineLaw]) -> Series {
        let (n, e) = (system.dof(), system.element_count());
        let steepest = laws
            .iter()
            .flat_map(|l| &l.slopes)
            .fold(1e-6_f64, |m, s| m.max(s.abs()));
        let norm =
            |m: &nalgebra::DMatrix<f64>| m.column_iter().map(|c| c.abs().sum()).fold(0.0, f64::max);
        let bound = norm(system.damping())
            + (norm(&(system.stiffness() * system.element_map())) * steepest).sqrt();
        let unit = if bound > 0.0 { 1.0 / bound } else { 1.0 };
        let (mut loads, mut rates) = (Harmonics::new(n), Harmonics::new(n));
        for load in system.loads() {
            let target = if load.kind == LoadKind::Value {
                &mut loads
            } else {
                &mut rates
            };
            for (i, d) in load
                .direction
                .iter()
                .enumerate()
                .filter(|(_, d)| **d != 0.0)
            {
                target.add(i, d * unit * unit, &load.series, load.kind);
            }
        }
        let mut errors = Harmonics::new(e);
        for (k, mount) in system.mounts().iter().enumerate() {
            if let Some(series) = &mount.transmission_error {
                errors.add(k, 1.0, series, LoadKind::Value);
            }
        }
        let has_errors = system
            .mounts()
            .iter()
            .any(|m| m.transmission_error.is_some());
        let stiffness = entries(system.stiffness(), unit * unit);
        let map = entries(system.element_map(), 1.0);
        let (coupled, links) = couple(&stiffness, &map);
        Series {
            unit,
            damping: entries(system.damping(), unit),
            stiffness,
            map,
            coupled,
            links,
            constant: vec![0.0; n],
            slope: vec![0.0; e],
            is_plain: system.is_tree() && !has_errors,
            is_rate_free: rates.terms.is_empty(),
            loads,
            rates,
            errors: has_errors.then_some(errors),
            frequency: f64::NAN,
            load: vec![0.0; n * COUNT],
            rate: vec![0.0; n * COUNT],
            error: vec![0.0; e * COUNT],
            q: vec![0.0; n * COUNT],
            deformation: vec![0.0; e * COUNT],
        }
    }

    /// Refreshes the tables that depend on the frequency.
    pub fn prepare(&mut self, system: &System) {
        let frequency = system.excitation_frequency() * self.unit;
        if frequency != self.frequency {
            self.frequency = frequency;
            self.loads.prepare(frequency);
            self.rates.prepare(frequency);
            if let Some(errors) = &mut self.errors {
                errors.prepare(frequency);
            }
        }
    }

    /// Taylor coefficients of the loads and transmission errors at a phase tau of the response.
    pub fn force(&mut self, system: &System, tau: f64) {
        let phase = (system.subharmonic() as f64 * tau).rem_euclid(TAU);
        self.loads.expand(phase, &mut self.load);
        if !self.is_rate_free {
            self.rates.expand(phase, &mut self.rate);
            let frequency = system.excitation_frequency();
            self.load
                .iter_mut()
                .zip(&self.rate)
                .for_each(|(l, r)| *l += frequency * r);
        }
        if let Some(errors) = &self.errors {
            errors.expand(phase, &mut self.error);
        }
    }

    /// Takes over the slope and offset of every law.
    pub fn set_laws(&mut self, slope: &[f64], offset: &[f64]) {
        self.coupled.iter_mut().for_each(|c| c.value = 0.0);
        for link in &self.links {
            self.coupled[link.row].value += link.value * slope[link.column];
        }
        self.constant.fill(0.0);
        self.slope.copy_from_slice(slope);
        for s in &self.stiffness {
            self.constant[s.row] -= s.value * offset[s.column];
        }
    }

    /// Coefficients of q and of the deformations from a state [q; v].
    ///
    ///     (k + 2)(k + 1) q_{k+2} = h^2 Q_k - h Gam (k + 1) q_{k+1} - h^2 kappa (slope x_k + offset [k = 0])
    pub fn expand(&mut self, state: &[f64]) {
        for (i, c) in self.constant.iter().enumerate() {
            self.load[i * COUNT] += c;
        }
        if self.errors.is_some() {
            for s in &self.stiffness {
                let factor = s.value * self.slope[s.column];
                let error = &self.error[s.column * COUNT..(s.column + 1) * COUNT];
                let load = &mut self.load[s.row * COUNT..(s.row + 1) * COUNT];
                load.iter_mut()
                    .zip(error)
                    .for_each(|(l, e)| *l += factor * e);
            }
        }
        self.recur(state, true);
        self.deform();
    }

    /// The recursion from a state, for the small systems in arrays that the compiler can unroll.
    fn recur(&mut self, state: &[f64], loaded: bool) {
        match state.len() / 2 {
            1 => self.recur_small::<1>(state, loaded),
            2 => self.recur_small::<2>(state, loaded),
            3 => self.recur_small::<3>(state, loaded),
            4 => self.recur_small::<4>(state, loaded),
            _ => self.recur_sparse(state, loaded),
        }
    }

    fn recur_small<const N: usize>(&mut self, state: &[f64], loaded: bool) {
        let (mut damping, mut stiffness) = ([[0.0; N]; N], [[0.0; N]; N]);
        self.damping
            .iter()
            .for_each(|d| damping[d.row][d.column] = d.value);
        self.coupled
            .iter()
            .for_each(|c| stiffness[c.row][c.column] = c.value);
        let (mut now, mut next) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (now[i], next[i]) = (state[i], state[N + i] * self.unit);
            (self.q[i * COUNT], self.q[i * COUNT + 1]) = (now[i], next[i]);
        }
        for (k, reciprocal) in RECIPROCAL.iter().enumerate() {
            let order = (k + 1) as f64;
            let mut last = [0.0; N];
            for i in 0..N {
                let mut sum = if loaded {
                    self.load[i * COUNT + k]
                } else {
                    0.0
                };
                for j in 0..N {
                    sum -= order * damping[i][j] * next[j] + stiffness[i][j] * now[j];
                }
                last[i] = sum * reciprocal;
                self.q[i * COUNT + k + 2] = last[i];
            }
            (now, next) = (next, last);
        }
    }

    fn recur_sparse(&mut self, state: &[f64], loaded: bool) {
        let n = state.len() / 2;
        for i in 0..n {
            self.q[i * COUNT] = state[i];
            self.q[i * COUNT + 1] = state[n + i] * self.unit;
        }
        for (k, reciprocal) in RECIPROCAL.iter().enumerate() {
            let order = (k + 1) as f64;
            for i in 0..n {
                self.q[i * COUNT + k + 2] = if loaded {
                    self.load[i * COUNT + k]
                } else {
                    0.0
                };
            }
            for d in &self.damping {
                self.q[d.row * COUNT + k + 2] -= d.value * order * self.q[d.column * COUNT + k + 1];
            }
            for c in &self.coupled {
                self.q[c.row * COUNT + k + 2] -= c.value * self.q[c.column * COUNT + k];
            }
            for i in 0..n {
                self.q[i * COUNT + k + 2] *= reciprocal;
            }
        }
    }

    /// Coefficients of the deformations W q - e.
    fn deform(&mut self) {
        if self.is_plain {
            self.deformation.copy_from_slice(&self.q);
            return;
        }
        self.deformation
            .iter_mut()
            .zip(&self.error)
            .for_each(|(x, e)| *x = -e);
        for w in &self.map {
            let source = &self.q[w.column * COUNT..(w.column + 1) * COUNT];
            let target = &mut self.deformation[w.row * COUNT..(w.row + 1) * COUNT];
            target
                .iter_mut()
                .zip(source)
                .for_each(|(t, s)| *t += w.value * s);
        }
    }

    /// Largest theta at which the last two terms are below rounding of the motion, whose size is that of its first terms (the
    /// state alone vanishes at a start from rest).
    pub fn reach(&self) -> f64 {
        let largest = |k: usize| {
            self.q
                .iter()
                .skip(k)
                .step_by(COUNT)
                .fold(0.0_f64, |m, c| m.max(c.abs()))
        };
        let size = (0..SIZE_TERMS)
            .map(largest)
            .fold(f64::MIN_POSITIVE, f64::max);
        let by = |k: usize| {
            let last = k as f64 * largest(k);
            if last > 0.0 {
                (ROUNDING * size / last).powf(1.0 / (k - 1) as f64)
            } else {
                MAX_REACH
            }
        };
        by(DEGREE).min(by(DEGREE - 1)).min(MAX_REACH)
    }

    /// State [q; v] at theta.
    pub fn state(&self, theta: f64, out: &mut [f64]) {
        let n = out.len() / 2;
        for (i, block) in self.q.chunks_exact(COUNT).enumerate() {
            let (q, slope) = crate::numeric::bernstein::evaluate(block, theta);
            (out[i], out[n + i]) = (q, slope / self.unit);
        }
    }

    /// Advances one column [q; v] of the variation over theta: the same recursion without loads and offsets.
    pub fn vary(&mut self, column: &mut [f64], theta: f64) {
        self.recur(column, false);
        self.state(theta, column);
    }
}

/// 1 / ((k + 1) (k + 2)).
const RECIPROCAL: [f64; COUNT - 2] = {
    let mut list = [0.0; COUNT - 2];
    let mut k = 0;
    while k < COUNT - 2 {
        list[k] = 1.0 / ((k + 1) as f64 * (k + 2) as f64);
        k += 1;
    }
    list
};
/// Terms that measure the size of the motion.
const SIZE_TERMS: usize = 5;
/// Terms below this share of the state are left out.
const ROUNDING: f64 = 1e-17;
/// Longest step in units of time: the polynomials of a slow system would reach for ever.
const MAX_REACH: f64 = 1e3;
/// Longest step of the variation in units of time: reach^DEGREE / DEGREE! is then below rounding for every initial state.
pub const VARIATION_REACH: f64 = 1.5;
