//! What `--backend` can't do, and what to do then.

use isograd::Backend;

use crate::error::Error;

/// Why there is no plan for the cloud of `file`.
pub fn plan_error(backend: Backend, error: isograd_backend::Error, file: &str) -> Error {
    let file = file.into();
    match error {
        isograd_backend::Error::NotBuilt(backend) => not_built(backend),
        isograd_backend::Error::Reconstruct(source) => Error::Reconstruct { file, source },
        error => Error::Backend { backend, error },
    }
}

/// Why a plan makes nothing of the cloud of `file`.
pub fn run_error(error: isograd_backend::Error, file: &str) -> Error {
    let file = file.into();
    match error {
        isograd_backend::Error::Reconstruct(source) => Error::Reconstruct { file, source },
        source => Error::Device { file, source },
    }
}

/// Why there is no fit.
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
