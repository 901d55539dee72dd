//! Differential quantities of a signed distance on the device: gradient, unit normal and mean curvature, at
//! every cell and at points.
//!
//! # Map
//! As [`isograd::differential`], walls, bounds and zeros included: central differences, one-sided at the walls;
//! curvature `κ = div(∇φ/|∇φ|)`, within `±2/h` and 0 where the gradient is, of a `φ` that [`Options::smoothing`]
//! passes have smoothed; at points the values at the eight cell centers round them, interpolated.
//!
//! # Residual
//! `φ` alone; at points, [`Differential`].
//!
//! # Pullback
//! [`gradient_pullback`], [`unit_normals_pullback`], [`mean_curvature_pullback`] and
//! [`Differential::pullback_at_points`] add to cotangents. Every cell gathers from the differences that it has a
//! part in: the transposes are exact. Where a gradient is 0 or a curvature at its bound, cotangents are left
//! out, as on the CPU, which also counts them.
//!
//! # Not differentiable
//! Where `∇φ = 0`, where `κ` is at its bound, and at a point that passes from one cell-center cube to the next.

mod curvature;
mod curvature_pullback;
mod gradient;
mod points;
mod spot;
mod stencil;

pub use curvature::mean_curvature;
pub use curvature_pullback::mean_curvature_pullback;
pub use gradient::{gradient, gradient_pullback, unit_normals, unit_normals_pullback};
pub use isograd::differential::Options;
pub use points::{Local, LocalCotangent};

use cubecl::prelude::Runtime;
use isograd::Grid;

use crate::{Buffer, Device, Error, Scalar};

/// Units of a group.
const BLOCK: u32 = 256;

/// Gradient and mean curvature at every cell, kept to be asked at any point.
#[derive(Clone, Debug)]
pub struct Differential<T> {
    grid: Grid<T>,
    options: Options,
    gradient: Buffer<T>,
    curvature: Buffer<T>,
}

impl<T: Scalar> Differential<T> {
    /// Of a signed distance, `(nx, ny, nz)` on `grid`.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::NoNumber`], [`Error::TooLarge`].
    pub fn new<R: Runtime>(
        device: &Device<R>,
        phi: &Buffer<T>,
        grid: &Grid<T>,
        options: &Options,
    ) -> Result<Self, Error> {
        Ok(Self {
            grid: *grid,
            options: *options,
            gradient: gradient(device, phi, grid)?,
            curvature: mean_curvature(device, phi, grid, options)?,
        })
    }

    /// `(cells, 3)`: `∇φ` at every cell, per unit length.
    pub fn gradient(&self) -> &Buffer<T> {
        &self.gradient
    }

    /// `(cells,)`: `div(∇φ/|∇φ|)` at every cell, per unit length; `+2/r` on a sphere of radius `r`.
    pub fn curvature(&self) -> &Buffer<T> {
        &self.curvature
    }
}
