//! The threads of a command.

use std::error::Error as _;
use std::num::NonZero;
use std::thread::available_parallelism;

use crate::error::Error;

/// Threads that are started where `--threads` asks for more and the machine has fewer cores. More threads than cores
/// only wait for each other.
pub const MOST: usize = 16;

/// Starts the threads: as many as `--threads` says, otherwise one per core.
///
/// Rayon would start them at their first use, and panic if it can't.
pub fn start(requested: Option<u32>) -> Result<(), Error> {
    let cores = available_parallelism().map_or(1, NonZero::get);
    // 0 is rayon's default: RAYON_NUM_THREADS or one per core.
    let threads = requested.map_or(0, |threads| number(threads as usize, cores));
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    match builder.build_global() {
        // Python may have started them before.
        Err(error) if requested.is_none() && error.source().is_none() => Ok(()),
        result => Ok(result?),
    }
}

/// Number of threads that are started.
fn number(requested: usize, cores: usize) -> usize {
    requested.min(cores.max(MOST))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_threads_are_started_than_are_useful() {
        assert_eq!(number(1, 2), 1);
        assert_eq!(number(8, 2), 8);
        assert_eq!(number(1024, 2), 16);
        assert_eq!(number(1024, 192), 192);
    }
}
