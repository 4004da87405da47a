//! Recorded values of every point of a branch: the measures of each table in order.

use super::Setting;
use super::response::ResponseTable;
use crate::measure::{
    ColumnHeading, Connections, ContactMetrics, EffectiveFrequencyColumns, EstimatedMultipliers,
    Losses, Measure, MeasureSheet, OrderAmplitudes, PeakAccelerations, ReportedUnits, Solved,
    TransmissionErrors,
};
use crate::model::Structure;
use crate::system::Mount;

/// Samples of an orbit by harmonics for its dynamic transmission error.
const SAMPLES: usize = 1024;

/// Dynamic transmission errors of the connections that have a static one.
fn transmission_errors(setting: &Setting<'_>) -> TransmissionErrors {
    let mounts = setting.assembly.system.mounts().iter().enumerate();
    let own = |k: usize, mount: &Mount| match &setting.model.structure {
        // Measured motions strain a train like transmission errors, but are none.
        Structure::Train(train) => train.connections[k].transmission_error.is_some(),
        Structure::Reduced(_) => mount.transmission_error.is_some(),
    };
    let varies = |(k, mount): &(usize, &Mount)| {
        let error = mount.transmission_error.as_ref();
        error.is_some_and(|e| !e.is_constant()) && own(*k, mount)
    };
    let list = mounts.filter(varies).map(|(k, _)| k);
    TransmissionErrors::new(SAMPLES, list.collect())
}

/// Values of one table among those of a point.
struct TableSection {
    table: ResponseTable,
    sheet: MeasureSheet,
}

/// All sections of a response.
pub(super) struct Sections(Vec<TableSection>);

impl Sections {
    /// The sections of the tables of a response, in a fixed order. `orders`: of the reference whose amplitudes are reported.
    pub fn of(
        setting: &Setting<'_>,
        orders: &[f64],
        computes: impl Fn(ResponseTable) -> bool,
    ) -> Sections {
        let dof = setting.assembly.system.dof();
        let mounts = setting.assembly.system.mounts();
        let remembers = |e: &usize| mounts[*e].element.memory_count() > 0;
        let connections: Vec<usize> = (0..mounts.len()).filter(remembers).collect();
        let mut main: Vec<Box<dyn Measure>> = vec![
            Box::new(Connections),
            Box::new(transmission_errors(setting)),
            Box::new(EffectiveFrequencyColumns { dof }),
        ];
        if !connections.is_empty() {
            main.push(Box::new(Losses { connections }));
        }
        if !orders.is_empty() {
            main.push(Box::new(OrderAmplitudes::new(orders)));
        }
        let mut list = vec![(ResponseTable::Main, main)];
        if computes(ResponseTable::Rattle) {
            let accelerations = PeakAccelerations::new(setting.model, setting.assembly);
            let measures: Vec<Box<dyn Measure>> =
                vec![Box::new(ContactMetrics), Box::new(accelerations)];
            list.push((ResponseTable::Rattle, measures));
        }
        if computes(ResponseTable::MultiplierEstimates) {
            let measures: Vec<Box<dyn Measure>> = vec![Box::new(EstimatedMultipliers { dof })];
            list.push((ResponseTable::MultiplierEstimates, measures));
        }
        let section = |(table, measures)| TableSection {
            table,
            sheet: MeasureSheet::new(measures),
        };
        Sections(list.into_iter().map(section).collect())
    }

    /// Appends the values of one solution.
    pub fn measure(&mut self, at: &Solved<'_>, values: &mut Vec<f64>) {
        for section in &mut self.0 {
            section.sheet.measure(at, values);
        }
    }

    /// Headings of all values of a point, each with its table.
    pub fn headings(&self, units: &ReportedUnits<'_>) -> Vec<(ResponseTable, ColumnHeading)> {
        let of = |s: &TableSection| {
            let headings = s.sheet.headings(units).into_iter();
            let table = s.table;
            headings.map(move |heading| (table, heading))
        };
        self.0.iter().flat_map(of).collect()
    }
}
