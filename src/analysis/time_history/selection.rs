//! Rows and columns that are written.

use super::TimeHistory;
use crate::analysis::{Fault, Setting, limits, transient};
use crate::error::did_you_mean;
use crate::report::{Table, Values};

impl TimeHistory {
    /// Columns that do not exist, and rows that are none.
    pub(super) fn check_columns(&self, setting: &Setting<'_>) -> Vec<Fault> {
        let mut faults: Vec<Fault> = limits::check("decimate", self.decimate, 1, limits::SAMPLES)
            .into_iter()
            .collect();
        let known: Vec<String> = transient::headings(setting).map(|h| h.name).collect();
        for (k, name) in self.columns.iter().flatten().enumerate() {
            if !known.contains(name) {
                let help = did_you_mean(name, known.iter().map(String::as_str));
                let message = format!("`{name}` is no column: {help}");
                faults.push(Fault::new(format!("columns.{k}"), message));
            }
        }
        faults
    }

    /// Keeps the requested columns and rows.
    pub(super) fn thin(&self, table: &mut Table) {
        if let Some(columns) = &self.columns {
            let mut place = 0;
            table.columns.retain(|column| {
                place += 1;
                place == 1 || columns.contains(&column.name)
            });
        }
        if self.decimate > 1 {
            for column in &mut table.columns {
                if let Values::Float(values) = &mut column.values {
                    let kept = values.iter().step_by(self.decimate).copied();
                    *values = kept.collect();
                }
            }
        }
    }
}
