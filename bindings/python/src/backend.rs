//! Failures of the computation, as exceptions.

use isograd::Backend;
use isograd_backend::{Error, Plan};
use pyo3::PyErr;
use pyo3::exceptions::{PyRuntimeError, PyValueError};

use crate::arrays::Number;
use crate::settings::Settings;

/// Failure of a computation.
#[derive(Debug)]
pub enum Failure {
    /// Invalid input.
    Value(String),
    /// A device that is unavailable or fails.
    Device(String),
}

impl Failure {
    /// This failure with `context` before its text.
    pub fn with_context(self, context: &str) -> Self {
        match self {
            Self::Value(text) => Self::Value(format!("{context}: {text}")),
            Self::Device(text) => Self::Device(format!("{context}: {text}")),
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Value(text) | Self::Device(text) => f.write_str(text),
        }
    }
}

impl From<String> for Failure {
    fn from(text: String) -> Self {
        Self::Value(text)
    }
}

impl From<&str> for Failure {
    fn from(text: &str) -> Self {
        Self::Value(text.into())
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Value(text) => PyValueError::new_err(text),
            Failure::Device(text) => PyRuntimeError::new_err(text),
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match error {
            Error::NotBuilt(backend) => not_built(backend),
            error if error.is_of_device() => Self::Device(error.to_string()),
            error => Self::Value(error.to_string()),
        }
    }
}

impl From<isograd_fit::Error> for Failure {
    fn from(error: isograd_fit::Error) -> Self {
        match error {
            isograd_fit::Error::Backend(error) => error.into(),
            error => Self::Value(error.to_string()),
        }
    }
}

/// A plan for grid, options and backend.
///
/// # Errors
/// Errors of the grid, the options and the device.
pub fn plan<T: Number>(settings: &Settings) -> Result<Plan<T>, Failure> {
    let grid = settings.grid::<T>();
    let grid = grid.map_err(|error| Failure::Value(error.to_string()))?;
    Ok(Plan::new(settings.backend, grid, settings.options.clone())?)
}

fn not_built(backend: Backend) -> Failure {
    let (name, feature) = isograd_backend::names(backend);
    Failure::Device(format!(
        "this package was built without {name}: build it with `MATURIN_PEP517_ARGS=\"--features pyo3/extension-module,{feature}\" pip install .`, or compute with backend=\"cpu\""
    ))
}
