//! Parallel loops whose result does not depend on the number of threads.
//!
//! Work is cut into chunks of a fixed length, and what the chunks return is combined in their order.

use std::ops::Range;

use rayon::prelude::*;

/// Items in one chunk of a loop over points or vertices.
pub(crate) const CHUNK: usize = 2048;

/// Pieces of a loop over few items.
const PIECES: usize = 64;

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

/// `f(0), …, f(n − 1)`.
pub(crate) fn map<T: Clone + Default + Send>(n: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut out = Vec::new();
    fill(&mut out, n, f);
    out
}

/// Makes `out` hold `f(0), …, f(n − 1)`, in the memory that it has.
pub(crate) fn fill<T: Clone + Default + Send>(
    out: &mut Vec<T>,
    n: usize,
    f: impl Fn(usize) -> T + Sync,
) {
    out.resize(n, T::default());
    for_each(out, |i, item| *item = f(i));
}

/// Calls `f` with the index of each item, and the item.
pub(crate) fn for_each<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    in_pieces(items, &|first, piece| {
        for (k, item) in piece.iter_mut().enumerate() {
            f(first + k, item);
        }
    });
}

/// Calls `f` with pieces of a slice, and the index of the first item of each. Compiled once for each `T`, as
/// [`of_chunks`] is.
fn in_pieces<T: Send>(items: &mut [T], f: &(dyn Fn(usize, &mut [T]) + Sync)) {
    // Few items may each take long.
    let size = items.len().div_ceil(PIECES).clamp(1, CHUNK);
    let pieces = items.par_chunks_mut(size).enumerate();
    pieces.for_each(|(k, piece)| f(k * size, piece));
}

/// `f` of each chunk of `0..n`. The closure is `dyn` so that what rayon adds is compiled once for each `R`.
fn of_chunks<R: Send>(n: usize, f: &(dyn Fn(Range<usize>) -> R + Sync)) -> Vec<R> {
    let chunk = |k: usize| f(k * CHUNK..n.min((k + 1) * CHUNK));
    (0..n.div_ceil(CHUNK)).into_par_iter().map(chunk).collect()
}
