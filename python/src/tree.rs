//! Trees of Python objects and of JSON values, to the bit.

use super::failure::refused;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use serde_json::{Map, Number, Value};

/// Levels of a tree: deeper ones are circles or mistakes.
const DEEPEST: usize = 64;
/// Values of a tree: far above every model, and soon reached by a list that holds itself many times.
const MOST: usize = 3_000_000;

/// A Python object as a tree: dicts with text keys, lists, tuples, numbers, texts, None, and what numpy and pandas have of these.
///
/// # Errors
/// `ModelError` with the path of what is something else.
pub fn from_python(object: &Bound<'_, PyAny>) -> PyResult<Value> {
    Reader { left: MOST }.value(object, "", DEEPEST)
}

struct Reader {
    left: usize,
}

impl Reader {
    fn value(&mut self, object: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Value> {
        let refuse = |message: String| refused(object.py(), path, message);
        if depth == 0 {
            return Err(refuse(format!("nested deeper than {DEEPEST} levels")));
        }
        if self.left == 0 {
            return Err(refuse(format!("more than {MOST} values")));
        }
        self.left -= 1;
        if object.is_none() {
            return Ok(Value::Null);
        }
        if let Ok(truth) = object.cast::<PyBool>() {
            return Ok(Value::Bool(truth.is_true()));
        }
        if object.cast::<PyFloat>().is_ok() || object.cast::<PyInt>().is_ok() {
            return number(object).map_err(refuse);
        }
        if let Ok(text) = object.cast::<PyString>() {
            let text = text.extract::<String>();
            return text
                .map(Value::String)
                .map_err(|_| refuse("a text that is no valid Unicode".into()));
        }
        if let Ok(dict) = object.cast::<PyDict>() {
            return self.map(dict, path, depth);
        }
        if let Ok(list) = object.cast::<PyList>() {
            return self.list(list.iter(), path, depth);
        }
        if let Ok(tuple) = object.cast::<PyTuple>() {
            return self.list(tuple.iter(), path, depth);
        }
        // Arrays and scalars of numpy, series of pandas; of polars.
        for method in ["tolist", "to_list"] {
            if object.hasattr(method)? {
                let plain = object.call_method0(method)?;
                return self.value(&plain, path, depth - 1);
            }
        }
        let kind = object.get_type().qualname()?;
        Err(refuse(format!(
            "found an object of type `{kind}`, wanted a number, a text such as \"50 um\", a dict or a list"
        )))
    }

    fn map(&mut self, dict: &Bound<'_, PyDict>, path: &str, depth: usize) -> PyResult<Value> {
        let mut map = Map::new();
        for (key, value) in dict.iter() {
            let Ok(name) = key.extract::<String>() else {
                let found = key.repr().map_or(String::new(), |text| text.to_string());
                let message = format!("the key {found} is no text");
                return Err(refused(dict.py(), path, message));
            };
            let value = self.value(&value, &joined(path, &name), depth - 1)?;
            map.insert(name, value);
        }
        Ok(Value::Object(map))
    }

    fn list<'py>(
        &mut self,
        list: impl Iterator<Item = Bound<'py, PyAny>>,
        path: &str,
        depth: usize,
    ) -> PyResult<Value> {
        let entries = list.enumerate().map(|(k, entry)| {
            let own = joined(path, &k.to_string());
            self.value(&entry, &own, depth - 1)
        });
        entries.collect::<PyResult<Vec<_>>>().map(Value::Array)
    }
}

fn joined(path: &str, step: &str) -> String {
    match path {
        "" => step.to_owned(),
        _ => format!("{path}.{step}"),
    }
}

fn number(object: &Bound<'_, PyAny>) -> Result<Value, String> {
    if object.cast::<PyInt>().is_ok() {
        if let Ok(small) = object.extract::<i64>() {
            return Ok(small.into());
        }
        if let Ok(positive) = object.extract::<u64>() {
            return Ok(positive.into());
        }
    }
    let value = object.extract::<f64>().unwrap_or(f64::INFINITY);
    let number = Number::from_f64(value);
    number
        .map(Value::Number)
        .ok_or_else(|| format!("found {value}, wanted a finite number"))
}

/// A tree as Python objects: dict, list, str, int, float, bool, None.
pub fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(truth) => truth.into_pyobject(py)?.to_owned().into_any(),
        Value::Number(number) => match (number.as_i64(), number.as_u64()) {
            (Some(small), _) => small.into_pyobject(py)?.into_any(),
            (None, Some(positive)) => positive.into_pyobject(py)?.into_any(),
            (None, None) => number.as_f64().into_pyobject(py)?.into_any(),
        },
        Value::String(text) => text.into_pyobject(py)?.into_any(),
        Value::Array(list) => {
            let entries = list.iter().map(|entry| to_python(py, entry));
            PyList::new(py, entries.collect::<PyResult<Vec<_>>>()?)?.into_any()
        }
        Value::Object(map) => {
            let dict = PyDict::new(py);
            for (key, entry) in map {
                dict.set_item(key, to_python(py, entry)?)?;
            }
            dict.into_any()
        }
    })
}
