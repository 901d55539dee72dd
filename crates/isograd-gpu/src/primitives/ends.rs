//! Least and greatest values.

use cubecl::prelude::*;

use super::reduce::{BLOCK, groups_for};
use crate::device::launch;
use crate::{Buffer, Device, Error, Scalar};

/// The least of each component of `(N, width)` finite values, then the greatest of each; N is not 0.
pub(crate) fn ends<R: Runtime, T: Scalar>(
    device: &Device<R>,
    values: &Buffer<T>,
    width: usize,
) -> Result<Buffer<T>, Error> {
    let items = values.len() / width;
    let shares = groups_for(items);
    let partial = device.empty(2 * shares * width)?;
    let ends = device.empty(2 * width)?;
    let pass = |from: &Buffer<T>, items: usize, high: usize, to: &Buffer<T>, shares: usize| {
        launch!(device, [shares * width; BLOCK] => find_ends<T>(
            from, to, items as u32, high as u32, shares as u32, width, BLOCK,
        ));
    };
    pass(values, items, 0, &partial, shares);
    pass(&partial, shares, shares * width, &ends, 1);
    Ok(ends)
}

/// Each group takes one component of a share of the items. Greatest values stand `high` places after the least.
#[cube(launch)]
fn find_ends<F: Float>(
    values: &Array<F>,
    ends: &mut Array<F>,
    items: u32,
    high: u32,
    shares: u32,
    #[comptime] width: usize,
    #[comptime] block: usize,
) {
    let mut shared_low = SharedMemory::<F>::new(block);
    let mut shared_high = SharedMemory::<F>::new(block);
    let unit = UNIT_POS as usize;
    let axis = CUBE_POS % width;
    let mut least = values[axis];
    let mut greatest = values[axis + high as usize];
    let mut item = CUBE_POS / width * block + unit;
    while item < items as usize {
        let at = item * width + axis;
        least = min(least, values[at]);
        greatest = max(greatest, values[at + high as usize]);
        item += shares as usize * block;
    }
    shared_low[unit] = least;
    shared_high[unit] = greatest;
    sync_cube();
    let mut reach = (block / 2).runtime();
    while reach > 0 {
        if unit < reach {
            shared_low[unit] = min(shared_low[unit], shared_low[unit + reach]);
            shared_high[unit] = max(shared_high[unit], shared_high[unit + reach]);
        }
        sync_cube();
        reach /= 2;
    }
    if unit == 0 {
        ends[CUBE_POS] = shared_low[0];
        ends[CUBE_POS + shares as usize * width] = shared_high[0];
    }
}
