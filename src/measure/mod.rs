//! Measured quantities of a periodic solution. One file per quantity, which defines its columns and values.

mod accelerations;
mod connections;
mod contacts;
mod frequencies;
mod losses;
mod multipliers;
mod orders;
mod transmission;
mod units;

pub(crate) use accelerations::PeakAccelerations;
pub use connections::Connections;
pub(crate) use contacts::{ContactColumns, ContactMetrics};
pub use frequencies::EffectiveFrequencyColumns;
pub(crate) use losses::Losses;
pub(crate) use multipliers::EstimatedMultipliers;
pub use orders::OrderAmplitudes;
pub(crate) use transmission::TransmissionErrors;
pub use units::{ColumnHeading, Numbers, ReportedUnits};

use crate::assembly::Assembly;
use crate::model::Model;
use crate::postprocess::connection::Measures;
use crate::solve::orbit::Orbit;
use crate::system::System;

/// A periodic solution with everything that measures read.
pub struct Solved<'a> {
    /// The model at this solution.
    pub model: &'a Model,
    /// Its assembly.
    pub assembly: &'a Assembly,
    /// The system, at its frequency.
    pub system: &'a System,
    /// The orbit.
    pub orbit: &'a Orbit,
    /// Motion and force of every connection; forces in units of the model as written.
    pub connections: &'a [Measures],
    /// Stiffness of every connection over the one of the model as written.
    pub stiffening: &'a [f64],
}

/// A measured quantity, or several that are computed together.
pub trait Measure {
    /// Its columns in the units of a report.
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading>;

    /// Appends the values of one solution, one per column; NaN is an empty cell.
    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>);
}

/// The measures of one table.
pub(crate) struct MeasureSheet {
    measures: Vec<Box<dyn Measure>>,
}

impl MeasureSheet {
    /// A sheet of measures, in the order of their columns.
    pub fn new(measures: Vec<Box<dyn Measure>>) -> MeasureSheet {
        MeasureSheet { measures }
    }

    /// Columns of all measures.
    pub(crate) fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let lists = self.measures.iter().map(|m| m.headings(units));
        lists.flatten().collect()
    }

    /// Appends the values of all measures.
    pub fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        for measure in &mut self.measures {
            measure.measure(at, out);
        }
    }
}
