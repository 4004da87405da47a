//! The native part of the Python package: models, runs and tables. What can be said in Python is said there.

#![deny(unsafe_code)]

mod failure;
mod law;
mod model;
mod study;
mod table;
mod tree;
mod watch;

use pyo3::prelude::*;

/// Models, runs and tables of gearlash.
#[pymodule(gil_used = true)]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("version", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<model::Model>()?;
    module.add_class::<study::Interrupt>()?;
    module.add_class::<study::Study>()?;
    module.add_class::<table::Table>()?;
    module.add_class::<table::Numbers>()?;
    module.add_function(wrap_pyfunction!(law::register_law, module)?)?;
    module.add_function(wrap_pyfunction!(watch::forked, module)?)
}
