//! Points between the eight cell centers round them, and the weights of trilinear interpolation.

use cubecl::prelude::*;

use crate::grid::{Cell, Lattice};
use crate::spread::Spread;
use crate::vector::Vector3;

/// Numbers of a point in the form that is spread: fractions along the axes, and what is spread.
pub(super) const NUMBERS: usize = 4;

/// The high corner of a grid.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
pub(super) struct Corner<F: Float + CubeElement> {
    pub(super) x: F,
    pub(super) y: F,
    pub(super) z: F,
}

/// Where a point is between the eight cell centers round it.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Spot<F: Float> {
    /// The lowest of the eight cells.
    pub(super) base: Cell,
    /// From its center, in cells.
    pub(super) fraction: Vector3<F>,
    /// Whether the point is in the grid.
    pub(super) inside: bool,
}

/// The lower of the two cells along an axis.
#[cube]
fn lower_cell<F: Float>(x: F, cells: u32) -> u32 {
    min(u32::cast_from(max(x, F::new(0.0))), cells - 2u32)
}

#[cube]
pub(super) fn spot<F: Float + CubeElement>(
    p: Vector3<F>,
    grid: &Lattice<F>,
    upper: &Corner<F>,
) -> Spot<F> {
    let inside = p.x >= grid.x
        && p.y >= grid.y
        && p.z >= grid.z
        && p.x <= upper.x
        && p.y <= upper.y
        && p.z <= upper.z;
    // What is outside may be too far for a cell to be named.
    let own = p.choose(
        inside,
        Vector3::<F> {
            x: grid.x,
            y: grid.y,
            z: grid.z,
        },
    );
    let half = F::new(0.5);
    let x = (own.x - grid.x) / grid.spacing - half;
    let y = (own.y - grid.y) / grid.spacing - half;
    let z = (own.z - grid.z) / grid.spacing - half;
    let base = Cell {
        i: lower_cell::<F>(x, grid.nx),
        j: lower_cell::<F>(y, grid.ny),
        k: lower_cell::<F>(z, grid.nz),
    };
    let fraction = Vector3::<F> {
        x: x - F::cast_from(base.i),
        y: y - F::cast_from(base.j),
        z: z - F::cast_from(base.k),
    };
    Spot::<F> {
        base,
        fraction,
        inside,
    }
}

#[cube]
impl<F: Float> Spot<F> {
    /// Place in memory of one of the eight cells; the last axis varies fastest.
    pub(super) fn cell(self, corner: u32, ny: u32, nz: u32) -> usize {
        let (i, j, k) = (corner >> 2u32, (corner >> 1u32) & 1u32, corner & 1u32);
        let row = (self.base.i + i) * ny + self.base.j + j;
        (row * nz + self.base.k + k) as usize
    }

    /// Its weights along the axes.
    pub(super) fn weights(self, corner: u32) -> Vector3<F> {
        let f = self.fraction;
        let one = F::new(1.0);
        Vector3::<F> {
            x: select((corner >> 2u32) == 1u32, f.x, one - f.x),
            y: select(((corner >> 1u32) & 1u32) == 1u32, f.y, one - f.y),
            z: select((corner & 1u32) == 1u32, f.z, one - f.z),
        }
    }
}

/// The slope along an axis of the weight of a cell, given its weights along the axes, per cell.
#[cube]
pub(super) fn slope<F: Float>(corner: u32, axis: usize, w: Vector3<F>) -> F {
    let high = (corner >> (2u32 - axis as u32)) & 1u32 == 1u32;
    let sign = select(high, F::new(1.0), F::new(-1.0));
    let across = select(
        axis == 0usize,
        w.y * w.z,
        select(axis == 1usize, w.z * w.x, w.x * w.y),
    );
    sign * across
}

/// By the weights of trilinear interpolation, from the lowest of the eight cells.
pub(super) struct Corners;

#[cube]
impl Spread for Corners {
    fn part<F: Float>(samples: &Array<F>, s: usize, x: u32, y: u32, z: u32) -> F {
        let at = s * NUMBERS;
        let wx = side::<F>(samples[at], x);
        let wy = side::<F>(samples[at + 1], y);
        let wz = side::<F>(samples[at + 2], z);
        samples[at + 3] * wx * wy * wz
    }
}

/// Weight of the lower cell (1) or the one above it (2); nothing of the one below (0).
#[cube]
fn side<F: Float>(f: F, cell: u32) -> F {
    let zero = F::new(0.0);
    select(cell == 1u32, F::new(1.0) - f, select(cell == 2u32, f, zero))
}
