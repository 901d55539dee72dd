//! Cotangents of the right-hand side to cotangents of points, normals, areas and grid: one gather a sample.

use cubecl::prelude::*;

use super::cotangent::subtract_from_grid;
use super::forward::sorted;
use super::stencil::{NUMBERS, REACH, WIDTH, along, central, extra, sum, total};
use super::{CotangentArrays, Residual, SampleArrays, SampleCotangent, Samples, Weights};
use crate::device::{check_length, launch};
use crate::element::stencil::{Triple, bspline, bspline_slope, hat, hat_slope};
use crate::grid::{Lattice, cell_at, center_of, check_field};
use crate::primitives::fill::add;
use crate::primitives::reduce::{BLOCK, sum_columns};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Adds the cotangents of the samples and the grid to `out`, given the cotangents `b_bar` of the right-hand side,
/// `(nx, ny, nz)`, and samples and residual of [`forward`](super::forward).
///
/// # Errors
/// [`Error::Length`] where the arrays do not match, [`Error::TooLarge`].
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    samples: Samples<'_, T>,
    b_bar: &Buffer<T>,
    out: &SampleCotangent<T>,
) -> Result<(), Error> {
    let (grid, order, count) = (&residual.grid, &residual.order, samples.len());
    samples.check()?;
    check_length("the array of areas", samples.areas, order.keys.len())?;
    check_field("the cotangent of the right-hand side", b_bar, grid)?;
    out.check(count)?;
    let blocks = count.div_ceil(BLOCK);
    let gathered = sorted(device, samples, residual, false)?;
    let grid_sums: Buffer<T> = device.empty(4 * blocks)?;
    launch!(device, count, BLOCK => gather_samples<T>(
        order.keys, b_bar, gathered, grid_sums, count as u32, grid,
        residual.weights == Weights::Paper,
    ));
    add(device, &sum_columns(device, &grid_sums, 4)?, &out.grid)?;
    launch!(device, count, BLOCK => add_to_samples<T>(
        samples, order.keys, order.places, gathered, out, grid.cells() as u32,
    ));
    Ok(())
}

/// Cotangents of a sample from the cells around it, in index space: of the vector that was spread, and of the sample's
/// index coordinates.
#[derive(CubeType, Clone, Copy)]
struct Gathered<F: Float> {
    spread: Vector3<F>,
    place: Vector3<F>,
}

/// Weights along each axis, or their derivatives.
#[derive(CubeType, Clone, Copy)]
struct Weights3<F: Float> {
    x: Triple<F>,
    y: Triple<F>,
    z: Triple<F>,
}

/// Replaces the offset and vector of each sample by the cotangents of the vector `a n` and of the point, and
/// sums the cotangent of the grid, a group at a time.
#[cube(launch)]
fn gather_samples<F: Float + CubeElement>(
    keys: &Array<u32>,
    b_bar: &Array<F>,
    samples: &mut Array<F>,
    grid_sums: &mut Array<F>,
    count: u32,
    grid: Lattice<F>,
    #[comptime] paper: bool,
) {
    let s = ABSOLUTE_POS;
    let mut bar = Vector3::<F>::zero();
    let mut of_spacing = F::new(0.0);
    if s < count as usize && keys[s] < grid.nx * grid.ny * grid.nz {
        let cell = cell_at(keys[s], grid.ny, grid.nz);
        let corner = keys[s] - REACH * ((grid.ny + 1u32) * grid.nz + 1u32);
        let f = Vector3::<F>::load(samples, s * NUMBERS);
        let v = Vector3::<F>::load(samples, s * NUMBERS + 3);
        let found = gather_sample::<F>(b_bar, corner, &grid, f, v, paper);
        let h = grid.spacing;
        bar = found.place.over(h);
        found.spread.over(h).over(h).store(samples, s * NUMBERS);
        bar.store(samples, s * NUMBERS + 3);
        // ∂x̂/∂h = −x̂/h; and the areas are divided by h².
        let x = center_of::<F>(cell).add(f);
        of_spacing = x.dot(bar) + F::new(2.0) * v.dot(found.spread) / h;
    }
    subtract_from_grid::<F>(bar, of_spacing, grid_sums);
}

/// A sample at offset `f` from the center of its cell, with vector `v`.
#[cube]
fn gather_sample<F: Float + CubeElement>(
    b_bar: &Array<F>,
    corner: u32,
    grid: &Lattice<F>,
    f: Vector3<F>,
    v: Vector3<F>,
    #[comptime] paper: bool,
) -> Gathered<F> {
    if comptime!(paper) {
        let w = Weights3::<F> {
            x: hat::<F>(f.x),
            y: hat::<F>(f.y),
            z: hat::<F>(f.z),
        };
        let slopes = Weights3::<F> {
            x: hat_slope::<F>(f.x),
            y: hat_slope::<F>(f.y),
            z: hat_slope::<F>(f.z),
        };
        gather_paper::<F>(b_bar, corner, grid, w, slopes, v)
    } else {
        let w = Weights3::<F> {
            x: bspline::<F>(f.x),
            y: bspline::<F>(f.y),
            z: bspline::<F>(f.z),
        };
        let slopes = Weights3::<F> {
            x: bspline_slope::<F>(f.x),
            y: bspline_slope::<F>(f.y),
            z: bspline_slope::<F>(f.z),
        };
        gather_product::<F>(b_bar, corner, grid, w, slopes, v)
    }
}

/// `(P + extra · C)/total`, by the rule of quotients: `P` spreads by the product of hats, `C` into the
/// central cell.
#[cube]
fn gather_paper<F: Float + CubeElement>(
    b_bar: &Array<F>,
    corner: u32,
    grid: &Lattice<F>,
    w: Weights3<F>,
    d: Weights3<F>,
    v: Vector3<F>,
) -> Gathered<F> {
    let one = central::<F>();
    let ones = Weights3::<F> {
        x: one,
        y: one,
        z: one,
    };
    let p = gather_product::<F>(b_bar, corner, grid, w, d, v);
    let c = gather_product::<F>(b_bar, corner, grid, ones, ones, v);
    let (extra, total) = (extra::<F>(w.x, w.y, w.z), total::<F>(w.x, w.y, w.z));
    let spread = p.spread.add(c.spread.scale(extra)).over(total);
    let of_extra = Vector3::<F> {
        x: -d.x.center * w.y.center * w.z.center,
        y: -d.y.center * w.z.center * w.x.center,
        z: -d.z.center * w.x.center * w.y.center,
    };
    let of_total = Vector3::<F> {
        x: sum::<F>(d.x) * sum::<F>(w.y) * sum::<F>(w.z) + of_extra.x,
        y: sum::<F>(d.y) * sum::<F>(w.z) * sum::<F>(w.x) + of_extra.y,
        z: sum::<F>(d.z) * sum::<F>(w.x) * sum::<F>(w.y) + of_extra.z,
    };
    let through_extra = p.place.add(of_extra.scale(v.dot(c.spread)));
    Gathered::<F> {
        spread,
        place: through_extra.sub(of_total.scale(v.dot(spread))).over(total),
    }
}

/// Weights `w` that are a product, with derivatives `d`. Sums over z, then y, then x; `a_b` is weighted by `a`
/// along y and by `b` along z, where `m` and `s` are the mass and the derivative of the weights and `dm` and
/// `ds` those of their derivatives.
#[cube]
fn gather_product<F: Float + CubeElement>(
    b_bar: &Array<F>,
    corner: u32,
    grid: &Lattice<F>,
    w: Weights3<F>,
    d: Weights3<F>,
    v: Vector3<F>,
) -> Gathered<F> {
    let zero = F::new(0.0);
    let mut spread = Vector3::<F>::zero();
    let mut place = Vector3::<F>::zero();
    for i in 0..WIDTH {
        let mut m_m = zero;
        let mut s_m = zero;
        let mut m_s = zero;
        let mut dm_m = zero;
        let mut ds_m = zero;
        let mut dm_s = zero;
        let mut m_dm = zero;
        let mut s_dm = zero;
        let mut m_ds = zero;
        for j in 0..WIDTH {
            let row = (corner + (i * grid.ny + j) * grid.nz) as usize;
            let mut m = zero;
            let mut s = zero;
            let mut dm = zero;
            let mut ds = zero;
            #[unroll]
            for k in 0..WIDTH {
                let value = b_bar[row + k as usize];
                let (z, dz) = (along::<F>(w.z, k), along::<F>(d.z, k));
                m += value * z.mass;
                s += value * z.slope;
                dm += value * dz.mass;
                ds += value * dz.slope;
            }
            let (y, dy) = (along::<F>(w.y, j), along::<F>(d.y, j));
            m_m += y.mass * m;
            s_m += y.slope * m;
            m_s += y.mass * s;
            dm_m += dy.mass * m;
            ds_m += dy.slope * m;
            dm_s += dy.mass * s;
            m_dm += y.mass * dm;
            s_dm += y.slope * dm;
            m_ds += y.mass * ds;
        }
        let (x, dx) = (along::<F>(w.x, i), along::<F>(d.x, i));
        spread.x += x.slope * m_m;
        spread.y += x.mass * s_m;
        spread.z += x.mass * m_s;
        place.x += v.x * dx.slope * m_m + dx.mass * (v.y * s_m + v.z * m_s);
        place.y += v.x * x.slope * dm_m + x.mass * (v.y * ds_m + v.z * dm_s);
        place.z += v.x * x.slope * m_dm + x.mass * (v.y * s_dm + v.z * m_ds);
    }
    Gathered::<F> { spread, place }
}

/// From the sorted order to that of the input.
#[cube(launch)]
fn add_to_samples<F: Float + CubeElement>(
    samples: &SampleArrays<F>,
    keys: &Array<u32>,
    places: &Array<u32>,
    gathered: &Array<F>,
    out: &mut CotangentArrays<F>,
    cells: u32,
) {
    let s = ABSOLUTE_POS;
    if s < samples.count as usize && keys[s] < cells {
        let i = places[s] as usize;
        let mut area_bar = F::new(0.0);
        for axis in 0..3usize {
            let spread = gathered[s * NUMBERS + axis];
            out.normals[3 * i + axis] += spread * samples.areas[i];
            out.points[3 * i + axis] += gathered[s * NUMBERS + 3 + axis];
            area_bar += spread * samples.normals[3 * i + axis];
        }
        out.areas[i] += area_bar;
    }
}
