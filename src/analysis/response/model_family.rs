//! The systems along a number of the model.

use crate::analysis::Setting;
use crate::analysis::parameter::{Variation, joined};
use crate::error::SolveError;
use crate::model::{Follower, Knob};
use crate::solve::family::Family;
use crate::system::System;

/// A number of the model between two values.
#[derive(Debug, Clone)]
pub(super) struct NumberTrack {
    /// The number.
    pub knob: Knob,
    /// The path as the user wrote it.
    pub written: String,
    /// Values at lambda = 0 and 1.
    pub ends: (f64, f64),
    /// Values that are met exactly, with their lambda.
    pub exact: Vec<(f64, f64)>,
    /// Excitation frequency over omega_c.
    pub at: f64,
}

impl NumberTrack {
    /// The number at lambda.
    pub fn value(&self, lambda: f64) -> f64 {
        let (from, to) = self.ends;
        let listed = self.exact.iter().find(|(x, _)| *x == lambda);
        listed.map_or_else(|| from + lambda * (to - from), |(_, value)| *value)
    }
}

/// Numbers of the model that follow the excitation frequency.
#[derive(Debug, Clone)]
pub(super) struct Ties {
    /// The numbers, each with its formula of the frequency in rad/s.
    pub followers: Vec<Follower>,
    /// omega_c \[rad/s\].
    pub unit: f64,
    /// First and last frequency over omega_c.
    pub range: (f64, f64),
}

/// What varies along a branch, beside or instead of the excitation frequency.
pub(super) trait Road {
    /// The numbers that vary.
    fn knobs(&self) -> Vec<Knob>;

    /// Their values at lambda.
    fn values(&self, lambda: f64) -> Vec<f64>;

    /// Excitation frequency over omega_c.
    fn excitation(&self, lambda: f64) -> f64;

    /// The nearest lambda of the range.
    fn clamped(&self, lambda: f64) -> f64;

    /// Step of a difference quotient in lambda.
    fn step(&self, lambda: f64) -> f64;
}

impl Road for NumberTrack {
    fn knobs(&self) -> Vec<Knob> {
        vec![self.knob.clone()]
    }

    fn values(&self, lambda: f64) -> Vec<f64> {
        vec![self.value(lambda)]
    }

    fn excitation(&self, _lambda: f64) -> f64 {
        self.at
    }

    fn clamped(&self, lambda: f64) -> f64 {
        lambda.clamp(0.0, 1.0)
    }

    /// For the size of the number, where that is larger than the range.
    fn step(&self, lambda: f64) -> f64 {
        let (from, to) = self.ends;
        let size = self.value(lambda).abs() / (to - from).abs();
        f64::EPSILON.cbrt() * size.clamp(1.0, 1e3)
    }
}

impl Road for Ties {
    fn knobs(&self) -> Vec<Knob> {
        self.followers.iter().map(|f| f.knob.clone()).collect()
    }

    fn values(&self, lambda: f64) -> Vec<f64> {
        let value = |f: &Follower| f.relation.value(lambda * self.unit);
        self.followers.iter().map(value).collect()
    }

    fn excitation(&self, lambda: f64) -> f64 {
        lambda
    }

    fn clamped(&self, lambda: f64) -> f64 {
        let (from, to) = self.range;
        lambda.clamp(from.min(to), from.max(to))
    }

    fn step(&self, lambda: f64) -> f64 {
        f64::EPSILON.cbrt() * lambda.abs()
    }
}

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
