//! NumPy arrays to slices and back. `isograd._arrays` makes them float32 or float64, C-contiguous, aligned and of the
//! native byte order; other arrays are errors here, and never reinterpreted.

use isograd::{Mesh, PointCloud, Real};
use numpy::{
    Element, PyArray1, PyArray2, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArray2, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::errors::value;

/// Number type of the library and of NumPy.
pub trait Number: Real + isograd_backend::Number + Element {}
impl Number for f32 {}
impl Number for f64 {}

/// The two number types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dtype {
    /// `float32`
    F32,
    /// `float64`
    F64,
}

/// A value for one of the two number types.
pub enum Either<S, D> {
    /// `float32`
    F32(S),
    /// `float64`
    F64(D),
}

/// Expands an expression, of any type, for both cases of [`Either`].
macro_rules! each {
    ($of:expr, $this:ident => $body:expr) => {
        match $of {
            $crate::arrays::Either::F32($this) => $body,
            $crate::arrays::Either::F64($this) => $body,
        }
    };
}
pub(crate) use each;

/// Expands an expression with `$number` as the number type of an array. Errors are returned from the function around it.
macro_rules! by_dtype {
    ($array:expr, $name:literal, $number:ident => $body:expr) => {
        match $crate::arrays::dtype($array, $name)? {
            $crate::arrays::Dtype::F32 => {
                type $number = f32;
                $body
            }
            $crate::arrays::Dtype::F64 => {
                type $number = f64;
                $body
            }
        }
    };
}
pub(crate) use by_dtype;

/// The number type of an array.
///
/// # Errors
/// Another type.
pub fn dtype(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Dtype> {
    let untyped = array.cast::<PyUntypedArray>();
    let untyped =
        untyped.map_err(|_| PyTypeError::new_err(format!("{name} is not a NumPy array")))?;
    let (py, dtype) = (array.py(), untyped.dtype());
    if dtype.is_equiv_to(&numpy::dtype::<f32>(py)) {
        Ok(Dtype::F32)
    } else if dtype.is_equiv_to(&numpy::dtype::<f64>(py)) {
        Ok(Dtype::F64)
    } else {
        Err(PyTypeError::new_err(format!(
            "{name} is of {dtype}; give float32 or float64"
        )))
    }
}

/// A copy of an `(N, 3)` array.
///
/// # Errors
/// Another type or shape.
pub fn vectors<T: Number>(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[T; 3]>> {
    let array = array.extract::<PyReadonlyArray2<'_, T>>();
    let array = array.map_err(|_| wrong_type(name, "(N, 3)", T::NAME))?;
    if array.shape()[1] != 3 {
        return Err(PyValueError::new_err(format!(
            "{name} has the shape {:?} and must have (N, 3)",
            array.shape()
        )));
    }
    let values = array.as_slice().map_err(|_| not_contiguous(name))?;
    Ok(values.as_chunks::<3>().0.to_vec())
}

/// A copy of an `(N, 3)` array of either type, in double precision.
///
/// # Errors
/// Another type or shape.
pub fn widened(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    match dtype(array, name)? {
        Dtype::F64 => vectors::<f64>(array, name),
        Dtype::F32 => {
            let values = vectors::<f32>(array, name)?;
            Ok(values.into_iter().map(|v| v.map(f64::from)).collect())
        }
    }
}

/// A mesh from `(V, 3)` vertices and `(F, 3)` faces.
///
/// # Errors
/// Another type or shape, and faces with invalid vertex indices.
pub fn mesh<T: Number>(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>) -> PyResult<Mesh<T>> {
    let corners = indices(faces, "faces")?;
    let faces = corners.as_chunks::<3>().0.to_vec();
    Mesh::new(vectors(vertices, "vertices")?, faces).map_err(value)
}

/// A copy of an array of any shape, in C order.
///
/// # Errors
/// Another type, or memory in another order.
pub fn values<T: Number>(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<T>> {
    let array = array.extract::<PyReadonlyArrayDyn<'_, T>>();
    let array = array.map_err(|_| wrong_type(name, "any shape", T::NAME))?;
    Ok(array.as_slice().map_err(|_| not_contiguous(name))?.to_vec())
}

/// A copy of `(N,)` indices.
///
/// # Errors
/// Another type or shape.
pub fn indices(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<u32>> {
    if let Ok(flat) = array.extract::<PyReadonlyArray1<'_, u32>>() {
        return Ok(flat.as_slice().map_err(|_| not_contiguous(name))?.to_vec());
    }
    let array = array.extract::<PyReadonlyArrayDyn<'_, u32>>();
    let array = array.map_err(|_| wrong_type(name, "any shape", "uint32"))?;
    Ok(array.as_slice().map_err(|_| not_contiguous(name))?.to_vec())
}

fn wrong_type(name: &str, shape: &str, type_name: &str) -> PyErr {
    PyValueError::new_err(format!(
        "{name} must be an array of shape {shape} and type {type_name}, as the points are"
    ))
}

fn not_contiguous(name: &str) -> PyErr {
    PyValueError::new_err(format!(
        "{name} is not C-contiguous; pass numpy.ascontiguousarray({name})"
    ))
}

/// A new array of the given shape from its values in C order.
///
/// # Errors
/// Another number of values than the shape has.
pub fn shaped<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    shape: impl numpy::ndarray::IntoDimension,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any())
}

/// A new `(N, 3)` array.
pub fn from_vectors<'py, E: Element + Copy>(
    py: Python<'py>,
    values: &[[E; 3]],
) -> Bound<'py, PyAny> {
    let flat = PyArray1::from_slice(py, values.as_flattened());
    match flat.reshape([values.len(), 3]) {
        Ok(array) => array.into_any(),
        // The numbers of values are equal, so this is unreachable.
        Err(_) => PyArray2::<E>::zeros(py, [0, 3], false).into_any(),
    }
}

/// Name and new `(N, components)` array of each attribute of a cloud.
///
/// # Errors
/// None, unless Python fails.
pub fn attributes<'py, T: Number>(
    py: Python<'py>,
    cloud: &PointCloud<T>,
) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let array = |attribute: &isograd::Attribute<T>| {
        let shape = [cloud.len(), attribute.components];
        let values = shaped(py, attribute.values.clone(), shape)?;
        Ok((attribute.name.clone(), values))
    };
    cloud.attributes().iter().map(array).collect()
}
