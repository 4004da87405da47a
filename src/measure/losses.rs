//! Energy dissipated by connections with memory.

use super::{ColumnHeading, Measure, ReportedUnits, Solved};

/// `energy_lost.c`: energy dissipated per excitation period, for connections with memory.
#[derive(Debug)]
pub(crate) struct Losses {
    /// The connections.
    pub connections: Vec<usize>,
}

impl Measure for Losses {
    fn headings(&self, units: &ReportedUnits<'_>) -> Vec<ColumnHeading> {
        let names = units.connections();
        let one = |e: &usize| units.energy(format!("energy_lost.{}", names[*e]), *e);
        self.connections.iter().map(one).collect()
    }

    fn measure(&mut self, at: &Solved<'_>, out: &mut Vec<f64>) {
        out.extend(self.connections.iter().map(|e| at.connections[*e].loss));
    }
}
