//! Why a fit failed.

use isograd::{PointCloudError, PullbackError};
use isograd_shapes::{SampleError, ShapeError};

use crate::target::TargetError;

/// Why a fit failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The target.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The shape, or values of its parameters.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// The shape could not be sampled.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// The points make no cloud.
    #[error(transparent)]
    Cloud(#[from] PointCloudError),
    /// The points make no field.
    #[error(transparent)]
    Reconstruct(#[from] isograd::Error),
    /// The pullback.
    #[error(transparent)]
    Pullback(#[from] PullbackError),
    /// The backend.
    #[error(transparent)]
    Backend(isograd_backend::Error),
    /// Nothing may change.
    #[error("no parameter is left to fit; name at least one that is not a whole number")]
    NoParameters,
    /// A whole number can't be fitted.
    #[error("{name} is a whole number, in which nothing is differentiable; leave it out")]
    Whole {
        /// The parameter.
        name: String,
    },
    /// An option that makes no sense.
    #[error("{what} is {value}; it must be {range}")]
    Option {
        /// The option.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// No random start makes a body.
    #[error(
        "none of {tries} random starts makes a body, the last because: {source}; use a smaller spread or another seed"
    )]
    NoStart {
        /// How many were tried.
        tries: usize,
        /// Why the last one does not.
        source: ShapeError,
    },
    /// The loss at the start can't be taken.
    #[error("the start can't be used: {0}; start nearer to the target, or use a larger grid")]
    Start(#[source] Box<Error>),
    /// Every step ends in a point without a field.
    #[error(
        "epoch {epoch}: no step, however short, leads to a body that can be reconstructed: {source}; use a smaller rate, a larger grid, or another start"
    )]
    Stuck {
        /// The epoch that failed.
        epoch: usize,
        /// Why the last one failed.
        source: Box<Error>,
    },
    /// The state is of another fit.
    #[error(
        "the state to resume is of another fit: its {what} differ; give the same as in the run that wrote it"
    )]
    Resume {
        /// What differs.
        what: &'static str,
    },
}

impl From<isograd_backend::Error> for Error {
    fn from(error: isograd_backend::Error) -> Self {
        match error {
            isograd_backend::Error::Reconstruct(error) => Self::Reconstruct(error),
            isograd_backend::Error::Pullback(error) => Self::Pullback(error),
            error => Self::Backend(error),
        }
    }
}
