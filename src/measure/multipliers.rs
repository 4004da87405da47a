//! Floquet multipliers estimated from the averaged system, Rook & Singh (1995), eqs. (19)-(22).

use super::{ColumnHeading, Measure, ReportedUnits, Solved};
use crate::postprocess::floquet_estimate::averaged_multipliers;

/// `re.1, im.1, ..`, by falling modulus.
#[derive(Debug)]
pub(crate) struct EstimatedMultipliers {
    /// n, coordinates.
    pub dof: usize,
}

impl Measure for EstimatedMultipliers {
    fn headings(&self, _units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let one = |k: usize| ["re", "im"].map(|part| ColumnHeading::number(format!("{part}.{k}")));
        (1..=2 * self.dof).flat_map(one).collect()
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        let means = at
            .connections
            .iter()
            .map(|m| [m.mean_slope, m.mean_damping]);
        let list = averaged_multipliers(at.system, &means.collect::<Vec<_>>());
        out.extend(list.iter().flat_map(|mu| [mu.re, mu.im]));
    }
}
