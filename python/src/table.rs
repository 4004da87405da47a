//! Tables whose columns Python reads where they are: Arrow through PyCapsules, numbers through numpy's array interface.

use arrow_array::ffi::{FFI_ArrowArray, FFI_ArrowSchema};
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{Array, ArrayRef, Float64Array, Int64Array, LargeStringArray, RecordBatch};
use arrow_array::{RecordBatchIterator, RecordBatchOptions, StructArray};
use arrow_buffer::{BooleanBuffer, NullBuffer, ScalarBuffer};
use arrow_schema::{ArrowError, DataType, Field, Schema};
use gearlash::report::{Column, Table as Rows, Values};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyTuple};
use std::collections::HashMap;
use std::sync::Arc;

/// Key of a field's metadata that holds the unit.
const UNIT: &str = "unit";

/// A table of a result.
#[pyclass(frozen, module = "gearlash._native")]
pub struct Table {
    #[pyo3(get)]
    name: String,
    batch: RecordBatch,
}

/// Numbers of a column, shared with numpy: `numpy.asarray` reads them where they are.
#[pyclass(frozen, module = "gearlash._native")]
pub struct Numbers(Owned);

/// The memory of a column.
enum Owned {
    Real(ScalarBuffer<f64>),
    Whole(ScalarBuffer<i64>),
}

/// A column as plain data: name, unit, kind, and its numbers as bytes or its words as a list.
type Plain<'py> = (String, String, String, Bound<'py, PyAny>);

#[pymethods]
impl Numbers {
    /// What numpy needs to read the numbers without a copy.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (address, length, kind) = match &self.0 {
            Owned::Real(values) => (values.as_ptr() as usize, values.len(), 'f'),
            Owned::Whole(values) => (values.as_ptr() as usize, values.len(), 'i'),
        };
        let order = if cfg!(target_endian = "big") {
            '>'
        } else {
            '<'
        };
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", (length,))?;
        interface.set_item("typestr", format!("{order}{kind}8"))?;
        let is_read_only = true;
        interface.set_item("data", (address, is_read_only))?;
        Ok(interface)
    }
}

impl Table {
    /// A table that takes over the memory of the rows.
    ///
    /// # Errors
    /// Columns of different lengths.
    pub fn new(rows: Rows) -> PyResult<Table> {
        let length = rows.rows();
        let options = RecordBatchOptions::new().with_row_count(Some(length));
        let (fields, columns): (Vec<Field>, Vec<ArrayRef>) =
            rows.columns.into_iter().map(arrow).unzip();
        let schema = Arc::new(Schema::new(fields));
        let batch = RecordBatch::try_new_with_options(schema, columns, &options);
        Ok(Table {
            name: rows.name,
            batch: batch.map_err(broken)?,
        })
    }

    fn column(&self, name: &str) -> PyResult<&ArrayRef> {
        let found = self.batch.column_by_name(name);
        found.ok_or_else(|| {
            let schema = self.batch.schema_ref();
            let known: Vec<&str> = schema.fields().iter().map(|f| f.name().as_str()).collect();
            let help = gearlash::error::did_you_mean(name, known);
            PyKeyError::new_err(format!("no column is called `{name}`; {help}"))
        })
    }

    /// The rows as the library has them.
    pub fn stored(&self) -> Rows {
        let schema = self.batch.schema_ref();
        let columns = (schema.fields().iter())
            .zip(self.batch.columns())
            .map(|(field, array)| Column {
                name: field.name().clone(),
                unit: unit(field).to_owned(),
                values: values(array),
            })
            .collect();
        Rows {
            name: self.name.clone(),
            columns,
        }
    }
}

#[pymethods]
impl Table {
    /// A table of plain columns: (name, unit, "float" | "integer" | "text", bytes of numbers or list of words).
    #[staticmethod]
    fn of(name: String, columns: Vec<Plain<'_>>) -> PyResult<Table> {
        let columns = columns.into_iter().map(|(name, unit, kind, plain)| {
            let values = match kind.as_str() {
                "float" => Values::Float(eights(&plain, f64::from_ne_bytes)?),
                "integer" => Values::Integer(eights(&plain, i64::from_ne_bytes)?),
                "text" => Values::Text(plain.extract()?),
                _ => {
                    return Err(PyValueError::new_err(format!(
                        "no column is of kind `{kind}`"
                    )));
                }
            };
            Ok(Column { name, unit, values })
        });
        let columns = columns.collect::<PyResult<Vec<_>>>()?;
        Table::new(Rows { name, columns })
    }

    /// The columns as `of` takes them.
    fn plain<'py>(&self, py: Python<'py>) -> PyResult<Vec<Plain<'py>>> {
        let plain = |column: Column| {
            let kind = column.values.kind().to_owned();
            let data = match &column.values {
                Values::Float(list) => bytes(py, list.iter().map(|x| x.to_ne_bytes())).into_any(),
                Values::Integer(list) => bytes(py, list.iter().map(|x| x.to_ne_bytes())).into_any(),
                Values::Text(list) => list.into_pyobject(py)?,
            };
            Ok((column.name, column.unit, kind, data))
        };
        self.stored().columns.into_iter().map(plain).collect()
    }

    /// The rows of several tables with equal columns, one after another.
    #[staticmethod]
    fn joined(parts: Vec<PyRef<'_, Table>>) -> PyResult<Table> {
        let mut parts = parts.iter().map(|part| part.stored());
        let mut whole = parts.next().unwrap_or_default();
        for part in parts {
            if part.columns.len() != whole.columns.len() {
                return Err(PyValueError::new_err("tables with different columns"));
            }
            for (column, more) in whole.columns.iter_mut().zip(part.columns) {
                match (&mut column.values, more.values) {
                    (Values::Float(all), Values::Float(more)) => all.extend(more),
                    (Values::Integer(all), Values::Integer(more)) => all.extend(more),
                    (Values::Text(all), Values::Text(more)) => all.extend(more),
                    _ => return Err(PyValueError::new_err("tables with different columns")),
                }
            }
        }
        Table::new(whole)
    }

    /// Names of the columns in the order of the file.
    #[getter]
    fn columns(&self) -> Vec<String> {
        let fields = self.batch.schema_ref().fields().iter();
        fields.map(|field| field.name().clone()).collect()
    }

    /// Units by column; empty where a column has none.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let units = PyDict::new(py);
        for field in self.batch.schema_ref().fields() {
            units.set_item(field.name(), unit(field))?;
        }
        Ok(units)
    }

    /// Number of rows.
    #[getter]
    fn num_rows(&self) -> usize {
        self.batch.num_rows()
    }

    /// The column as something numpy reads without a copy, or as a list of words.
    fn values<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let array = self.column(name)?;
        let numbers = if let Some(real) = array.as_any().downcast_ref::<Float64Array>() {
            Owned::Real(real.values().clone())
        } else if let Some(whole) = array.as_any().downcast_ref::<Int64Array>() {
            Owned::Whole(whole.values().clone())
        } else {
            return match values(array) {
                Values::Text(words) => words.into_pyobject(py),
                _ => Ok(py.None().into_bound(py)),
            };
        };
        Ok(Bound::new(py, Numbers(numbers))?.into_any())
    }

    /// Arrow PyCapsule interface: the type of a row.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema_ref().as_ref());
        PyCapsule::new_with_value(py, schema.map_err(broken)?, c"arrow_schema")
    }

    /// Arrow PyCapsule interface: the rows as one struct array, without a copy.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_array__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        // A request is a wish: consumers cast what they get.
        drop(requested_schema);
        let rows = StructArray::from(self.batch.clone());
        let array = FFI_ArrowArray::new(&rows.to_data());
        let schema = self.__arrow_c_schema__(py)?;
        let array = PyCapsule::new_with_value(py, array, c"arrow_array")?;
        PyTuple::new(py, [schema, array])
    }

    /// Arrow PyCapsule interface: the rows as a stream of one batch, without a copy.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        drop(requested_schema);
        let schema = self.batch.schema();
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], schema);
        let stream = FFI_ArrowArrayStream::new(Box::new(batches));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}

fn broken(error: ArrowError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn unit(field: &Field) -> &str {
    field.metadata().get(UNIT).map_or("", String::as_str)
}

/// A column for Arrow. Empty cells, which are NaN, are null; the numbers stay where they are.
fn arrow(column: Column) -> (Field, ArrayRef) {
    let (kind, array): (DataType, ArrayRef) = match column.values {
        Values::Float(list) => {
            let nulls = list.iter().any(|x| x.is_nan()).then(|| {
                let present = BooleanBuffer::collect_bool(list.len(), |k| !list[k].is_nan());
                NullBuffer::new(present)
            });
            let array = Float64Array::new(ScalarBuffer::from(list), nulls);
            (DataType::Float64, Arc::new(array))
        }
        Values::Integer(list) => {
            let array = Int64Array::new(ScalarBuffer::from(list), None);
            (DataType::Int64, Arc::new(array))
        }
        Values::Text(list) => {
            let array = LargeStringArray::from_iter_values(&list);
            (DataType::LargeUtf8, Arc::new(array))
        }
    };
    let metadata = HashMap::from([(UNIT.to_owned(), column.unit)]);
    let field = Field::new(column.name, kind, true).with_metadata(metadata);
    (field, array)
}

/// The values of a column that [`arrow`] made.
fn values(array: &ArrayRef) -> Values {
    let array = array.as_any();
    if let Some(real) = array.downcast_ref::<Float64Array>() {
        Values::Float(real.values().to_vec())
    } else if let Some(whole) = array.downcast_ref::<Int64Array>() {
        Values::Integer(whole.values().to_vec())
    } else {
        let words = array.downcast_ref::<LargeStringArray>();
        let words = words.into_iter().flat_map(|words| words.iter().flatten());
        Values::Text(words.map(str::to_owned).collect())
    }
}

/// Numbers of eight bytes each.
fn eights<T>(plain: &Bound<'_, PyAny>, number: fn([u8; 8]) -> T) -> PyResult<Vec<T>> {
    let plain = plain.cast::<PyBytes>()?;
    let (numbers, rest) = plain.as_bytes().as_chunks::<8>();
    match rest {
        [] => Ok(numbers.iter().map(|bytes| number(*bytes)).collect()),
        _ => Err(PyValueError::new_err("wanted eight bytes per number")),
    }
}

fn bytes<'py>(py: Python<'py>, numbers: impl Iterator<Item = [u8; 8]>) -> Bound<'py, PyBytes> {
    PyBytes::new(py, &numbers.flatten().collect::<Vec<u8>>())
}
