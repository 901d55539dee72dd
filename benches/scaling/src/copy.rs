//! How fast this machine copies.

use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;

/// Values in each of the two arrays: far more than any cache holds.
const VALUES: usize = 1 << 26;

/// Copies of which the fastest counts.
const RUNS: usize = 5;

/// Values that one task copies at a time.
const CHUNK: usize = 1 << 16;

/// Bytes read and written in a second by a copy of a large array with all threads.
pub fn bytes_per_second() -> f64 {
    let from = vec![1f32; VALUES];
    let mut to = vec![0f32; VALUES];
    let mut fastest = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        let chunks = to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK));
        chunks.for_each(|(to, from)| to.copy_from_slice(from));
        fastest = fastest.min(start.elapsed().as_secs_f64());
        black_box(&to);
    }
    2.0 * size_of_val(from.as_slice()) as f64 / fastest
}
