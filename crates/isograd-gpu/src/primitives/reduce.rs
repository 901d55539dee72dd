//! Sums of whole arrays, by a tree that depends on their length alone: the same bits every time.

use cubecl::prelude::*;

use crate::device::{check_length, launch};
use crate::{Buffer, Device, Error, Scalar};

/// Units of a group of a kernel that sums.
pub(crate) const BLOCK: usize = 256;

/// Rows that one unit adds up before its group does.
const STEPS: usize = 8;

/// Most groups of a first step whose units go through the elements in strides.
const GROUPS: usize = 512;

/// How many groups sum `count` elements.
pub(crate) fn groups_for(count: usize) -> usize {
    count.div_ceil(BLOCK).clamp(1, GROUPS)
}

/// The sum of `values`, an array of one number. Of no values, it is 0.
pub fn sum<R: Runtime, T: Scalar>(
    device: &Device<R>,
    values: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    sum_columns(device, values, 1)
}

/// The sum of each column of `values`, `(N, columns)`: `columns` numbers.
///
/// # Errors
/// [`Error::Length`] where `values` are not whole rows.
pub fn sum_columns<R: Runtime, T: Scalar>(
    device: &Device<R>,
    values: &Buffer<T>,
    columns: usize,
) -> Result<Buffer<T>, Error> {
    let rows = values.len() / columns;
    check_length("the array to sum", values, rows * columns)?;
    let groups = rows.div_ceil(BLOCK * STEPS).max(1);
    let sums: Buffer<T> = device.empty(groups * columns)?;
    launch!(device, groups * BLOCK, BLOCK => sum_spans<T>(
        values, sums, rows as u32, groups as u32, columns,
    ));
    match groups {
        1 => Ok(sums),
        _ => sum_columns(device, &sums, columns),
    }
}

/// Column sums of `BLOCK · STEPS` rows a group.
#[cube(launch)]
fn sum_spans<F: Float>(
    values: &Array<F>,
    sums: &mut Array<F>,
    rows: u32,
    groups: u32,
    #[comptime] columns: usize,
) {
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let first = CUBE_POS * (BLOCK * STEPS) + UNIT_POS as usize;
    for column in 0..columns {
        let mut own = F::new(0.0);
        for step in 0..STEPS {
            let row = first + step * BLOCK;
            if row < rows as usize {
                own += values[row * columns + column];
            }
        }
        let total = sum_of_group::<F>(own, &mut shared);
        if UNIT_POS == 0 && CUBE_POS < groups as usize {
            sums[CUBE_POS * columns + column] = total;
        }
    }
}

/// Writes the sum over the units of each group, one number a group. Every unit must call it.
#[cube]
pub(crate) fn write_sum<F: Float>(value: F, sums: &mut Array<F>) {
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let sum = sum_of_group::<F>(value, &mut shared);
    if UNIT_POS == 0 && CUBE_POS < sums.len() {
        sums[CUBE_POS] = sum;
    }
}

/// [`write_sum`] of two values, two numbers a group.
#[cube]
pub(crate) fn write_two_sums<F: Float>(first: F, second: F, sums: &mut Array<F>) {
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let first = sum_of_group::<F>(first, &mut shared);
    let second = sum_of_group::<F>(second, &mut shared);
    let own = CUBE_POS * 2;
    if UNIT_POS == 0 && own < sums.len() {
        sums[own] = first;
        sums[own + 1] = second;
    }
}

/// Sum of the values of the `BLOCK` units of a group, by halves. Every unit must call it.
#[cube]
pub(crate) fn sum_of_group<N: Numeric>(value: N, shared: &mut SharedMemory<N>) -> N {
    let unit = UNIT_POS as usize;
    // What was there may still be read.
    sync_cube();
    shared[unit] = value;
    sync_cube();
    let mut reach = (BLOCK / 2).runtime();
    while reach > 0 {
        if unit < reach {
            let other = shared[unit + reach];
            shared[unit] += other;
        }
        sync_cube();
        reach /= 2;
    }
    shared[0]
}
