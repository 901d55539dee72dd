//! From the indicator to its mean.

use cubecl::prelude::*;

use super::Residual;
use crate::device::{check_length, launch};
use crate::grid::{Lattice, check_field, place};
use crate::primitives::reduce::{BLOCK, sum_columns, write_two_sums};
use crate::trilinear::interpolate;
use crate::{Buffer, Device, Error, Scalar};

/// The iso-value `c` of `chi`, `(nx, ny, nz)` on `grid`, an array of one number, for `(N, 3)` samples `points` in
/// the user's unit and their `(N,)` areas. It is not finite, as the CPU's stage says by an error, where
/// the areas do not add up to a positive number or the indicator at the samples is not finite.
///
/// # Errors
/// [`Error::Length`] where the arrays do not match, [`Error::NoNumber`], [`Error::TooLarge`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    chi: &Buffer<T>,
    grid: &isograd::Grid<T>,
    points: &Buffer<T>,
    areas: &Buffer<T>,
) -> Result<(Buffer<T>, Residual<T>), Error> {
    device.check_number::<T>()?;
    check_field("the indicator", chi, grid)?;
    check_length("the array of points", points, 3 * areas.len())?;
    let count = areas.len();
    let at_samples: Buffer<T> = device.empty(4 * count)?;
    let group_sums: Buffer<T> = device.empty(2 * count.div_ceil(BLOCK))?;
    launch!(device, count, BLOCK => find_at_samples<T>(
        chi, points, areas, at_samples, group_sums, count as u32, grid,
    ));
    let sums = sum_columns(device, &group_sums, 2)?;
    let value: Buffer<T> = device.empty(1)?;
    launch!(device, 1, 1 => divide<T>(sums, value));
    Ok((value, Residual { sums, at_samples }))
}

/// `χ` and `∇χ` at each sample, and `a χ` and `a` summed a group at a time.
#[cube(launch)]
fn find_at_samples<F: Float + CubeElement>(
    chi: &Array<F>,
    points: &Array<F>,
    areas: &Array<F>,
    at_samples: &mut Array<F>,
    group_sums: &mut Array<F>,
    count: u32,
    grid: Lattice<F>,
) {
    let i = ABSOLUTE_POS;
    let mut product = F::new(0.0);
    let mut area = F::new(0.0);
    if i < count as usize {
        let p = place::<F>(points, i, &grid);
        let found = interpolate::<F>(chi, p, &grid);
        at_samples[4 * i] = found.value;
        found.gradient.store(at_samples, 4 * i + 1);
        area = areas[i];
        product = area * found.value;
    }
    write_two_sums::<F>(product, area, group_sums);
}

/// `Σ a χ / Σ a`; not finite where `Σ a` is not positive.
#[cube(launch)]
fn divide<F: Float>(sums: &Array<F>, value: &mut Array<F>) {
    if ABSOLUTE_POS == 0 {
        value[0] = sums[0] / max(sums[1], F::new(0.0));
    }
}
