//! Which elements have a flag: the first of them, and all of them.

use cubecl::prelude::*;

use super::scan::exclusive_sum;
use crate::device::launch;
use crate::{Buffer, Device, Error};

const BLOCK: u32 = 256;

/// The index of the first flag that is 1, the others being 0. Waits for the device.
pub(crate) fn first<R: Runtime>(
    device: &Device<R>,
    flags: &Buffer<u32>,
) -> Result<Option<usize>, Error> {
    let sums = exclusive_sum(device, flags)?;
    let found: Buffer<u32> = device.empty(2)?;
    launch!(device, sums.len(), BLOCK => find_first(sums, found));
    let found = device.download(&found)?;
    Ok((found[0] > 0).then_some(found[1] as usize))
}

/// The sum of some numbers, `(1,)`: of flags that are 1 or 0, how many are 1. Nothing waits.
pub(crate) fn count<R: Runtime>(
    device: &Device<R>,
    flags: &Buffer<u32>,
) -> Result<Buffer<u32>, Error> {
    let sums = exclusive_sum(device, flags)?;
    let total = device.empty(1)?;
    launch!(device, 1, 1 => take_last(sums, total, 0u32));
    Ok(total)
}

/// The indices of the flags that are 1, ascending; only as many numbers are written. The sums end with how many.
pub(crate) struct Listed {
    pub indices: Buffer<u32>,
    pub sums: Buffer<u32>,
}

/// Lists the flags that are 1, the others being 0. Nothing waits.
pub(crate) fn list<R: Runtime>(device: &Device<R>, flags: &Buffer<u32>) -> Result<Listed, Error> {
    let sums = exclusive_sum(device, flags)?;
    let indices = indices(device, &sums, flags.len())?;
    Ok(Listed { indices, sums })
}

/// The indices of the flags that are 1, ascending, in an array of `len`: at least as many as there are. `sums` are
/// the exclusive sums of the flags.
pub(crate) fn indices<R: Runtime>(
    device: &Device<R>,
    sums: &Buffer<u32>,
    len: usize,
) -> Result<Buffer<u32>, Error> {
    let (flags, indices) = (sums.len() - 1, device.empty(len)?);
    launch!(device, flags, BLOCK => write_indices(sums, indices, flags as u32));
    Ok(indices)
}

/// How many flags of each of some arrays are 1, the others being 0, by the exclusive sums of the flags. Waits for the
/// device, once.
pub(crate) fn totals<R: Runtime, const N: usize>(
    device: &Device<R>,
    sums: [&Buffer<u32>; N],
) -> Result<[usize; N], Error> {
    let last: Buffer<u32> = device.empty(N)?;
    for (k, sums) in sums.into_iter().enumerate() {
        launch!(device, 1, 1 => take_last(sums, last, k as u32));
    }
    let last = device.download(&last)?;
    Ok(std::array::from_fn(|k| last[k] as usize))
}

/// The sum of all numbers of some arrays, `(1,)`. Nothing waits.
pub(crate) fn sum_of_all<R: Runtime>(
    device: &Device<R>,
    arrays: &[&Buffer<u32>],
) -> Result<Buffer<u32>, Error> {
    let ends: Buffer<u32> = device.empty(arrays.len())?;
    for (k, array) in arrays.iter().enumerate() {
        launch!(device, 1, 1 => take_last(exclusive_sum(device, array)?, ends, k as u32));
    }
    count(device, &ends)
}

#[cube(launch)]
fn take_last(values: &Array<u32>, last: &mut Array<u32>, at: u32) {
    if ABSOLUTE_POS == 0 {
        last[at as usize] = values[values.len() - 1];
    }
}

/// How many flags there are, and the first, where there is one: the only one with none before it.
#[cube(launch)]
fn find_first(sums: &Array<u32>, found: &mut Array<u32>) {
    let last = sums.len() - 1;
    if ABSOLUTE_POS < last {
        if sums[ABSOLUTE_POS] == 0u32 && sums[ABSOLUTE_POS + 1] == 1u32 {
            found[1] = ABSOLUTE_POS as u32;
        }
    } else if ABSOLUTE_POS == last {
        found[0] = sums[last];
    }
}

#[cube(launch)]
fn write_indices(sums: &Array<u32>, indices: &mut Array<u32>, count: u32) {
    if ABSOLUTE_POS < count as usize {
        let to = sums[ABSOLUTE_POS];
        if sums[ABSOLUTE_POS + 1] > to {
            indices[to as usize] = ABSOLUTE_POS as u32;
        }
    }
}
