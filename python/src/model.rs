//! Models: numbers by name, and analyses that run beside Python.

use super::failure::{exception, released};
use super::study::Study;
use super::table::Table;
use super::tree::{from_python, to_python};
use super::watch::{in_pool, watched};
use gearlash::analysis::Control;
use gearlash::assembly;
use gearlash::error::Error;
use gearlash::interrupt::Interrupt;
use gearlash::model;
use gearlash::report::Report;
use gearlash::solve::equilibrium::equilibrium;
use gearlash::study;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};
use std::path::PathBuf;

/// A valid model.
#[pyclass(frozen, module = "gearlash._native")]
pub struct Model(model::Model);

/// A number of a model: name, value, unit, range, whether it is written.
type Number = (String, f64, String, String, bool);

#[pymethods]
impl Model {
    /// The model of a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Model> {
        released(py, || model::Model::load(path)).map(Model)
    }

    /// The model of a YAML text.
    #[staticmethod]
    fn from_yaml(py: Python<'_>, text: &str) -> PyResult<Model> {
        released(py, || model::Model::from_yaml(text)).map(Model)
    }

    /// The model of a tree; `name` where the tree has none.
    #[staticmethod]
    #[pyo3(signature = (tree, name = None))]
    fn from_tree(py: Python<'_>, tree: &Bound<'_, PyAny>, name: Option<String>) -> PyResult<Model> {
        let tree = from_python(tree)?;
        let mut model = released(py, || model::Model::from_tree(&tree))?;
        if model.name.is_empty() {
            model.name = name.unwrap_or_default();
        }
        Ok(Model(model))
    }

    /// The tree of the model, analyses included.
    fn tree<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0.to_tree())
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    /// Names of the analyses.
    #[getter]
    fn analyses(&self) -> Vec<String> {
        self.0.analyses()
    }

    /// All numbers with name, value, unit, range and whether they are written.
    fn numbers(&self, py: Python<'_>) -> PyResult<Vec<Number>> {
        let numbers = released(py, || Ok(self.0.numbers()))?;
        let plain = |n: model::NamedNumber| {
            let range = json!(n.range);
            let range = range.as_str().unwrap_or("any").to_owned();
            (n.name, n.value, n.unit, range, n.is_written)
        };
        Ok(numbers.into_iter().map(plain).collect())
    }

    /// Full name, value, unit and range of a number.
    fn number(&self, py: Python<'_>, name: &str) -> PyResult<(String, f64, String, String)> {
        let knob = released(py, || self.0.knob(name))?;
        let range = json!(knob.range());
        let range = range.as_str().unwrap_or("any").to_owned();
        Ok((knob.name().into(), self.0.get(&knob), knob.unit(), range))
    }

    /// The model with other values by name.
    fn changed(&self, py: Python<'_>, changes: &Bound<'_, PyDict>) -> PyResult<Model> {
        let changes = from_python(changes)?;
        let list = || {
            let entries = changes.as_object().into_iter().flatten();
            let entries = entries.map(|(name, value)| (name.as_str(), value.clone()));
            self.0.with(entries)
        };
        released(py, list).map(Model)
    }

    /// The assembled system, where it rests, and all mistakes of the analyses.
    fn check<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let summary = released(py, || summary(&self.0))?;
        to_python(py, &summary)
    }

    /// Runs an analysis by its name. Returns the result and whether Ctrl-C ended it.
    #[pyo3(signature = (name, progress = None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyDict>, bool)> {
        let run = |control: &dyn Control| self.0.run_observed(name, control);
        let (report, interrupted) = watched(py, progress, run)?;
        Ok((parts(py, report)?, interrupted))
    }

    /// A parameter study of the model, by the name of its analysis.
    fn study(&self, py: Python<'_>, name: &str) -> PyResult<Study> {
        let only = [name.to_owned()];
        let study = released(py, || {
            let study = study::Study::of(&self.0, &only)?;
            let extent = in_pool(|| study.extent(name, &Interrupt::default()))?;
            Ok((study, extent))
        })?;
        Ok(Study::new(name, study))
    }
}

/// What `gearlash check` says, as a tree.
fn summary(model: &model::Model) -> Result<Value, Error> {
    let study = study::Study::of(model, &[])?;
    let mut value = assembly::summary(&study.model, &study.assembly);
    let rest = equilibrium(&study.assembly.system);
    let names = &study.assembly.connections;
    let is_si = study.model.report_units == model::ReportUnits::Si;
    let scale = |k: usize| match is_si {
        true => study.assembly.scales.displacement[k],
        false => 1.0,
    };
    let deformations = |rest: &gearlash::solve::equilibrium::Equilibrium| {
        let scaled = rest.deformation.iter().enumerate();
        scaled.map(|(k, x)| x * scale(k)).collect::<Vec<f64>>()
    };
    value["static_displacement"] = json!(rest.as_ref().ok().map(deformations));
    value["static_flank"] = json!(rest.as_ref().ok().map(|rest| rest.flank.clone()));
    value["static_is_unique"] = json!(rest.as_ref().ok().map(|rest| rest.is_unique));
    value["static_reason"] = json!(rest.as_ref().err().map(|none| none.describe(names)));
    value["analyses"] = json!(model.analyses());
    Ok(value)
}

/// A report as a dict; its tables keep their memory.
pub fn parts(py: Python<'_>, mut report: Report) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    let tables = std::mem::take(&mut report.tables).into_iter();
    let tables = tables.map(Table::new).collect::<PyResult<Vec<_>>>()?;
    dict.set_item("tables", tables.into_pyobject(py)?)?;
    let plain = serde_json::to_value(&report)
        .map_err(|error| exception(py, &Error::Input(vec![unwritable(&error)])))?;
    for (key, value) in plain.as_object().into_iter().flatten() {
        if key != "tables" {
            dict.set_item(key, to_python(py, value)?)?;
        }
    }
    Ok(dict)
}

fn unwritable(error: &serde_json::Error) -> gearlash::error::Diagnostic {
    gearlash::error::Diagnostic {
        location: None,
        path: "summary".into(),
        message: error.to_string(),
        help: None,
    }
}
