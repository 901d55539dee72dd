//! Cotangents of samples.

use cubecl::prelude::*;

use crate::device::{argument, check_length};
use crate::primitives::fill::zeros;
use crate::primitives::reduce::{BLOCK, sum_of_group};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Cotangents of what a splat reads, the samples in input order: the stages that read them add to these.
#[derive(Clone, Debug)]
pub struct SampleCotangent<T> {
    /// `(N, 3)` of the points.
    pub points: Buffer<T>,
    /// `(N, 3)` of the outward unit normals.
    pub normals: Buffer<T>,
    /// `(N,)` of the areas.
    pub areas: Buffer<T>,
    /// `(4,)` of the low corner of the grid and of its cell size, at fixed points.
    pub grid: Buffer<T>,
}

/// [`SampleCotangent`] in kernels, but for the grid.
#[derive(CubeLaunch, CubeType)]
pub(crate) struct CotangentArrays<F: Float + CubeElement> {
    pub points: Array<F>,
    pub normals: Array<F>,
    pub areas: Array<F>,
}

argument!(
    SampleCotangent<T> => CotangentArraysLaunch<T, R>:
    |of| of.points.arg(), of.normals.arg(), of.areas.arg()
);

impl<T: Scalar> SampleCotangent<T> {
    /// Zeros for `count` samples.
    pub fn zeros<R: Runtime>(device: &Device<R>, count: usize) -> Result<Self, Error> {
        Ok(Self {
            points: zeros(device, 3 * count)?,
            normals: zeros(device, 3 * count)?,
            areas: zeros(device, count)?,
            grid: zeros(device, 4)?,
        })
    }

    pub(crate) fn check(&self, count: usize) -> Result<(), Error> {
        check_length("the cotangent of the points", &self.points, 3 * count)?;
        check_length("the cotangent of the normals", &self.normals, 3 * count)?;
        check_length("the cotangent of the areas", &self.areas, count)?;
        check_length("the cotangent of the grid", &self.grid, 4)
    }
}

/// Cotangent of the grid at fixed points, from the cotangents `bar` of the points of a group: their negative sum for the low
/// corner, and the negative sum of `spacing` for the cell size. Every unit must call it.
#[cube]
pub(crate) fn subtract_from_grid<F: Float>(bar: Vector3<F>, spacing: F, grid_sums: &mut Array<F>) {
    let mut shared = SharedMemory::<F>::new(BLOCK);
    let x = sum_of_group::<F>(bar.x, &mut shared);
    let y = sum_of_group::<F>(bar.y, &mut shared);
    let z = sum_of_group::<F>(bar.z, &mut shared);
    let spacing = sum_of_group::<F>(spacing, &mut shared);
    let own = CUBE_POS * 4;
    if UNIT_POS == 0 && own < grid_sums.len() {
        grid_sums[own] = -x;
        grid_sums[own + 1] = -y;
        grid_sums[own + 2] = -z;
        grid_sums[own + 3] = -spacing;
    }
}
