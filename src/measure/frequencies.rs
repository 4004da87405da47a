//! Natural frequencies of the system with every law replaced by its effective stiffness.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::postprocess::effective_stiffness::natural_frequencies;

/// `effective_frequency.1..n`.
#[derive(Debug)]
pub struct EffectiveFrequencyColumns {
    /// n, coordinates.
    pub dof: usize,
}

impl Measure for EffectiveFrequencyColumns {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let one = |i: usize| units.frequency(format!("effective_frequency.{i}"));
        (1..=self.dof).map(one).collect()
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        let connections = at.connections.iter();
        let slopes = connections.map(|m| m.effective_stiffness.unwrap_or(m.mean_slope));
        out.extend(natural_frequencies(
            at.system,
            &slopes.collect::<Vec<f64>>(),
        ));
    }
}
