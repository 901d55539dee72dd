//! Custom calls for XLA, which is how `isograd.jax` gets into compiled programs, without any C++.
//!
//! A *target* is a pure function on arrays. XLA calls it through [`api`]; PyTorch, and JAX where XLA can't, call it from
//! Python by [`call_target`].

mod api;
mod buffers;
mod common;
#[cfg(feature = "cuda")]
mod cuda;
mod extend;
mod field;
mod mesh;
mod orient;
mod query;
mod surface;

use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyReadwriteArrayDyn};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::backend::Failure;
use crate::{background, threads};
use buffers::{Array, Batch, Call, Data, DataMut};
use common::Float;

/// A pure function on arrays.
trait Target {
    /// Its name in compiled programs.
    const NAME: &'static str;

    /// Whether it computes on the backend that the settings name, not always on the CPU.
    #[cfg(feature = "cuda")]
    const HAS_BACKEND: bool = true;

    /// The function of one cloud, in one number type.
    ///
    /// # Errors
    /// Errors of the arrays, the settings and the stages.
    fn run<T: Float>(call: Call<'_>) -> Result<(), Failure>;

    /// The function of a batch, in the number type of its first input.
    fn run_batch(batch: Batch<'_>) -> Result<(), Failure> {
        run_each(batch, Self::run::<f64>, Self::run::<f32>)
    }

    /// [`Self::run_batch`] with arrays on a CUDA device: by copies in the host's memory, unless a target does better.
    #[cfg(feature = "cuda")]
    fn run_on_cuda(batch: Batch<'_>) -> Result<(), Failure> {
        if Self::HAS_BACKEND {
            cuda::check_backend(batch.settings)?;
        }
        cuda::by_copies(batch, Self::run_batch)
    }
}

/// Runs the function of the number type of the points for each cloud of a batch, on the package's threads.
fn run_each(
    batch: Batch<'_>,
    double: fn(Call<'_>) -> Result<(), Failure>,
    single: fn(Call<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let is_double = batch.is_double();
    threads::install(|| batch.for_each(if is_double { double } else { single }))
}

/// A target: its function for XLA and its function for Python.
struct Entry {
    name: &'static str,
    handler: api::Handler,
    call: fn(Batch<'_>) -> Result<(), Failure>,
    #[cfg(feature = "cuda")]
    handler_on_cuda: api::Handler,
    #[cfg(feature = "cuda")]
    call_on_cuda: fn(Batch<'_>) -> Result<(), Failure>,
}

impl Entry {
    const fn of<W: Target>() -> Self {
        Self {
            name: W::NAME,
            handler: api::handler::<W>,
            call: W::run_batch,
            #[cfg(feature = "cuda")]
            handler_on_cuda: api::handler_on_cuda::<W>,
            #[cfg(feature = "cuda")]
            call_on_cuda: W::run_on_cuda,
        }
    }
}

const TARGETS: &[Entry] = &[
    Entry::of::<field::Forward>(),
    Entry::of::<field::Pullback>(),
    Entry::of::<query::Forward>(),
    Entry::of::<query::Pullback>(),
    Entry::of::<mesh::Forward>(),
    Entry::of::<mesh::Pullback>(),
    Entry::of::<extend::Forward>(),
    Entry::of::<extend::Pullback>(),
    Entry::of::<orient::Forward>(),
    Entry::of::<surface::Forward>(),
    Entry::of::<surface::Pullback>(),
];

/// `{platform: {name: capsule}}` for `jax.ffi.register_ffi_target`.
#[pyfunction]
pub fn xla_targets(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let platforms = PyDict::new(py);
    let targets = |handler: fn(&Entry) -> api::Handler| -> PyResult<_> {
        let targets = PyDict::new(py);
        for target in TARGETS {
            targets.set_item(target.name, api::capsule(py, handler(target))?)?;
        }
        Ok(targets)
    };
    platforms.set_item("cpu", targets(|target| target.handler)?)?;
    #[cfg(feature = "cuda")]
    platforms.set_item("CUDA", targets(|target| target.handler_on_cuda)?)?;
    Ok(platforms)
}

fn find(name: &str) -> PyResult<&'static Entry> {
    let target = TARGETS.iter().find(|target| target.name == name);
    target.ok_or_else(|| PyValueError::new_err(format!("no target '{name}'")))
}

/// Calls a target with NumPy arrays, and writes its results into `outputs`: float32, float64 or uint32, in C
/// order.
#[pyfunction]
#[pyo3(signature = (name, inputs, outputs, settings, band=None, inside=false))]
pub fn call_target(
    py: Python<'_>,
    name: &str,
    inputs: Vec<Bound<'_, PyAny>>,
    outputs: Vec<Bound<'_, PyAny>>,
    settings: &str,
    band: Option<f64>,
    inside: bool,
) -> PyResult<()> {
    background::check_process()?;
    let target = find(name)?;
    let inputs = inputs.iter().map(Readable::new);
    let inputs = inputs.collect::<PyResult<Vec<_>>>()?;
    let outputs = outputs.iter().map(Writable::new);
    let mut outputs = outputs.collect::<PyResult<Vec<_>>>()?;
    let batch = Batch {
        settings,
        band,
        inside,
        inputs: inputs
            .iter()
            .map(Readable::array)
            .collect::<PyResult<_>>()?,
        outputs: outputs
            .iter_mut()
            .map(Writable::array)
            .collect::<PyResult<_>>()?,
    };
    call(py, target.call, batch)
}

/// Calls a function with the interpreter released.
fn call(
    py: Python<'_>,
    target: fn(Batch<'_>) -> Result<(), Failure>,
    batch: Batch<'_>,
) -> PyResult<()> {
    let result = py.detach(|| background::guard(|| target(batch)));
    Ok(result.map_err(PyRuntimeError::new_err)??)
}

/// Calls a target with arrays on a CUDA device, each as its address, its shape and the name of its type. `stream` is the
/// one in which they are made and used, 0 for the default.
#[cfg(feature = "cuda")]
#[pyfunction]
#[pyo3(signature = (name, inputs, outputs, stream, settings, band=None, inside=false))]
#[allow(clippy::too_many_arguments)] // as Python passes them
pub fn call_target_on_cuda(
    py: Python<'_>,
    name: &str,
    inputs: Vec<(u64, Vec<usize>, String)>,
    outputs: Vec<(u64, Vec<usize>, String)>,
    stream: usize,
    settings: &str,
    band: Option<f64>,
    inside: bool,
) -> PyResult<()> {
    background::check_process()?;
    let target = find(name)?;
    let pointer = |address, dims: &[usize], kind: &str| {
        api::pointer(address, dims, kind, stream).ok_or_else(wrong_type)
    };
    let inputs = inputs.into_iter().map(|(address, dims, kind)| {
        let data = Data::OnDevice(pointer(address, &dims, &kind)?);
        Ok(Array { dims, data })
    });
    let outputs = outputs.into_iter().map(|(address, dims, kind)| {
        let data = DataMut::OnDevice(pointer(address, &dims, &kind)?);
        Ok(Array { dims, data })
    });
    let batch = Batch {
        settings,
        band,
        inside,
        inputs: inputs.collect::<PyResult<_>>()?,
        outputs: outputs.collect::<PyResult<_>>()?,
    };
    call(py, target.call_on_cuda, batch)
}

/// A NumPy array as an input.
enum Readable<'py> {
    F32(PyReadonlyArrayDyn<'py, f32>),
    F64(PyReadonlyArrayDyn<'py, f64>),
    U32(PyReadonlyArrayDyn<'py, u32>),
}

/// A NumPy array as an output.
enum Writable<'py> {
    F32(PyReadwriteArrayDyn<'py, f32>),
    F64(PyReadwriteArrayDyn<'py, f64>),
    U32(PyReadwriteArrayDyn<'py, u32>),
}

macro_rules! array {
    ($enum:ident, $data:ident, $array:expr, $slice:ident) => {
        Ok(match $array {
            $enum::F32(array) => Array {
                dims: array.as_array().shape().to_vec(),
                data: $data::F32(array.$slice()?),
            },
            $enum::F64(array) => Array {
                dims: array.as_array().shape().to_vec(),
                data: $data::F64(array.$slice()?),
            },
            $enum::U32(array) => Array {
                dims: array.as_array().shape().to_vec(),
                data: $data::U32(array.$slice()?),
            },
        })
    };
}

impl<'py> Readable<'py> {
    fn new(array: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = array.extract() {
            Ok(Self::F32(array))
        } else if let Ok(array) = array.extract() {
            Ok(Self::F64(array))
        } else {
            array.extract().map(Self::U32).map_err(|_| wrong_type())
        }
    }

    fn array(&self) -> PyResult<Array<Data<'_>>> {
        array!(Self, Data, self, as_slice)
    }
}

impl<'py> Writable<'py> {
    fn new(array: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Ok(array) = array.cast::<PyArrayDyn<f32>>() {
            Ok(Self::F32(array.try_readwrite()?))
        } else if let Ok(array) = array.cast::<PyArrayDyn<f64>>() {
            Ok(Self::F64(array.try_readwrite()?))
        } else {
            let array = array.cast::<PyArrayDyn<u32>>();
            Ok(Self::U32(array.map_err(|_| wrong_type())?.try_readwrite()?))
        }
    }

    fn array(&mut self) -> PyResult<Array<DataMut<'_>>> {
        array!(Self, DataMut, self, as_slice_mut)
    }
}

fn wrong_type() -> PyErr {
    PyTypeError::new_err("an array is not of float32, float64 or uint32")
}
