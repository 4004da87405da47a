//! Responses against the excitation frequency (figures 10 to 17).

use super::cost::Cost;
use super::parameter::{FREQUENCY, VariedParameter};
use super::response::{self, BranchSettings, Swept, branch_settings, response_keys};
use super::{Analysis, Fault, Link, Setting, columns};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use serde_json::Value;

response_keys! {
    /// Settings of `frequency_response`.
    pub struct FrequencyResponse {
        /// Frequency of a response with `points: 1`, instead of `from` and `to`.
        #[serde(default)]
        pub at: Option<Quantity>,
        /// Numbers of the model that follow the frequency (x, rad/s), such as `{gear_2.drag: "0.01*x"}`.
        #[serde(default, skip_serializing_if = "Link::is_empty")]
        pub link: Link,
    }
}

impl FrequencyResponse {
    fn settings(&self, setting: &Setting<'_>) -> BranchSettings {
        let mut settings = branch_settings!(self).for_model(setting);
        if let Some(at) = &self.at {
            (settings.from, settings.to) = (Some(at.clone()), Some(at.clone()));
        }
        settings
    }

    /// What is wrong with `at`.
    fn check_at(&self, settings: &BranchSettings) -> Option<Fault> {
        self.at.as_ref()?;
        let message = match () {
            _ if !settings.is_single() => {
                "one frequency is for the method `integration` with `points: 1`; a range needs `from` and `to`"
            }
            _ if self.from.is_some() || self.to.is_some() => "`at` excludes `from` and `to`",
            _ => return None,
        };
        Some(Fault::new("at", message))
    }
}

#[typetag::serde(name = "frequency_response")]
impl Analysis for FrequencyResponse {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let settings = self.settings(setting);
        if let Some(fault) = self.check_at(&settings) {
            return vec![fault];
        }
        let parameter = match VariedParameter::alone(setting, FREQUENCY, &self.link) {
            Ok(parameter) => parameter,
            Err(message) => return vec![Fault::new("link", message)],
        };
        let mut faults = settings.check_range(&|written| {
            parameter.check(setting, written)?;
            setting.frequency(written)
        });
        faults.extend(settings.check(setting, &setting.assembly.system));
        if faults.is_empty()
            && let Ok(swept) = Swept::frequency(setting, &settings, &self.link)
        {
            faults.extend(swept.check_start(&settings));
        }
        if let Some((_, slowest)) = self.range(setting) {
            faults.extend(settings.check_steps(setting, slowest));
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let cost = |(range, slowest)| self.settings(setting).cost(setting, range, slowest);
        self.range(setting).map_or(Cost::default(), cost)
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let settings = self.settings(setting);
        let swept = Swept::frequency(setting, &settings, &self.link)
            .map_err(|fault| columns::refused(setting, fault))?;
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        response::run(&settings, &swept, options)
    }

    fn event_states(
        &self,
        setting: &Setting<'_>,
    ) -> Result<Option<Vec<response::EventState>>, Error> {
        let settings = self.settings(setting);
        let swept = Swept::frequency(setting, &settings, &self.link)
            .map_err(|fault| columns::refused(setting, fault))?;
        response::event_states(&settings, &swept).map(Some)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let settings = self.settings(setting);
        let swept = Swept::frequency(setting, &settings, &self.link);
        swept.map_or(Vec::new(), |swept| response::tables(&settings, &swept))
    }
}

impl FrequencyResponse {
    /// Both ends, and the lower one.
    fn range(&self, setting: &Setting<'_>) -> Option<((f64, f64), f64)> {
        let settings = self.settings(setting);
        let (from, to) = settings.ends().ok()?;
        let (from, to) = (setting.frequency(from).ok()?, setting.frequency(to).ok()?);
        Some(((from, to), from.min(to)))
    }
}
