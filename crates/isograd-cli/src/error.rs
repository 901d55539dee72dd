//! Errors of the commands, and their exit status.

use std::path::Path;

use isograd_shapes::{SampleError, ShapeError};

/// 128 + SIGPIPE.
const BROKEN_PIPE: u8 = 141;

/// Error of a command.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line is invalid.
    #[error("{0}")]
    Usage(String),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] isograd_io::Error),
    /// The content of a file can't be used, or the work on it failed.
    #[error("{file}: {source}")]
    Input {
        /// The file.
        file: String,
        /// The cause.
        source: Box<dyn std::error::Error>,
    },
    /// Gradients differ from finite differences by more than the tolerance.
    #[error(
        "{file}: the pullback differs from a small step by {off:.1e} ({motion}), more than {tolerance:.1e}; see the counts of that row: what changed has no derivative"
    )]
    Gradients {
        /// The file.
        file: String,
        /// The worst motion.
        motion: &'static str,
        /// Its relative error.
        off: f64,
        /// The limit.
        tolerance: f64,
    },
    /// The verdict is bad, with `--strict`.
    #[error("{file}: the result is bad, and --strict was given; all outputs were written")]
    Bad {
        /// The file.
        file: String,
    },
    /// Some of several clouds failed; their errors were printed.
    #[error(
        "{failed} of {clouds} clouds failed, as said above; the outputs of the others were written"
    )]
    Clouds {
        /// Number of clouds that failed.
        failed: usize,
        /// Number of clouds.
        clouds: usize,
    },
    /// The verdicts of some of several clouds are bad, with `--strict`.
    #[error(
        "the results of {bad} of {clouds} clouds are bad, and --strict was given; all outputs were written"
    )]
    BadClouds {
        /// Number of clouds with bad results.
        bad: usize,
        /// Number of clouds.
        clouds: usize,
    },
    /// Unknown shape, or invalid parameters.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// A shape could not be sampled.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// A fit failed.
    #[error(transparent)]
    Fit(#[from] isograd_fit::Error),
    /// Ctrl-C or another signal; the state is in a checkpoint.
    #[error("stopped after epoch {epoch}; go on with --resume {file}")]
    Stopped {
        /// The last completed epoch.
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
    /// A backend that is unavailable, or not with these options.
    #[error("--backend {backend}: {error}")]
    Backend {
        /// The requested backend.
        backend: isograd::Backend,
        /// The cause.
        error: isograd_backend::Error,
    },
    /// The threads could not be started.
    #[error(
        "the threads could not be started: {0}; use fewer (--threads N), or raise the limit of memory or processes (ulimit -v, ulimit -u)"
    )]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// Standard output is full, closed, or a pipe without a reader. The files are complete.
    #[error("cannot write to standard output: {0}; redirect it to another place, or use -q")]
    Stdout(std::io::Error),
}

impl Error {
    /// Turns an error in the content of the file `path`, or in the work on it, into one that names the file.
    pub fn input<E: Into<Box<dyn std::error::Error>>>(path: &Path) -> impl FnOnce(E) -> Self {
        let file = file_name(path);
        move |source| Self::Input {
            file,
            source: source.into(),
        }
    }

    /// 2 where the command line is wrong, 3 where the result is bad, 128 and the number of the signal after a signal, of which a pipe without a
    /// reader is one (SIGPIPE), else 1.
    pub fn status(&self) -> u8 {
        use isograd_fit::Error as Fit;
        match self {
            Self::Usage(_) | Self::Shape(_) => 2,
            Self::Fit(Fit::NoParameters | Fit::Whole { .. } | Fit::Option { .. }) => 2,
            Self::Fit(Fit::Shape(_) | Fit::NoStart { .. }) => 2,
            Self::Bad { .. } | Self::BadClouds { .. } => 3,
            Self::Stopped { .. } => crate::interrupt::status(),
            _ if self.is_broken_pipe() => BROKEN_PIPE,
            _ => 1,
        }
    }

    /// Whether other clouds would fail in the same way.
    pub fn is_of_program(&self) -> bool {
        let of_program = matches!(
            self,
            Self::NotBuilt { .. } | Self::Backend { .. } | Self::Stdout(_) | Self::Usage(_)
        );
        of_program || self.is_broken_pipe()
    }

    /// Whether nobody reads the output any more, which needs no message.
    pub fn is_broken_pipe(&self) -> bool {
        let source = match self {
            Self::Stdout(source) | Self::File(isograd_io::Error::Write { source, .. }) => source,
            _ => return false,
        };
        source.kind() == std::io::ErrorKind::BrokenPipe
    }
}

/// Name of a file in messages.
pub fn file_name(path: &Path) -> String {
    match path == Path::new("-") {
        true => "standard input".into(),
        false => path.display().to_string(),
    }
}
