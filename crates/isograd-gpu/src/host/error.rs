//! Why a host gets nothing.

use isograd::distance::extend;
use isograd::{Backend, PointCloudError, PullbackError, RestoreError, Stage};

use crate::pipeline;

/// Why there is no plan, no result or no gradient.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// This program has no such backend.
    #[error("{0} is not built into this program")]
    NotBuilt(Backend),
    /// A choice that is no device.
    #[error("{0} is no device; give cuda or vulkan")]
    NoDevice(Backend),
    /// The device.
    #[error(transparent)]
    Device(#[from] crate::Error),
    /// The device's stages.
    #[error(transparent)]
    Pipeline(pipeline::Error),
    /// What the CPU says of the same cloud.
    #[error(transparent)]
    Host(#[from] isograd::Error),
    /// Cotangents.
    #[error(transparent)]
    Pullback(#[from] PullbackError),
    /// What was saved makes no result.
    #[error(transparent)]
    Restore(#[from] RestoreError),
    /// What was saved makes no cloud.
    #[error(transparent)]
    Cloud(#[from] PointCloudError),
    /// An attribute that was to be extended, or what was extended.
    #[error(transparent)]
    Extension(#[from] extend::Error),
    /// Stopped by the observer.
    #[error("stopped before the stage '{}'", .0.name())]
    Interrupted(Stage),
    /// What came back from the device makes no result.
    #[error("{device} gave a result that is none ({reason}); compute on the CPU")]
    Result {
        /// Its name.
        device: String,
        /// What is wrong.
        reason: String,
    },
}

impl From<pipeline::Error> for Error {
    fn from(error: pipeline::Error) -> Self {
        match error {
            pipeline::Error::Device(error) => Self::Device(error),
            pipeline::Error::Interrupted(stage) => Self::Interrupted(stage),
            pipeline::Error::Neighbors(error) => Self::Host(error.into()),
            pipeline::Error::Orient(error) => Self::Host(error.into()),
            pipeline::Error::Extension(error) => Self::Extension(error),
            error => Self::Pipeline(error),
        }
    }
}
