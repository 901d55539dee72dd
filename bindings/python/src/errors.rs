//! Errors of Rust as exceptions of Python, with the same text.

use std::io::ErrorKind;

use pyo3::exceptions::{PyFileNotFoundError, PyIsADirectoryError, PyOSError, PyValueError};
use pyo3::prelude::*;

/// A `ValueError`.
pub fn value(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The exception for a file: that of the operating system, or a `ValueError` for invalid content.
pub fn file(error: isograd_io::Error) -> PyErr {
    // Names and content of files may hold control characters.
    let text = isograd_io::printable(&error.to_string());
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
