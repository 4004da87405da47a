//! Everything about the attractor at one frequency, in one row.

use super::cost::Cost;
use super::{Analysis, Fault, FrequencyResponse, ReportedOrder, Setting};
use crate::error::Error;
use crate::quantity::Quantity;
use crate::report::{Report, Table};
use crate::solve::integrate::IntegratorChoice;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Settings of `operating_point`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct OperatingPoint {
    /// Excitation frequency.
    pub at: Quantity,
    /// Periods integrated before the record.
    #[serde(default = "defaults::settle")]
    pub settle: usize,
    /// Periods recorded. A period n attractor is measured over n of them, any other attractor over all.
    #[serde(default = "defaults::periods")]
    pub periods: usize,
    /// Longest period of a label, in excitation periods; default 256.
    #[serde(default)]
    pub longest_period: Option<usize>,
    /// Limit to which an undecided record is extended, in lengths of the record; default 8.
    #[serde(default)]
    pub extend: Option<usize>,
    /// Orders of the reference whose amplitudes in deformations, forces and accelerations are reported.
    #[serde(default)]
    pub orders: Vec<ReportedOrder>,
    /// Whether small deviations are followed, without which nothing is called chaotic; true when absent.
    #[serde(default)]
    pub lyapunov: Option<bool>,
    /// Integrator.
    #[serde(default)]
    pub integrator: IntegratorChoice,
}

mod defaults {
    pub fn settle() -> usize {
        200
    }
    pub fn periods() -> usize {
        100
    }
}

impl OperatingPoint {
    /// The response of one value by integration that this is.
    fn response(&self) -> Result<FrequencyResponse, String> {
        let own = json!({
            "at": self.at.text,
            "points": 1,
            "method": "integration",
            "transient": self.settle,
            "periods": self.periods,
            "integrator": self.integrator,
            "longest_period": self.longest_period,
            "extend": self.extend,
            "orders": self.orders,
            "lyapunov": self.lyapunov,
            "tables": ["main", "rattle"],
        });
        FrequencyResponse::deserialize(own).map_err(|e| e.to_string())
    }
}

/// The main table with the columns of the rattle table that it does not have.
fn joined(mut tables: Vec<Table>) -> Vec<Table> {
    let rattle = tables.iter().position(|t| t.name == "rattle");
    let rattle = rattle.map(|k| tables.remove(k));
    tables.truncate(1);
    if let (Some(main), Some(rattle)) = (tables.first_mut(), rattle) {
        for column in rattle.columns {
            if main.column(&column.name).is_none() {
                main.columns.push(column);
            }
        }
    }
    tables
}

#[typetag::serde(name = "operating_point")]
impl Analysis for OperatingPoint {
    fn check(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let response = match self.response() {
            Ok(response) => response,
            Err(message) => return vec![Fault::new("", message)],
        };
        let mut faults = response.check(setting);
        for fault in &mut faults {
            if fault.key == "transient" {
                fault.key = "settle".into();
            }
        }
        faults
    }

    fn cost(&self, setting: &Setting<'_>) -> Cost {
        let response = self.response();
        response.map_or(Cost::default(), |response| response.cost(setting))
    }

    fn run(&self, setting: &Setting<'_>) -> Result<Report, Error> {
        let Ok(response) = self.response() else {
            return Ok(Report::default());
        };
        let mut report = Analysis::run(&response, setting)?;
        report.tables = joined(report.tables);
        report.figure = None;
        // Nothing is drawn, so nothing is left out.
        if let Some((_, rest)) = report.caption.split_once("the table has all connections.") {
            report.caption = rest.trim().to_owned();
        }
        report.further_figures.clear();
        let options = serde_json::to_value(self).unwrap_or(Value::Null);
        report.summary.insert("options".into(), options);
        Ok(report)
    }

    fn tables(&self, setting: &Setting<'_>) -> Vec<Table> {
        let response = self.response();
        response.map_or(Vec::new(), |response| joined(response.tables(setting)))
    }
}
