//! Gradient and unit normal at every cell, and their pullbacks.

use cubecl::prelude::*;
use isograd::Grid;

use super::BLOCK;
use super::stencil::{difference, lines, transposed};
use crate::device::check_length;
use crate::grid::{self, Lattice, check_field};
use crate::vector::{Vector3, is_finite};
use crate::{Buffer, Device, Error, Scalar};

/// `∇φ` at every cell, `(cells, 3)`, per unit length; `phi` is `(nx, ny, nz)` on `grid`.
///
/// # Errors
/// [`Error::Length`], [`Error::NoNumber`], [`Error::TooLarge`].
pub fn gradient<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Buffer<T>,
    grid: &Grid<T>,
) -> Result<Buffer<T>, Error> {
    differentiate(device, phi, grid, false)
}

/// `∇φ/|∇φ|` at every cell, `(cells, 3)`, outward; zero where the gradient is.
///
/// # Errors
/// Those of [`gradient`].
pub fn unit_normals<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Buffer<T>,
    grid: &Grid<T>,
) -> Result<Buffer<T>, Error> {
    differentiate(device, phi, grid, true)
}

fn differentiate<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Buffer<T>,
    grid: &Grid<T>,
    of_length_one: bool,
) -> Result<Buffer<T>, Error> {
    device.check_number::<T>()?;
    check_field("the field", phi, grid)?;
    let out = device.empty(3 * grid.cells())?;
    fill_gradients::launch::<T, R>(
        device.client(),
        device.groups(grid.cells(), BLOCK),
        CubeDim::new_1d(BLOCK),
        phi.arg(),
        out.arg(),
        grid::arg(grid),
        of_length_one,
    );
    Ok(out)
}

/// Adds to `phi_bar`, `(nx, ny, nz)`, what the cotangents `bar` `(cells, 3)` of the [`gradient`] mean for `φ`. The
/// map is linear, and this its transpose. The cell size is held constant.
///
/// # Errors
/// [`Error::Length`], [`Error::NoNumber`].
pub fn gradient_pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    grid: &Grid<T>,
    bar: &Buffer<T>,
    phi_bar: &Buffer<T>,
) -> Result<(), Error> {
    device.check_number::<T>()?;
    check_length("the cotangent of the gradient", bar, 3 * grid.cells())?;
    add_gradient(device, grid, [bar, bar, bar], true, phi_bar)
}

/// Adds to `phi_bar` what the cotangents `bar` `(cells, 3)` of [`unit_normals`] mean for `phi`. Where the gradient
/// is 0, or so small that its reciprocal is not finite, a cotangent is left out.
///
/// # Errors
/// [`Error::Length`], [`Error::NoNumber`], [`Error::TooLarge`].
pub fn unit_normals_pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    phi: &Buffer<T>,
    grid: &Grid<T>,
    bar: &Buffer<T>,
    phi_bar: &Buffer<T>,
) -> Result<(), Error> {
    device.check_number::<T>()?;
    check_field("the field", phi, grid)?;
    check_length("the cotangent of the normals", bar, 3 * grid.cells())?;
    let of_gradient = device.empty(bar.len())?;
    pull_normals::launch::<T, R>(
        device.client(),
        device.groups(grid.cells(), BLOCK),
        CubeDim::new_1d(BLOCK),
        phi.arg(),
        bar.arg(),
        of_gradient.arg(),
        grid::arg(grid),
    );
    gradient_pullback(device, grid, &of_gradient, phi_bar)
}

/// Adds the transposed differences of cotangents of the gradient: of one array, `(cells, 3)`, given thrice, if
/// `interleaved`; else of three, `(cells,)` each.
pub(super) fn add_gradient<R: Runtime, T: Scalar>(
    device: &Device<R>,
    grid: &Grid<T>,
    [x, y, z]: [&Buffer<T>; 3],
    interleaved: bool,
    phi_bar: &Buffer<T>,
) -> Result<(), Error> {
    check_field("the cotangent of the field", phi_bar, grid)?;
    add_gradients::launch::<T, R>(
        device.client(),
        device.groups(grid.cells(), BLOCK),
        CubeDim::new_1d(BLOCK),
        x.arg(),
        y.arg(),
        z.arg(),
        phi_bar.arg(),
        grid::arg(grid),
        interleaved,
    );
    Ok(())
}

/// `∇φ` at a cell.
#[cube]
fn gradient_at<F: Float + CubeElement>(phi: &Array<F>, at: usize, grid: &Lattice<F>) -> Vector3<F> {
    let through = lines::<F>(at, grid);
    let inverse = F::new(1.0) / grid.spacing;
    Vector3::<F> {
        x: difference::<F>(phi, through.x, false) * inverse,
        y: difference::<F>(phi, through.y, false) * inverse,
        z: difference::<F>(phi, through.z, false) * inverse,
    }
}

/// Of length 1, or zero.
#[cube]
pub(super) fn unit<F: Float>(g: Vector3<F>) -> Vector3<F> {
    g.direction().choose(g.is_finite(), Vector3::<F>::zero())
}

/// `(n̄ − n (n·n̄))/|g|`, and zero where that does not exist.
#[cube]
pub(super) fn unit_pullback<F: Float>(g: Vector3<F>, bar: Vector3<F>) -> Vector3<F> {
    let n = unit::<F>(g);
    let across = bar.sub(n.scale(n.dot(bar)));
    let out = across.divide(g.norm());
    out.choose(g.is_finite() && out.is_finite(), Vector3::<F>::zero())
}

#[cube(launch)]
fn fill_gradients<F: Float + CubeElement>(
    phi: &Array<F>,
    out: &mut Array<F>,
    grid: Lattice<F>,
    #[comptime] of_length_one: bool,
) {
    if ABSOLUTE_POS < phi.len() {
        let g = gradient_at::<F>(phi, ABSOLUTE_POS, &grid);
        if comptime!(of_length_one) {
            unit::<F>(g).write(out, ABSOLUTE_POS);
        } else {
            g.write(out, ABSOLUTE_POS);
        }
    }
}

#[cube(launch)]
fn pull_normals<F: Float + CubeElement>(
    phi: &Array<F>,
    bar: &Array<F>,
    of_gradient: &mut Array<F>,
    grid: Lattice<F>,
) {
    if ABSOLUTE_POS < phi.len() {
        let g = gradient_at::<F>(phi, ABSOLUTE_POS, &grid);
        let bar = Vector3::<F>::at(bar, ABSOLUTE_POS);
        unit_pullback::<F>(g, bar).write(of_gradient, ABSOLUTE_POS);
    }
}

#[cube(launch)]
fn add_gradients<F: Float + CubeElement>(
    x: &Array<F>,
    y: &Array<F>,
    z: &Array<F>,
    phi_bar: &mut Array<F>,
    grid: Lattice<F>,
    #[comptime] interleaved: bool,
) {
    if ABSOLUTE_POS < phi_bar.len() {
        let through = lines::<F>(ABSOLUTE_POS, &grid);
        let pitch = comptime!(if interleaved { 3usize } else { 1usize });
        let (second, third) = comptime!((pitch / 2, pitch - 1));
        let along_x = transposed::<F>(x, through.x, false, pitch, 0usize);
        let along_y = transposed::<F>(y, through.y, false, pitch, second);
        let along_z = transposed::<F>(z, through.z, false, pitch, third);
        let sum = (along_x + along_y + along_z) / grid.spacing;
        phi_bar[ABSOLUTE_POS] += select(is_finite::<F>(sum), sum, F::new(0.0));
    }
}
