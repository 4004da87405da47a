//! Responses at a fixed excitation frequency against any number of the model.

use super::cost::Cost;
use super::parameter::{Variation, VariedParameter, joined};
use super::response::{self, BranchSettings, Swept, branch_settings, response_keys};
use super::{Analysis, Fault, Link, Setting, columns};
use crate::error::Error;
use crate::model::Knob;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::system::System;
use serde_json::json;

response_keys! {
    /// Settings of `parameter_response`.
    pub struct ParameterResponse {
        /// Excitation frequency.
        pub at: Quantity,
        /// Dotted path of a number of the model, or a short form of one.
        pub parameter: String,
        /// Further numbers that follow it, such as `{gear_2.drag: "0.4*x"}`.
        #[serde(default, skip_serializing_if = "Link::is_empty")]
        pub link: Link,
    }
}

/// Share of the range by which the number is moved to see whether it varies continuously.
const NUDGE: f64 = 1e-3 * std::f64::consts::SQRT_2;

#[typetag::serde(name = "parameter_response")]
impl Analysis for ParameterResponse {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let settings = branch_settings!(self).for_model(setting);
        let mut faults = Vec::new();
        if let Err(message) = setting.frequency(&self.at) {
            faults.push(Fault::new("at", message));
        }
        let values = self.knob(setting).map_err(|fault| vec![fault]);
        let values = values.and_then(|knob| check_values(setting, &settings, knob));
        match values {
            Ok(first) => faults.extend(settings.check(setting, &first)),
            Err(list) => {
                faults.extend(list);
                faults.extend(settings.check(setting, &setting.assembly.system));
            }
        }
        if let Ok(at) = setting.frequency(&self.at) {
            faults.extend(settings.check_steps(setting, at));
            if faults.is_empty()
                && let Ok(knob) = self.knob(setting)
                && let Ok(swept) = Swept::number(setting, &settings, (&knob, &self.parameter), at)
            {
                faults.extend(swept.check_start(&settings));
            }
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let at = setting.frequency(&self.at);
        // lambda is the share of the way.
        at.map_or(Cost::default(), |at| {
            branch_settings!(self)
                .for_model(setting)
                .cost(setting, (0.0, 1.0), at)
        })
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let refused = |fault| columns::refused(setting, fault);
        let settings = branch_settings!(self).for_model(setting);
        let at = setting.frequency(&self.at);
        let at = at.map_err(|message| refused(Fault::new("at", message)))?;
        let knob = self.knob(setting).map_err(refused)?;
        let swept = Swept::number(setting, &settings, (&knob, &self.parameter), at);
        let options = serde_json::to_value(self).unwrap_or(serde_json::Value::Null);
        let mut report = response::run(&settings, &swept.map_err(refused)?, options)?;
        report
            .summary
            .insert("parameter".into(), json!(knob.name()));
        Ok(report)
    }

    fn event_states(
        &self,
        setting: &Setting<'_>,
    ) -> Result<Option<Vec<response::EventState>>, Error> {
        let refused = |fault| columns::refused(setting, fault);
        let settings = branch_settings!(self).for_model(setting);
        let at = setting.frequency(&self.at);
        let at = at.map_err(|message| refused(Fault::new("at", message)))?;
        let knob = self.knob(setting).map_err(refused)?;
        let swept = Swept::number(setting, &settings, (&knob, &self.parameter), at);
        response::event_states(&settings, &swept.map_err(refused)?).map(Some)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let settings = branch_settings!(self).for_model(setting);
        let Ok(knob) = self.knob(setting) else {
            return Vec::new();
        };
        let swept = Swept::number(setting, &settings, (&knob, &self.parameter), 1.0);
        swept.map_or(Vec::new(), |swept| response::tables(&settings, &swept))
    }
}

impl ParameterResponse {
    /// The number that is varied.
    fn knob(&self, setting: &Setting<'_>) -> Result<Knob, Fault> {
        let fault = |message: String| Fault::new("parameter", message);
        let is_frequency = ["frequency", "at", "omega"].contains(&self.parameter.as_str());
        match VariedParameter::alone(setting, &self.parameter, &self.link).map_err(fault) {
            Ok(VariedParameter::Number(knob)) => Ok(*knob),
            Err(fault) if !is_frequency => Err(fault),
            _ => {
                let message = "the excitation frequency is what the type `frequency_response` varies: use that, and give the \
                               frequencies as `from` and `to`";
                Err(fault(message.into()))
            }
        }
    }
}

/// Checks the values of the number; the system at the first one.
fn check_values(
    setting: &Setting<'_>,
    settings: &BranchSettings,
    knob: Knob,
) -> Result<System, Vec<Fault>> {
    let parameter = VariedParameter::Number(Box::new(knob.clone()));
    let path = knob.name().to_owned();
    let value = |written: &Quantity| {
        parameter.check(setting, written)?;
        parameter.value(setting, written)
    };
    let faults = settings.check_range(&value);
    if let Some(first) = faults.first() {
        // What is wrong with every value alike is wrong with the path.
        let is_common = faults.len() > 1
            && faults.len() == 2 + settings.marks.len()
            && faults.iter().all(|f| f.message == first.message);
        return Err(if is_common {
            vec![Fault::new("parameter", first.message.clone())]
        } else {
            faults
        });
    }
    let mut variation = Variation::new(setting, vec![knob]);
    let (from, to) = settings.ends().map(|(from, to)| (from.value, to.value))?;
    let mut system = |value: f64| variation.system(&[value]).map_err(|list| joined(&list));
    let one = |message: String| vec![Fault::new("parameter", message)];
    let first = system(from).map_err(one)?;
    if settings.is_single() {
        return Ok(first);
    }
    let moved = system(from + NUDGE * (to - from))
        .map_err(|reason| one(format!("{path} cannot be varied continuously: {reason}")))?;
    if first.is_alike(&moved) {
        return Err(one(format!(
            "{path} changes nothing: the scaled equation is the same at every value (scales stay those of the model as \
             written)"
        )));
    }
    Ok(first)
}
