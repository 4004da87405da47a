//! Errors as Python exceptions. No panic crosses the border.

use super::law;
use gearlash::analysis::panicked;
use gearlash::error::{Colour, Diagnostic, Error, render};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs without the GIL; errors and panics become exceptions.
pub fn released<T: Send>(
    py: Python<'_>,
    work: impl FnOnce() -> Result<T, Error> + Send,
) -> PyResult<T> {
    let outcome = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    whole(py, outcome)
}

/// What came of work that may have panicked.
pub fn whole<T>(py: Python<'_>, outcome: std::thread::Result<Result<T, Error>>) -> PyResult<T> {
    if let Some(raised) = law::failure() {
        return Err(raised);
    }
    match outcome {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(exception(py, &error)),
        Err(panic) => Err(PyRuntimeError::new_err(panicked(panic.as_ref()))),
    }
}

/// The exception of an error: `gearlash.ModelError` with its diagnostics, or `OSError` for files.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    build(py, error).unwrap_or_else(|failure| failure)
}

fn build(py: Python<'_>, error: &Error) -> PyResult<PyErr> {
    let errors = py.import("gearlash._errors")?;
    match error {
        Error::Input(list) => {
            let diagnostics = (list.iter())
                .map(|diagnostic| described(py, diagnostic))
                .collect::<PyResult<Vec<_>>>()?;
            let text = render(list, Colour::Plain);
            let value = errors
                .getattr("ModelError")?
                .call1((text.trim_end(), diagnostics))?;
            Ok(PyErr::from_value(value))
        }
        Error::File {
            action,
            path,
            source,
        } => {
            let number = source.raw_os_error();
            let text = format!("cannot {action} {}: {source}", path.display());
            let value = errors
                .getattr("file_error")?
                .call1((number, text, path.as_os_str()))?;
            Ok(PyErr::from_value(value))
        }
        other => {
            let value = errors
                .getattr("GearlashError")?
                .call1((other.to_string(),))?;
            Ok(PyErr::from_value(value))
        }
    }
}

/// A refusal of the border itself, in the same form as those of the library.
pub fn refused(py: Python<'_>, path: &str, message: String) -> PyErr {
    let diagnostic = Diagnostic {
        location: None,
        path: path.to_owned(),
        message,
        help: None,
    };
    exception(py, &Error::Input(vec![diagnostic]))
}

fn described<'py>(py: Python<'py>, diagnostic: &Diagnostic) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let at = diagnostic.location.as_ref();
    dict.set_item("file", at.map(|at| at.source.name.as_str()))?;
    dict.set_item("line", at.map(|at| at.line))?;
    dict.set_item("column", at.map(|at| at.column))?;
    dict.set_item("path", &diagnostic.path)?;
    dict.set_item("message", &diagnostic.message)?;
    dict.set_item("help", diagnostic.help.as_deref())?;
    Ok(dict)
}
