//! Sums over many elements, as a tree of fixed shape: at most [`GROUPS`] groups add up elements in strides, then
//! the units of each as a binary tree, then one group the sums of the groups.

use cubecl::prelude::*;

use super::signs::BLOCK;
use crate::{Buffer, Device};

/// Most groups of the first step.
const GROUPS: usize = 512;

/// How many groups sum `count` elements.
pub(super) fn groups_for(count: usize) -> usize {
    count.div_ceil(BLOCK).clamp(1, GROUPS)
}

/// Adds up the sums of the groups, `sums` kinds of them from kind `first` on, all of one kind side by side in
/// `partial`.
pub(super) fn fold<R: Runtime, N: Numeric + CubeElement>(
    device: &Device<R>,
    partial: &Buffer<N>,
    groups: usize,
    first: usize,
    sums: &Buffer<N>,
) {
    fold_groups::launch::<N, R>(
        device.client(),
        CubeCount::Static(sums.len() as u32, 1, 1),
        CubeDim::new_1d(BLOCK as u32),
        partial.arg(),
        sums.arg(),
        groups as u32,
        first as u32,
        BLOCK,
    );
}

#[cube(launch)]
fn fold_groups<N: Numeric>(
    partial: &Array<N>,
    sums: &mut Array<N>,
    groups: u32,
    first: u32,
    #[comptime] block: usize,
) {
    let mut shared = SharedMemory::<N>::new(block);
    let begin = (CUBE_POS + first as usize) * groups as usize;
    let mut own = N::from_int(0);
    let mut group = UNIT_POS as usize;
    while group < groups as usize {
        own += partial[begin + group];
        group += block;
    }
    let sum = tree_sum::<N>(&mut shared, own, block);
    if UNIT_POS == 0u32 {
        sums[CUBE_POS] = sum;
    }
}

/// The sum of a number of each unit of the group; all units must call it.
#[cube]
pub(super) fn tree_sum<N: Numeric>(
    shared: &mut SharedMemory<N>,
    own: N,
    #[comptime] block: usize,
) -> N {
    let unit = UNIT_POS as usize;
    shared[unit] = own;
    sync_cube();
    let mut reach = (block / 2).runtime();
    while reach > 0 {
        if unit < reach {
            let other = shared[unit + reach];
            shared[unit] += other;
        }
        sync_cube();
        reach /= 2;
    }
    let sum = shared[0];
    // The memory is free for the next sum.
    sync_cube();
    sum
}
