//! Impacts on rigid stops.
//!
//! ```text
//! v+ = v- + kappa_A J,   (W_A kappa_A) J = -(1 + r) rates,   rates = W_A v- - e_A'
//! S = [[D, 0], [A, D]],  D = 1 - kappa_A (W_A kappa_A)^-1 (1 + r) W_A,
//!     A = sum_i (a+ - a- + (D - 1)_i (W_i a- - e_i'')) W_i / rate_i
//! ```

use super::impulse::{Impact, StopPart, agree};
use super::part::Watched;
use super::regions::{RegionCrossing, size};
use super::sliding::Slide;
use super::{Exact, MovedState, ROUNDING, SAME_INSTANT};
use crate::element::automaton::{Reset, Surface};
use crate::numeric::bernstein::Direction;
use crate::solve::integrate::{IntegrationEnd, Switch, SwitchKind};
use crate::system::System;

/// Rounds in which impacts on some stops may cause others at the same instant. Where many bodies touch, each impact sends another one
/// back, and the speeds fall by a few per cent per round.
const ROUNDS: usize = 100_000;

/// Rounds after which it is asked whether any motion keeps within all stops.
const PATIENT: usize = 100;

/// Work space.
#[derive(Debug, Clone, Default)]
pub(crate) struct Buffers {
    /// Connections that are held.
    pub held: Vec<usize>,
    before: Vec<f64>,
    after: Vec<f64>,
    pub(super) stops: Vec<StopPart>,
    pub(super) slides: Vec<Slide>,
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
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        self.lift(tau, state, motion)?;
        self.collide(tau, None, state, motion)?;
        self.rest_on_jumps(tau, state, motion)
    }

    /// The stops that are closed at an instant, whatever the tolerance the one that has just been reached, and those in a flight
    /// that began there.
    fn near_stops(
        &mut self,
        (system, tau): (&System, f64),
        reached: Option<(usize, Direction)>,
        state: &[f64],
    ) {
        self.deform(system, tau, state);
        let size = size(&self.series, state);
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
                // The other side of a joint without play is closed, too.
                let is_held = held_level.is_some() && part.region == held;
                let sign = guard.direction.sign();
                let beyond = sign * (self.deformation[part.connection] - level);
                // What is held on one side does not move to the other, whatever the rounding.
                let rate = match held_level.is_some() && !is_held {
                    true => 0.0,
                    false => sign * self.rate(system, tau, state, part.connection),
                };
                let instant = SAME_INSTANT * self.series.unit * rate.max(0.0);
                let is_reached = reached == Some((k, guard.direction));
                let flight = part.rebounds.filter(|r| r.direction == guard.direction);
                let gap = match flight {
                    _ if is_held || is_reached => Some(0.0),
                    Some(rebound) if rebound.gap <= instant => Some(0.0),
                    Some(rebound) => Some(rebound.gap),
                    None => (beyond >= -part.tolerance(level, size, tau)).then_some(0.0),
                };
                let Some(gap) = gap else { continue };
                self.impacts.stops.push(StopPart {
                    part: k,
                    connection: part.connection,
                    direction: guard.direction,
                    level,
                    coefficient,
                    held,
                    is_held,
                    gap,
                    rate,
                    speed: part.tolerance(0.0, size, 0.0) / (ROUNDING * self.series.unit),
                });
            }
        }
    }

    /// Impacts of everything that is closed and approaches, then rest where impacts have died out. A closed stop at rest is not passed by
    /// an impact on others, whether a force holds it or not: what follows must not hang on the rounding of its rate.
    pub(super) fn collide(
        &mut self,
        tau: f64,
        reached: Option<(usize, Direction)>,
        state: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        let mut reached = reached;
        for round in 0..ROUNDS {
            self.near_stops((system, tau), reached, state);
            let stops = std::mem::take(&mut self.impacts.stops);
            if round == PATIENT && !agree(system, &stops) {
                return Err(IntegrationEnd::Locked(stops[0].connection));
            }
            let is_reached = |s: &StopPart| reached == Some((s.part, s.direction)) && s.rate > 0.0;
            let approaches =
                |s: &&StopPart| !s.is_held && s.gap == 0.0 && (s.rate > s.slow() || is_reached(s));
            let found = stops.iter().any(|s| approaches(&s));
            let result = match found {
                true => {
                    let struck: Vec<StopPart> = stops.iter().filter(approaches).copied().collect();
                    let others = stops.iter().filter(|s| !approaches(s));
                    self.strike(tau, (&struck, others), state, motion)
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
    fn strike<'a>(
        &mut self,
        tau: f64,
        (struck, others): (&[StopPart], impl Iterator<Item = &'a StopPart> + Clone),
        state: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        let n = system.dof();
        if motion.phi.is_some() {
            self.open_series(system, tau, state)?;
            self.series.acceleration(0.0, &mut self.impacts.before);
        }
        let Some(impact) = Impact::among(system, struck, others) else {
            return Err(IntegrationEnd::Locked(struck[0].connection));
        };
        let set = &impact.set;
        let accelerations: Vec<f64> = (set.iter())
            .map(|s| match motion.phi {
                Some(_) => self.series.deformation_acceleration(s.connection, 0.0),
                None => 0.0,
            })
            .collect();
        self.note_slides(system, tau, state);
        for (stop, impulse) in set.iter().zip(&impact.impulses) {
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
        self.break_loose(tau, state, motion);
        self.turn_slides((tau, state), set, motion);
        if motion.phi.is_some() {
            self.open_series(system, tau, state)?;
            self.series.acceleration(0.0, &mut self.impacts.after);
        }
        if let Some(phi) = motion.phi.as_deref_mut() {
            let shift: Vec<f64> = (self.impacts.after.iter())
                .zip(&self.impacts.before)
                .map(|(after, before)| after - before)
                .collect();
            impact.saltate((system, phi), (&shift, &accelerations));
        }
        for stop in struck {
            self.regions.rebound(stop.part, stop.direction);
        }
        for stop in set.iter().filter(|s| !s.is_held) {
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

    /// Joints at rest on a jump of their force, which is finite, give way to an impulse.
    fn break_loose(&mut self, tau: f64, state: &[f64], motion: &mut MovedState<'_>) {
        let system = motion.system;
        let size = size(&self.series, state);
        let held: Vec<(usize, usize, f64)> = (self.regions.held())
            .filter(|h| !self.is_stop(h.0))
            .collect();
        for (part, connection, level) in held {
            let velocity = self.rate(system, tau, state, connection);
            let nothing = self.regions.parts()[part].tolerance(0.0, size, 0.0);
            if velocity.abs() <= nothing / self.series.unit {
                continue;
            }
            let direction = match velocity > 0.0 {
                true => Direction::Up,
                false => Direction::Down,
            };
            let crossing = RegionCrossing {
                theta: 0.0,
                part,
                watched: Watched::Force,
                direction,
            };
            let passage = self.regions.pass(&crossing, level);
            motion.observer.switch(&Switch {
                tau,
                connection,
                level,
                from: passage.from,
                to: passage.to,
                velocity,
                kind: SwitchKind::Holding,
            });
        }
    }

    /// Rate of a deformation.
    pub(super) fn rate(&self, system: &System, tau: f64, state: &[f64], connection: usize) -> f64 {
        let v = &state[system.dof()..];
        let row = system.element_map_row(connection).iter();
        let rate: f64 = row.map(|(i, w)| w * v[*i]).sum();
        let error = system.mounts()[connection].transmission_error.as_ref();
        let at = system.moment(tau);
        rate - error.map_or(0.0, |e| at.frequency * e.derivative(at.phase))
    }

    /// Whether a held part rests on a stop, not on a jump.
    pub(super) fn is_stop(&self, part: usize) -> bool {
        let part = &self.regions.parts()[part];
        let automaton = part.law.automaton.as_ref();
        automaton.is_some_and(|a| {
            let guards = a.regions.iter().flat_map(|r| &r.guards);
            let mut resets = guards.map(|g| g.reset);
            resets.any(|r| matches!(r, Reset::Restitution { .. }))
        })
    }
}

pub(super) fn flank(direction: Direction) -> i8 {
    match direction {
        Direction::Up => 1,
        Direction::Down => -1,
    }
}
