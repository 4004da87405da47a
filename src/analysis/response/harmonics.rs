//! How many harmonics: a number, or as many as a tolerance asks for.

use super::{BranchSettings, Quadrature};
use crate::analysis::response::crossings::MOST_HARMONICS;
use crate::analysis::{Fault, Setting};
use crate::solve::galerkin::GalerkinOptions;
use crate::solve::galerkin::adaptive::HarmonicLimits;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Serialize};

/// Harmonics of the excitation frequency.
#[derive(Debug, Default, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Harmonics {
    /// 12, times the greatest common divisor of all excitation orders.
    #[schemars(skip)]
    #[default]
    Usual,
    /// The same number everywhere.
    Count(usize),
    /// Adapted to a tolerance.
    Chosen(Chosen),
}

/// Number of harmonics, adapted along the branch by an error estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Chosen {
    /// Largest estimated relative error of an r.m.s. value.
    pub tolerance: f64,
    /// Smallest number of harmonics.
    #[serde(default = "least")]
    pub least: usize,
    /// Largest number of harmonics.
    #[serde(default = "most")]
    pub most: usize,
}

fn least() -> usize {
    5
}

fn most() -> usize {
    200
}

/// Harmonics when no number is given, and those that an adaptive branch begins with, within its limits.
const USUAL: usize = 12;
/// Sampling errs in r.m.s. values by about this over the square of the number of samples per excitation period (8 with the
/// backlashes of figure 11), which has to stay well below the tolerance.
const ALIASING: f64 = 10.0;
/// How often samples may be doubled where that does not suffice.
const DOUBLINGS: u32 = 6;

impl Harmonics {
    /// Whether no number is given.
    pub(in crate::analysis) fn is_usual(&self) -> bool {
        *self == Harmonics::Usual
    }

    /// The number that a branch begins with.
    pub(super) fn first(self) -> usize {
        match self {
            Harmonics::Usual => USUAL,
            Harmonics::Count(count) => count,
            Harmonics::Chosen(Chosen { least, most, .. }) => USUAL.min(most).max(least),
        }
    }

    /// The largest number.
    pub(super) fn most(self) -> usize {
        match self {
            Harmonics::Usual => USUAL,
            Harmonics::Count(count) => count,
            Harmonics::Chosen(chosen) => chosen.most,
        }
    }

    /// Whether the number is chosen along the branch.
    pub(super) fn are_chosen(self) -> bool {
        matches!(self, Harmonics::Chosen(_))
    }

    /// Default lower limit of samples per response period.
    fn samples(self, harmonics: usize, subharmonic: usize) -> usize {
        let least = GalerkinOptions::default_samples(harmonics, subharmonic);
        match self {
            Harmonics::Usual | Harmonics::Count(_) => least,
            Harmonics::Chosen(Chosen { tolerance, .. }) => {
                let period = (ALIASING / tolerance).sqrt().ceil();
                // Of a tolerance that was checked: at most 2^15 a period.
                least.max((period as usize * subharmonic).next_power_of_two())
            }
        }
    }
}

impl<'de> Deserialize<'de> for Harmonics {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(WrittenHarmonics)
    }
}

/// By hand, so that errors inside the map keep their place.
struct WrittenHarmonics;

impl<'de> Visitor<'de> for WrittenHarmonics {
    type Value = Harmonics;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a number of harmonics or {tolerance: .., least: .., most: ..}")
    }

    fn visit_u64<E: serde::de::Error>(self, count: u64) -> Result<Harmonics, E> {
        let wrong = || E::invalid_value(Unexpected::Unsigned(count), &self);
        let count = usize::try_from(count).map_err(|_| wrong())?;
        Ok(Harmonics::Count(count))
    }

    fn visit_f64<E: serde::de::Error>(self, count: f64) -> Result<Harmonics, E> {
        // Values of a study are floats.
        let is_count = count.fract() == 0.0 && (0.0..1e9).contains(&count);
        match is_count {
            true => Ok(Harmonics::Count(count as usize)),
            false => Err(E::invalid_value(Unexpected::Float(count), &self)),
        }
    }

    fn visit_map<A: serde::de::MapAccess<'de>>(self, map: A) -> Result<Harmonics, A::Error> {
        Chosen::deserialize(MapAccessDeserializer::new(map)).map(Harmonics::Chosen)
    }
}

impl BranchSettings {
    /// The settings for one model: harmonics that nobody gave count in the lowest frequency of everything that excites it, so
    /// that a load of order 2 is resolved as well as one of order 1 at twice the frequency.
    pub(in crate::analysis) fn for_model(mut self, setting: &Setting<'_>) -> BranchSettings {
        if self.harmonics.is_usual() {
            let system = &setting.assembly.system;
            let most = MOST_HARMONICS / self.subharmonic.max(1) / system.revolutions();
            let own =
                (system.common_order() / system.revolutions()).clamp(1, (most / USUAL).max(1));
            self.harmonics = Harmonics::Count(USUAL * own);
        }
        self
    }

    /// The limits of the size, where it is chosen along the branch.
    pub(super) fn resolution(&self) -> Option<HarmonicLimits> {
        let Harmonics::Chosen(Chosen {
            tolerance,
            least,
            most,
        }) = self.harmonics
        else {
            return None;
        };
        let is_free = self.samples.is_none() && self.quadrature == Quadrature::Sampled;
        Some(HarmonicLimits {
            tolerance,
            least,
            most,
            doublings: if is_free { DOUBLINGS } else { 0 },
        })
    }

    /// The size of the Galerkin approximation at the beginning of the primary branch.
    pub(super) fn size(&self) -> GalerkinOptions {
        self.size_with(self.harmonics.first(), self.subharmonic)
    }

    /// The largest size for a subharmonic index.
    pub(super) fn size_for(&self, subharmonic: usize) -> GalerkinOptions {
        self.size_with(self.harmonics.most(), subharmonic)
    }

    /// The size with a number of harmonics, for a subharmonic index: as many samples per excitation period.
    pub(super) fn size_with(&self, harmonics: usize, subharmonic: usize) -> GalerkinOptions {
        let default = || self.harmonics.samples(harmonics, self.subharmonic);
        let samples = self.samples.unwrap_or_else(default) * subharmonic / self.subharmonic;
        GalerkinOptions { harmonics, samples }
    }

    /// What is wrong with the number of harmonics.
    pub(super) fn check_harmonics(&self, revolutions: usize) -> Vec<Fault> {
        let mut faults = Vec::new();
        let period = match revolutions {
            1 => String::new(),
            _ => format!(" and the {revolutions} revolutions in a period"),
        };
        let product = |count: usize| {
            count
                .saturating_mul(self.subharmonic)
                .saturating_mul(revolutions)
        };
        let mut limit = |key: &str, count: usize| {
            if count == 0 || product(count) > MOST_HARMONICS {
                let message = format!(
                    "{count} must be at least 1, and at most {MOST_HARMONICS} with the subharmonic index{period}"
                );
                faults.push(Fault::new(key, message));
            }
        };
        match self.harmonics {
            Harmonics::Usual => limit("harmonics", USUAL),
            Harmonics::Count(count) => limit("harmonics", count),
            Harmonics::Chosen(chosen) => {
                limit("harmonics.least", chosen.least);
                limit("harmonics.most", chosen.most);
                faults.extend(self.check_chosen(chosen));
            }
        }
        faults
    }

    fn check_chosen(&self, chosen: Chosen) -> Vec<Fault> {
        let Chosen {
            tolerance,
            least,
            most,
        } = chosen;
        let mut faults = Vec::new();
        if least > most {
            let message = format!("{most} must be at least the fewest, {least}");
            faults.push(Fault::new("harmonics.most", message));
        }
        // The corrector's own residual must not show in the estimate.
        let finest = 100.0 * self.tolerance;
        if !(tolerance >= finest && tolerance < 0.1) {
            let message = format!(
                "{tolerance} must be below 0.1, and at least a hundred times the `tolerance` of the corrector, {finest:e}"
            );
            faults.push(Fault::new("harmonics.tolerance", message));
        }
        if !self.has_galerkin() {
            let message =
                "harmonics adapt along branches of the method `galerkin`, which is not selected";
            faults.push(Fault::new("harmonics", message));
        }
        faults
    }
}
