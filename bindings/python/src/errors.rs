//! Errors of Rust as exceptions of Python, with the same text.

use std::io::ErrorKind;

use pyo3::exceptions::{PyFileNotFoundError, PyIsADirectoryError, PyOSError, PyValueError};
use pyo3::prelude::*;

/// Bad values.
pub fn value(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// What is wrong with a file: the operating system's errors stay what they are, bad content is a `ValueError`.
pub fn file(error: isograd_io::Error) -> PyErr {
    let text = error.to_string();
    match error {
        isograd_io::Error::Read { source, .. } | isograd_io::Error::Write { source, .. } => {
            match source.kind() {
                ErrorKind::NotFound => PyFileNotFoundError::new_err(text),
                _ => PyOSError::new_err(text),
            }
        }
        isograd_io::Error::Folder { .. } => PyIsADirectoryError::new_err(text),
        _ => PyValueError::new_err(text),
    }
}
