//! Impacts on rigid stops, their end in a contact that is held, and rest on jumps of the force.
//!
//! ```text
//! v+ = v- + kappa_A J,   (W_A kappa_A) J = -(1 + r) rates,   rates = W_A v- - e_A'
//! S = [[D, 0], [A, D]],  D = 1 - kappa_A (W_A kappa_A)^-1 (1 + r) W_A,
//!     A = sum_i (a+ - a- + (D - 1)_i (W_i a- - e_i'')) W_i / rate_i
//! ```

use super::impulse::{Impact, Stop};
use super::regions::{ROUNDING, size};
use super::{Exact, Motion};
use crate::element::automaton::{Reset, Surface};
use crate::numeric::bernstein::Direction;
use crate::solve::integrate::{IntegrationEnd, Switch, SwitchKind};
use crate::system::System;
use nalgebra::DMatrix;

use super::part::Watched;

/// Impacts that die out within this time, in units of time of the series, are over.
const CHATTER: f64 = 1e-10;
/// Rounds in which impacts on some stops may cause others at the same instant.
const ROUNDS: usize = 100;

/// Work space.
#[derive(Debug, Clone, Default)]
pub(crate) struct Buffers {
    /// Connections that are held.
    pub held: Vec<usize>,
    before: Vec<f64>,
    after: Vec<f64>,
    stops: Vec<Stop>,
}

impl Buffers {
    pub fn new(dof: usize) -> Buffers {
        Buffers {
            before: vec![0.0; dof],
            after: vec![0.0; dof],
            ..Buffers::default()
        }
    }
}

impl Exact {
    /// Takes deformations beyond a stop back to it, and settles parts on stops and jumps.
    pub(super) fn rest_at_begin(
        &mut self,
        tau: f64,
        state: &mut [f64],
        motion: &mut Motion<'_>,
    ) -> Result<(), IntegrationEnd> {
        self.lift(tau, state, motion);
        self.collide(tau, None, state, motion)?;
        self.rest_on_jumps(tau, state, motion)
    }

    /// Takes deformations beyond a stop back to it along its force.
    fn lift(&mut self, tau: f64, state: &mut [f64], motion: &mut Motion<'_>) {
        let system = motion.system;
        for k in 0..self.regions.parts().len() {
            let part = &self.regions.parts()[k];
            let connection = part.connection;
            for direction in [Direction::Up, Direction::Down] {
                let part = &self.regions.parts()[k];
                let guard = part.guard(Watched::Level, direction);
                let Some(Surface::Deformation { level, .. }) = guard
                    .filter(|g| matches!(g.reset, Reset::Restitution { .. }))
                    .map(|g| g.surface)
                else {
                    continue;
                };
                let beyond = self.deformation[connection] - level;
                if direction.sign() * beyond <= 0.0 {
                    continue;
                }
                let step = beyond / self.mobility(system, connection);
                for (i, kappa) in system.stiffness_column(connection) {
                    state[*i] -= step * kappa;
                }
                let is_far = beyond.abs() > ROUNDING * (level.abs() + size(&self.series, state));
                if let Some(phi) = motion.phi.as_deref_mut().filter(|_| is_far) {
                    project_rows(system, phi, connection, 0);
                }
                self.deform(system, tau, state);
            }
        }
    }

    /// The stops that are closed at an instant, whatever the tolerance the one that has just been reached.
    fn closed_stops(
        &mut self,
        (system, tau): (&System, f64),
        reached: Option<usize>,
        state: &[f64],
    ) {
        self.deform(system, tau, state);
        let size = size(&self.series, state);
        let phase = system.moment(tau).phase;
        let n = system.dof();
        self.impacts.stops.clear();
        for (k, part) in self.regions.parts().iter().enumerate() {
            let Some(automaton) = &part.law.automaton else {
                continue;
            };
            let held_level = part.held_level();
            let home = match held_level {
                None => part.region,
                // Behind a stop lies the region without it.
                Some(_) => automaton.regions[part.region].guards[0].to,
            };
            for guard in &automaton.regions[home].guards {
                let (Surface::Deformation { level, .. }, Reset::Restitution { coefficient, held }) =
                    (guard.surface, guard.reset)
                else {
                    continue;
                };
                let is_held = held_level.is_some();
                if is_held && part.region != held {
                    continue;
                }
                let x = self.deformation[part.connection];
                let is_at = (x - level).abs() <= part.tolerance(level, size, tau);
                let is_reached = reached == Some(k)
                    && (x - level).abs() < (x + level).abs().max(f64::MIN_POSITIVE)
                    || reached == Some(k) && level == 0.0;
                if !(is_held || is_at || is_reached) {
                    continue;
                }
                let error = system.mounts()[part.connection].transmission_error.as_ref();
                let moves =
                    error.map_or(0.0, |e| system.moment(tau).frequency * e.derivative(phase));
                let row = system.element_map_row(part.connection).iter();
                let rate = row.map(|(i, w)| w * state[n + i]).sum::<f64>() - moves;
                self.impacts.stops.push(Stop {
                    part: k,
                    connection: part.connection,
                    direction: guard.direction,
                    level,
                    coefficient,
                    held,
                    is_held,
                    rate: guard.direction.sign() * rate,
                });
            }
        }
    }

    /// Impacts of everything that is closed and approaches, then rest where impacts have died out.
    pub(super) fn collide(
        &mut self,
        tau: f64,
        reached: Option<usize>,
        state: &mut [f64],
        motion: &mut Motion<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        let slow = ROUNDING * size(&self.series, state) / self.series.unit;
        let mut reached = reached;
        for _ in 0..ROUNDS {
            self.closed_stops((system, tau), reached, state);
            let stops = std::mem::take(&mut self.impacts.stops);
            let approaches = |s: &&Stop| {
                !s.is_held && (s.rate > slow || reached == Some(s.part) && s.rate > 0.0)
            };
            let found = stops.iter().any(|s| approaches(&s));
            let result = match found {
                true => {
                    let meets = |s: &&Stop| s.is_held || approaches(s);
                    let set: Vec<Stop> = stops.iter().filter(meets).copied().collect();
                    self.strike(tau, set, state, motion)
                }
                false => self.rest(tau, &stops, state, motion),
            };
            self.impacts.stops = stops;
            result?;
            if !found {
                return Ok(());
            }
            reached = None;
        }
        Err(IntegrationEnd::TooManySwitches)
    }

    /// One impact of several stops at once; those that would have to pull take no part.
    fn strike(
        &mut self,
        tau: f64,
        mut set: Vec<Stop>,
        state: &mut [f64],
        motion: &mut Motion<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        let n = system.dof();
        if motion.phi.is_some() {
            self.open_series(system, tau, state)?;
            self.series.acceleration(0.0, &mut self.impacts.before);
        }
        let impact = loop {
            let Some(impact) = Impact::of(system, &set) else {
                return Err(IntegrationEnd::Locked(set[0].connection));
            };
            let outward = |a: usize| set[a].direction.sign() * impact.impulses[a];
            let worst = (0..set.len()).max_by(|a, b| outward(*a).total_cmp(&outward(*b)));
            match worst.filter(|a| outward(*a) > 0.0 && set.len() > 1) {
                Some(a) => {
                    set.remove(a);
                }
                None => break impact,
            }
        };
        let accelerations: Vec<f64> = (set.iter())
            .map(|s| match motion.phi {
                Some(_) => self.series.deformation_acceleration(s.connection, 0.0),
                None => 0.0,
            })
            .collect();
        for (stop, impulse) in set.iter().zip(impact.impulses.iter()) {
            for (i, kappa) in system.stiffness_column(stop.connection) {
                state[n + i] += kappa * impulse;
            }
        }
        // Contacts that were held and took no part are released.
        let kept = |part: usize| set.iter().any(|s| s.part == part);
        let left: Vec<usize> = (self.regions.held())
            .map(|h| h.0)
            .filter(|part| self.is_stop(*part) && !kept(*part))
            .collect();
        for part in left {
            self.release(part, tau, motion);
        }
        if motion.phi.is_some() {
            self.open_series(system, tau, state)?;
            self.series.acceleration(0.0, &mut self.impacts.after);
        }
        if let Some(phi) = motion.phi.as_deref_mut() {
            let shift: Vec<f64> = (self.impacts.after.iter())
                .zip(&self.impacts.before)
                .map(|(after, before)| after - before)
                .collect();
            impact.saltate((system, phi), &set, (&shift, &accelerations));
        }
        for stop in set.iter().filter(|s| !s.is_held) {
            self.regions.rebound(stop.part, Some(stop.direction));
            motion.observer.switch(&Switch {
                tau,
                connection: stop.connection,
                level: stop.level,
                from: 0,
                to: flank(stop.direction),
                velocity: stop.direction.sign() * stop.rate,
                kind: SwitchKind::Impact,
            });
        }
        Ok(())
    }

    /// Whether a held part rests on a stop, not on a jump.
    fn is_stop(&self, part: usize) -> bool {
        let part = &self.regions.parts()[part];
        let automaton = part.law.automaton.as_ref();
        automaton.is_some_and(|a| {
            let guards = a.regions.iter().flat_map(|r| &r.guards);
            let mut resets = guards.map(|g| g.reset);
            resets.any(|r| matches!(r, Reset::Restitution { .. }))
        })
    }

    /// Holds what presses against a stop once its impacts have died out.
    fn rest(
        &mut self,
        tau: f64,
        stops: &[Stop],
        state: &mut [f64],
        motion: &mut Motion<'_>,
    ) -> Result<(), IntegrationEnd> {
        if stops.is_empty() {
            return Ok(());
        }
        let system = motion.system;
        let slow = ROUNDING * size(&self.series, state) / self.series.unit;
        let shortest = CHATTER * self.series.unit * self.series.pace();
        self.open_series(system, tau, state)?;
        let mut caught = Vec::new();
        for stop in stops.iter().filter(|s| !s.is_held) {
            let acceleration = self.series.deformation_acceleration(stop.connection, 0.0);
            let presses = stop.direction.sign() * acceleration;
            let speed = (-stop.rate).max(0.0);
            let remaining = 2.0 * speed / (presses * (1.0 - stop.coefficient));
            if presses > 0.0 && (speed <= slow || remaining <= shortest) {
                let remaining = if remaining.is_finite() {
                    remaining
                } else {
                    0.0
                };
                caught.push((*stop, remaining));
            }
        }
        if caught.is_empty() {
            return Ok(());
        }
        for (stop, _) in &caught {
            self.regions.enter(stop.part, stop.held);
        }
        self.snap(tau, state, motion)?;
        // Those that would have to pull are let go, the worst one first.
        loop {
            let pulls = |(k, (stop, _)): (usize, &(Stop, f64))| {
                let force = self.series.holding_force(stop.connection)?;
                let pull = -stop.direction.sign() * force[0];
                (pull > 0.0).then_some((k, pull))
            };
            let all = caught.iter().enumerate().filter_map(pulls);
            let Some((k, _)) = all.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                break;
            };
            let (stop, _) = caught.remove(k);
            self.regions.enter(stop.part, 0);
            self.open_series(system, tau, state)?;
        }
        for (stop, remaining) in caught {
            motion.observer.switch(&Switch {
                tau: tau + remaining * system.omega(),
                connection: stop.connection,
                level: stop.level,
                from: 0,
                to: flank(stop.direction),
                velocity: stop.direction.sign() * stop.rate,
                kind: SwitchKind::Holding,
            });
        }
        Ok(())
    }

    /// Lets a stop go.
    fn release(&mut self, part: usize, tau: f64, motion: &mut Motion<'_>) {
        let here = &self.regions.parts()[part];
        let level = here.held_level().unwrap_or_default();
        let (connection, from) = (here.connection, here.law.flanks[here.region]);
        self.regions.enter(part, 0);
        motion.observer.switch(&Switch {
            tau,
            connection,
            level,
            from,
            to: 0,
            velocity: 0.0,
            kind: SwitchKind::Holding,
        });
    }

    /// Puts a state, and deviations from it, onto the levels that are held; opens its series.
    pub(super) fn snap(
        &mut self,
        tau: f64,
        state: &mut [f64],
        motion: &mut Motion<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        self.stiffen(system, tau)?;
        let phase = system.moment(tau).phase;
        let frequency = system.moment(tau).frequency;
        let levels: Vec<(usize, f64)> = self.regions.held().map(|h| (h.1, h.2)).collect();
        if let Some(holding) = self.series.holding() {
            let error = |e: usize| system.mounts()[e].transmission_error.as_ref();
            let (q, v) = state.split_at_mut(system.dof());
            let level = |e: usize| levels.iter().find(|l| l.0 == e).map_or(0.0, |l| l.1);
            holding.correct(q, |e| level(e) + error(e).map_or(0.0, |s| s.value(phase)));
            holding.correct(v, |e| {
                error(e).map_or(0.0, |s| frequency * s.derivative(phase))
            });
            if let Some(phi) = motion.phi.as_deref_mut() {
                for mut column in phi.column_iter_mut() {
                    let (q, rest) = column.as_mut_slice().split_at_mut(system.dof());
                    holding.correct(q, |_| 0.0);
                    holding.correct(&mut rest[..system.dof()], |_| 0.0);
                }
            }
        }
        self.open_series(system, tau, state)
    }
}

fn flank(direction: Direction) -> i8 {
    match direction {
        Direction::Up => 1,
        Direction::Down => -1,
    }
}

/// Takes what a force along a connection moves out of the rows of deviations that begin at `first`.
fn project_rows(system: &System, phi: &mut DMatrix<f64>, connection: usize, first: usize) {
    let column = system.stiffness_column(connection);
    let row = system.element_map_row(connection);
    let mobility: f64 = row
        .iter()
        .map(|(i, w)| {
            column
                .iter()
                .filter(|(k, _)| k == i)
                .map(|(_, c)| w * c)
                .sum::<f64>()
        })
        .sum();
    for j in 0..phi.ncols() {
        let strain: f64 = row.iter().map(|(i, w)| w * phi[(first + i, j)]).sum();
        for (i, kappa) in column {
            phi[(first + i, j)] -= kappa * strain / mobility;
        }
    }
}
