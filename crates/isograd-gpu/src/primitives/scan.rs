//! Sums from the beginning.

use cubecl::prelude::*;

use crate::device::launch;
use crate::{Buffer, Device, Error};

/// Units of a group, and elements that it sums.
const BLOCK: usize = 256;

/// The exclusive sum of `values`: element `i` of the result is the sum of the first `i`, and the last
/// element, one more than there are values, is the sum of all. Sums must fit in 32 bits.
pub fn exclusive_sum<R: Runtime>(
    device: &Device<R>,
    values: &Buffer<u32>,
) -> Result<Buffer<u32>, Error> {
    let count = values.len();
    let blocks = (count + 1).div_ceil(BLOCK);
    let sums: Buffer<u32> = device.empty(count + 1)?;
    let totals: Buffer<u32> = device.empty(blocks)?;
    launch!(device, blocks * BLOCK, BLOCK => sum_blocks(
        values, sums, totals, count as u32, BLOCK,
    ));
    if blocks > 1 {
        let before = exclusive_sum(device, &totals)?;
        launch!(device, count + 1, BLOCK => add_blocks(before, sums, BLOCK));
    }
    Ok(sums)
}

/// The exclusive sums within each block (Hillis and Steele, *Data parallel algorithms*, 1986), and its
/// total.
#[cube(launch)]
fn sum_blocks(
    values: &Array<u32>,
    sums: &mut Array<u32>,
    totals: &mut Array<u32>,
    count: u32,
    #[comptime] block: usize,
) {
    let mut shared = SharedMemory::<u32>::new(block);
    let unit = UNIT_POS as usize;
    let at = CUBE_POS * block + unit;
    let mut own = 0u32;
    if at < count as usize {
        own = values[at];
    }
    shared[unit] = own;
    sync_cube();
    let mut reach = 1usize.runtime();
    while reach < block {
        let mut more = 0u32;
        if unit >= reach {
            more = shared[unit - reach];
        }
        sync_cube();
        shared[unit] += more;
        sync_cube();
        reach *= 2;
    }
    if at < sums.len() {
        sums[at] = shared[unit] - own;
    }
    if unit == block - 1 && CUBE_POS < totals.len() {
        totals[CUBE_POS] = shared[unit];
    }
}

/// Adds to each element the total of the blocks before its own.
#[cube(launch)]
fn add_blocks(before: &Array<u32>, sums: &mut Array<u32>, #[comptime] block: usize) {
    if ABSOLUTE_POS < sums.len() {
        sums[ABSOLUTE_POS] += before[ABSOLUTE_POS / block];
    }
}
