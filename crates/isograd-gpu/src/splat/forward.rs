//! From samples to the right-hand side.

use cubecl::prelude::*;

use super::stencil::{BSpline, NUMBERS, Paper, REACH, total};
use super::{Residual, SampleArrays, SampleOrder, Samples, Weights};
use crate::device::launch;
use crate::element::stencil::hat;
use crate::grid::{Lattice, cell_at, from_center, place};
use crate::spread::{Before, spread};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

const BLOCK: u32 = 256;

/// `b`, `(nx, ny, nz)` on `grid`. Areas are all 1 for no area weights: `χ` is then scaled, not changed in shape,
/// where the samples are even. Samples that are less than 2 cells inside the grid or not finite are left
/// out: see [`Residual::refused`].
///
/// # Errors
/// [`Error::Length`] where the arrays do not match, [`Error::NoNumber`], [`Error::TooLarge`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    samples: Samples<'_, T>,
    grid: &isograd::Grid<T>,
    weights: Weights,
) -> Result<(Buffer<T>, Residual<T>), Error> {
    device.check_number::<T>()?;
    samples.check()?;
    let residual = Residual {
        grid: *grid,
        weights,
        order: SampleOrder::new(device, samples, grid)?,
    };
    let sorted = sorted(device, samples, &residual, weights == Weights::Paper)?;
    let b: Buffer<T> = device.empty(grid.cells())?;
    let order = &residual.order;
    match weights {
        Weights::BSpline => {
            spread::<R, T, BSpline>(device, &sorted, order, REACH, Before::Replaced, &b)?;
        }
        Weights::Paper => {
            spread::<R, T, Paper>(device, &sorted, order, REACH, Before::Replaced, &b)?;
        }
    }
    Ok((b, residual))
}

/// `(N, 6)` offset and vector of each sample, in sorted order. The vector is over the sum of the paper's weights
/// if `normalize` says so.
pub(super) fn sorted<R: Runtime, T: Scalar>(
    device: &Device<R>,
    samples: Samples<'_, T>,
    residual: &Residual<T>,
    normalize: bool,
) -> Result<Buffer<T>, Error> {
    let sorted: Buffer<T> = device.empty(NUMBERS * samples.len())?;
    launch!(device, samples.len(), BLOCK => sort_samples<T>(
        samples, residual.order.keys, residual.order.places, sorted, residual.grid, normalize,
    ));
    Ok(sorted)
}

#[cube(launch)]
fn sort_samples<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    keys: &Array<u32>,
    places: &Array<u32>,
    sorted: &mut Array<F>,
    grid: Lattice<F>,
    #[comptime] normalize: bool,
) {
    let s = ABSOLUTE_POS;
    if s < samples.count as usize {
        let i = places[s] as usize;
        let x = place::<F>(&samples.points, i, &grid);
        let cell = cell_at(keys[s], grid.ny, grid.nz);
        let f = from_center::<F>(x, cell);
        // One division after the other: h² may underflow where a/h² is fine.
        let mut scale = samples.areas[i] / grid.spacing / grid.spacing;
        if normalize {
            scale /= total::<F>(hat::<F>(f.x), hat::<F>(f.y), hat::<F>(f.z));
        }
        let vector = Vector3::<F>::at(&samples.normals, i).scale(scale);
        f.store(sorted, s * NUMBERS);
        vector.store(sorted, s * NUMBERS + 3);
    }
}
