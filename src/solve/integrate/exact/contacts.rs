//! Contact with rigid stops that is held: how it begins, which stops carry it, and how it ends.
//!
//! ```text
//! W_A q'' - e_A'' = b - D f,   D = W_A kappa_A,   f >= 0 outwards, no acceleration beyond a stop, one of the two zero
//! ```

use super::holding::Holding;
use super::impacts::flank;
use super::impulse::StopPart;
use super::regions::size;
use super::{Exact, MovedState, ROUNDING};
use crate::element::automaton::{Reset, Surface};
use crate::numeric::bernstein::Direction;
use crate::numeric::complementary::{share, solve};
use crate::numeric::nonzeros::sparse_dot;
use crate::solve::integrate::{IntegrationEnd, Switch, SwitchKind};
use crate::system::System;
use nalgebra::DMatrix;

/// Impacts that die out within this time, in units of time of the series, are over.
const CHATTER: f64 = 1e-10;
/// Time ahead at which forces are compared, in units of time of the series.
const SOON: f64 = 1e-6;
/// Share of its mobility that a stop has whose deformation other joints hold.
const CARRIED: f64 = 1e-11;
/// Fastest rates that may be at their end, relative to the motion.
const FAST: f64 = 1e-6;

impl Exact {
    /// Takes deformations beyond stops back to them along the forces of the stops, so that none is pushed beyond another.
    pub(super) fn lift(
        &mut self,
        tau: f64,
        state: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        let mut stops: Vec<(usize, Direction, f64)> = Vec::new();
        for part in self.regions.parts() {
            let regions = part.law.automaton.iter().flat_map(|a| &a.regions);
            for guard in regions.flat_map(|r| &r.guards) {
                if let (Surface::Deformation { level, .. }, Reset::Restitution { .. }) =
                    (guard.surface, guard.reset)
                {
                    stops.push((part.connection, guard.direction, level));
                }
            }
        }
        let beyond = |s: &(usize, Direction, f64)| s.1.sign() * (self.deformation[s.0] - s.2);
        let beyond: Vec<f64> = stops.iter().map(beyond).collect();
        if beyond.iter().all(|b| *b <= 0.0) {
            return Ok(());
        }
        let signs: Vec<(usize, f64)> = stops.iter().map(|s| (s.0, s.1.sign())).collect();
        let mobility = mobility(&signs, |a, b| system.mobility(a, b));
        let Some(moves) = solve(&mobility, &beyond) else {
            return Err(IntegrationEnd::Locked(stops[0].0));
        };
        let all = || stops.iter().zip(&beyond).zip(&moves);
        let reached: Vec<usize> = (all().filter(|(_, m)| **m > 0.0))
            .map(|((stop, _), _)| stop.0)
            .collect();
        let extent = size(&self.series, state);
        let is_far = all().any(|((s, b), _)| *b > ROUNDING * (s.2.abs() + extent));
        for ((connection, direction, _), step) in stops.iter().zip(&moves) {
            for (i, kappa) in system.stiffness_column(*connection) {
                state[*i] -= direction.sign() * step * kappa;
            }
        }
        let holding = Holding::new(system, &reached);
        if let (true, Some(phi), Some(holding)) = (is_far, motion.phi.as_deref_mut(), holding) {
            for mut column in phi.column_iter_mut() {
                let (q, _) = column.as_mut_slice().split_at_mut(system.dof());
                holding.correct(q, |_| 0.0);
            }
        }
        self.deform(system, tau, state);
        Ok(())
    }

    /// Holds what presses against stops once its impacts have died out, and lets go what would have to pull.
    pub(super) fn rest(
        &mut self,
        tau: f64,
        stops: &[StopPart],
        state: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        let is_slow = |s: &&StopPart| s.is_held || s.rate.abs() <= FAST * s.speed;
        let mut near: Vec<StopPart> = stops.iter().filter(is_slow).copied().collect();
        if near.is_empty() {
            return Ok(());
        }
        for stop in near.iter().filter(|s| s.is_held) {
            self.regions.enter(stop.part, 0);
        }
        self.open_series(system, tau, state)?;
        let forces = self.carriers(system, &mut near)?;
        if near.is_empty() {
            return Ok(());
        }
        let end = |(stop, force): (&StopPart, &f64)| self.remaining(system, (stop, *force));
        let ends: Vec<f64> = near.iter().zip(&forces).map(end).collect();
        for stop in near.iter().filter(|s| s.is_held) {
            self.regions.rebound(stop.part, stop.direction);
        }
        for (stop, _) in near.iter().zip(&forces).filter(|(_, f)| **f > 0.0) {
            self.regions.enter(stop.part, stop.held);
        }
        self.snap(tau, state, motion)?;
        for ((stop, force), end) in near.iter().zip(&forces).zip(ends) {
            let switch = Switch {
                tau,
                connection: stop.connection,
                level: stop.level,
                from: flank(stop.direction),
                to: 0,
                velocity: 0.0,
                kind: SwitchKind::Holding,
            };
            match (stop.is_held, *force > 0.0) {
                (true, false) => motion.observer.switch(&switch),
                (false, true) => motion.observer.switch(&Switch {
                    tau: tau + end * system.omega(),
                    from: 0,
                    to: flank(stop.direction),
                    velocity: stop.direction.sign() * stop.rate,
                    ..switch
                }),
                _ => {}
            }
        }
        Ok(())
    }

    /// Forces of stops that are held or whose impacts are over; the others are taken out of the list.
    fn carriers(
        &self,
        system: &System,
        near: &mut Vec<StopPart>,
    ) -> Result<Vec<f64>, IntegrationEnd> {
        while !near.is_empty() {
            let Some(forces) = self.forces(system, near) else {
                return Err(IntegrationEnd::Locked(near[0].connection));
            };
            let remaining = |k: usize| match forces[k] > 0.0 && !near[k].is_held {
                true => self.remaining(system, (&near[k], forces[k])),
                false => 0.0,
            };
            let last = (0..near.len()).max_by(|a, b| remaining(*a).total_cmp(&remaining(*b)));
            match last.filter(|k| remaining(*k) > self.shortest()) {
                Some(k) => near.remove(k),
                None => return Ok(forces),
            };
        }
        Ok(Vec::new())
    }

    /// Impacts that would end within this time are over.
    fn shortest(&self) -> f64 {
        CHATTER * self.series.unit * self.series.pace()
    }

    /// Time in which the impacts of a stop die out under the force that would hold it; 0 at rest.
    fn remaining(&self, system: &System, (stop, force): (&StopPart, f64)) -> f64 {
        let presses = force * system.mobility(stop.connection, stop.connection);
        let speed = stop.rate.abs();
        let time = (speed + (speed * speed + 2.0 * presses * stop.gap).sqrt())
            / (presses * (1.0 - stop.coefficient));
        let is_at_rest = stop.gap == 0.0 && speed <= stop.slow();
        match is_at_rest && time > self.shortest() {
            true => 0.0,
            false if time.is_nan() => 0.0,
            false => time,
        }
    }

    /// Forces of stops, outwards, with which no deformation is accelerated beyond them; the series has none of them. What is about to press
    /// presses: where a force passes 0, its trend decides.
    fn forces(&self, system: &System, stops: &[StopPart]) -> Option<Vec<f64>> {
        let signs: Vec<(usize, f64)> = (stops.iter())
            .map(|s| (s.connection, s.direction.sign()))
            .collect();
        let accelerations: Vec<f64> = (signs.iter())
            .map(|(e, sign)| sign * self.series.deformation_acceleration(*e, SOON))
            .collect();
        let along = |a: usize, b: usize| {
            sparse_dot(system.element_map_row(a), self.series.column(system, b))
        };
        // Joints that rest on jumps carry what they hold.
        let moves = |s: &usize| {
            let connection = signs[*s].0;
            let own = along(connection, connection).abs();
            own > CARRIED * system.mobility(connection, connection).abs()
        };
        let moved: Vec<usize> = (0..signs.len()).filter(moves).collect();
        let among: Vec<(usize, f64)> = moved.iter().map(|s| signs[*s]).collect();
        let wanted: Vec<f64> = moved.iter().map(|s| accelerations[*s]).collect();
        let mobility = mobility(&among, along);
        let found = share(&mobility, &wanted, solve(&mobility, &wanted)?);
        let mut forces = vec![0.0; signs.len()];
        moved.iter().zip(found).for_each(|(s, f)| forces[*s] = f);
        Some(forces)
    }

    /// Lets a stop go.
    pub(super) fn release(&mut self, part: usize, tau: f64, motion: &mut MovedState<'_>) {
        let here = &self.regions.parts()[part];
        let level = here.held_level().unwrap_or_default();
        let (connection, from) = (here.connection, here.law.flanks[here.region]);
        self.regions.enter(part, 0);
        let direction = match from < 0 {
            true => Direction::Down,
            false => Direction::Up,
        };
        self.regions.rebound(part, direction);
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
        motion: &mut MovedState<'_>,
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

/// W_A kappa_A of connections with the signs of their stops, from its entries without signs.
fn mobility(stops: &[(usize, f64)], along: impl Fn(usize, usize) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(stops.len(), stops.len(), |a, b| {
        let ((of, one), (by, other)) = (stops[a], stops[b]);
        one * other * along(of, by)
    })
}
