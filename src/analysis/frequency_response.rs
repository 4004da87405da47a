//! Responses against the excitation frequency (figures 10 to 17).

use super::cost::Cost;
use super::response::{self, Swept, branch_settings, response_keys};
use super::{Analysis, Fault, Setting, columns};
use crate::error::Error;
use crate::report::{Report, Table};
use serde_json::Value;

response_keys! {
    /// Settings of `frequency_response`.
    pub struct FrequencyResponse {}
}

#[typetag::serde(name = "frequency_response")]
impl Analysis for FrequencyResponse {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let settings = branch_settings!(self);
        let mut faults = settings.check_range(&|written| setting.frequency(written));
        faults.extend(settings.check(setting, &setting.assembly.system));
        if let Some((_, slowest)) = self.range(setting) {
            faults.extend(settings.check_steps(setting, slowest));
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let cost = |(range, slowest)| branch_settings!(self).cost(setting, range, slowest);
        self.range(setting).map_or(Cost::default(), cost)
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let settings = branch_settings!(self);
        let swept = Swept::frequency(setting, &settings)
            .map_err(|fault| columns::refused(setting, fault))?;
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        response::run(&settings, &swept, options)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let settings = branch_settings!(self);
        let swept = Swept::frequency(setting, &settings);
        swept.map_or(Vec::new(), |swept| response::tables(&settings, &swept))
    }
}

impl FrequencyResponse {
    /// Both ends, and the lower one.
    fn range(&self, setting: &Setting<'_>) -> Option<((f64, f64), f64)> {
        let from = setting.frequency(&self.from).ok()?;
        let to = setting.frequency(&self.to).ok()?;
        Some(((from, to), from.min(to)))
    }
}
