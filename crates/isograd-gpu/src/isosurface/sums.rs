//! Sums over many elements, as a tree of fixed shape: a bounded number of groups add up elements in strides, then
//! the units of each as a binary tree, then one group the sums of the groups.

use cubecl::prelude::*;

use crate::device::launch;
use crate::primitives::reduce::{BLOCK, sum_of_group};
use crate::{Buffer, Device};

/// Adds up the sums of the groups, `sums` kinds of them from kind `first` on, all of one kind side by side in
/// `partial`.
pub(super) fn fold<R: Runtime, N: Numeric + CubeElement>(
    device: &Device<R>,
    partial: &Buffer<N>,
    groups: usize,
    first: usize,
    sums: &Buffer<N>,
) {
    launch!(device, [sums.len(); BLOCK] => fold_groups<N>(
        partial, sums, groups as u32, first as u32, BLOCK,
    ));
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
    let sum = sum_of_group::<N>(own, &mut shared);
    if UNIT_POS == 0u32 {
        sums[CUBE_POS] = sum;
    }
}
