//! The equation of motion as a recursion for Taylor coefficients, in units of time that suit the system.

use super::SeriesOptions;
use super::acting::Acting;
use super::forcing::{Instant, Sources};
use super::laws::Law;
use super::pace::Pace;
use super::regions::Regions;
use crate::numeric::bernstein::evaluate;
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::system::{LoadKind, Mount, System};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// One nonzero entry of a matrix.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    pub row: usize,
    pub column: usize,
    pub value: f64,
}

fn entries(matrix: &DMatrix<f64>, factor: f64) -> Vec<Entry> {
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

/// The same matrix in an array.
pub fn dense<const N: usize>(entries: &[Entry]) -> [[f64; N]; N] {
    let mut matrix = [[0.0; N]; N];
    entries
        .iter()
        .for_each(|e| matrix[e.row][e.column] = e.value);
    matrix
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
    /// h Gam.
    pub damping: Vec<Entry>,
    /// h^2 kappa.
    stiffness: Vec<Entry>,
    map: Vec<Entry>,
    /// Loads that are given, those that grow with the frequency, and both at the frequency at hand.
    values: Sources,
    rates: Sources,
    loads: Sources,
    /// Transmission errors; `None` when W is the identity and there are none.
    errors: Option<Sources>,
    /// Excitation frequency for which the loads were prepared.
    frequency: f64,
    load: Vec<Polynomial>,
    error: Vec<Polynomial>,
    /// Coefficients of the coordinates.
    pub q: Vec<Polynomial>,
    /// Coefficients of the deformations, where they are not the coordinates.
    deformation: Vec<Polynomial>,
    /// h^2 kappa diag(slope) W of the current regions.
    pub coupled: Vec<Entry>,
    /// What each product kappa_ie W_ej adds: target in `coupled`, connection e, value.
    links: Vec<Entry>,
    /// -h^2 kappa offset of the current regions.
    constant: Vec<f64>,
    slope: Vec<f64>,
    /// Error of a step allowed where the force is no constant multiple of the deformation, relative to the motion.
    tolerance: f64,
    /// Coefficients at most there.
    terms: usize,
    pace: Pace,
    /// Coefficients that the last expansion has; zeros behind.
    pub count: usize,
}

/// A stretch of time to be expanded.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    /// Phase of the response at its begin.
    pub tau: f64,
    /// A phase of the response inside the stretch without corners.
    pub middle: f64,
    /// Length in units of time of the series up to the end of that stretch.
    pub remaining: f64,
}

impl Span {
    /// What happens right at an instant.
    pub fn at(tau: f64) -> Span {
        Span {
            tau,
            middle: tau,
            remaining: f64::INFINITY,
        }
    }
}

impl Series {
    /// Tables of a system. The unit of time is the reciprocal of a bound on its highest frequency.
    pub fn new(system: &System, laws: &[Law], options: &SeriesOptions) -> Series {
        let (n, e) = (system.dof(), system.element_count());
        let highest = frequency_bound(system, laws, f64::max);
        let unit = if highest > 0.0 { 1.0 / highest } else { 1.0 };
        let (mut values, mut rates) = (Sources::new(n), Sources::new(n));
        for load in system.loads() {
            let target = match load.kind {
                LoadKind::Value => &mut values,
                LoadKind::Rate => &mut rates,
            };
            let directions = load.direction.iter().enumerate();
            for (i, d) in directions.filter(|(_, d)| **d != 0.0) {
                target.add(i, d * unit * unit, &load.series);
            }
        }
        let mut errors = Sources::new(e);
        for (k, mount) in system.mounts().iter().enumerate() {
            if let Some(series) = &mount.transmission_error {
                errors.add(k, 1.0, series);
            }
        }
        let is_plain = system.is_tree() && errors.is_zero();
        let stiffness = entries(system.stiffness(), unit * unit);
        let map = entries(system.element_map(), 1.0);
        let (coupled, links) = couple(&stiffness, &map);
        let slowest = unit * frequency_bound(system, laws, f64::min);
        Series {
            pace: Pace::new(system, unit, slowest),
            unit,
            damping: entries(system.damping(), unit),
            stiffness,
            map,
            coupled,
            links,
            constant: vec![0.0; n],
            slope: vec![0.0; e],
            loads: values.clone(),
            values,
            rates,
            errors: (!is_plain).then_some(errors),
            frequency: f64::NAN,
            load: vec![[0.0; COUNT]; n],
            error: vec![[0.0; COUNT]; e],
            q: vec![[0.0; COUNT]; n],
            deformation: vec![[0.0; COUNT]; e],
            tolerance: options.tolerance,
            terms: options.terms.clamp(FEWEST_TERMS, COUNT),
            count: COUNT,
        }
    }

    /// Refreshes the tables that depend on the frequency; whether it has changed.
    pub fn prepare(&mut self, system: &System) -> bool {
        let frequency = system.excitation_frequency();
        if frequency == self.frequency {
            return false;
        }
        self.frequency = frequency;
        self.pace.prepare(frequency * self.unit);
        self.loads = self.values.clone();
        self.loads.add_derivative(frequency, &self.rates);
        self.loads.prepare(frequency * self.unit);
        if let Some(errors) = &mut self.errors {
            errors.prepare(frequency * self.unit);
        }
        true
    }

    /// Sum of the moduli of W in the row of a connection, and a bound on its transmission error and its slope.
    pub fn sizes(&self, connection: usize) -> (f64, f64) {
        let row = self.map.iter().filter(|w| w.row == connection);
        let error = self.errors.as_ref();
        (
            row.map(|w| w.value.abs()).sum(),
            error.map_or(0.0, |e| e.size(connection)),
        )
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
        self.pace.read(&self.coupled);
    }

    /// Unit of time that suits the current regions, in units of the series: above 1 where a stiff contact is open.
    pub fn pace(&self) -> f64 {
        self.pace.unit
    }

    /// Coefficients of q and of the deformations from a state [q; v].
    ///
    ///     (k + 2)(k + 1) q_{k+2} = h^2 Q_k - h Gam (k + 1) q_{k+1} - h^2 kappa (slope x_k + offset [k = 0] + forces_k)
    pub fn expand(
        &mut self,
        system: &System,
        (acting, regions): (&mut Acting, &Regions),
        span: Span,
        state: &[f64],
    ) {
        let at = self.instant(system, span);
        self.loads.expand(&at, &mut self.load);
        for (load, c) in self.load.iter_mut().zip(&self.constant) {
            load[0] += c;
        }
        if let Some(errors) = &self.errors {
            errors.expand(&at, &mut self.error);
            for s in &self.stiffness {
                let factor = s.value * self.slope[s.column];
                add(&mut self.load[s.row], factor, &self.error[s.column]);
            }
        }
        if acting.list.is_empty() {
            self.count = COUNT;
            self.recur(state);
        } else {
            self.count = self.terms;
            acting.expand(&at);
            self.recur_acting(system, (acting, regions), span.remaining, state);
        }
        if self.errors.is_some() {
            for (x, error) in self.deformation.iter_mut().zip(&self.error) {
                *x = error.map(|e| -e);
            }
            for w in &self.map {
                add(&mut self.deformation[w.row], w.value, &self.q[w.column]);
            }
        }
    }

    fn instant(&self, system: &System, span: Span) -> Instant {
        let nu = system.subharmonic() as f64;
        let phase = (nu * span.tau).rem_euclid(TAU);
        let middle = phase + nu * (span.middle - span.tau);
        // A stretch that begins at the end of a turn, to rounding, is the first one of the next turn.
        let turn = if middle >= TAU && phase > TAU - TURN {
            TAU
        } else {
            0.0
        };
        Instant {
            phase: phase - turn,
            middle: middle - turn,
            rate: self.frequency * self.unit,
        }
    }

    fn recur(&mut self, state: &[f64]) {
        match state.len() / 2 {
            1 => self.recur_small::<1>(state),
            2 => self.recur_small::<2>(state),
            3 => self.recur_small::<3>(state),
            4 => self.recur_small::<4>(state),
            _ => self.recur_sparse(state),
        }
    }

    /// The recursion for N coordinates in arrays that the compiler can unroll.
    fn recur_small<const N: usize>(&mut self, state: &[f64]) {
        let damping = dense::<N>(&self.damping);
        let stiffness = dense::<N>(&self.coupled);
        let load: &[Polynomial; N] = self.load.first_chunk().expect("one a coordinate");
        let q: &mut [Polynomial; N] = self.q.first_chunk_mut().expect("one a coordinate");
        // q_k and (k + 1) q_{k+1}
        let (mut now, mut rate) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            (now[i], rate[i]) = (state[i], state[N + i] * self.unit);
            (q[i][0], q[i][1]) = (now[i], rate[i]);
        }
        for k in 0..COUNT - 2 {
            let mut next = [0.0; N];
            for i in 0..N {
                // The damping last: the other terms do not wait for the step before.
                let mut sum = load[i][k];
                for j in 0..N {
                    sum -= stiffness[i][j] * now[j];
                }
                sum *= RECIPROCAL[k + 1];
                for j in 0..N {
                    sum -= damping[i][j] * RECIPROCAL[k + 1] * rate[j];
                }
                next[i] = sum;
                q[i][k + 2] = sum * RECIPROCAL[k + 2];
            }
            for i in 0..N {
                now[i] = q[i][k + 1];
            }
            rate = next;
        }
    }

    fn recur_sparse(&mut self, state: &[f64]) {
        let q = &mut self.q;
        let n = q.len();
        for (i, q) in q.iter_mut().enumerate() {
            (q[0], q[1]) = (state[i], state[n + i] * self.unit);
        }
        for k in 0..COUNT - 2 {
            let order = (k + 1) as f64;
            for (q, load) in q.iter_mut().zip(&self.load) {
                q[k + 2] = load[k];
            }
            for d in &self.damping {
                q[d.row][k + 2] -= d.value * order * q[d.column][k + 1];
            }
            for c in &self.coupled {
                q[c.row][k + 2] -= c.value * q[c.column][k];
            }
            for q in q.iter_mut() {
                q[k + 2] *= RECIPROCAL[k + 1] * RECIPROCAL[k + 2];
            }
        }
    }

    /// The recursion with forces that are made beside it; it ends where the terms no longer count in the time that remains.
    fn recur_acting(
        &mut self,
        system: &System,
        (acting, regions): (&mut Acting, &Regions),
        remaining: f64,
        state: &[f64],
    ) {
        let n = self.q.len();
        for (i, q) in self.q.iter_mut().enumerate() {
            (q[0], q[1]) = (state[i], state[n + i] * self.unit);
        }
        let square = self.unit * self.unit;
        let mut ending = Ending::new(remaining, self.tolerance);
        for k in 0..self.terms - 2 {
            let order = (k + 1) as f64;
            for (q, load) in self.q.iter_mut().zip(&self.load) {
                q[k + 2] = load[k];
            }
            for d in &self.damping {
                self.q[d.row][k + 2] -= d.value * order * self.q[d.column][k + 1];
            }
            for c in &self.coupled {
                self.q[c.row][k + 2] -= c.value * self.q[c.column][k];
            }
            for place in 0..acting.list.len() {
                let e = acting.list[place];
                let motion = self.motion(system, e, k);
                let force = square * acting.force(e, regions.piece(e), k, motion);
                for (i, kappa) in system.stiffness_column(e) {
                    self.q[*i][k + 2] -= kappa * force;
                }
            }
            let mut largest = 0.0_f64;
            for q in &mut self.q {
                q[k + 2] *= RECIPROCAL[k + 1] * RECIPROCAL[k + 2];
                largest = largest.max(q[k + 2].abs());
            }
            if ending.is_reached(k, &self.q, largest) {
                self.count = k + 3;
                break;
            }
        }
        for q in &mut self.q {
            q[self.count..].fill(0.0);
        }
    }

    /// Coefficient k of a deformation W q - e and of its rate.
    #[inline]
    fn motion(&self, system: &System, e: usize, k: usize) -> (f64, f64) {
        let (mut x, mut next) = (0.0, 0.0);
        for (i, w) in system.element_map_row(e) {
            x += w * self.q[*i][k];
            next += w * self.q[*i][k + 1];
        }
        if self.errors.is_some() {
            x -= self.error[e][k];
            next -= self.error[e][k + 1];
        }
        (x, (k + 1) as f64 * next / self.unit)
    }

    /// Coefficients of a deformation W q - e.
    pub fn deformation(&self, connection: usize) -> &Polynomial {
        match &self.errors {
            None => &self.q[connection],
            Some(_) => &self.deformation[connection],
        }
    }

    /// Largest theta at which the last two terms of every rate are negligible beside the motion, whose size is that of its
    /// first terms (the state alone vanishes at a start from rest).
    pub fn reach(&self, acting: &Acting) -> f64 {
        let negligible = if acting.list.is_empty() {
            NEGLIGIBLE
        } else {
            self.tolerance
        };
        let pace = match acting.list.is_empty() {
            true => self.pace.unit,
            false => 1.0,
        };
        let mut reach = reach(&self.q, self.count, (negligible, pace));
        if self.errors.is_some() {
            // An error moves a deformation also where it has no part in the motion.
            for x in &self.deformation {
                reach = reach.min(self::reach(
                    std::slice::from_ref(x),
                    COUNT,
                    (negligible, pace),
                ));
            }
        }
        reach
    }

    /// State [q; v] at theta.
    pub fn state(&self, theta: f64, out: &mut [f64]) {
        let n = out.len() / 2;
        for (i, q) in self.q.iter().enumerate() {
            let (q, slope) = evaluate(q, theta);
            (out[i], out[n + i]) = (q, slope / self.unit);
        }
    }
}

/// Whether the terms of a series count in the time that remains.
struct Ending {
    remaining: f64,
    tolerance: f64,
    size: f64,
    before: f64,
    power: f64,
}

impl Ending {
    fn new(remaining: f64, tolerance: f64) -> Ending {
        Ending {
            remaining,
            tolerance,
            size: f64::MIN_POSITIVE,
            before: f64::INFINITY,
            power: remaining * remaining,
        }
    }

    /// After term k + 2, whose modulus is given.
    fn is_reached(&mut self, k: usize, q: &[Polynomial], largest: f64) -> bool {
        if !self.power.is_finite() {
            return false;
        }
        if k + 3 == SIZE_TERMS {
            let first = q.iter().flat_map(|q| &q[..SIZE_TERMS]);
            self.size = first.fold(self.size, |m, c| m.max(c.abs()));
        }
        let term = largest * self.power * (k + 2) as f64;
        let last = term.max(self.before);
        (self.before, self.power) = (term, self.power * self.remaining);
        k + 3 > SIZE_TERMS && last <= self.tolerance * self.size
    }
}

/// Largest theta at which the last two of so many terms, as rates, are negligible beside the first ones, all of them in the unit
/// of time that suits the contact state.
fn reach(list: &[Polynomial], count: usize, (negligible, pace): (f64, f64)) -> f64 {
    let (mut size, mut last) = (f64::MIN_POSITIVE, 0.0_f64);
    let power = match pace == 1.0 {
        true => 1.0,
        false => pace.powi(count as i32 - 2),
    };
    for q in list {
        let mut scale = 1.0;
        for c in &q[..SIZE_TERMS] {
            size = size.max(scale * c.abs());
            scale *= pace;
        }
        let (a, b) = (q[count - 2].abs(), pace * q[count - 1].abs());
        last = last.max(power * a.max(b));
    }
    // last (count - 1) theta^power = negligible size, with the power that gives the shorter step.
    let ratio = negligible * size / ((count - 1) as f64 * last);
    let power = if ratio < 1.0 { count - 3 } else { count - 2 };
    pace * ratio.powf(1.0 / power as f64).min(MAX_REACH)
}

/// A bound on the frequencies with the steepest, or with the flattest, part of every law; of laws that are not affine, near their
/// breakpoints.
fn frequency_bound(system: &System, laws: &[Law], chosen: fn(f64, f64) -> f64) -> f64 {
    let slope = |(law, mount): (&Law, &Mount)| {
        let largest = (mount.stiffness_variation.as_ref()).map_or(1.0, |s| s.largest());
        let (q, v) = law.slopes(chosen);
        (q * largest, v * largest)
    };
    let slopes: Vec<(f64, f64)> = laws.iter().zip(system.mounts()).map(slope).collect();
    let coupled = |slopes: &mut dyn Iterator<Item = f64>| {
        let mut stiffness = system.stiffness().abs();
        for (mut column, slope) in stiffness.column_iter_mut().zip(slopes) {
            column *= slope;
        }
        radius(&(stiffness * system.element_map().abs()))
    };
    let springs = coupled(&mut slopes.iter().map(|s| s.0.max(LEAST_SLOPE)));
    let dampers = match slopes.iter().any(|s| s.1 > 0.0) {
        true => coupled(&mut slopes.iter().map(|s| s.1)),
        false => 0.0,
    };
    radius(&system.damping().abs()) + dampers + springs.sqrt()
}

/// A bound on the spectral radius of a matrix without negative numbers, close whatever the scales of its coordinates are.
///
///     rho(A) <= max_i (A x)_i / x_i  for every x > 0 (Collatz and Wielandt),  x from the power iteration
pub(super) fn radius(matrix: &DMatrix<f64>) -> f64 {
    let mut x = DVector::from_element(matrix.ncols(), 1.0);
    let mut bound = f64::INFINITY;
    for _ in 0..POWERS {
        let y = matrix * &x;
        let ratio = y.iter().zip(&x).map(|(y, x)| y / x).fold(0.0, f64::max);
        bound = bound.min(ratio);
        let largest = y.amax().max(f64::MIN_POSITIVE);
        x = y.map(|y| (y / largest).max(LEAST_SHARE));
    }
    bound
}

/// Keeps a system without stiffness in motion.
const LEAST_SLOPE: f64 = 1e-6;
/// Steps of the power iteration.
const POWERS: usize = 30;
/// Keeps the numbers of coordinates that nothing drives from zero.
const LEAST_SHARE: f64 = 1e-30;

fn add(sum: &mut Polynomial, factor: f64, part: &Polynomial) {
    for k in 0..COUNT {
        sum[k] += factor * part[k];
    }
}

/// 1 / k.
const RECIPROCAL: Polynomial = {
    let mut list = [0.0; COUNT];
    let mut k = 1;
    while k < COUNT {
        list[k] = 1.0 / k as f64;
        k += 1;
    }
    list
};
/// Phases this close to the end of a turn are its end.
const TURN: f64 = 1e-9;
/// Coefficients at least.
const FEWEST_TERMS: usize = 6;
/// Terms that measure the size of the motion.
const SIZE_TERMS: usize = 5;
/// The last terms are below this share of the motion; the first one left out is about a tenth of them, below rounding.
const NEGLIGIBLE: f64 = 1e-15;
/// Longest step in units of time: the polynomials of a slow system would reach for ever.
const MAX_REACH: f64 = 1e3;
