//! Samples in the order of the cells that hold them.

use cubecl::prelude::*;

use super::{SampleArrays, Samples};
use crate::device::launch;
use crate::grid::{Lattice, place};
use crate::primitives::sort::{self, first_at_least};
use crate::vector::{Vector3, is_finite};
use crate::{Buffer, Device, Error, Scalar};

const BLOCK: u32 = 256;

/// Samples by cell, in C order of the cells; those of one cell in the order of the input, and those that are
/// refused after all others.
#[derive(Clone, Debug)]
pub struct SampleOrder {
    /// Cells of the grid along each axis.
    pub shape: [usize; 3],
    /// `(N,)` place in memory of the cell of each sample, ascending; the number of cells for refused samples.
    pub keys: Buffer<u32>,
    /// `(N,)` index of each sample in the input.
    pub places: Buffer<u32>,
    /// `(nx · ny + 1,)` where the samples of each row of cells along z begin; the last entry is the number of
    /// samples that are not refused.
    pub rows: Buffer<u32>,
}

/// Samples that are left out: less than 2 cells inside the grid, or not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refused {
    /// How many.
    pub count: usize,
    /// Index of the first.
    pub first: usize,
}

impl SampleOrder {
    /// Sorts samples by the cells of `grid`.
    pub(super) fn new<R: Runtime, T: Scalar>(
        device: &Device<R>,
        samples: Samples<'_, T>,
        grid: &isograd::Grid<T>,
    ) -> Result<Self, Error> {
        let (shape, cells) = (grid.shape(), grid.cells() as u32);
        let keys: Buffer<u32> = device.empty(samples.len())?;
        launch!(device, samples.len(), BLOCK => find_cells<T>(samples, keys, grid));
        let sort::Order { keys, places } = sort::order(device, &keys, cells + 1)?;
        let rows: Buffer<u32> = device.empty(shape[0] * shape[1] + 1)?;
        launch!(device, rows.len(), BLOCK => find_rows(
            keys, rows, keys.len() as u32, shape[2] as u32,
        ));
        Ok(Self {
            shape,
            keys,
            places,
            rows,
        })
    }

    pub(crate) fn refused<R: Runtime>(&self, device: &Device<R>) -> Result<Option<Refused>, Error> {
        if self.keys.is_empty() {
            return Ok(None);
        }
        let found: Buffer<u32> = device.empty(2)?;
        launch!(device, 1, 1 => find_refused(self.rows, self.places, found));
        let found = device.download(&found)?;
        Ok((found[0] > 0).then(|| Refused {
            count: found[0] as usize,
            first: found[1] as usize,
        }))
    }
}

/// The cell of each sample.
#[cube(launch)]
fn find_cells<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    keys: &mut Array<u32>,
    grid: Lattice<F>,
) {
    let i = ABSOLUTE_POS;
    if i < samples.count as usize {
        let x = place::<F>(&samples.points, i, &grid);
        let inside =
            holds::<F>(x.x, grid.nx) && holds::<F>(x.y, grid.ny) && holds::<F>(x.z, grid.nz);
        let normal = Vector3::<F>::at(&samples.normals, i);
        let finite = is_finite::<F>(samples.areas[i]) && normal.is_finite();
        let mut key = grid.nx * grid.ny * grid.nz;
        if inside && finite {
            let row = central_cell::<F>(x.x, grid.nx) * grid.ny + central_cell::<F>(x.y, grid.ny);
            key = row * grid.nz + central_cell::<F>(x.z, grid.nz);
        }
        keys[i] = key;
    }
}

/// Whether `x` is at least 2 cells from both walls.
#[cube]
fn holds<F: Float>(x: F, cells: u32) -> bool {
    cells >= 5u32 && x >= F::new(2.0) && x <= F::cast_from(cells) - F::new(2.0)
}

/// The cell that holds `x`. One exactly 2 cells from the far wall counts to the cell before it.
#[cube]
fn central_cell<F: Float>(x: F, cells: u32) -> u32 {
    min(u32::cast_from(x), cells - 3u32)
}

/// Where each row of `nz` cells begins among ascending `keys`.
#[cube(launch)]
fn find_rows(keys: &Array<u32>, rows: &mut Array<u32>, count: u32, nz: u32) {
    if ABSOLUTE_POS < rows.len() {
        rows[ABSOLUTE_POS] = first_at_least(keys, 0u32, count, ABSOLUTE_POS as u32 * nz);
    }
}

/// How many samples are refused, and the first of them.
#[cube(launch)]
fn find_refused(rows: &Array<u32>, places: &Array<u32>, found: &mut Array<u32>) {
    if ABSOLUTE_POS == 0 {
        let taken = rows[rows.len() - 1];
        let count = places.len() as u32 - taken;
        found[0] = count;
        found[1] = 0u32;
        if count > 0u32 {
            found[1] = places[taken as usize];
        }
    }
}
