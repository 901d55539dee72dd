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
