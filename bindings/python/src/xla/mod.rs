//! Custom calls for XLA, which is how `isograd.jax` gets into compiled programs, without any C++.
//!
//! A *target* is a pure function on arrays. XLA calls it through [`api`]; where XLA can't, JAX calls back into
//! Python, which calls the same function by [`call_target`].

mod api;
mod buffers;
mod common;
mod extend;
mod handlers;
mod mesh;
mod query;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::backend::Failure;
use buffers::{Call, Data, DataMut, Input, Output};
use common::Float;

/// A pure function on arrays.
trait Target {
    /// Its name in compiled programs.
    const NAME: &'static str;

    /// The function, for one number type.
    ///
    /// # Errors
    /// What the arrays, the settings or a stage say.
    fn run<T: Float>(call: Call<'_>) -> Result<(), Failure>;

    /// The same, for that of the first input.
    ///
    /// # Errors
    /// As [`Self::run`].
    fn call(call: Call<'_>) -> Result<(), Failure> {
        match call.is_double() {
            true => Self::run::<f64>(call),
            false => Self::run::<f32>(call),
        }
    }
}

/// A target in the two ways in which it is called.
struct Entry {
    name: &'static str,
    handler: api::Handler,
    call: fn(Call<'_>) -> Result<(), Failure>,
}

impl Entry {
    const fn of<W: Target>() -> Self {
        Self {
            name: W::NAME,
            handler: api::handler::<W>,
            call: W::call,
        }
    }
}

const TARGETS: &[Entry] = &[
    Entry::of::<handlers::Forward>(),
    Entry::of::<handlers::Pullback>(),
    Entry::of::<query::Forward>(),
    Entry::of::<query::Pullback>(),
    Entry::of::<mesh::Forward>(),
    Entry::of::<mesh::Pullback>(),
    Entry::of::<extend::Forward>(),
    Entry::of::<extend::Pullback>(),
];

/// `{name: capsule}` for `jax.ffi.register_ffi_target`.
#[pyfunction]
pub fn xla_targets(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let targets = PyDict::new(py);
    for target in TARGETS {
        targets.set_item(target.name, api::capsule(py, target.handler)?)?;
    }
    Ok(targets)
}

/// Calls a target with NumPy arrays, and writes its results into `outputs`: float32, float64 or uint32, in C
/// order.
#[pyfunction]
#[pyo3(signature = (name, inputs, outputs, settings, band=None))]
pub fn call_target(
    py: Python<'_>,
    name: &str,
    inputs: Vec<Bound<'_, PyAny>>,
    outputs: Vec<Bound<'_, PyAny>>,
    settings: &str,
    band: Option<f64>,
) -> PyResult<()> {
    let target = TARGETS.iter().find(|target| target.name == name);
    let target = target.ok_or_else(|| PyValueError::new_err(format!("no target '{name}'")))?;
    let inputs = inputs.iter().map(Readable::of);
    let inputs = inputs.collect::<PyResult<Vec<_>>>()?;
    let outputs = outputs.iter().map(Writable::of);
    let mut outputs = outputs.collect::<PyResult<Vec<_>>>()?;
    let inputs = inputs.iter().map(Readable::input);
    let inputs = inputs.collect::<PyResult<Vec<_>>>()?;
    let outputs = outputs.iter_mut().map(Writable::output);
    let outputs = outputs.collect::<PyResult<Vec<_>>>()?;
    let result = py.detach(|| guard(|| (target.call)(Call::new(settings, band, inputs, outputs))));
    Ok(result.map_err(PyRuntimeError::new_err)??)
}

/// What `work` gives, or what a panic in it said.
fn guard<R>(work: impl FnOnce() -> R) -> Result<R, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic: Box<dyn Any + Send>| {
        let text = panic.downcast_ref::<&str>().map(|s| s.to_string());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        let text = text.unwrap_or_default();
        format!("a defect of isograd, please report it: {text}")
    })
}

enum Readable<'py> {
    F32(PyReadonlyArrayDyn<'py, f32>),
    F64(PyReadonlyArrayDyn<'py, f64>),
    U32(PyReadonlyArrayDyn<'py, u32>),
}

impl<'py> Readable<'py> {
    fn of(array: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = array.extract() {
            Ok(Self::F32(array))
        } else if let Ok(array) = array.extract() {
            Ok(Self::F64(array))
        } else {
            array.extract().map(Self::U32).map_err(|_| refused())
        }
    }

    fn input(&self) -> PyResult<Input<'_>> {
        macro_rules! input {
            ($array:expr, $variant:ident) => {
                Input {
                    dims: $array.as_array().shape().to_vec(),
                    data: Data::$variant($array.as_slice()?),
                }
            };
        }
        Ok(match self {
            Self::F32(array) => input!(array, F32),
            Self::F64(array) => input!(array, F64),
            Self::U32(array) => input!(array, U32),
        })
    }
}

enum Writable<'py> {
    F32(PyReadwriteArrayDyn<'py, f32>),
    F64(PyReadwriteArrayDyn<'py, f64>),
    U32(PyReadwriteArrayDyn<'py, u32>),
}

impl<'py> Writable<'py> {
    fn of(array: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = array.cast::<PyArrayDyn<f32>>() {
            Ok(Self::F32(array.try_readwrite()?))
        } else if let Ok(array) = array.cast::<PyArrayDyn<f64>>() {
            Ok(Self::F64(array.try_readwrite()?))
        } else {
            let array = array.cast::<PyArrayDyn<u32>>();
            Ok(Self::U32(array.map_err(|_| refused())?.try_readwrite()?))
        }
    }

    fn output(&mut self) -> PyResult<Output<'_>> {
        macro_rules! output {
            ($array:expr, $variant:ident) => {
                Output {
                    dims: $array.as_array().shape().to_vec(),
                    data: DataMut::$variant($array.as_slice_mut()?),
                }
            };
        }
        Ok(match self {
            Self::F32(array) => output!(array, F32),
            Self::F64(array) => output!(array, F64),
            Self::U32(array) => output!(array, U32),
        })
    }
}

fn refused() -> PyErr {
    PyTypeError::new_err("an array is not of float32, float64 or uint32")
}
