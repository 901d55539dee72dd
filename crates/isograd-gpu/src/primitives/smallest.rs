//! The smallest few of some numbers, in registers: loops over them are unrolled.

use cubecl::prelude::*;

/// Puts a number where it belongs among the `k` smallest so far.
#[cube]
pub(crate) fn insert<F: Float>(number: F, smallest: &mut Array<F>, #[comptime] k: usize) {
    if number < smallest[k - 1] {
        let mut moved = number;
        #[unroll]
        for i in 0..k {
            let own = smallest[i];
            let stays = own <= moved;
            smallest[i] = select(stays, own, moved);
            moved = select(stays, moved, own);
        }
    }
}

/// Of the first `count` values, the one of the given rank, from 1.
#[cube]
pub(crate) fn ranked<F: Float>(
    values: &Array<F>,
    #[comptime] count: usize,
    #[comptime] rank: usize,
) -> F {
    let mut smallest = Array::<F>::new(rank);
    #[unroll]
    for i in 0..rank {
        smallest[i] = F::max_value();
    }
    #[unroll]
    for i in 0..count {
        insert::<F>(values[i], &mut smallest, rank);
    }
    smallest[rank - 1]
}

/// The upper median of the first `count` values.
#[cube]
pub(crate) fn median<F: Float>(values: &Array<F>, #[comptime] count: usize) -> F {
    ranked::<F>(values, count, comptime!(count / 2 + 1))
}
