//! Rows of a time history: deformations, rates, forces, absolute accelerations; and the table of switches.

use crate::analysis::{Setting, columns};
use crate::measure::ColumnHeading;
use crate::report::{Column, Table};
use crate::solve::integrate::Switch;
use crate::system::{Scratch, Stops, System};

/// Collects rows.
pub struct Rows<'a> {
    setting: &'a Setting<'a>,
    system: &'a System,
    scratch: Scratch,
    stops: Stops,
    /// Nondimensional times T.
    pub times: Vec<f64>,
    /// Deformations, rates, forces and memories of the connections, then accelerations of the bodies: one list a column.
    series: Vec<Vec<f64>>,
}

impl<'a> Rows<'a> {
    /// No rows yet.
    pub fn new(setting: &'a Setting<'a>, system: &'a System) -> Rows<'a> {
        let bodies = columns::accelerations(setting).len();
        Rows {
            setting,
            system,
            scratch: system.scratch(),
            stops: Stops::new(system),
            times: Vec::new(),
            series: vec![Vec::new(); 3 * system.element_count() + system.memory_count() + bodies],
        }
    }

    /// A row at time T, which the solvers call `tau`.
    pub fn push(&mut self, time: f64, tau: f64, state: &[f64]) {
        self.times.push(time);
        let (setting, system) = (self.setting, self.system);
        system.respond(tau, state, &mut self.scratch);
        self.stops.load(system, tau, state, &mut self.scratch);
        let bodies = (setting.assembly).body_accelerations_under(system, tau, state, &self.scratch);
        let Scratch {
            deformation,
            rate,
            response,
        } = &self.scratch;
        let forces = response.iter().map(|r| r.f);
        let values = (deformation.iter().copied())
            .chain(rate.iter().copied())
            .chain(forces)
            .chain(state[2 * system.dof()..].iter().copied())
            .chain(bodies.into_iter().flatten());
        for (column, value) in self.series.iter_mut().zip(values) {
            column.push(value);
        }
    }

    /// The main table.
    pub fn table(self) -> Table {
        let setting = self.setting;
        let mut main = vec![columns::time(setting).column(self.times)];
        main.extend(
            headings(setting)
                .zip(self.series)
                .map(|(d, list)| d.column(list)),
        );
        Table {
            name: String::new(),
            columns: main,
        }
    }
}

/// Columns besides the time.
pub fn headings(setting: &Setting<'_>) -> impl Iterator<Item = ColumnHeading> {
    let connections = columns::connections(setting).into_iter();
    let connections = connections.chain(columns::memories(setting));
    connections.chain(columns::accelerations(setting))
}

/// Passages of breakpoints: when, where, from which flank to which, in which direction, how fast, and the breakpoint.
pub fn switch_table(setting: &Setting<'_>, switches: &[(f64, Switch)]) -> Table {
    let names = &setting.assembly.connections;
    let all = columns::connections(setting);
    let rates: Vec<_> = (0..names.len())
        .map(|k| columns::rate(setting, k))
        .collect();
    let float = |f: &dyn Fn(&Switch) -> f64| switches.iter().map(|(_, s)| f(s)).collect();
    let whole = |f: &dyn Fn(&Switch) -> i8| switches.iter().map(|(_, s)| i64::from(f(s))).collect();
    let direction = |s: &Switch| if s.velocity < 0.0 { -1 } else { 1 };
    let rate = |s: &Switch| s.velocity * rates[s.connection].factor;
    let level = |s: &Switch| s.level * all[s.connection].factor;
    Table {
        name: "switches".into(),
        columns: vec![
            time_column(setting, switches.iter().map(|(t, _)| *t)),
            connection_column(setting, switches.iter().map(|(_, s)| s.connection)),
            columns::integer("from", whole(&|s| s.from)),
            columns::integer("to", whole(&|s| s.to)),
            columns::integer("direction", whole(&direction)),
            columns::float("rate", units_of(&rates), float(&rate)),
            columns::float("level", units_of(&all[..names.len()]), float(&level)),
        ],
    }
}

/// A column `time`.
pub fn time_column(setting: &Setting<'_>, times: impl Iterator<Item = f64>) -> Column {
    let mut time = columns::time(setting);
    time.name = "time".into();
    time.column(times)
}

/// A column `connection` of names.
pub fn connection_column(setting: &Setting<'_>, numbers: impl Iterator<Item = usize>) -> Column {
    let names = &setting.assembly.connections;
    columns::text("connection", numbers.map(|k| names[k].clone()).collect())
}

/// The units of quantities that share a column.
pub fn units_of(headings: &[ColumnHeading]) -> String {
    let mut units: Vec<&str> = headings.iter().map(|q| q.unit.as_str()).collect();
    units.dedup();
    units.join(" or ")
}
