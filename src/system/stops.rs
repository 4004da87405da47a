//! Forces of rigid stops on which a motion rests.

use super::{Scratch, System};
use crate::element::automaton::{Direction, RegionForce};
use crate::numeric::complementary::{inverse, solve};
use nalgebra::DMatrix;

/// Finds the forces of held stops from states alone; owns its buffers.
///
/// Where a deformation stays at its stop the force follows from the equation of motion:
///
/// ```text
/// W_A q'' = e_A'',   f_A = (W_A kappa_A)^-1 (W_A a - e_A''),   a: acceleration without the forces f_A
/// ```
///
/// A: stops that are closed, do not move apart, and press. In flight the force is 0; an impact has an impulse and no force.
#[derive(Debug, Clone, Default)]
pub struct Stops {
    /// Connection, level, and the direction in which the level is reached.
    list: Vec<(usize, f64, f64)>,
    /// Stops on which the motion rests.
    closed: Vec<(usize, f64)>,
    acceleration: Vec<f64>,
}

/// Distance from a level and rate there, relative to the motion, at which a stop is closed.
const CLOSED: f64 = 1e-9;

impl Stops {
    /// The stops of a system.
    pub fn new(system: &System) -> Stops {
        let mut list = Vec::new();
        for (connection, mount) in system.mounts().iter().enumerate() {
            if mount.element.least_impact().is_none() {
                continue;
            }
            let regions = mount.element.automata().unwrap_or_default();
            for region in regions.iter().flat_map(|a| &a.regions) {
                if let RegionForce::Held { level } = region.force {
                    // A contact that is held ends where its force would pull.
                    let ends = region.guards.first().map(|g| g.direction);
                    let side = if ends == Some(Direction::Up) {
                        -1.0
                    } else {
                        1.0
                    };
                    list.push((connection, level, side));
                }
            }
        }
        Stops {
            list,
            closed: Vec::new(),
            acceleration: vec![0.0; system.dof()],
        }
    }

    /// Puts the forces of the stops at a state into the responses, which are those of [`System::respond`] there; NaN where stops share
    /// a motion, so that the equation of motion does not decide.
    pub fn load(&mut self, system: &System, tau: f64, state: &[f64], scratch: &mut Scratch) {
        if self.list.is_empty() {
            return;
        }
        let n = system.dof();
        let largest = |part: &[f64]| part.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let (size, speed) = (largest(&state[..n]), largest(&state[n..2 * n]));
        self.closed.clear();
        for (e, level, side) in &self.list {
            scratch.response[*e].f = 0.0;
            let is_at = (scratch.deformation[*e] - level).abs() <= CLOSED * (level.abs() + size);
            if is_at && scratch.rate[*e].abs() <= CLOSED * (speed + size) {
                self.closed.push((*e, *side));
            }
        }
        if self.closed.is_empty() {
            return;
        }
        system.accelerate(tau, state, scratch, &mut self.acceleration);
        match self.forces(system, tau) {
            Some(forces) => {
                for ((e, side), f) in self.closed.iter().zip(forces) {
                    scratch.response[*e].f += side * f;
                }
            }
            None => {
                let unknown = self.closed.iter();
                unknown.for_each(|(e, _)| scratch.response[*e].f = f64::NAN);
            }
        }
    }

    /// Forces of the closed stops, outwards: of those that press, so that none is passed.
    fn forces(&self, system: &System, tau: f64) -> Option<Vec<f64>> {
        let count = self.closed.len();
        let row = |a: usize| system.element_map_row(self.closed[a].0).iter();
        let moment = system.moment(tau);
        let along = |a: usize, b: usize| {
            let ((of, one), (by, other)) = (self.closed[a], self.closed[b]);
            one * other * system.mobility(of, by)
        };
        let mobility = DMatrix::from_fn(count, count, along);
        let side = |a: usize| {
            let (e, sign) = self.closed[a];
            let free: f64 = row(a).map(|(i, w)| w * self.acceleration[*i]).sum();
            let error = system.mounts()[e].transmission_error.as_ref();
            sign * (free - error.map_or(0.0, |e| moment.bend(e)))
        };
        let sides: Vec<f64> = (0..count).map(side).collect();
        // Of connections that share a motion no force is known; the two sides of one take turns.
        let mut each: Vec<usize> = (0..count).collect();
        each.dedup_by_key(|a| self.closed[*a].0);
        inverse(&mobility.select_rows(&each).select_columns(&each))?;
        solve(&mobility, &sides)
    }
}
