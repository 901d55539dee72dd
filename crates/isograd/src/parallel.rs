//! Parallel loops whose result does not depend on the number of threads.
//!
//! Work is cut into chunks of a fixed length, and what the chunks return is combined in their order.

use std::ops::Range;

use rayon::prelude::*;

/// Items in one chunk of a loop over points or vertices.
pub(crate) const CHUNK: usize = 2048;

/// `Σ_i f(i)` for `i` in `0..n`, several sums at once, in one fixed order.
pub(crate) fn sum_array<const M: usize>(
    n: usize,
    f: impl Fn(usize) -> [f64; M] + Sync,
) -> [f64; M] {
    let partial = of_chunks(n, &|items| {
        let mut total = [0.0; M];
        for i in items {
            let term = f(i);
            for m in 0..M {
                total[m] += term[m];
            }
        }
        total
    });
    let mut total = [0.0; M];
    for part in partial {
        for m in 0..M {
            total[m] += part[m];
        }
    }
    total
}

/// `f` of each chunk of `0..n`. The closure is `dyn` so that what rayon adds is compiled once for each `R`.
fn of_chunks<R: Send>(n: usize, f: &(dyn Fn(Range<usize>) -> R + Sync)) -> Vec<R> {
    let chunk = |k: usize| f(k * CHUNK..n.min((k + 1) * CHUNK));
    (0..n.div_ceil(CHUNK)).into_par_iter().map(chunk).collect()
}
