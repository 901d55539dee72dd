//! Errors of the front for hosts.

use isograd::distance::extend;
use isograd::{Backend, PointCloudError, PullbackError, RestoreError, Stage, SurfaceResolution};

use crate::pipeline;

/// Errors of plans, results and gradients.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// This program has no such backend.
    #[error("{0} is not built into this program")]
    NotBuilt(Backend),
    /// A choice that is no device.
    #[error("{0} is no device; give cuda or vulkan")]
    NoDevice(Backend),
    /// A surface on a grid other than that of φ.
    #[error(
        "the surface is {0:?}; a device finds it on the grid of φ only: give 'grid', or compute on the CPU"
    )]
    Surface(SurfaceResolution),
    /// A sparse solve.
    #[error("a device has no sparse solve: give 'auto' or 'dense', or compute on the CPU")]
    Sparse,
    /// Closed walls.
    #[error(
        "the walls are 'closed', which a device does not have: give 'free' or 'auto', or compute on the CPU"
    )]
    Walls,
    /// The paper's weights of normals.
    #[error(
        "a device does not have the weights of a radius 'cut:{0}': give the radius alone, or compute on the CPU"
    )]
    Radius(f64),
    /// Trimmed surfaces and sheets.
    #[error("a device has neither trim nor sheet: give 'off' for both, or compute on the CPU")]
    Open,
    /// The device.
    #[error(transparent)]
    Device(#[from] crate::Error),
    /// The device's stages.
    #[error(transparent)]
    Pipeline(pipeline::Error),
    /// An error that the CPU reports for such a cloud too.
    #[error(transparent)]
    Host(#[from] isograd::Error),
    /// Cotangents.
    #[error(transparent)]
    Pullback(#[from] PullbackError),
    /// Saved data that do not match the plan.
    #[error(transparent)]
    Restore(#[from] RestoreError),
    /// Saved normals that do not match the cloud.
    #[error(transparent)]
    Cloud(#[from] PointCloudError),
    /// An attribute that was to be extended, or what was extended.
    #[error(transparent)]
    Extension(#[from] extend::Error),
    /// Stopped by the observer.
    #[error("stopped before the stage '{}'", .0.name())]
    Interrupted(Stage),
    /// Invalid results from the device.
    #[error("{device} gave a result that is none ({reason}); compute on the CPU")]
    Result {
        /// Its name.
        device: String,
        /// Reason.
        reason: String,
    },
}

impl From<pipeline::Error> for Error {
    fn from(error: pipeline::Error) -> Self {
        match error {
            pipeline::Error::Device(error) => Self::Device(error),
            pipeline::Error::Interrupted(stage) => Self::Interrupted(stage),
            pipeline::Error::Samples(error) => Self::Host(error),
            pipeline::Error::Extension(error) => Self::Extension(error),
            error => Self::Pipeline(error),
        }
    }
}
