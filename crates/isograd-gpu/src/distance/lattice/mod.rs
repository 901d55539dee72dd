//! Distance at every cell center.

mod forward;
mod pullback;

pub use forward::forward;
pub use pullback::pullback;

use isograd::Grid;

use super::Mesh;
use crate::Buffer;

/// Residual of [`forward`] for [`pullback`]. Arrays share the memory of inputs and outputs.
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

    /// The surface that distances are to.
    pub(crate) fn mesh(&self) -> &Mesh<T> {
        &self.mesh
    }

    /// The grid that they are on.
    pub(crate) fn grid(&self) -> &Grid<T> {
        &self.grid
    }
}

/// Cotangents of the mesh and the grid.
#[derive(Clone, Debug)]
pub struct Cotangents<T> {
    /// `(V, 3)`, of the vertices.
    pub vertices: Buffer<T>,
    /// Four numbers: of the low corner of the grid, and of its cell size, through the cell centers.
    pub grid: Buffer<T>,
}
