//! The equation of motion as a recursion for Taylor coefficients, in units of time that suit the system.

use super::SeriesOptions;
use super::acting::Acting;
use super::decay::{SeriesControl, reach_of_closed_form, reach_within};
use super::entries::{MatrixEntry, SquareMatrix, couple, entries};
use super::forcing::{CoursePosition, Instant, Sources};
use super::frequencies::frequency_bound;
use super::holding::Holding;
use super::laws::LawPart;
use super::pace::Pace;
use crate::numeric::bernstein::evaluate;
use crate::numeric::taylor::{COUNT, Polynomial};
use crate::system::{LoadKind, System};
use std::f64::consts::TAU;

/// The recursion with its tables and buffers.
#[derive(Debug, Clone)]
pub struct MotionSeries {
    /// Unit of time h in omega_c t: theta = T / h.
    pub unit: f64,
    /// h Gam.
    pub damping: SquareMatrix,
    /// h^2 kappa.
    pub(super) stiffness: Vec<MatrixEntry>,
    pub(super) map: Vec<MatrixEntry>,
    pub(super) loads: Sources,
    /// Transmission errors; `None` when W is the identity and there are none.
    pub(super) errors: Option<Sources>,
    /// Excitation frequency for which the loads were prepared.
    frequency: f64,
    pub(super) load: Vec<Polynomial>,
    pub(super) error: Vec<Polynomial>,
    /// Coefficients of the coordinates.
    pub q: Vec<Polynomial>,
    /// Coefficients of the deformations, where they are not the coordinates.
    pub(super) deformation: Vec<Polynomial>,
    /// h^2 kappa diag(slope) W of the current regions.
    pub coupled: SquareMatrix,
    /// What each product kappa_ie W_ej adds: target in `coupled`, connection e, value.
    links: Vec<MatrixEntry>,
    /// -h^2 kappa offset of the current regions.
    pub(super) constant: Vec<f64>,
    pub(super) slope: Vec<f64>,
    /// Error of a step allowed where the force is not a constant multiple of the deformation, relative to the motion.
    pub(super) control: SeriesControl,
    /// Coefficients at most there.
    pub(super) terms: usize,
    pace: Pace,
    /// What keeps deformations at their levels; `None` where nothing does.
    pub(super) holding: Option<Holding>,
    /// h^2 kappa df/dz of the parts that keep a memory: coordinate, place of the memory, value.
    pub memories: Vec<MatrixEntry>,
    /// Coefficients that the last expansion has; zeros behind.
    pub count: usize,
}

/// A stretch of time to be expanded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// Phase of the response at its begin.
    pub tau: f64,
    /// A phase of the response inside the stretch without corners.
    pub middle: f64,
    /// Length in units of time of the series up to the end of that stretch.
    pub remaining: f64,
    /// Coefficients at least: deviations need them also where the motion itself is at rest.
    pub least: usize,
}

impl Span {
    /// Action at an instant.
    pub fn at(tau: f64) -> Span {
        Span {
            tau,
            middle: tau,
            remaining: f64::INFINITY,
            least: 0,
        }
    }
}

impl MotionSeries {
    /// Tables of a system. The unit of time is the reciprocal of a bound on its highest frequency.
    pub fn new(system: &System, laws: &[LawPart], options: &SeriesOptions) -> MotionSeries {
        let (n, e) = (system.dof(), system.element_count());
        let highest = frequency_bound(system, laws, f64::max);
        let unit = if highest > 0.0 { 1.0 / highest } else { 1.0 };
        let mut loads = Sources::new(n);
        for load in system.loads() {
            let directions = load.direction.iter().enumerate();
            for (i, d) in directions.filter(|(_, d)| **d != 0.0) {
                let factor = d * unit * unit;
                match &load.kind {
                    LoadKind::Rate => loads.add_rate(i, factor, &load.series),
                    LoadKind::Acceleration => loads.add_acceleration(i, factor, &load.series),
                    LoadKind::Orders { ratio, growth } => {
                        loads.add_orders(i, factor, (&load.series, *ratio), growth);
                    }
                    LoadKind::Timed(line) if system.course().is_some() => {
                        loads.add_line(i, factor, line);
                    }
                    LoadKind::Value | LoadKind::Timed(_) => loads.add(i, factor, &load.series),
                }
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
        MotionSeries {
            pace: Pace::new(system, unit, slowest),
            holding: None,
            memories: Vec::new(),
            unit,
            damping: SquareMatrix::new(n, entries(system.damping(), unit)),
            stiffness,
            map,
            coupled: SquareMatrix::new(n, coupled),
            links,
            constant: vec![0.0; n],
            slope: vec![0.0; e],
            loads,
            errors: (!is_plain).then_some(errors),
            frequency: f64::NAN,
            load: vec![[0.0; COUNT]; n],
            error: vec![[0.0; COUNT]; e],
            q: vec![[0.0; COUNT]; n],
            deformation: vec![[0.0; COUNT]; e],
            control: SeriesControl::new(options.tolerance, unit),
            terms: options.terms.clamp(FEWEST_TERMS, COUNT),
            count: COUNT,
        }
    }

    /// Refreshes the tables that depend on the frequency; whether it has changed.
    pub fn prepare(&mut self, system: &System) -> bool {
        let frequency = system.highest_frequency();
        if frequency == self.frequency {
            return false;
        }
        self.frequency = frequency;
        self.pace.prepare(frequency * self.unit);
        let revolutions = system.revolutions() as f64;
        self.loads.prepare(frequency, self.unit, revolutions);
        if let Some(errors) = &mut self.errors {
            errors.prepare(frequency, self.unit, revolutions);
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
    pub(crate) fn set_laws(&mut self, slope: &[f64], offset: &[f64]) {
        if let Some(holding) = self.holding.take() {
            (self.damping, self.coupled) = holding.free;
        }
        let links = &self.links;
        self.coupled.change(|coupled| {
            coupled.iter_mut().for_each(|c| c.value = 0.0);
            for link in links {
                coupled[link.row].value += link.value * slope[link.column];
            }
        });
        self.constant.fill(0.0);
        self.slope.copy_from_slice(slope);
        for s in &self.stiffness {
            self.constant[s.row] -= s.value * offset[s.column];
        }
        self.pace.read(self.coupled.entries());
    }

    /// Adds what a memory does to a coordinate.
    pub(crate) fn add_memory(&mut self, row: usize, column: usize, value: f64) {
        self.memories.push(MatrixEntry { row, column, value });
    }

    /// Keeps connections at their levels, until the laws change; whether that is possible.
    pub fn hold(&mut self, system: &System, connections: &[usize]) -> bool {
        let Some(mut holding) = Holding::new(system, connections) else {
            return false;
        };
        let free = (&self.damping, &self.coupled);
        let projected = (holding.project(free.0), holding.project(free.1));
        holding.project_memories(&mut self.memories);
        let free = (
            std::mem::replace(&mut self.damping, projected.0),
            std::mem::replace(&mut self.coupled, projected.1),
        );
        holding.free = free;
        self.holding = Some(holding);
        true
    }

    /// Forces that hold deformations at their levels.
    pub fn holding(&self) -> Option<&Holding> {
        self.holding.as_ref()
    }

    /// Coefficients of the force that holds a connection.
    pub(crate) fn holding_force(&self, connection: usize) -> Option<&Polynomial> {
        self.holding.as_ref()?.force(connection)
    }

    /// The coordinates that the force of a connection drives, and how.
    #[inline]
    pub fn column<'a>(&'a self, system: &'a System, connection: usize) -> &'a [(usize, f64)] {
        match &self.holding {
            None => system.stiffness_column(connection),
            Some(holding) => holding.column(connection),
        }
    }

    /// d^2 q / dT^2 at theta.
    pub fn acceleration(&self, theta: f64, out: &mut [f64]) {
        let factor = 1.0 / (self.unit * self.unit);
        for (a, q) in out.iter_mut().zip(&self.q) {
            *a = factor * second_derivative(q, theta);
        }
    }

    /// d^2 / dT^2 of a deformation at theta.
    pub(crate) fn deformation_acceleration(&self, connection: usize, theta: f64) -> f64 {
        second_derivative(self.deformation(connection), theta) / (self.unit * self.unit)
    }

    /// Unit of time that suits the current regions, in units of the series: above 1 where a stiff contact is open.
    pub(crate) fn pace(&self) -> f64 {
        self.pace.unit
    }

    pub(super) fn instant(&self, system: &System, span: Span) -> Instant {
        let begin = system.moment_on(span.tau, span.middle);
        let phase = within_turn(begin.phase);
        let inside = system.moment_on(span.middle, span.middle);
        let middle = match system.course() {
            None => phase + system.subharmonic() as f64 * (span.middle - span.tau),
            Some(_) => phase + (inside.phase - begin.phase),
        };
        let turn = match is_next_turn(phase, middle) {
            true => TAU,
            false => 0.0,
        };
        Instant {
            phase: phase - turn,
            middle: middle - turn,
            rate: begin.frequency * self.unit,
            change: begin.change * self.unit * self.unit,
            course: system.course().map(|_| CoursePosition {
                phase: begin.phase,
                time: (span.tau, span.middle),
                unit: self.unit,
                speed: inside.frequency * system.revolutions() as f64,
                revolutions: system.revolutions() as f64,
            }),
        }
    }

    /// Coefficient k of a deformation W q - e and of its rate.
    #[inline]
    pub(super) fn motion(&self, system: &System, e: usize, k: usize) -> (f64, f64) {
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
        let reach = |list: &[Polynomial], count: usize| match acting.list.is_empty() {
            true => reach_of_closed_form(list, count, self.pace.unit),
            false => reach_within(list, count, self.control),
        };
        let own = reach(&self.q, self.count);
        let memories = acting.later();
        let own = memories.fold(own, |own, z| {
            own.min(reach(std::slice::from_ref(z), self.count))
        });
        if self.errors.is_none() {
            return own;
        }
        // An error moves a deformation also where it has no part in the motion.
        let deformations = self.deformation.iter();
        let reaches = deformations.map(|x| reach(std::slice::from_ref(x), COUNT));
        reaches.fold(own, f64::min)
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

/// c''(theta).
fn second_derivative(c: &Polynomial, theta: f64) -> f64 {
    let terms = c.iter().enumerate().skip(2).rev();
    terms.fold(0.0, |sum, (k, c)| sum * theta + (k * (k - 1)) as f64 * c)
}

/// A phase in [0, 2 pi).
#[inline]
pub(super) fn within_turn(phase: f64) -> f64 {
    match (0.0..TAU).contains(&phase) {
        true => phase,
        false => phase.rem_euclid(TAU),
    }
}

/// Whether a stretch that begins at the end of a turn, to rounding, is the first one of the next turn.
#[inline]
pub(super) fn is_next_turn(begin: f64, middle: f64) -> bool {
    middle >= TAU && begin > TAU - TURN
}

pub(super) fn add(sum: &mut Polynomial, factor: f64, part: &Polynomial) {
    for k in 0..COUNT {
        sum[k] += factor * part[k];
    }
}

/// Phases this close to the end of a turn are its end.
const TURN: f64 = 1e-9;
/// Coefficients at least.
const FEWEST_TERMS: usize = 6;
