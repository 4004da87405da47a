//! The continued parameter of a response: the systems along it, and how it is reported.

use super::BranchSettings;
use crate::analysis::{Fault, Setting};
use crate::solve::family::{Family, FrequencyFamily};
use crate::system::System;

/// The continued parameter: omega/omega_c.
pub(in crate::analysis) struct Swept<'a> {
    pub setting: &'a Setting<'a>,
    /// First and last value.
    pub range: (f64, f64),
    /// Values to solve exactly.
    pub marks: Vec<f64>,
    /// Unit of the reported parameter, and the factor to it.
    pub unit: String,
    factor: f64,
    /// At any frequency.
    system: System,
}

impl<'a> Swept<'a> {
    /// The excitation frequency.
    ///
    /// # Errors
    /// The first value that is no frequency.
    pub fn frequency(
        setting: &'a Setting<'a>,
        settings: &BranchSettings,
    ) -> Result<Swept<'a>, Fault> {
        let read = |key: &str, written| {
            let value = setting.frequency(written);
            value.map_err(|message| Fault::new(key, message))
        };
        let mut marks = Vec::new();
        for mark in &settings.marks {
            marks.push(read("marks", mark)?);
        }
        let mut system = setting.assembly.system.clone();
        system.set_subharmonic(settings.subharmonic);
        let (unit, factor) = match setting.is_si() {
            true => ("rad/s".into(), setting.assembly.scales.frequency),
            false => (String::new(), 1.0),
        };
        Ok(Swept {
            setting,
            range: (read("from", &settings.from)?, read("to", &settings.to)?),
            marks,
            unit,
            factor,
            system,
        })
    }

    /// The systems along the parameter.
    pub fn family(&self) -> Box<dyn Family> {
        Box::new(FrequencyFamily::new(self.system.clone()))
    }

    /// The system at a value.
    ///
    /// # Errors
    /// Why the model does not exist there.
    pub fn system(&self, lambda: f64) -> Result<System, String> {
        let mut system = self.system.clone();
        system.set_excitation_frequency(lambda);
        Ok(system)
    }

    /// The reported value.
    pub fn value(&self, lambda: f64) -> f64 {
        lambda * self.factor
    }

    /// Excitation frequency over omega_c.
    pub fn excitation(&self, lambda: f64) -> f64 {
        lambda
    }

    /// Where a branch stands, in words.
    pub fn place(&self, lambda: f64) -> String {
        format!("omega/omega_c = {lambda:.6}")
    }
}
