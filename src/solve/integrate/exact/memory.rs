//! Memories that have a rate of their own, along the motion.

use super::ROUNDING;
use super::acting::Acting;
use super::regions::{Regions, size};
use super::series::MotionSeries;
use crate::numeric::bernstein::evaluate;

impl Regions {
    /// Puts a part whose memory has a rate into the region of its deformation, rate and memory, on a level into the one below; whether it
    /// is where it may leave.
    pub(crate) fn place_cell(
        &mut self,
        series: &MotionSeries,
        state: &[f64],
        k: usize,
        motion: [f64; 2],
    ) -> bool {
        let size = size(series, state);
        let part = &mut self.parts[k];
        let Some(cells) = &part.law.cells else {
            return false;
        };
        let [x, rate] = motion;
        let sizes = [size, size / series.unit, size];
        let tolerance = |axis: usize, level: f64| ROUNDING * (level.abs() + sizes[axis]);
        let (region, stands) = cells.find([x, rate, part.z], tolerance);
        part.enter(region);
        stands
    }

    /// Takes over the series of the memories that have a rate.
    pub(crate) fn take_courses(&mut self, acting: &Acting) {
        for (k, part) in self.parts.iter_mut().enumerate() {
            if part.evolves() {
                part.course = *acting.memory(k);
            }
        }
    }

    /// Takes the memories that have a rate along to theta.
    pub fn evolve(&mut self, theta: f64) {
        for part in self.parts.iter_mut().filter(|p| p.evolves()) {
            part.z = evaluate(&part.course, theta).0;
        }
    }
}
