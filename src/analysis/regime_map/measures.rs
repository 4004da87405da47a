//! The requested measures of an attractor.

use crate::analysis::{Fault, Setting};
use crate::error::did_you_mean;
use crate::measure::{
    ColumnHeading, Connections, ContactMetrics, EffectiveFrequencyColumns, Measure, MeasureSheet,
    PeakAccelerations, Solved,
};

/// Columns of all measures, and which of them are wanted.
pub(super) struct WantedColumns {
    /// Places among the values of the sheet, with their headings.
    pub columns: Vec<(usize, ColumnHeading)>,
    /// The column that is drawn; labels when `None`.
    pub drawn: Option<String>,
}

/// All measures of an attractor.
pub(super) fn sheet(setting: &Setting<'_>) -> MeasureSheet {
    let dof = setting.assembly.system.dof();
    let accelerations = PeakAccelerations::new(setting.model, setting.assembly);
    let measures: Vec<Box<dyn Measure>> = vec![
        Box::new(Connections),
        Box::new(EffectiveFrequencyColumns { dof }),
        Box::new(ContactMetrics),
        Box::new(accelerations),
    ];
    MeasureSheet::new(measures)
}

impl WantedColumns {
    /// Reads the keys.
    ///
    /// # Errors
    /// Names that are not columns.
    pub fn new(
        setting: &Setting<'_>,
        names: &[String],
        drawn: Option<&str>,
    ) -> Result<WantedColumns, Vec<Fault>> {
        let headings = sheet(setting).headings(&setting.units());
        let (mut columns, mut faults) = (Vec::<(usize, ColumnHeading)>::new(), Vec::new());
        for (k, name) in names.iter().enumerate() {
            let is_own =
                |h: &ColumnHeading| h.name == *name || h.name.starts_with(&format!("{name}."));
            let own = headings.iter().enumerate().filter(|(_, h)| is_own(h));
            let own: Vec<(usize, ColumnHeading)> = own.map(|(k, h)| (k, h.clone())).collect();
            if own.is_empty() && name != "label" {
                let known = headings.iter().map(|h| h.name.as_str());
                let message = format!(
                    "`{name}` is no column of a response; {}",
                    did_you_mean(name, known)
                );
                faults.push(Fault::new(format!("measures.{k}"), message));
            }
            for column in own {
                // Two measures have a column of the same name and meaning.
                if columns.iter().all(|(_, h)| h.name != column.1.name) {
                    columns.push(column);
                }
            }
        }
        let drawn = match drawn {
            None | Some("label") => None,
            Some(name) => {
                let is_own = |(_, h): &&(usize, ColumnHeading)| {
                    h.name == name || h.name.starts_with(&format!("{name}."))
                };
                let own = columns.iter().find(is_own).map(|(_, h)| h.name.clone());
                if own.is_none() {
                    let message = format!("`{name}` is none of the `measures`");
                    faults.push(Fault::new("draw", message));
                }
                own
            }
        };
        match faults.is_empty() {
            true => Ok(WantedColumns { columns, drawn }),
            false => Err(faults),
        }
    }

    /// The wanted values of a solution, in the units of the report.
    pub fn of(&self, sheet: &mut MeasureSheet, solved: &Solved<'_>) -> Vec<f64> {
        let mut values = Vec::new();
        sheet.measure(solved, &mut values);
        self.columns
            .iter()
            .map(|(place, _)| values[*place])
            .collect()
    }
}
