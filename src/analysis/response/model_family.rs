//! The systems along a number of the model.

use super::swept::Track;
use crate::analysis::Setting;
use crate::analysis::parameter::{Variation, joined};
use crate::error::SolveError;
use crate::solve::family::Family;
use crate::system::System;

/// Systems kept: a value and its two neighbours, which Newton's iteration asks for in turn.
const KEPT: usize = 3;
/// The systems between two values of a number of the model, over lambda from 0 to 1.
///
/// Beyond the ends of the range, where the path following looks over the border, the system of the end replaces one that
/// does not exist.
pub(super) struct ModelFamily<'a> {
    variation: Variation<'a>,
    track: &'a Track,
    subharmonic: usize,
    /// With their lambda; NaN before the first use.
    kept: [(f64, System); KEPT],
    next: usize,
}

impl<'a> ModelFamily<'a> {
    /// The systems of a setting along a number of its model.
    ///
    /// # Errors
    /// There is no system at lambda = 0.
    pub fn new(
        setting: &'a Setting<'a>,
        track: &'a Track,
        subharmonic: usize,
    ) -> Result<ModelFamily<'a>, SolveError> {
        let system = setting.assembly.system.clone();
        let mut family = ModelFamily {
            variation: Variation::new(setting, vec![track.knob.clone()]),
            track,
            subharmonic,
            kept: std::array::from_fn(|_| (f64::NAN, system.clone())),
            next: 0,
        };
        family.kept[0] = (0.0, family.built(0.0)?);
        Ok(family)
    }

    /// The system of the model.
    fn built(&mut self, lambda: f64) -> Result<System, SolveError> {
        let found = self.variation.system(&[self.track.value(lambda)]);
        let mut system = found.map_err(|list| SolveError::NoSystem {
            reason: joined(&list),
        })?;
        system.set_subharmonic(self.subharmonic);
        system.set_reference_frequency(self.track.at);
        Ok(system)
    }

    /// Makes the system at lambda the one in a slot.
    fn fill(&mut self, slot: usize, lambda: f64) -> Result<(), SolveError> {
        let border = lambda.clamp(0.0, 1.0);
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

    /// Inside the range, for a model may end at its border; a step for the size of the number, where that is the larger one.
    fn neighbours(&self, lambda: f64) -> (f64, f64) {
        let (from, to) = self.track.ends;
        let size = self.track.value(lambda).abs() / (to - from).abs();
        let h = f64::EPSILON.cbrt() * size.clamp(1.0, 1e3);
        let (low, high) = (lambda - h, lambda + h);
        if (0.0..=1.0).contains(&lambda) {
            (low.max(0.0), high.min(1.0))
        } else {
            (low, high)
        }
    }
}
