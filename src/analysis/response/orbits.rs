//! The orbits kept along a branch: 256 rows each, unless fewer are wanted.

use crate::analysis::Setting;
use crate::analysis::columns::{connections, coordinates, integer};
use crate::measure::ColumnHeading;
use crate::report::{Column, Table};
use crate::solve::galerkin::march;
use crate::solve::orbit::Orbit;
use crate::system::{Stops, System};
use std::f64::consts::TAU;

/// Rows collected so far.
#[derive(Debug, Clone)]
pub(in crate::analysis) struct OrbitTable {
    numbers: Vec<Vec<i64>>,
    series: Vec<Vec<f64>>,
    /// Rows per orbit.
    rows: usize,
    /// Places in the state of coordinates and rates that are no deformations.
    others: Vec<usize>,
}

impl OrbitTable {
    /// No rows yet.
    pub(in crate::analysis) fn new(setting: &Setting<'_>) -> OrbitTable {
        let others: Vec<usize> = others(setting).into_iter().map(|(i, _)| i).collect();
        let columns = 1 + 3 * setting.assembly.connections.len() + others.len();
        OrbitTable {
            numbers: vec![Vec::new(); 2],
            series: vec![Vec::new(); columns],
            rows: ORBIT_ROWS,
            others,
        }
    }

    /// The same with another number of rows per orbit.
    pub(in crate::analysis) fn with_rows(self, rows: usize) -> OrbitTable {
        OrbitTable { rows, ..self }
    }

    /// Appends the orbits of another table as this point.
    pub(in crate::analysis) fn append(&mut self, other: &OrbitTable, point: usize) {
        self.numbers[0].extend(&other.numbers[0]);
        let rows = other.numbers[0].len();
        self.numbers[1].extend(std::iter::repeat_n(point as i64, rows));
        for (own, more) in self.series.iter_mut().zip(&other.series) {
            own.extend(more);
        }
    }

    /// Appends one orbit: deformations, their rates and forces, at equal steps of tau, the end excluded.
    pub(in crate::analysis) fn add(
        &mut self,
        (branch, point): (usize, usize),
        system: &System,
        orbit: &Orbit,
    ) {
        let e = system.element_count();
        let (mut state, mut scratch) = (vec![0.0; system.state_size()], system.scratch());
        let mut stops = Stops::new(system);
        let tracks = match orbit {
            Orbit::Fourier(series) => march::tracks_of_each(system, series),
            Orbit::Segments(_) => Vec::new(),
        };
        for row in 0..self.rows {
            let tau = TAU * row as f64 / self.rows as f64;
            orbit.state(tau, &mut state);
            system.respond(tau, &state, &mut scratch);
            stops.load(system, tau, &state, &mut scratch);
            self.numbers[0].push(branch as i64);
            self.numbers[1].push(point as i64);
            self.series[0].push(tau);
            for k in 0..e {
                if let Some(tracks) = tracks.get(k).filter(|own| !own.is_empty()) {
                    let phase = system.moment(tau).phase;
                    let motion = [scratch.deformation[k], scratch.rate[k], phase];
                    let here = march::response(tracks, system, tau, motion);
                    scratch.response[k].f = system.mounts()[k].vary(here, phase).f;
                }
                self.series[1 + k].push(scratch.deformation[k]);
                self.series[1 + e + k].push(scratch.rate[k]);
                self.series[1 + 2 * e + k].push(scratch.response[k].f);
            }
            for (column, place) in self.series[1 + 3 * e..].iter_mut().zip(&self.others) {
                column.push(state[*place]);
            }
        }
    }

    /// The table in the units of the report.
    pub(in crate::analysis) fn finish(self, setting: &Setting<'_>) -> Table {
        orbit_columns(setting, self.numbers, self.series)
    }
}

/// Rows of an orbit in the orbits file.
const ORBIT_ROWS: usize = 256;

/// Coordinates and rates that are no deformations, with their places in the state: with them a row is a whole state.
fn others(setting: &Setting<'_>) -> Vec<(usize, ColumnHeading)> {
    let list = coordinates(setting).into_iter().enumerate();
    list.filter(|(_, heading)| heading.name.starts_with(['r', 'd']))
        .collect()
}

fn orbit_columns(setting: &Setting<'_>, numbers: Vec<Vec<i64>>, series: Vec<Vec<f64>>) -> Table {
    let names = ["branch", "point"].into_iter();
    let mut columns: Vec<Column> = names
        .zip(numbers)
        .map(|(name, n)| integer(name, n))
        .collect();
    let headings = [ColumnHeading::new("tau", "rad", 1.0)]
        .into_iter()
        .chain(connections(setting))
        .chain(others(setting).into_iter().map(|(_, heading)| heading));
    columns.extend(
        headings
            .zip(series)
            .map(|(heading, values)| heading.column(values)),
    );
    Table {
        name: "orbits".into(),
        columns,
    }
}
