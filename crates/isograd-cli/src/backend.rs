//! Errors of `--backend`, with what to do.

use std::path::Path;

use isograd::Backend;

use crate::error::Error;

/// Error of a plan for the cloud of the file `path`.
pub fn plan_error(backend: Backend, error: isograd_backend::Error, path: &Path) -> Error {
    match error {
        isograd_backend::Error::NotBuilt(backend) => not_built(backend),
        isograd_backend::Error::Reconstruct(source) => Error::input(path)(source),
        error => Error::Backend { backend, error },
    }
}

/// Error of a fit.
pub fn fit_error(backend: Backend, error: isograd_fit::Error) -> Error {
    match error {
        isograd_fit::Error::Backend(isograd_backend::Error::NotBuilt(backend)) => {
            not_built(backend)
        }
        isograd_fit::Error::Backend(error) => Error::Backend { backend, error },
        error => Error::Fit(error),
    }
}

fn not_built(backend: Backend) -> Error {
    let (name, feature) = isograd_backend::names(backend);
    Error::NotBuilt { name, feature }
}
