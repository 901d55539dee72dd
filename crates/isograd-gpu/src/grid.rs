//! Grids in kernels.

use cubecl::prelude::*;

use crate::device::check_length;
use crate::vector::Vector3;
use crate::{Buffer, Error, Scalar};

/// Low corner, cell size and numbers of cells.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
pub(crate) struct Lattice<F: Float + CubeElement> {
    pub x: F,
    pub y: F,
    pub z: F,
    pub spacing: F,
    pub nx: u32,
    pub ny: u32,
    pub nz: u32,
}

/// A grid as an argument of a kernel.
pub(crate) fn arg<R: Runtime, T: Scalar>(grid: &isograd::Grid<T>) -> LatticeLaunch<T, R> {
    let ([x, y, z], [nx, ny, nz]) = (grid.lower(), grid.shape().map(|n| n as u32));
    LatticeLaunch::new(x, y, z, grid.spacing(), nx, ny, nz)
}

/// Low corner of a grid.
#[cube]
pub(crate) fn low_corner<F: Float + CubeElement>(grid: &Lattice<F>) -> Vector3<F> {
    Vector3::<F>::of(grid.x, grid.y, grid.z)
}

/// Index coordinates `(x − lower)/h` of point `i`.
#[cube]
pub(crate) fn place<F: Float + CubeElement>(
    points: &Array<F>,
    i: usize,
    grid: &Lattice<F>,
) -> Vector3<F> {
    let offset = Vector3::<F>::at(points, i).sub(low_corner::<F>(grid));
    offset.over(grid.spacing)
}

/// The cell at a place in memory.
#[derive(CubeType, Clone, Copy)]
pub(crate) struct Cell {
    pub i: u32,
    pub j: u32,
    pub k: u32,
}

#[cube]
pub(crate) fn cell_at(index: u32, ny: u32, nz: u32) -> Cell {
    let row = index / nz;
    Cell {
        i: row / ny,
        j: row % ny,
        k: index % nz,
    }
}

/// Offset of index coordinates from the center of a cell.
#[cube]
pub(crate) fn from_center<F: Float>(x: Vector3<F>, cell: Cell) -> Vector3<F> {
    let half = F::new(0.5);
    Vector3::<F> {
        x: x.x - F::cast_from(cell.i) - half,
        y: x.y - F::cast_from(cell.j) - half,
        z: x.z - F::cast_from(cell.k) - half,
    }
}

/// Index coordinates of the center of a cell.
#[cube]
pub(crate) fn center_of<F: Float>(cell: Cell) -> Vector3<F> {
    let half = F::new(0.5);
    Vector3::<F> {
        x: F::cast_from(cell.i) + half,
        y: F::cast_from(cell.j) + half,
        z: F::cast_from(cell.k) + half,
    }
}

/// A field must have a value a cell.
pub(crate) fn check_field<T: Scalar>(
    what: &'static str,
    field: &Buffer<T>,
    grid: &isograd::Grid<T>,
) -> Result<(), Error> {
    check_length(what, field, grid.cells())
}
