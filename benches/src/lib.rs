//! Measurements of isograd: the programs of this package write their results as JSON, from which `benches/pages`
//! renders the pages below `docs/`.

pub mod accuracy;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod gradients;
pub mod orientation;
pub mod output;
pub mod sampling;
pub mod scaling;
pub mod statistics;
pub mod timing;
pub mod torus;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Cells along each axis.
pub const CELLS: [usize; 4] = [32, 64, 128, 256];

/// Numbers of points.
pub const POINTS: [usize; 4] = [1_000, 10_000, 100_000, 1_000_000];

/// Numbers of threads.
pub const THREADS: [usize; 2] = [1, 2];

/// A pool of `threads` threads.
///
/// # Panics
/// If the system refuses a thread: nothing can be measured then.
pub fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads to measure with")
}
