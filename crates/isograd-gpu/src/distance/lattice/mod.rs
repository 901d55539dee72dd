//! Distance at every cell centre.

mod forward;
mod pullback;

pub use forward::forward;
pub use pullback::pullback;

use cubecl::prelude::*;
use isograd::Grid;

use super::Mesh;
use super::vector::Vector3;
use crate::Buffer;

/// What [`forward`] keeps for [`pullback`]. Arrays share the memory of those that went in and came out.
#[derive(Clone, Debug)]
pub struct Residual<T> {
    mesh: Mesh<T>,
    grid: Grid<T>,
    phi: Buffer<T>,
    closest: Buffer<u32>,
}

impl<T> Residual<T> {
    /// The closest face of each cell, in memory order; [`NO_TRIANGLE`](super::NO_TRIANGLE) beyond the band.
    pub fn closest(&self) -> &Buffer<u32> {
        &self.closest
    }
}

/// What cotangents of the distances mean for the mesh and the grid.
#[derive(Clone, Debug)]
pub struct Cotangents<T> {
    /// `(V, 3)`, of the vertices.
    pub vertices: Buffer<T>,
    /// Four numbers: of the low corner of the grid, and of its cell size, through the cell centres.
    pub grid: Buffer<T>,
}

/// The centre of a cell in memory order, from the low corner of the grid.
#[cube]
fn centre<F: Float>(cell: u32, spacing: F, ny: u32, nz: u32) -> Vector3<F> {
    let half = F::new(0.5);
    Vector3::<F> {
        x: spacing * (F::cast_from(cell / (ny * nz)) + half),
        y: spacing * (F::cast_from(cell / nz % ny) + half),
        z: spacing * (F::cast_from(cell % nz) + half),
    }
}
