//! Parallel loops whose result does not depend on the number of threads.
//!
//! Work is cut into chunks of a fixed length, and what the chunks return is combined in their order.

use rayon::prelude::*;

/// Items in one chunk of a loop over points or vertices.
pub(crate) const CHUNK: usize = 2048;

/// `Σ_i f(i)` for `i` in `0..n`, several sums at once, in one fixed order.
pub(crate) fn sum_array<const M: usize>(
    n: usize,
    f: impl Fn(usize) -> [f64; M] + Sync,
) -> [f64; M] {
    let partial: Vec<[f64; M]> = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut total = [0.0; M];
            for i in chunk * CHUNK..n.min((chunk + 1) * CHUNK) {
                let term = f(i);
                for m in 0..M {
                    total[m] += term[m];
                }
            }
            total
        })
        .collect();
    let mut total = [0.0; M];
    for part in partial {
        for m in 0..M {
            total[m] += part[m];
        }
    }
    total
}
