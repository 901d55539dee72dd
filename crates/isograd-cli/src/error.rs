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
    /// Gradients could not be compared.
    #[error("{file}: {source}")]
    Gradcheck {
        /// The file.
        file: String,
        /// What is wrong.
        source: isograd::gradcheck::CheckError,
    },
    /// Gradients are not what they should be.
    #[error(
        "{file}: the pullback is off from a small step by {off:.1e} ({motion}), more than {tolerance:.1e}; look at the counts of that row: what changed on the way has no derivative"
    )]
    Gradients {
        /// The file.
        file: String,
        /// The worst motion.
        motion: &'static str,
        /// Its relative error.
        off: f64,
        /// What was allowed.
        tolerance: f64,
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
    /// A target can't be used.
    #[error("{file}: {source}")]
    Target {
        /// The file.
        file: String,
        /// What is wrong.
        source: isograd_fit::TargetError,
    },
    /// A fit failed.
    #[error(transparent)]
    Fit(#[from] isograd_fit::Error),
    /// A checkpoint can't be used.
    #[error("{file}: {problem}")]
    Checkpoint {
        /// The file.
        file: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// Ctrl-C, and all that is to be kept is kept.
    #[error("stopped after epoch {epoch}; go on with --resume {file}")]
    Stopped {
        /// The last epoch that was done.
        epoch: usize,
        /// The checkpoint.
        file: String,
    },
    /// A backend that this program was built without.
    #[error(
        "this program was built without {name}: build it with `cargo install --path crates/isograd-cli --features {feature}`, or give --backend cpu"
    )]
    NotBuilt {
        /// Its name.
        name: &'static str,
        /// The feature of Cargo that builds it.
        feature: &'static str,
    },
    /// A backend that can't be had, or not with these options.
    #[error("--backend {backend}: {error}")]
    Backend {
        /// What was asked for.
        backend: isograd::Backend,
        /// What is wrong.
        error: isograd_backend::Error,
    },
    /// A device failed.
    #[error("{file}: {source}")]
    Device {
        /// The file.
        file: String,
        /// What is wrong.
        source: isograd_backend::Error,
    },
    /// The threads could not be started.
    #[error("the threads could not be started: {0}; use fewer")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl Error {
    /// 2 where the command line is wrong, 130 after Ctrl-C, else 1.
    pub fn status(&self) -> u8 {
        use isograd_fit::Error as Fit;
        match self {
            Self::Usage(_) | Self::Shape(_) => 2,
            Self::Fit(Fit::NoParameters | Fit::Whole { .. } | Fit::Option { .. }) => 2,
            Self::Fit(Fit::Shape(_) | Fit::NoStart { .. }) => 2,
            Self::Stopped { .. } => crate::interrupt::STATUS as u8,
            _ => 1,
        }
    }
}
