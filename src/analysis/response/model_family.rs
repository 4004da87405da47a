//! The systems along a number of the model.

use super::swept::Road;
use crate::analysis::Setting;
use crate::analysis::parameter::{Variation, joined};
use crate::error::SolveError;
use crate::solve::family::Family;
use crate::system::System;

/// Systems kept: a value and its two neighbours, which Newton's iteration asks for in turn.
const KEPT: usize = 3;
/// The systems along numbers of the model.
///
/// Beyond the ends of the range, where the path following looks over the border, the system of the end replaces one that
/// does not exist.
pub(super) struct ModelFamily<'a> {
    variation: Variation<'a>,
    road: &'a dyn Road,
    subharmonic: usize,
    /// With their lambda; NaN before the first use.
    kept: [(f64, System); KEPT],
    next: usize,
}

impl<'a> ModelFamily<'a> {
    /// The systems of a setting along numbers of its model, from `from`.
    ///
    /// # Errors
    /// There is no system at `from`.
    pub fn new(
        setting: &'a Setting<'a>,
        road: &'a dyn Road,
        (from, subharmonic): (f64, usize),
    ) -> Result<ModelFamily<'a>, SolveError> {
        let system = setting.assembly.system.clone();
        let mut family = ModelFamily {
            variation: Variation::new(setting, road.knobs()),
            road,
            subharmonic,
            kept: std::array::from_fn(|_| (f64::NAN, system.clone())),
            next: 0,
        };
        family.kept[0] = (from, family.built(from)?);
        Ok(family)
    }

    /// The system of the model.
    fn built(&mut self, lambda: f64) -> Result<System, SolveError> {
        let found = self.variation.system(&self.road.values(lambda));
        let mut system = found.map_err(|list| SolveError::NoSystem {
            reason: joined(&list),
        })?;
        system.set_subharmonic(self.subharmonic);
        system.set_reference_frequency(self.road.excitation(lambda));
        Ok(system)
    }

    /// Makes the system at lambda the one in a slot.
    fn fill(&mut self, slot: usize, lambda: f64) -> Result<(), SolveError> {
        let border = self.road.clamped(lambda);
        self.kept[slot].1 = match self.built(lambda) {
            Err(_) if border != lambda => self.built(border)?,
            built => built?,
        };
        self.kept[slot].0 = lambda;
        Ok(())
    }
}

impl Family for ModelFamily<'_> {
    fn at(&mut self, lambda: f64) -> Result<&System, SolveError> {
        let known = self.kept.iter().position(|(place, _)| *place == lambda);
        let slot = match known {
            Some(slot) => slot,
            None => {
                let slot = self.next;
                self.next = (slot + 1) % KEPT;
                // A slot that fails halfway holds nothing.
                self.kept[slot].0 = f64::NAN;
                self.fill(slot, lambda)?;
                slot
            }
        };
        Ok(&self.kept[slot].1)
    }

    /// Inside the range, for a model may end at its border.
    fn neighbours(&self, lambda: f64) -> (f64, f64) {
        let h = self.road.step(lambda);
        let (low, high) = (lambda - h, lambda + h);
        if self.road.clamped(lambda) == lambda {
            (self.road.clamped(low), self.road.clamped(high))
        } else {
            (low, high)
        }
    }
}
