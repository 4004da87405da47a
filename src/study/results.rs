//! Analyses run on a model by a program, and their results by name.

use crate::analysis::{
    Analysis, BifurcationDiagram, Control, EffectiveFrequencies, FrequencyResponse, Modes,
    OperatingPoint, ParameterResponse, ParameterStudy, PoincareMap, RunUp, TimeHistory,
};
use crate::error::Error;
use crate::interrupt::Interrupt;
use crate::model::Model;
use crate::report::{Report, Table, Values};
use serde::{Deserialize, Serialize};

/// `run` of an analysis, with the type of its results.
macro_rules! runs {
    ($($analysis:ident => $results:ident),+ $(,)?) => {$(
        impl $analysis {
            /// Runs the analysis on a model, in memory.
            ///
            /// # Errors
            /// [`Error::Input`]: what is wrong with the settings, or what the model does not allow.
            pub fn run(&self, model: &Model) -> Result<$results, Error> {
                self.run_observed(model, &Interrupt::default())
            }

            /// The same, telling an observer how far it is; the observer may stop it. What is finished then is in the
            /// results, and `ended_early` of the report says so.
            ///
            /// # Errors
            /// As [`run`](Self::run).
            pub fn run_observed(
                &self,
                model: &Model,
                observer: &dyn Control,
            ) -> Result<$results, Error> {
                model.run_analysis(self as &dyn Analysis, observer).map($results::from)
            }
        }
    )+};
}
runs! {
    FrequencyResponse => ResponseCurves,
    ParameterResponse => ResponseCurves,
    TimeHistory => History,
    OperatingPoint => Report,
    RunUp => Report,
    PoincareMap => Iterates,
    BifurcationDiagram => Iterates,
    Modes => Report,
    EffectiveFrequencies => Report,
    ParameterStudy => Report,
}

/// A view of results: the report with all tables, events and warnings beside it.
macro_rules! views {
    ($($name:ident),+) => {$(
        impl From<Report> for $name {
            fn from(report: Report) -> $name {
                $name { report }
            }
        }

        impl $name {
            /// All tables, warnings, the summary, and why the analysis ended early, if it did.
            pub fn report(&self) -> &Report {
                &self.report
            }

            /// The report alone.
            pub fn into_report(self) -> Report {
                self.report
            }

            /// A column of the main table, NaN where a cell is empty; `None` where there is no such column of numbers.
            pub fn column(&self, name: &str) -> Option<&[f64]> {
                self.report.main()?.floats(name)
            }
        }
    )+};
}
views!(ResponseCurves, History, Iterates);

/// Branches of periodic responses, point by point, and their bifurcations.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ResponseCurves {
    report: Report,
}

impl ResponseCurves {
    /// All points, branch by branch, in the order in which they were found.
    pub fn points(&self) -> impl Iterator<Item = ResponsePoint<'_>> {
        rows(self.report.main()).map(|row| ResponsePoint { row })
    }

    /// Folds, period doublings, branch points, Neimark-Sacker points, grazings.
    pub fn events(&self) -> impl Iterator<Item = ResponseEvent<'_>> {
        rows(self.report.table("events")).map(|row| ResponseEvent { row })
    }
}

/// A periodic response. Deformations are in m or rad, forces in N or N m; nondimensional for reduced models.
#[derive(Debug, Clone, Copy)]
pub struct ResponsePoint<'a> {
    row: Row<'a>,
}

impl ResponsePoint<'_> {
    /// Number of its branch, from 0.
    pub fn branch(&self) -> i64 {
        self.row.integer("branch").unwrap_or(0)
    }

    /// Value of the parameter: rad/s for frequencies of SI models.
    pub fn parameter(&self) -> f64 {
        self.value("parameter").unwrap_or(f64::NAN)
    }

    /// Excitation frequency over omega_c.
    pub fn omega(&self) -> f64 {
        self.value("omega").unwrap_or(f64::NAN)
    }

    /// Excitation frequency in Hz; NaN for reduced models, which have none.
    pub fn frequency_hz(&self) -> f64 {
        self.value("frequency_hz").unwrap_or(f64::NAN)
    }

    /// Root mean square of the alternating deformation of a connection; NaN for a name that the model does not have.
    pub fn rms(&self, connection: &str) -> f64 {
        let name = format!("rms.{connection}");
        self.value(&name).unwrap_or(f64::NAN)
    }

    /// Whether it is known to be stable.
    pub fn is_stable(&self) -> bool {
        self.stability() == Some(true)
    }

    /// Whether it is stable; `None` where that is not known.
    pub fn stability(&self) -> Option<bool> {
        self.value("stable").map(|stable| stable == 1.0)
    }

    /// Any number of the main table, by the name of its column; `None` where the cell is empty or there is no such column.
    pub fn value(&self, column: &str) -> Option<f64> {
        self.row.number(column)
    }
}

/// Something that happens on a branch.
#[derive(Debug, Clone, Copy)]
pub struct ResponseEvent<'a> {
    row: Row<'a>,
}

impl<'a> ResponseEvent<'a> {
    /// `fold`, `period_doubling`, `branch_point`, `neimark_sacker`, `grazing` or `unresolved`.
    pub fn kind(&self) -> &'a str {
        self.row.text("kind").unwrap_or_default()
    }

    /// Value of the parameter: rad/s for frequencies of SI models.
    pub fn parameter(&self) -> f64 {
        self.value("parameter").unwrap_or(f64::NAN)
    }

    /// Excitation frequency over omega_c.
    pub fn omega(&self) -> f64 {
        self.value("omega").unwrap_or(f64::NAN)
    }

    /// Connection that grazes its gap; `None` for other events.
    pub fn connection(&self) -> Option<&'a str> {
        self.row.text("connection").filter(|name| !name.is_empty())
    }

    /// Whether it was found as a root; its place is only a bracket otherwise.
    pub fn is_located(&self) -> bool {
        self.row.integer("located") == Some(1)
    }

    /// Any number of the table of events, by the name of its column.
    pub fn value(&self, column: &str) -> Option<f64> {
        self.row.number(column)
    }
}

/// A motion against time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct History {
    report: Report,
}

impl History {
    /// Instants in s; in units of 1/omega_c for reduced models.
    pub fn times(&self) -> &[f64] {
        let column = |name| self.column(name);
        column("t").or_else(|| column("T")).unwrap_or_default()
    }

    /// Instants at which connections pass their breakpoints.
    pub fn switches(&self) -> Option<&Table> {
        self.report.table("switches")
    }
}

/// States at phase 0 of the excitation, period after period.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Iterates {
    report: Report,
}

impl Iterates {
    /// What the runs end in, such as `period 2` or `chaotic`: one label per run, or per run and value of the parameter.
    pub fn labels(&self) -> &[String] {
        let labels = |table: &'_ Table| table.column("label").is_some();
        let table = self.report.tables.iter().find(|table| labels(table));
        let column = table.and_then(|table| table.column("label"));
        column
            .and_then(|column| column.values.as_texts())
            .unwrap_or_default()
    }
}

/// A row of a table.
#[derive(Debug, Clone, Copy)]
struct Row<'a> {
    table: &'a Table,
    row: usize,
}

fn rows(table: Option<&Table>) -> impl Iterator<Item = Row<'_>> {
    let rows = |table| (0..Table::rows(table)).map(move |row| Row { table, row });
    table.into_iter().flat_map(rows)
}

impl<'a> Row<'a> {
    fn number(&self, column: &str) -> Option<f64> {
        match &self.table.column(column)?.values {
            Values::Float(values) => values.get(self.row).copied().filter(|x| !x.is_nan()),
            Values::Integer(values) => values.get(self.row).map(|x| *x as f64),
            Values::Text(_) => None,
        }
    }

    fn integer(&self, column: &str) -> Option<i64> {
        self.table
            .column(column)?
            .values
            .as_integers()?
            .get(self.row)
            .copied()
    }

    fn text(&self, column: &str) -> Option<&'a str> {
        let texts = self.table.column(column)?.values.as_texts()?;
        texts.get(self.row).map(String::as_str)
    }
}
