//! What differs between two runs.

use super::{Table, Values};

/// Two runs side by side.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    /// Names of the runs.
    pub names: [String; 2],
    /// Values of the models that differ.
    pub changes: Vec<ReportChange>,
    /// Quantities of the results.
    pub differences: Vec<Difference>,
    /// Analyses that only one of the runs has, with its name.
    pub missing: Vec<String>,
}

/// A value of the model; empty where it is not given.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReportChange {
    /// Dotted path.
    pub path: String,
    /// In the one run and in the other.
    pub values: [String; 2],
}

/// A quantity of the results.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Analysis.
    pub analysis: String,
    /// Name: `largest rms.mesh_1 [m]`.
    pub quantity: String,
    /// In the one run and in the other; NaN where there is none.
    pub values: [f64; 2],
}

impl Difference {
    /// The second value over the first one, less 1; `None` without a first value.
    pub fn share(&self) -> Option<f64> {
        let [a, b] = self.values;
        let share = b / a - 1.0;
        share.is_finite().then_some(share)
    }
}

impl Table {
    /// Largest finite value of a column of numbers.
    pub fn largest(&self, name: &str) -> Option<f64> {
        let Values::Float(list) = &self.column(name)?.values else {
            return None;
        };
        let finite = list.iter().copied().filter(|x| x.is_finite());
        finite.fold(None, |most, x| Some(most.map_or(x, |m: f64| m.max(x))))
    }
}
