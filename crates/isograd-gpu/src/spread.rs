//! Samples spread over the cells around them, as a gather: each cell adds up what the samples near it have
//! for it, in the order of the samples, which are sorted by cell.
//!
//! Where many samples lie in one cell, a unit would add them up for as long as there are samples while the
//! others wait. So every 64 samples in a row that lie in one cell are first added up by units of their own,
//! for each of the cells that they reach, and every 64 of those sums again: however the samples lie, a
//! unit adds at most some hundreds of numbers a cell (and one in 4096 of a cell's samples).

use cubecl::prelude::*;

use crate::device::{Ready, launch};
use crate::primitives::sort::first_at_least;
use crate::splat::SampleOrder;
use crate::{Buffer, Device, Error, Scalar};

/// Samples in a run that is summed before, and runs in a run of runs.
const RUN: u32 = 64;

/// Cells of a group along each axis: the 32 units of a warp have 4 × 8 of them, most of which see the same
/// samples.
const BRICK_X: u32 = 4;
const BRICK_Y: u32 = 8;
const BRICK_Z: u32 = 8;

/// Cells of a group, a unit for each.
const BRICK: usize = (BRICK_X * BRICK_Y * BRICK_Z) as usize;

/// Samples in the order of their cells, and sums over runs of them.
#[derive(CubeLaunch, CubeType)]
struct SortedSamples<F: Float + CubeElement> {
    values: Array<F>,
    keys: Array<u32>,
    rows: Array<u32>,
    runs: Array<F>,
    long_runs: Array<F>,
    nx: u32,
    ny: u32,
    nz: u32,
}

/// Spreading of a sample over the cells at most `reach` away along each axis.
#[cube]
pub(crate) trait Spread: Send + Sync + 'static {
    /// Part of sample `s` in the cell that is `(x, y, z) − reach` cells from its own.
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F;
}

/// Treatment of the values in the field.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) enum Before {
    /// They are overwritten.
    Replaced,
    /// The samples' parts are added to them.
    Kept,
}

/// Writes the sum of the samples' parts in each cell to `out`, `(nx, ny, nz)`. `samples` are in the order
/// of `order`, in the form that `P` reads.
pub(crate) fn spread<R: Runtime, T: Scalar, P: Spread>(
    device: &Device<R>,
    samples: &Buffer<T>,
    order: &SampleOrder,
    reach: u32,
    before: Before,
    out: &Buffer<T>,
) -> Result<(), Error> {
    let cells = (2 * reach as usize + 1).pow(3);
    let count = order.keys.len();
    let runs: Buffer<T> = device.empty(count / RUN as usize * cells)?;
    launch!(device, runs.len() => sum_runs<T, P>(
        samples, order.keys, runs, (count / RUN as usize) as u32, reach,
    ));
    let long = count / (RUN * RUN) as usize;
    let long_runs: Buffer<T> = device.empty(long * cells)?;
    launch!(device, long_runs.len() => sum_long_runs<T>(
        order.keys, runs, long_runs, long as u32, cells as u32,
    ));
    let [nx, ny, nz] = order.shape.map(|n| n as u32);
    let bricks = nx.div_ceil(BRICK_X) * ny.div_ceil(BRICK_Y) * nz.div_ceil(BRICK_Z);
    let samples = SortedSamplesLaunch::new(
        samples.arg(),
        order.keys.arg(),
        order.rows.arg(),
        runs.arg(),
        long_runs.arg(),
        nx,
        ny,
        nz,
    );
    launch!(device, bricks as usize * BRICK, BRICK => gather_cells<T, P>(
        Ready::new(samples), out, reach, before == Before::Kept,
    ));
    Ok(())
}

/// Sums over each run of samples in one cell, for each of the cells around it: a unit for each run and cell.
#[cube(launch)]
fn sum_runs<F: Float, P: Spread>(
    samples: &Array<F>,
    keys: &Array<u32>,
    runs: &mut Array<F>,
    count: u32,
    #[comptime] reach: u32,
) {
    let width = comptime!(2 * reach + 1);
    let cells = comptime!((width * width * width) as usize);
    let run = ABSOLUTE_POS / cells;
    if run < count as usize {
        let first = run * RUN as usize;
        if keys[first] == keys[first + RUN as usize - 1] {
            let cell = (ABSOLUTE_POS % cells) as u32;
            let (x, y, z) = (cell / (width * width), cell / width % width, cell % width);
            let mut sum = F::new(0.0);
            for s in first..first + RUN as usize {
                sum += P::part::<F>(samples, s, x, y, z);
            }
            runs[ABSOLUTE_POS] = sum;
        }
    }
}

/// Sums over runs of runs.
#[cube(launch)]
fn sum_long_runs<F: Float>(
    keys: &Array<u32>,
    runs: &Array<F>,
    long_runs: &mut Array<F>,
    count: u32,
    cells: u32,
) {
    let cells = cells as usize;
    let long = ABSOLUTE_POS / cells;
    if long < count as usize {
        let first = long * RUN as usize;
        let samples = RUN as usize;
        if keys[first * samples] == keys[(first + samples) * samples - 1] {
            let cell = ABSOLUTE_POS % cells;
            let mut sum = F::new(0.0);
            for run in first..first + samples {
                sum += runs[run * cells + cell];
            }
            long_runs[ABSOLUTE_POS] = sum;
        }
    }
}

/// Number of samples from `s` on, all in the cell `key`, that have a sum: 1, 64 or 4096.
#[cube]
fn summed(keys: &Array<u32>, s: u32, end: u32, key: u32) -> u32 {
    let mut step = 1u32.runtime();
    if is_run(keys, s, RUN, end, key) {
        step = RUN.runtime();
        if is_run(keys, s, RUN * RUN, end, key) {
            step = (RUN * RUN).runtime();
        }
    }
    step
}

/// Whether a run of `length` samples, a power of two, begins at `s`, all of them in the cell `key`.
#[cube]
fn is_run(keys: &Array<u32>, s: u32, length: u32, end: u32, key: u32) -> bool {
    let mut is_run = false;
    if s & (length - 1u32) == 0u32 && s + length <= end {
        is_run = keys[(s + length - 1u32) as usize] == key;
    }
    is_run
}

/// Each cell adds up what the samples near it have for it.
#[cube(launch)]
fn gather_cells<F: Float + CubeElement, P: Spread>(
    samples: &SortedSamples<F>,
    out: &mut Array<F>,
    #[comptime] reach: u32,
    #[comptime] keep: bool,
) {
    let (nx, ny, nz) = (samples.nx, samples.ny, samples.nz);
    let bricks_y = (ny - 1u32) / BRICK_Y + 1u32;
    let bricks_z = (nz - 1u32) / BRICK_Z + 1u32;
    let brick = CUBE_POS as u32;
    let i = brick / (bricks_y * bricks_z) * BRICK_X + UNIT_POS / (BRICK_Y * BRICK_Z);
    let j = brick / bricks_z % bricks_y * BRICK_Y + UNIT_POS / BRICK_Z % BRICK_Y;
    let k = brick % bricks_z * BRICK_Z + UNIT_POS % BRICK_Z;
    if i < nx && j < ny && k < nz {
        let mut sum = F::new(0.0);
        let low_j = j - min(j, reach);
        let high_j = min(j + reach, ny - 1u32);
        for p in i - min(i, reach)..min(i + reach, nx - 1u32) + 1u32 {
            // The rows of a plane follow each other: most have no samples.
            let begin = samples.rows[(p * ny + low_j) as usize];
            if begin < samples.rows[(p * ny + high_j + 1u32) as usize] {
                let x = i + reach - p;
                for q in low_j..high_j + 1u32 {
                    let y = j + reach - q;
                    let row = p * ny + q;
                    sum += sum_of_row::<F, P>(samples, row, x, y, k, reach);
                }
            }
        }
        let at = ((i * ny + j) * nz + k) as usize;
        if keep {
            sum += out[at];
        }
        out[at] = sum;
    }
}

/// Sum over the samples in a row of `nz` cells for the cell `(x, y)` of those that they reach, at height `k`.
#[cube]
fn sum_of_row<F: Float + CubeElement, P: Spread>(
    samples: &SortedSamples<F>,
    row: u32,
    x: u32,
    y: u32,
    k: u32,
    #[comptime] reach: u32,
) -> F {
    let mut sum = F::new(0.0);
    let first = row * samples.nz;
    let last = first + min(k + reach, samples.nz - 1u32);
    let end = samples.rows[row as usize + 1];
    let least = first + (k - min(k, reach));
    let mut s = first_at_least(&samples.keys, samples.rows[row as usize], end, least);
    let mut key = key_or_last(&samples.keys, s, end);
    while key <= last {
        let z = k + reach - (key - first);
        let step = summed(&samples.keys, s, end, key);
        sum += part_or_sum::<F, P>(samples, s, step, x, y, z, reach);
        s += step;
        key = key_or_last(&samples.keys, s, end);
    }
    sum
}

/// The key of sample `s`, or a key above all where there is none.
#[cube]
fn key_or_last(keys: &Array<u32>, s: u32, end: u32) -> u32 {
    let mut key = 4294967295u32.runtime();
    if s < end {
        key = keys[s as usize];
    }
    key
}

/// Part of sample `s` in a cell, or the sum of the `step` samples from it on.
#[cube]
fn part_or_sum<F: Float + CubeElement, P: Spread>(
    samples: &SortedSamples<F>,
    s: u32,
    step: u32,
    x: u32,
    y: u32,
    z: u32,
    #[comptime] reach: u32,
) -> F {
    let width = comptime!(2 * reach + 1);
    let cells = comptime!((width * width * width) as usize);
    let cell = ((x * width + y) * width + z) as usize;
    if step == 1u32 {
        P::part::<F>(&samples.values, s as usize, x, y, z)
    } else if step == RUN {
        samples.runs[(s / RUN) as usize * cells + cell]
    } else {
        samples.long_runs[(s / (RUN * RUN)) as usize * cells + cell]
    }
}
