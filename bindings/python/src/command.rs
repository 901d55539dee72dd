//! The command line, behind `python -m isograd`.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs a command line, the first argument of which is the name of the program, and returns the exit status. Ctrl-C
/// ends the process.
#[pyfunction]
pub fn run_command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| isograd_cli::run(arguments))
}
