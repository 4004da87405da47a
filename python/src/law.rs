//! A law that is a function in Python: for prototypes.

use gearlash::element::{
    Dimension, Element, InvalidParameter, Parameter, ParameterKind, Response, ResponseSeries, Scale,
};
use gearlash::error::did_you_mean;
use gearlash::serde::{Deserialize, Serialize};
use gearlash::typetag;
use indexmap::IndexMap;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Functions by name.
static FUNCTIONS: Mutex<BTreeMap<String, Py<PyAny>>> = Mutex::new(BTreeMap::new());
/// What a function raised, until somebody hands it on.
static FAILURE: Mutex<Option<PyErr>> = Mutex::new(None);

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes a function a law: `function(q, v, phase, parameters, breakpoints, scales)`, all numbers as bytes, returns force and partials.
#[pyfunction]
pub fn register_law(name: String, function: Py<PyAny>) {
    let earlier = locked(&FUNCTIONS).insert(name, function);
    drop(earlier);
}

/// The exception of a law, if one was raised since the last time.
pub fn failure() -> Option<PyErr> {
    locked(&FAILURE).take()
}

/// A function of Python as a law.
///
///     f = F(q, v, phase) / K
///
/// F: force in N of q in m and v in m/s (N m, rad, rad/s for shafts; nondimensional in reduced models), K: reference stiffness.
/// Partials come from the function's own derivative or from differences that respect the breakpoints.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(crate = "gearlash::serde", deny_unknown_fields)]
pub struct PythonLaw {
    /// Name under which it was registered.
    function: String,
    /// Keyword arguments.
    #[serde(default)]
    parameters: IndexMap<String, f64>,
    /// Displacements at which the force is not smooth, ascending.
    #[serde(default)]
    breakpoints: Vec<f64>,
    #[serde(skip)]
    scale: Scale,
}

gearlash::register_element! {
    tag: "python",
    doc: "f = force/K, the force a function in Python, registered with gearlash.law; for prototypes, tens of microseconds per call",
    parameters: [
        { name: "function", doc: "name given to gearlash.law", kind: ParameterKind::Text, dimension: Dimension::NONE, default: None },
        { name: "parameters", doc: "named numbers, handed over as keyword arguments, in SI units", kind: ParameterKind::Map, dimension: Dimension::NONE, default: Some("{}") },
        { name: "breakpoints", doc: "displacements at which the force is not smooth, ascending", kind: ParameterKind::List, dimension: Dimension::DISPLACEMENT, default: Some("[]") },
    ],
    example: "{type: python, function: f}",
}

impl PythonLaw {
    /// Displacement and velocity in SI units.
    fn inwards(&self, q: f64, v: f64) -> (f64, f64) {
        let mut own = (q, v);
        self.scale.eval(q, v, |q, v| {
            own = (q, v);
            Response::default()
        });
        own
    }

    /// Force and partials in SI units of a series.
    fn call(&self, input: [&[f64]; 3], mut put: impl FnMut(usize, Response)) -> PyResult<()> {
        let scales = self.inwards(1.0, 1.0);
        Python::attach(|py| {
            let function = locked(&FUNCTIONS)
                .get(&self.function)
                .map(|f| f.clone_ref(py));
            let Some(function) = function else {
                let message = format!("no function is registered as `{}`", self.function);
                return Err(PyValueError::new_err(message));
            };
            let [q, v, phase] = input.map(|list| {
                let bytes: Vec<u8> = list.iter().flat_map(|x| x.to_ne_bytes()).collect();
                PyBytes::new(py, &bytes)
            });
            let parameters = PyDict::new(py);
            for (name, value) in &self.parameters {
                parameters.set_item(name, value)?;
            }
            let breakpoints = self.breakpoints.clone();
            let arguments = (q, v, phase, parameters, breakpoints, scales);
            let found = function.bind(py).call1(arguments)?;
            let found = found.extract::<[Bound<'_, PyBytes>; 3]>()?;
            let [f, df_dq, df_dv] = found
                .each_ref()
                .map(|bytes| bytes.as_bytes().as_chunks::<8>().0);
            for (k, ((f, df_dq), df_dv)) in f.iter().zip(df_dq).zip(df_dv).enumerate() {
                let [f, df_dq, df_dv] = [f, df_dq, df_dv].map(|bytes| f64::from_ne_bytes(*bytes));
                put(k, Response { f, df_dq, df_dv });
            }
            Ok(())
        })
    }
}

#[typetag::serde(name = "python")]
impl Element for PythonLaw {
    fn eval(&self, q: f64, v: f64, phase: f64) -> Response {
        let (mut f, mut df_dq, mut df_dv) = ([f64::NAN], [f64::NAN], [f64::NAN]);
        let out = ResponseSeries {
            f: &mut f,
            df_dq: &mut df_dq,
            df_dv: &mut df_dv,
        };
        self.eval_many(&[q], &[v], &[phase], out);
        Response {
            f: f[0],
            df_dq: df_dq[0],
            df_dv: df_dv[0],
        }
    }

    fn eval_many(&self, q: &[f64], v: &[f64], phase: &[f64], out: ResponseSeries<'_>) {
        let own = q.iter().zip(v).map(|(q, v)| self.inwards(*q, *v));
        let (own_q, own_v): (Vec<f64>, Vec<f64>) = own.unzip();
        let ResponseSeries { f, df_dq, df_dv } = out;
        let outcome = self.call([&own_q, &own_v, phase], |k, own| {
            let r = self.scale.eval(0.0, 0.0, |_, _| own);
            (f[k], df_dq[k], df_dv[k]) = (r.f, r.df_dq, r.df_dv);
        });
        if let Err(error) = outcome {
            f.fill(f64::NAN);
            df_dq.fill(f64::NAN);
            df_dv.fill(f64::NAN);
            locked(&FAILURE).get_or_insert(error);
            // Nothing that is computed from here on matters.
            gearlash::interrupt::current().request();
        }
    }

    fn visit_parameters(&mut self, visit: &mut dyn FnMut(Parameter<'_>)) {
        for (k, value) in self.parameters.values_mut().enumerate() {
            let dimension = Dimension::NONE;
            visit(Parameter {
                name: "parameters",
                index: Some(k),
                dimension,
                value,
            });
        }
    }

    fn scale_mut(&mut self) -> Option<&mut Scale> {
        Some(&mut self.scale)
    }

    fn clone_box(&self) -> Box<dyn Element> {
        Box::new(self.clone())
    }

    fn breakpoints(&self) -> Vec<f64> {
        let levels = self.breakpoints.iter();
        levels.map(|b| self.scale.outwards(*b)).collect()
    }

    fn validate(&self) -> Result<(), InvalidParameter> {
        let known: Vec<String> = locked(&FUNCTIONS).keys().cloned().collect();
        if !known.contains(&self.function) {
            let message = format!(
                "no function is registered as `{}` in this process; gearlash.law registers one; {}",
                self.function,
                did_you_mean(&self.function, &known)
            );
            return Err(InvalidParameter::about("function", message));
        }
        let is_sorted = self.breakpoints.is_sorted_by(|a, b| a < b);
        if !is_sorted || self.breakpoints.iter().any(|b| !b.is_finite()) {
            let message = "must be finite and ascending";
            return Err(InvalidParameter::about("breakpoints", message));
        }
        Ok(())
    }
}
