//! The pullback of the mean curvature.

use cubecl::prelude::*;
use isograd::Grid;

use super::curvature::{
    Derivatives, curvature, derivatives, slope_length, smoothed, smoothed_back,
};
use super::stencil::{Line, lines, taken, taker, takers, transposed};
use super::{BLOCK, Options};
use crate::element::curvature as element;
use crate::grid::{self, Lattice, check_field};
use crate::vector::{Vector3, is_finite};
use crate::{Buffer, Device, Error, Scalar};

/// Cotangents of the derivatives of a cell: three of the gradient, then `xx, yy, zz, xy, xz, yz` of the Hessian.
const DERIVATIVES: usize = 9;

/// Adds to `phi_bar` what the cotangents `bar` of [`mean_curvature`](super::mean_curvature) with the same options
/// mean for `phi`; all are `(nx, ny, nz)`. Smoothing and the one-sided differences at the walls are transposed
/// exactly. The cell size is held constant. Where the gradient is 0 or the curvature at its bound, a cotangent is
/// left out.
///
/// # Errors
/// [`Error::Length`], [`Error::NoNumber`], [`Error::TooLarge`].
pub fn mean_curvature_pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Buffer<T>,
    grid: &Grid<T>,
    options: &Options,
    bar: &Buffer<T>,
    phi_bar: &Buffer<T>,
) -> Result<(), Error> {
    device.check_number::<T>()?;
    check_field("the field", phi, grid)?;
    check_field("the cotangent of the curvature", bar, grid)?;
    check_field("the cotangent of the field", phi_bar, grid)?;
    let cells = grid.cells();
    let (groups, dim) = (device.groups(cells, BLOCK), CubeDim::new_1d(BLOCK));
    let bars: Buffer<T> = device.empty(DERIVATIVES * cells)?;
    pull_curvatures::launch::<T, R>(
        device.client(),
        groups.clone(),
        dim,
        smoothed(device, phi, grid, options)?.arg(),
        bar.arg(),
        bars.arg(),
        grid::arg(grid),
    );
    let of_smooth: Buffer<T> = device.empty(cells)?;
    gather_derivatives::launch::<T, R>(
        device.client(),
        groups.clone(),
        dim,
        bars.arg(),
        of_smooth.arg(),
        grid::arg(grid),
    );
    drop(bars);
    let of_phi = smoothed_back(device, of_smooth, grid, options)?;
    add_finite::launch::<T, R>(
        device.client(),
        groups,
        dim,
        of_phi.arg(),
        phi_bar.arg(),
        grid.spacing(),
    );
    Ok(())
}

/// Cotangents of the derivatives for that of their [`curvature`]; zero where that has no derivative.
#[cube]
fn pull<F: Float>(d: Derivatives<F>, bar: F) -> Derivatives<F> {
    let zero = Vector3::<F>::zero();
    let kappa = curvature::<F>(d);
    let length = slope_length::<F>(d.first);
    let n = d.first.divide(length);
    let per_length = bar / length;
    let (p, m) = (d.plain, d.mixed);
    let x = p.x * n.x + m.x * n.y + m.y * n.z;
    let y = m.x * n.x + p.y * n.y + m.z * n.z;
    let z = m.y * n.x + m.z * n.y + p.z * n.z;
    let trace = p.x + p.y + p.z;
    let first = Vector3::<F> {
        x: element::gradient_bar::<F>(per_length, n.x, trace, x, length, kappa),
        y: element::gradient_bar::<F>(per_length, n.y, trace, y, length, kappa),
        z: element::gradient_bar::<F>(per_length, n.z, trace, z, length, kappa),
    };
    let plain = Vector3::<F> {
        x: element::plain_bar::<F>(per_length, n.x),
        y: element::plain_bar::<F>(per_length, n.y),
        z: element::plain_bar::<F>(per_length, n.z),
    };
    let mixed = Vector3::<F> {
        x: element::mixed_bar::<F>(per_length, n.x, n.y),
        y: element::mixed_bar::<F>(per_length, n.x, n.z),
        z: element::mixed_bar::<F>(per_length, n.y, n.z),
    };
    let smooth = length > F::new(0.0) && F::abs(kappa) < F::new(2.0);
    let exists = smooth && first.is_finite() && plain.is_finite() && mixed.is_finite();
    Derivatives::<F> {
        first: first.choose(exists, zero),
        plain: plain.choose(exists, zero),
        mixed: mixed.choose(exists, zero),
    }
}

/// Writes a vector as the columns of a cell from `first` on.
#[cube]
fn write_columns<F: Float>(
    bars: &mut Array<F>,
    at: usize,
    cells: usize,
    #[comptime] first: usize,
    v: Vector3<F>,
) {
    bars[first * cells + at] = v.x;
    bars[(first + 1) * cells + at] = v.y;
    bars[(first + 2) * cells + at] = v.z;
}

/// Writes the cotangents of the derivatives of each cell, `(9, cells)`.
#[cube(launch)]
fn pull_curvatures<F: Float + CubeElement>(
    phi: &Array<F>,
    bar: &Array<F>,
    bars: &mut Array<F>,
    grid: Lattice<F>,
) {
    let cells = phi.len();
    if ABSOLUTE_POS < cells {
        let d = derivatives::<F>(phi, ABSOLUTE_POS, &grid);
        let out = pull::<F>(d, bar[ABSOLUTE_POS] / grid.spacing);
        write_columns::<F>(bars, ABSOLUTE_POS, cells, 0usize, out.first);
        write_columns::<F>(bars, ABSOLUTE_POS, cells, 3usize, out.plain);
        write_columns::<F>(bars, ABSOLUTE_POS, cells, 6usize, out.mixed);
    }
}

/// `h Σ_a D_aᵀ ḡ_a + h² Σ_ab D_abᵀ H̄_ab / h` at each cell.
#[cube(launch)]
fn gather_derivatives<F: Float + CubeElement>(
    bars: &Array<F>,
    out: &mut Array<F>,
    grid: Lattice<F>,
) {
    let cells = out.len();
    if ABSOLUTE_POS < cells {
        let through = lines::<F>(ABSOLUTE_POS, &grid);
        let (x, y, z) = (through.x, through.y, through.z);
        let mut sum = along::<F>(bars, x.further(3usize * cells), true);
        sum += along::<F>(bars, y.further(4usize * cells), true);
        sum += along::<F>(bars, z.further(5usize * cells), true);
        sum += along::<F>(bars, z.further(2usize * cells), false);
        for t in 0..takers(x) {
            let weight = taken::<F>(x, t, false);
            if weight != F::new(0.0) {
                let place = taker(x, t);
                let xy = y.through(x, place).further(6usize * cells);
                let xz = z.through(x, place).further(7usize * cells);
                sum += weight
                    * (bars[x.at(place)]
                        + along::<F>(bars, xy, false)
                        + along::<F>(bars, xz, false));
            }
        }
        for t in 0..takers(y) {
            let weight = taken::<F>(y, t, false);
            if weight != F::new(0.0) {
                let place = taker(y, t);
                let yz = z.through(y, place).further(8usize * cells);
                let own = y.further(cells).at(place);
                sum += weight * (bars[own] + along::<F>(bars, yz, false));
            }
        }
        out[ABSOLUTE_POS] = sum;
    }
}

/// The transposed difference along a line of one column.
#[cube]
fn along<F: Float>(bars: &Array<F>, line: Line, #[comptime] second: bool) -> F {
    transposed::<F>(bars, line, second, 1usize, 0usize)
}

/// Adds what is finite, over the cell size.
#[cube(launch)]
fn add_finite<F: Float + CubeElement>(values: &Array<F>, out: &mut Array<F>, spacing: F) {
    if ABSOLUTE_POS < out.len() {
        let x = values[ABSOLUTE_POS] / spacing;
        out[ABSOLUTE_POS] += select(is_finite::<F>(x), x, F::new(0.0));
    }
}
