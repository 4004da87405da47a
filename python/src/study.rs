//! Parameter studies: runs by their numbers.

use super::failure::released;
use super::model::parts;
use super::table::Table;
use super::watch::in_pool;
use gearlash::interrupt as flag;
use gearlash::study::{self, StudyExtent};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A flag that asks runs to stop.
#[pyclass(frozen, module = "gearlash._native")]
#[derive(Default)]
pub struct Interrupt(flag::Interrupt);

#[pymethods]
impl Interrupt {
    #[new]
    fn new() -> Interrupt {
        Interrupt::default()
    }

    /// Asks the runs to stop.
    fn request(&self) {
        self.0.request();
    }
}

/// A parameter study, checked.
#[pyclass(frozen, module = "gearlash._native")]
pub struct Study {
    #[pyo3(get)]
    name: String,
    study: study::Study,
    extent: StudyExtent,
}

impl Study {
    /// A study and what is known of it.
    pub fn new(name: &str, (study, extent): (study::Study, StudyExtent)) -> Study {
        Study {
            name: name.to_owned(),
            study,
            extent,
        }
    }
}

#[pymethods]
impl Study {
    /// Number of runs.
    #[getter]
    fn runs(&self) -> u64 {
        self.extent.runs
    }

    /// Estimated seconds of the most expensive run.
    #[getter]
    fn seconds(&self) -> f64 {
        self.extent.seconds
    }

    /// SHA-256 of what the rows depend on except the program.
    #[getter]
    fn identity(&self) -> &str {
        &self.extent.identity
    }

    /// The table without rows.
    fn empty(&self) -> PyResult<Table> {
        Table::new(gearlash::report::Table {
            name: String::new(),
            columns: self.extent.columns.clone(),
        })
    }

    /// The rows of runs `start` to `stop - 1`, one after another on this thread without the GIL; fewer when the flag is raised.
    #[pyo3(signature = (start, stop, interrupt = None))]
    fn rows(
        &self,
        py: Python<'_>,
        start: u64,
        stop: u64,
        interrupt: Option<PyRef<'_, Interrupt>>,
    ) -> PyResult<Table> {
        let flag = interrupt.map(|flag| flag.0.clone()).unwrap_or_default();
        let rows = released(py, || {
            in_pool(|| self.study.rows(&self.name, start..stop, &flag))
        })?;
        Table::new(rows)
    }

    /// The result of the study from its finished rows.
    fn report<'py>(&self, py: Python<'py>, rows: PyRef<'_, Table>) -> PyResult<Bound<'py, PyDict>> {
        let rows = rows.stored();
        let report = released(py, || {
            self.study
                .report_of(&self.name, rows, &flag::Interrupt::default())
        })?;
        parts(py, report)
    }
}
