//! Errors of a fit.

use isograd::{PointCloudError, PullbackError};
use isograd_shapes::{SampleError, ShapeError};

use crate::target::TargetError;

/// Error of a fit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Invalid target.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// Invalid shape or parameter values.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// Sampling of the shape failed.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// The points form no valid cloud.
    #[error(transparent)]
    Cloud(#[from] PointCloudError),
    /// The reconstruction failed.
    #[error(transparent)]
    Reconstruct(#[from] isograd::Error),
    /// The pullback failed.
    #[error(transparent)]
    Pullback(#[from] PullbackError),
    /// The backend failed.
    #[error(transparent)]
    Backend(isograd_backend::Error),
    /// No parameter to fit.
    #[error("there is no parameter to fit; name at least one that is not a whole number")]
    NoParameters,
    /// An integer parameter cannot be fitted.
    #[error("{name} is a whole number, which has no derivative; leave it out")]
    Whole {
        /// The parameter.
        name: String,
    },
    /// Invalid value of an option.
    #[error("{what} is {value}; it must be {range}")]
    Option {
        /// The option.
        what: &'static str,
        /// The refused value.
        value: f64,
        /// Allowed range.
        range: &'static str,
    },
    /// No random start is a valid shape.
    #[error(
        "none of {tries} random starts is a valid shape (last error: {source}); use a smaller spread or another seed"
    )]
    NoStart {
        /// Number of starts.
        tries: usize,
        /// Error of the last one.
        source: ShapeError,
    },
    /// The loss at the start cannot be evaluated.
    #[error("the start can't be used: {0}; start nearer to the target, or use a larger grid")]
    Start(#[source] Box<Error>),
    /// Even the shortest step ends in points that cannot be reconstructed.
    #[error(
        "epoch {epoch}: even the shortest step leads to a body that cannot be reconstructed: {source}; use a smaller rate, a larger grid, or another start"
    )]
    Stuck {
        /// The epoch that failed.
        epoch: usize,
        /// Error of the last step.
        source: Box<Error>,
    },
    /// The checkpoint belongs to another fit.
    #[error(
        "the checkpoint belongs to another fit: its {what} differ; use those of the run that wrote it"
    )]
    Resume {
        /// The part that differs.
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
