//! Analyses run from code, and access to their results by name.

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
            /// [`Error::Input`]: invalid settings, or settings that the model does not admit.
            pub fn run(&self, model: &Model) -> Result<$results, Error> {
                self.run_observed(model, &Interrupt::default())
            }

            /// Runs the analysis and reports progress to an observer, which may stop it. The results are then
            /// partial, and `ended_early` of the report gives the reason.
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

/// A view of results, with access to the report: all tables, events and warnings.
macro_rules! views {
    ($($name:ident),+) => {$(
        impl From<Report> for $name {
            fn from(report: Report) -> $name {
                $name { report }
            }
        }

        impl $name {
            /// Report with all tables, warnings, the summary, and the reason of an early end.
            pub fn report(&self) -> &Report {
                &self.report
            }

            /// The report.
            pub fn into_report(self) -> Report {
                self.report
            }

            /// Column of the main table, NaN for empty cells; `None` if there is no such numeric column.
            pub fn column(&self, name: &str) -> Option<&[f64]> {
                self.report.main()?.floats(name)
            }
        }
    )+};
}
views!(ResponseCurves, History, Iterates);

/// Branches of periodic responses and their bifurcations.
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
    row: ResultRow<'a>,
}

impl ResponsePoint<'_> {
    /// Number of the branch, from 0.
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

    /// R.m.s. of the alternating deformation of a connection; NaN for an unknown name.
    pub fn rms(&self, connection: &str) -> f64 {
        let name = format!("rms.{connection}");
        self.value(&name).unwrap_or(f64::NAN)
    }

    /// Whether it is known to be stable; false also if the stability is unknown.
    pub fn is_stable(&self) -> bool {
        self.stability() == Some(true)
    }

    /// Whether it is stable; `None` if unknown.
    pub fn stability(&self) -> Option<bool> {
        self.value("stable").map(|stable| stable == 1.0)
    }

    /// Value of a column of the main table; `None` if the cell is empty or there is no such column.
    pub fn value(&self, column: &str) -> Option<f64> {
        self.row.number(column)
    }
}

/// An event on a branch.
#[derive(Debug, Clone, Copy)]
pub struct ResponseEvent<'a> {
    row: ResultRow<'a>,
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

    /// Whether it was located as a root; otherwise only its bracket is known.
    pub fn is_located(&self) -> bool {
        self.row.integer("located") == Some(1)
    }

    /// Value of a column of the table of events.
    pub fn value(&self, column: &str) -> Option<f64> {
        self.row.number(column)
    }
}

/// A motion in time.
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

    /// Table of the switches, at which connections pass their breakpoints.
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
    /// Labels of the runs, such as `period 2` or `chaotic`: one per run, or per run and value of the parameter.
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
struct ResultRow<'a> {
    table: &'a Table,
    row: usize,
}

fn rows(table: Option<&Table>) -> impl Iterator<Item = ResultRow<'_>> {
    let rows = |table| (0..Table::rows(table)).map(move |row| ResultRow { table, row });
    table.into_iter().flat_map(rows)
}

impl<'a> ResultRow<'a> {
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
