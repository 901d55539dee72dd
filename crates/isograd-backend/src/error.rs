//! Why there is no plan, no result or no gradient.

use isograd::distance::extend;
use isograd::{Backend, PullbackError, RestoreError};

/// Why there is no plan, no result or no gradient.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A backend that this program was built without.
    #[error("{} is not built into this program", names(*.0).0)]
    NotBuilt(Backend),
    /// Arrays on a device, for the CPU.
    #[cfg(feature = "cuda")]
    #[error("the arrays are on a CUDA device, and the CPU computes: choose the backend cuda")]
    OnDevice,
    /// The grid, the options or a stage.
    #[error(transparent)]
    Reconstruct(#[from] isograd::Error),
    /// Normals or results to restore.
    #[error(transparent)]
    Restore(#[from] RestoreError),
    /// Cotangents.
    #[error(transparent)]
    Pullback(#[from] PullbackError),
    /// An attribute that was to be extended, or what was extended.
    #[error(transparent)]
    Extension(#[from] extend::Error),
    /// A device that can't be had, or that failed.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Device(isograd_gpu::host::Error),
}

impl Error {
    /// Whether another device, or another build, would do: nothing is wrong with what was given.
    pub fn is_of_device(&self) -> bool {
        match self {
            Self::NotBuilt(_) => true,
            #[cfg(feature = "gpu")]
            Self::Device(error) => {
                use isograd_gpu::host::Error as Host;
                matches!(error, Host::Device(_) | Host::Result { .. })
            }
            _ => false,
        }
    }
}

/// The name of what computes, and the feature of Cargo that builds it: `("CUDA", "cuda")`.
pub fn names(backend: Backend) -> (&'static str, &'static str) {
    match backend {
        Backend::Cuda(_) => ("CUDA", "cuda"),
        _ => ("Vulkan", "vulkan"),
    }
}

#[cfg(feature = "gpu")]
impl From<isograd_gpu::host::Error> for Error {
    fn from(error: isograd_gpu::host::Error) -> Self {
        use isograd_gpu::host::Error as Host;
        match error {
            Host::NotBuilt(backend) => Self::NotBuilt(backend),
            Host::Host(error) => Self::Reconstruct(error),
            Host::Interrupted(stage) => isograd::Error::Interrupted(stage).into(),
            Host::Restore(error) => Self::Restore(error),
            Host::Pullback(error) => Self::Pullback(error),
            Host::Extension(error) => Self::Extension(error),
            error => Self::Device(error),
        }
    }
}
