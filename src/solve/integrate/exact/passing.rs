//! Which regions a motion begins in, and what happens where it leaves them.

use super::bounces::Excursion;
use super::regions::RegionCrossing;
use super::series::Span;
use super::{Exact, MovedState};
use crate::element::automaton::Reset;
use crate::numeric::bernstein::{Direction, evaluate};
use crate::solve::integrate::{IntegrationEnd, Switch, SwitchKind};
use crate::solve::jumps;
use crate::system::System;
use nalgebra::DMatrix;

use super::part::Watched;

impl Exact {
    /// Deformations of all connections at a state.
    pub(super) fn deform(&mut self, system: &System, tau: f64, state: &[f64]) {
        let q = &state[..system.dof()];
        let phase = system.moment(tau).phase;
        for (k, x) in self.deformation.iter_mut().enumerate() {
            let error = system.mounts()[k].transmission_error.as_ref();
            *x = if system.is_tree() {
                q[k]
            } else {
                let row = system.element_map().row(k);
                row.iter().zip(q).map(|(w, q)| w * q).sum()
            };
            *x -= error.map_or(0.0, |e| e.value(phase));
        }
    }

    /// Regions at an instant; on a breakpoint that to which the connection moves.
    pub(super) fn place(
        &mut self,
        system: &System,
        tau: f64,
        state: &[f64],
        memory: &mut [f64],
    ) -> Result<(), IntegrationEnd> {
        self.deform(system, tau, state);
        if !memory.is_empty() {
            self.recalled.copy_from_slice(memory);
            let mut begin = 0;
            for (mount, x) in system.mounts().iter().zip(&self.deformation) {
                let end = begin + mount.element.memory_count();
                mount.element.project(*x, &mut memory[begin..end]);
                begin = end;
            }
            self.regions.remember(memory);
        }
        let mut stands = (self.regions).place(&self.series, (tau, state), &self.deformation);
        for k in 0..self.regions.parts().len() {
            if self.regions.parts()[k].evolves() {
                let motion = self.motion_of(system, tau, state, k);
                stands |= self.regions.place_cell(&self.series, state, k, motion);
            }
        }
        if stands {
            self.open_series(system, tau, state)?;
            self.regions.leave(&self.series, (tau, state));
        }
        Ok(())
    }

    /// Deformation of a part, as found by [`Exact::deform`], and its rate.
    pub(super) fn motion_of(
        &self,
        system: &System,
        tau: f64,
        state: &[f64],
        part: usize,
    ) -> [f64; 2] {
        let connection = self.regions.parts()[part].connection;
        [
            self.deformation[connection],
            self.rate(system, tau, state, connection),
        ]
    }

    /// What happens to memories and at stops right at the begin.
    pub(super) fn begin(
        &mut self,
        tau: f64,
        state: &mut [f64],
        memory: &[f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        if let Some(phi) = motion.phi.as_deref_mut() {
            let is_moved = |m: usize| self.recalled[m] != memory[m];
            for (k, part) in self.regions.parts().iter().enumerate() {
                if let Some(m) = part.memory
                    && (is_moved(m) || self.regions.follows(k).is_some())
                {
                    follow(motion.system, phi, part.connection, m);
                }
            }
        }
        match self.regions.has_contacts() {
            true => self.rest_at_begin(tau, state, motion),
            false => Ok(()),
        }
    }

    /// The series of the motion at an instant, in the regions at hand.
    pub(super) fn open_series(
        &mut self,
        system: &System,
        tau: f64,
        state: &[f64],
    ) -> Result<(), IntegrationEnd> {
        self.stiffen(system, tau)?;
        let span = Span::at(tau);
        let forces = (&mut self.acting, &self.regions);
        self.series.expand(system, forces, span, state);
        self.regions.take_courses(&self.acting);
        Ok(())
    }

    /// Takes over what keeps deformations at their levels, and what memories add.
    pub(super) fn bind(&mut self, system: &System, phase: f64) -> Result<(), IntegrationEnd> {
        self.series.memories.clear();
        let square = self.series.unit * self.series.unit;
        for (k, part) in self.regions.parts().iter().enumerate() {
            let gain = self.regions.memory_gain(k);
            let Some(m) = part.memory.filter(|_| gain != 0.0) else {
                continue;
            };
            let variation = system.mounts()[part.connection]
                .stiffness_variation
                .as_ref();
            let factor = square * gain * variation.map_or(1.0, |s| s.value(phase));
            for (i, kappa) in system.stiffness_column(part.connection) {
                self.series.add_memory(*i, m, factor * kappa);
            }
        }
        if !self.regions.has_contacts() {
            return Ok(());
        }
        let held = &mut self.impacts.held;
        held.clear();
        held.extend(self.regions.held().map(|(_, connection, _)| connection));
        match held.last() {
            Some(last) if !self.series.hold(system, held) => Err(IntegrationEnd::Locked(*last)),
            _ => Ok(()),
        }
    }

    /// Hands memories over and reports the switches of connections that end on a breakpoint and are about to pass it: the next call
    /// starts beyond.
    pub(super) fn arrive(
        &mut self,
        tau: f64,
        state: &[f64],
        memory: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        if !memory.is_empty() {
            self.deform(system, tau, state);
            let deformation = &self.deformation;
            self.regions.recall(|e| deformation[e], memory);
            if let Some(phi) = motion.phi.as_deref_mut() {
                for (k, part) in self.regions.parts().iter().enumerate() {
                    if let (Some(m), Some(_)) = (part.memory, self.regions.follows(k)) {
                        follow(system, phi, part.connection, m);
                    }
                }
            }
        }
        if !self.regions.has_lines() {
            return Ok(());
        }
        let mut after = std::mem::take(&mut self.scratch);
        self.regions.save(&mut after);
        self.place(system, tau, state, memory)?;
        self.regions.swap(&mut after);
        for (part, region) in after.iter().enumerate() {
            while let Some(direction) = self.regions.towards(part, *region) {
                self.open_series(system, tau, state)?;
                let crossing = RegionCrossing {
                    theta: 0.0,
                    part,
                    watched: Watched::Level,
                    direction,
                };
                self.move_on(&crossing, tau, motion);
            }
        }
        self.scratch = after;
        Ok(())
    }

    /// A part passes a guard at theta of the series, which is tau; whether that counts as a switch, not as one of many bounces.
    pub(super) fn cross(
        &mut self,
        crossing: &RegionCrossing,
        tau: f64,
        state: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<bool, IntegrationEnd> {
        match self.regions.reset(crossing) {
            Reset::Restitution { .. } => {
                let reached = Some((crossing.part, crossing.direction));
                self.collide(tau, reached, state, motion)?;
                Ok(true)
            }
            Reset::Jump { held } => match self.excursion(crossing, tau, motion.system) {
                Some(excursion) if self.bounces.ends(excursion) => {
                    let connection = self.regions.parts()[crossing.part].connection;
                    self.bounces.average(connection, excursion);
                    self.catch(crossing.part, held, tau, state, motion)?;
                    Ok(true)
                }
                excursion => {
                    self.move_on(crossing, tau, motion);
                    Ok(!excursion.is_some_and(|e| self.bounces.follow(e)))
                }
            },
            Reset::None => {
                self.move_on(crossing, tau, motion);
                Ok(true)
            }
        }
    }

    /// Moves a part into the region behind a guard.
    fn move_on(&mut self, crossing: &RegionCrossing, tau: f64, motion: &mut MovedState<'_>) {
        let system = motion.system;
        let connection = self.regions.parts()[crossing.part].connection;
        let deformation = self.series.deformation(connection);
        let (x, slope) = evaluate(deformation, crossing.theta);
        let rate = slope / self.series.unit;
        let followed = self.regions.follows(crossing.part).is_some();
        let was_held = self.regions.parts()[crossing.part].held_level().is_some();
        let passage = self.regions.pass(crossing, x);
        let part = &self.regions.parts()[crossing.part];
        if part.evolves() && crossing.watched != Watched::Level {
            // Force and rate are continuous there.
            return;
        }
        if let Some(phi) = motion.phi.as_deref_mut() {
            match part.memory {
                Some(m) if followed || self.regions.follows(crossing.part).is_some() => {
                    follow(system, phi, connection, m);
                }
                Some(_) => {}
                None if was_held => {}
                None => {
                    let phase = system.moment(tau).phase;
                    let mount = &system.mounts()[connection];
                    let jump = jumps::size(mount, passage.level, rate, phase);
                    jumps::saltate(system, connection, jump, rate, phi.as_mut_slice());
                }
            }
        }
        motion.observer.switch(&Switch {
            tau,
            connection,
            level: passage.level,
            from: passage.from,
            to: passage.to,
            velocity: rate,
            kind: match part.memory {
                Some(_) => SwitchKind::Memory,
                None if was_held => SwitchKind::Holding,
                None => SwitchKind::Breakpoint,
            },
        });
    }

    /// How far a motion that passes a jump goes before it comes back, if it does so again and again.
    fn excursion(&self, crossing: &RegionCrossing, tau: f64, system: &System) -> Option<Excursion> {
        let connection = self.regions.parts()[crossing.part].connection;
        let deformation = self.series.deformation(connection);
        let rate = evaluate(deformation, crossing.theta).1 / self.series.unit;
        let here = self
            .series
            .deformation_acceleration(connection, crossing.theta);
        self.excursion_on_jump(
            (crossing.part, crossing.direction),
            (rate, here),
            (system, tau),
        )
    }

    /// The same for a part in the region on one side of a jump that it is about to pass in a direction, with its rate and its
    /// acceleration there.
    pub(super) fn excursion_on_jump(
        &self,
        (part, direction): (usize, Direction),
        (rate, here): (f64, f64),
        (system, tau): (&System, f64),
    ) -> Option<Excursion> {
        let part = &self.regions.parts()[part];
        let level = match direction {
            Direction::Up => part.exits.high,
            Direction::Down => part.exits.low,
        };
        let phase = system.moment(tau).phase;
        let mount = &system.mounts()[part.connection];
        let jump = jumps::size(mount, level, rate, phase);
        let beyond =
            here - direction.sign() * jump * system.mobility(part.connection, part.connection);
        // Towards the level from both sides.
        let (here, beyond) = (direction.sign() * here, -direction.sign() * beyond);
        let least = here.min(beyond);
        (least > 0.0).then(|| Excursion {
            stay: 2.0 * rate.abs() / (least * self.series.unit * self.series.pace()),
            height: 0.5 * rate * rate / least,
        })
    }
}

/// The row of a memory that follows its deformation.
fn follow(system: &System, phi: &mut DMatrix<f64>, connection: usize, memory: usize) {
    let row = 2 * system.dof() + memory;
    for j in 0..phi.ncols() {
        let parts = system.element_map_row(connection).iter();
        phi[(row, j)] = parts.map(|(i, w)| w * phi[(*i, j)]).sum();
    }
}
