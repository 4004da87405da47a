//! Rest on a jump of the force whose two sides press against it.

use super::part::Watched;
use super::regions::size;
use super::{Exact, MovedState};
use crate::element::automaton::Reset;
use crate::numeric::bernstein::Direction;
use crate::solve::integrate::{IntegrationEnd, Switch, SwitchKind};

impl Exact {
    /// Rest on jumps of the force.
    pub(super) fn rest_on_jumps(
        &mut self,
        tau: f64,
        state: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        let system = motion.system;
        self.deform(system, tau, state);
        let size = size(&self.series, state);
        for k in 0..self.regions.parts().len() {
            for direction in [Direction::Up, Direction::Down] {
                let part = &self.regions.parts()[k];
                let (level, connection) = match direction {
                    Direction::Up => (part.exits.high, part.connection),
                    Direction::Down => (part.exits.low, part.connection),
                };
                let reset = part.guard(Watched::Level, direction).map(|g| g.reset);
                let Some(Reset::Jump { held }) = reset else {
                    continue;
                };
                let x = self.deformation[connection];
                if (x - level).abs() > part.tolerance(level, size, tau) {
                    continue;
                }
                self.open_series(system, tau, state)?;
                let rate = self.series.deformation(connection)[1] / self.series.unit;
                let here = self.series.deformation_acceleration(connection, 0.0);
                let (way, moved) = ((k, direction), (rate, here));
                let excursion = self.excursion_on_jump(way, moved, (system, tau));
                if excursion.is_some_and(|e| self.bounces.ends(e)) {
                    self.catch(k, held, tau, state, motion)?;
                    break;
                }
            }
        }
        Ok(())
    }

    /// A motion comes to rest on a jump of the force.
    pub(super) fn catch(
        &mut self,
        part: usize,
        held: usize,
        tau: f64,
        state: &mut [f64],
        motion: &mut MovedState<'_>,
    ) -> Result<(), IntegrationEnd> {
        let flanks = &self.regions.parts()[part].law.flanks;
        let from = flanks[self.regions.parts()[part].region];
        let to = flanks[held];
        self.regions.enter(part, held);
        let part = &self.regions.parts()[part];
        let switch = Switch {
            tau,
            connection: part.connection,
            level: part.held_level().unwrap_or_default(),
            from,
            to,
            velocity: 0.0,
            kind: SwitchKind::Holding,
        };
        self.snap(tau, state, motion)?;
        motion.observer.switch(&switch);
        Ok(())
    }
}
