//! Laws that depend on the sign of a rate, where an impact changes it.

use super::impulse::StopPart;
use super::part::Watched;
use super::regions::RegionCrossing;
use super::{Exact, MovedState};
use crate::solve::integrate::{Switch, SwitchKind};
use crate::system::System;
use nalgebra::DMatrix;

/// A part whose memory follows its deformation up to an impact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slide {
    part: usize,
    connection: usize,
    memory: usize,
    /// Its rate before the impact.
    rate: f64,
}

impl Exact {
    /// Notes the parts that slip before an impact.
    pub(super) fn note_slides(&mut self, system: &System, tau: f64, state: &[f64]) {
        let mut slides = std::mem::take(&mut self.impacts.slides);
        slides.clear();
        for (part, here) in self.regions.parts().iter().enumerate() {
            if let (Some(memory), Some(_)) = (here.memory, self.regions.follows(part)) {
                slides.push(Slide {
                    part,
                    connection: here.connection,
                    memory,
                    rate: self.rate(system, tau, state, here.connection),
                });
            }
        }
        self.impacts.slides = slides;
    }

    /// Lets parts stick that no longer move the way they slip; moves parts whose memory has a rate into the region of theirs.
    /// Deviations are those before the impact.
    pub(super) fn turn_slides(
        &mut self,
        (tau, state): (f64, &[f64]),
        set: &[StopPart],
        motion: &mut MovedState<'_>,
    ) {
        let system = motion.system;
        let slides = std::mem::take(&mut self.impacts.slides);
        for slide in &slides {
            let Some(direction) = self.regions.parts()[slide.part].exits.rate else {
                continue;
            };
            let velocity = self.rate(system, tau, state, slide.connection);
            if direction.sign() * velocity <= 0.0 {
                continue;
            }
            if let Some(phi) = motion.phi.as_deref_mut() {
                stop_memory((system, phi), slide, set);
            }
            let deformation = self.deformation[slide.connection];
            let crossing = RegionCrossing {
                theta: 0.0,
                part: slide.part,
                watched: Watched::Rate,
                direction,
            };
            let passage = self.regions.pass(&crossing, deformation);
            motion.observer.switch(&Switch {
                tau,
                connection: slide.connection,
                level: passage.level,
                from: passage.from,
                to: passage.to,
                velocity,
                kind: SwitchKind::Memory,
            });
        }
        self.impacts.slides = slides;
        for part in 0..self.regions.parts().len() {
            if self.regions.parts()[part].evolves() {
                let moved = self.motion_of(system, tau, state, part);
                self.regions.place_cell(&self.series, state, part, moved);
            }
        }
    }
}

/// Row of a memory that follows its deformation up to the instant of the impact, which moves with the deformations of the stops:
///
/// ```text
/// dz = W dq + rate dt,   dt = -W_s dq / rate_s
/// ```
fn stop_memory((system, phi): (&System, &mut DMatrix<f64>), slide: &Slide, set: &[StopPart]) {
    let row = 2 * system.dof() + slide.memory;
    let moving = || set.iter().filter(|s| !s.is_held);
    let count = moving().count().max(1) as f64;
    for j in 0..phi.ncols() {
        let strain = |connection: usize| {
            let parts = system.element_map_row(connection).iter();
            parts.map(|(i, w)| w * phi[(*i, j)]).sum::<f64>()
        };
        let delay = |s: &StopPart| -strain(s.connection) / (s.direction.sign() * s.rate);
        let later = moving().map(delay).sum::<f64>() / count;
        phi[(row, j)] = strain(slide.connection) + slide.rate * later;
    }
}
