//! Cotangent of the iso-value to cotangents of the indicator, the samples and the grid.

use cubecl::prelude::*;

use super::Residual;
use crate::device::{Ready, check_length, launch};
use crate::grid::{Lattice, cell_at, check_field, from_center, place};
use crate::primitives::fill::add;
use crate::primitives::reduce::{BLOCK, sum_columns};
use crate::splat::{self, SampleCotangent, Samples, subtract_from_grid};
use crate::spread::{Before, spread};
use crate::trilinear::{NUMBERS, REACH, Trilinear};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Adds to `chi_bar`, `(nx, ny, nz)`, and to `out` what the cotangent `bar` of the iso-value, an array of one
/// number, and the cotangents `values_bar` `(N,)` of `χ(x_i)` mean for the indicator, the samples and the grid.
/// `splat` is what the forward splat of the same samples on the same grid left; all else is as it was in
/// [`forward`](super::forward).
///
/// # Errors
/// [`Error::Length`] where the arrays do not match, [`Error::TooLarge`].
#[allow(clippy::too_many_arguments)]
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    splat: &splat::Residual<T>,
    samples: Samples<'_, T>,
    bar: &Buffer<T>,
    values_bar: Option<&Buffer<T>>,
    chi_bar: &Buffer<T>,
    out: &SampleCotangent<T>,
) -> Result<(), Error> {
    let (grid, order, count) = (&splat.grid, &splat.order, samples.len());
    samples.check()?;
    check_length("the array of areas", samples.areas, order.keys.len())?;
    check_length("the residual", &residual.at_samples, 4 * count)?;
    check_length("the cotangent of the iso-value", bar, 1)?;
    check_field("the cotangent of the indicator", chi_bar, grid)?;
    out.check(count)?;
    let given = values_bar.unwrap_or(bar);
    if values_bar.is_some() {
        check_length("the cotangent of the values", given, count)?;
    }
    let shares: Buffer<T> = device.empty(count)?;
    let mean = MeanLaunch::new(
        samples.areas.arg(),
        residual.at_samples.arg(),
        residual.sums.arg(),
        bar.arg(),
        given.arg(),
    );
    launch!(device, count, BLOCK => pull_samples<T>(
        Ready::new(mean), out.points, out.areas, shares, grid.spacing(), values_bar.is_some(),
    ));
    let sorted: Buffer<T> = device.empty(NUMBERS * count)?;
    let grid_sums: Buffer<T> = device.empty(4 * count.div_ceil(BLOCK))?;
    launch!(device, count, BLOCK => sort_shares<T>(
        samples.points, residual.at_samples, shares, order.keys, order.places, sorted, grid_sums,
        grid,
    ));
    add(device, &sum_columns(device, &grid_sums, 4)?, &out.grid)?;
    spread::<R, T, Trilinear>(device, &sorted, order, REACH, Before::Kept, chi_bar)
}

/// The mean, and cotangents of it and of the values at the samples.
#[derive(CubeLaunch, CubeType)]
struct Mean<F: Float + CubeElement> {
    areas: Array<F>,
    at_samples: Array<F>,
    sums: Array<F>,
    bar: Array<F>,
    values_bar: Array<F>,
}

/// The cotangent of the value at each sample, and what it means for the point; and the cotangent of the area,
/// which the mean alone depends on.
#[cube(launch)]
fn pull_samples<F: Float + CubeElement>(
    of: &Mean<F>,
    points_bar: &mut Array<F>,
    areas_bar: &mut Array<F>,
    shares: &mut Array<F>,
    spacing: F,
    #[comptime] given: bool,
) {
    let i = ABSOLUTE_POS;
    if i < shares.len() {
        let share = of.bar[0] / of.sums[1];
        let mean = of.sums[0] / of.sums[1];
        let mut value_bar = share * of.areas[i];
        if given {
            value_bar += of.values_bar[i];
        }
        shares[i] = value_bar;
        let slope = value_bar / spacing;
        let gradient = Vector3::<F>::load(&of.at_samples, 4 * i + 1);
        gradient.scale(slope).add_to(points_bar, 3 * i);
        areas_bar[i] += share * (of.at_samples[4 * i] - mean);
    }
}

/// Offset and share of each sample in sorted order; and what the cotangents of the points mean for the grid,
/// summed a group at a time.
#[cube(launch)]
fn sort_shares<F: Float + CubeElement>(
    points: &Array<F>,
    at_samples: &Array<F>,
    shares: &Array<F>,
    keys: &Array<u32>,
    places: &Array<u32>,
    sorted: &mut Array<F>,
    grid_sums: &mut Array<F>,
    grid: Lattice<F>,
) {
    let s = ABSOLUTE_POS;
    let mut bar = Vector3::<F>::zero();
    let mut of_spacing = F::new(0.0);
    if s < keys.len() {
        let i = places[s] as usize;
        let x = place::<F>(points, i, &grid);
        let cell = cell_at(keys[s], grid.ny, grid.nz);
        from_center::<F>(x, cell).store(sorted, NUMBERS * s);
        sorted[NUMBERS * s + 3] = shares[i];
        bar = Vector3::<F>::load(at_samples, 4 * i + 1).scale(shares[i] / grid.spacing);
        of_spacing = x.dot(bar);
    }
    subtract_from_grid::<F>(bar, of_spacing, grid_sums);
}
