//! Mean curvature at every cell.

use cubecl::prelude::*;
use isograd::Grid;

use super::stencil::{Line, difference, lines, mixed_difference, transposed};
use super::{BLOCK, Options};
use crate::element::curvature as element;
use crate::grid::{self, Lattice, check_field};
use crate::vector::{Vector3, is_finite};
use crate::{Buffer, Device, Error, Scalar};

/// `κ = div(∇φ/|∇φ|)` at every cell, `(cells,)`, per unit length: the sum of the principal curvatures, `+2/r` on a
/// sphere of radius `r`. Within `±2/h`; 0 where the gradient is 0. `phi` is `(nx, ny, nz)` on `grid`.
///
/// # Errors
/// [`Error::Length`], [`Error::NoNumber`], [`Error::TooLarge`].
pub fn mean_curvature<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Buffer<T>,
    grid: &Grid<T>,
    options: &Options,
) -> Result<Buffer<T>, Error> {
    device.check_number::<T>()?;
    check_field("the field", phi, grid)?;
    let smooth = smoothed(device, phi, grid, options)?;
    let out = device.empty(grid.cells())?;
    fill_curvatures::launch::<T, R>(
        device.client(),
        device.groups(grid.cells(), BLOCK),
        CubeDim::new_1d(BLOCK),
        smooth.arg(),
        out.arg(),
        grid::arg(grid),
    );
    Ok(out)
}

/// `φ` after `u + ¼ δ²u` along each axis, in all passes. At the walls the second difference is the one-sided one, so
/// that linear functions pass unchanged and nothing is bent there.
pub(super) fn smoothed<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Buffer<T>,
    grid: &Grid<T>,
    options: &Options,
) -> Result<Buffer<T>, Error> {
    let axes = (0..options.smoothing).flat_map(|_| 0..3);
    sweep(device, phi.clone(), grid, axes, false)
}

/// The transpose of [`smoothed`].
pub(super) fn smoothed_back<R: Runtime, T: Scalar>(
    device: &Device<R>,
    bar: Buffer<T>,
    grid: &Grid<T>,
    options: &Options,
) -> Result<Buffer<T>, Error> {
    let axes = (0..options.smoothing).flat_map(|_| (0..3).rev());
    sweep(device, bar, grid, axes, true)
}

/// Smooths along one axis after the other; `values` are kept as they are.
fn sweep<R: Runtime, T: Scalar>(
    device: &Device<R>,
    values: Buffer<T>,
    grid: &Grid<T>,
    axes: impl Iterator<Item = usize>,
    back: bool,
) -> Result<Buffer<T>, Error> {
    // What is read, what is written, and what was read before.
    let (mut values, mut spare) = (values, None);
    for (pass, axis) in axes.enumerate() {
        let out = match spare.take() {
            Some(spare) => spare,
            None => device.empty(grid.cells())?,
        };
        smooth_along::launch::<T, R>(
            device.client(),
            device.groups(grid.cells(), BLOCK),
            CubeDim::new_1d(BLOCK),
            values.arg(),
            out.arg(),
            grid::arg(grid),
            axis,
            back,
        );
        let before = std::mem::replace(&mut values, out);
        // The first one belongs to the caller.
        spare = (pass > 0).then_some(before);
    }
    Ok(values)
}

#[cube(launch)]
fn smooth_along<F: Float + CubeElement>(
    values: &Array<F>,
    out: &mut Array<F>,
    grid: Lattice<F>,
    #[comptime] axis: usize,
    #[comptime] back: bool,
) {
    if ABSOLUTE_POS < out.len() {
        let through = lines::<F>(ABSOLUTE_POS, &grid);
        let bend = if comptime!(axis == 0) {
            bend::<F>(values, through.x, back)
        } else if comptime!(axis == 1) {
            bend::<F>(values, through.y, back)
        } else {
            bend::<F>(values, through.z, back)
        };
        out[ABSOLUTE_POS] = values[ABSOLUTE_POS] + F::new(0.25) * bend;
    }
}

/// The second difference along a line, or its transpose.
#[cube]
fn bend<F: Float>(values: &Array<F>, line: Line, #[comptime] back: bool) -> F {
    if comptime!(back) {
        transposed::<F>(values, line, true, 1usize, 0usize)
    } else {
        difference::<F>(values, line, true)
    }
}

/// Gradient and Hessian at a cell, the latter times `h`.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Derivatives<F: Float> {
    pub first: Vector3<F>,
    /// `xx, yy, zz`.
    pub plain: Vector3<F>,
    /// `xy, xz, yz`.
    pub mixed: Vector3<F>,
}

#[cube]
pub(super) fn derivatives<F: Float + CubeElement>(
    phi: &Array<F>,
    at: usize,
    grid: &Lattice<F>,
) -> Derivatives<F> {
    let through = lines::<F>(at, grid);
    let inverse = F::new(1.0) / grid.spacing;
    let first = Vector3::<F> {
        x: difference::<F>(phi, through.x, false),
        y: difference::<F>(phi, through.y, false),
        z: difference::<F>(phi, through.z, false),
    };
    let plain = Vector3::<F> {
        x: difference::<F>(phi, through.x, true),
        y: difference::<F>(phi, through.y, true),
        z: difference::<F>(phi, through.z, true),
    };
    let mixed = Vector3::<F> {
        x: mixed_difference::<F>(phi, through.x, through.y),
        y: mixed_difference::<F>(phi, through.x, through.z),
        z: mixed_difference::<F>(phi, through.y, through.z),
    };
    Derivatives::<F> {
        first: first.scale(inverse),
        plain: plain.scale(inverse),
        mixed: mixed.scale(inverse),
    }
}

/// `|g|` where there is a gradient, else 0.
#[cube]
pub(super) fn slope_length<F: Float>(g: Vector3<F>) -> F {
    let squared = g.dot(g);
    select(is_finite::<F>(squared), F::sqrt(squared), F::new(0.0))
}

/// `div(g/|g|)`, within ±2 (a sphere of radius 1); 0 where the gradient is 0.
#[cube]
pub(super) fn curvature<F: Float>(d: Derivatives<F>) -> F {
    let length = slope_length::<F>(d.first);
    let mut kappa = F::new(0.0);
    if length > F::new(0.0) {
        let n = d.first.divide(length);
        let plain = element::plain::<F>(d.plain.x, d.plain.y, d.plain.z, n.x, n.y, n.z);
        let mixed = element::mixed::<F>(d.mixed.x, d.mixed.y, d.mixed.z, n.x, n.y, n.z);
        let free = element::curvature::<F>(plain, mixed, length);
        kappa = min(max(free, F::new(-2.0)), F::new(2.0));
    }
    kappa
}

#[cube(launch)]
fn fill_curvatures<F: Float + CubeElement>(phi: &Array<F>, out: &mut Array<F>, grid: Lattice<F>) {
    if ABSOLUTE_POS < out.len() {
        let d = derivatives::<F>(phi, ABSOLUTE_POS, &grid);
        out[ABSOLUTE_POS] = curvature::<F>(d) / grid.spacing;
    }
}
