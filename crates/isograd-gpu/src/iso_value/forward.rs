//! From the indicator to its mean.

use cubecl::prelude::*;

use super::Residual;
use crate::device::check_length;
use crate::element::linear::lerp;
use crate::grid::{self, Lattice, check_field, place};
use crate::primitives::reduce::{BLOCK, sum_columns, sum_of_group};
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
    interpolate::launch::<T, R>(
        device.client(),
        device.groups(count, BLOCK as u32),
        CubeDim::new_1d(BLOCK as u32),
        chi.arg(),
        points.arg(),
        areas.arg(),
        at_samples.arg(),
        group_sums.arg(),
        count as u32,
        grid::arg(grid),
    );
    let sums = sum_columns(device, &group_sums, 2)?;
    let value: Buffer<T> = device.empty(1)?;
    divide::launch::<T, R>(
        device.client(),
        device.groups(1, 1),
        CubeDim::new_1d(1),
        sums.arg(),
        value.arg(),
    );
    Ok((value, Residual { sums, at_samples }))
}

/// Two neighbouring cell centres along an axis, and where a point is between them.
#[derive(CubeType, Clone, Copy)]
struct Between<F: Float> {
    /// The lower one.
    cell: u32,
    /// How far the point is from it, in cells: 0 to 1.
    fraction: F,
    /// 1 between cell centres; 0 beyond the outermost, where the field is constant.
    inside: F,
}

#[cube]
fn between<F: Float>(x: F, cells: u32) -> Between<F> {
    let last = cells - 1u32;
    let mut u = x - F::new(0.5);
    let mut inside = F::new(1.0);
    if u < F::new(0.0) {
        u = F::new(0.0);
        inside = F::new(0.0);
    }
    if u > F::cast_from(last) {
        u = F::cast_from(last);
        inside = F::new(0.0);
    }
    let cell = min(u32::cast_from(u), last - 1u32);
    Between::<F> {
        cell,
        fraction: u - F::cast_from(cell),
        inside,
    }
}

/// `χ` and `∇χ` at each sample, and `a χ` and `a` summed a group at a time.
#[cube(launch)]
fn interpolate<F: Float + CubeElement>(
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
        let x = between::<F>(p.x, grid.nx);
        let y = between::<F>(p.y, grid.ny);
        let z = between::<F>(p.z, grid.nz);
        let row = grid.nz as usize;
        let plane = (grid.ny * grid.nz) as usize;
        let at = x.cell as usize * plane + y.cell as usize * row + z.cell as usize;
        let e00 = edge::<F>(chi, at, z.fraction);
        let e01 = edge::<F>(chi, at + row, z.fraction);
        let e10 = edge::<F>(chi, at + plane, z.fraction);
        let e11 = edge::<F>(chi, at + plane + row, z.fraction);
        let low = lerp::<F>(e00.value, e01.value, y.fraction);
        let high = lerp::<F>(e10.value, e11.value, y.fraction);
        let low_slope = lerp::<F>(e00.slope, e01.slope, y.fraction);
        let high_slope = lerp::<F>(e10.slope, e11.slope, y.fraction);
        let value = lerp::<F>(low, high, x.fraction);
        let across = lerp::<F>(e01.value - e00.value, e11.value - e10.value, x.fraction);
        at_samples[4 * i] = value;
        at_samples[4 * i + 1] = (high - low) * x.inside;
        at_samples[4 * i + 2] = across * y.inside;
        at_samples[4 * i + 3] = lerp::<F>(low_slope, high_slope, x.fraction) * z.inside;
        area = areas[i];
        product = area * value;
    }
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let products = sum_of_group::<F>(product, &mut shared);
    let areas = sum_of_group::<F>(area, &mut shared);
    let own = CUBE_POS * 2;
    if UNIT_POS == 0 && own < group_sums.len() {
        group_sums[own] = products;
        group_sums[own + 1] = areas;
    }
}

/// Value between a cell and the next along z, and the slope.
#[derive(CubeType, Clone, Copy)]
struct Edge<F: Float> {
    value: F,
    slope: F,
}

#[cube]
fn edge<F: Float>(chi: &Array<F>, at: usize, fraction: F) -> Edge<F> {
    let low = chi[at];
    let high = chi[at + 1];
    Edge::<F> {
        value: lerp::<F>(low, high, fraction),
        slope: high - low,
    }
}

/// `Σ a χ / Σ a`; not finite where `Σ a` is not positive.
#[cube(launch)]
fn divide<F: Float>(sums: &Array<F>, value: &mut Array<F>) {
    if ABSOLUTE_POS == 0 {
        value[0] = sums[0] / max(sums[1], F::new(0.0));
    }
}
