//! Why a command failed, and the exit status that says so.

use isograd::{GridError, MeshError, PointCloudError};
use isograd_shapes::{SampleError, ShapeError};

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line asks for something that makes no sense.
    #[error("{0}")]
    Usage(String),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] isograd_io::Error),
    /// The cloud in a file can't be used.
    #[error("{file}: {source}")]
    Cloud {
        /// The file.
        file: String,
        /// What is wrong.
        source: PointCloudError,
    },
    /// The mesh in a file can't be used.
    #[error("{file}: {source}")]
    Mesh {
        /// The file.
        file: String,
        /// What is wrong.
        source: MeshError,
    },
    /// No grid can be laid round the cloud.
    #[error("{file}: {source}")]
    Grid {
        /// The file.
        file: String,
        /// What is wrong.
        source: GridError,
    },
    /// A stage failed.
    #[error("{file}: {source}")]
    Reconstruct {
        /// The file.
        file: String,
        /// What is wrong.
        source: isograd::Error,
    },
    /// Distances to a mesh can't be taken.
    #[error("{file}: {source}")]
    Distance {
        /// The file.
        file: String,
        /// What is wrong.
        source: isograd::distance::Error,
    },
    /// The shape is not there, or not with these parameters.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A shape could not be sampled.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// The grid needs more memory than there is.
    #[error(
        "a grid of {shape:?} cells needs about {needed:.1} GiB, and {available:.1} GiB are free; use a lower resolution, a larger spacing or tighter bounds"
    )]
    Memory {
        /// Cells along each axis.
        shape: [usize; 3],
        /// GiB.
        needed: f64,
        /// GiB.
        available: f64,
    },
    /// The threads could not be started.
    #[error("the threads could not be started: {0}; use fewer")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl Error {
    /// 2 where the command line is wrong, else 1.
    pub fn status(&self) -> u8 {
        match self {
            Self::Usage(_) | Self::Shape(_) => 2,
            _ => 1,
        }
    }
}
