//! The requested measures of an attractor.

use crate::analysis::{Fault, Setting};
use crate::error::did_you_mean;
use crate::measure::{
    ColumnHeading, Connections, ContactColumns, ContactMetrics, EffectiveFrequencyColumns, Measure,
    PeakAccelerations, Solved,
};
use std::collections::BTreeMap;

/// A column that is wanted.
pub(super) struct WantedColumn {
    /// Number of its measure in [`MEASURES`], and its place there.
    measure: usize,
    place: usize,
    pub heading: ColumnHeading,
}

impl WantedColumn {
    /// Whether a name means this column, alone or with those of all connections or bodies.
    fn is_named(&self, name: &str) -> bool {
        let own = &self.heading.name;
        own == name || own.starts_with(&format!("{name}."))
    }
}

/// The columns that are wanted.
pub(super) struct WantedColumns {
    pub columns: Vec<WantedColumn>,
    /// The column that is drawn; labels when `None`.
    pub drawn: Option<String>,
}

/// Makes a measure for a setting.
type MeasureMaker = fn(&Setting<'_>) -> Box<dyn Measure>;

/// All measures of an attractor. Where two have a column, the first one is read: the one that costs least stands first.
const MEASURES: [MeasureMaker; 5] = [
    |_| Box::new(ContactColumns),
    |_| Box::new(Connections),
    |setting| {
        Box::new(EffectiveFrequencyColumns {
            dof: setting.assembly.system.dof(),
        })
    },
    |_| Box::new(ContactMetrics),
    |setting| Box::new(PeakAccelerations::new(setting.model, setting.assembly)),
];

/// Number of the measure that reads contacts alone.
const CONTACTS: usize = 0;

/// Columns of all measures.
fn all(setting: &Setting<'_>) -> Vec<WantedColumn> {
    let mut list = Vec::new();
    for (measure, make) in MEASURES.iter().enumerate() {
        let headings = make(setting).headings(&setting.units()).into_iter();
        list.extend(headings.enumerate().map(|(place, heading)| WantedColumn {
            measure,
            place,
            heading,
        }));
    }
    list
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
        let (mut columns, mut faults) = (Vec::<WantedColumn>::new(), Vec::new());
        for (k, name) in names.iter().enumerate() {
            let all = all(setting);
            if name != "label" && !all.iter().any(|c| c.is_named(name)) {
                let known = all.iter().map(|c| c.heading.name.as_str());
                let message = format!(
                    "`{name}` is no column of a response; {}",
                    did_you_mean(name, known)
                );
                faults.push(Fault::new(format!("measures.{k}"), message));
            }
            for column in all.into_iter().filter(|c| c.is_named(name)) {
                let is_same = |c: &WantedColumn| c.heading.name == column.heading.name;
                if !columns.iter().any(is_same) {
                    columns.push(column);
                }
            }
        }
        let drawn = match drawn {
            None | Some("label") => None,
            Some(name) => {
                let own = columns.iter().find(|c| c.is_named(name));
                let own = own.map(|c| c.heading.name.clone());
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

    /// Whether contacts tell everything that is wanted.
    pub fn are_contacts(&self) -> bool {
        self.columns.iter().all(|c| c.measure == CONTACTS)
    }

    /// The wanted values of a solution, in the units of the report.
    pub fn of(&self, setting: &Setting<'_>, solved: &Solved<'_>) -> Vec<f64> {
        let mut known: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        let value = |column: &WantedColumn| {
            let values = known.entry(column.measure).or_insert_with(|| {
                let mut values = Vec::new();
                MEASURES[column.measure](setting).measure(solved, &mut values);
                values
            });
            values[column.place]
        };
        self.columns.iter().map(value).collect()
    }
}
