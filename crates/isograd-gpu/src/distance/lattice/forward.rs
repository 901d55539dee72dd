//! Mesh and signs to φ.

use cubecl::prelude::*;
use isograd::Grid;

use super::super::bvh::{self, NONE, Tree, center};
use super::super::triangle::{closest, corners};
use super::super::{Band, Error, FAR, Mesh, MeshArrays};
use super::Residual;
use crate::device::{check_length, launch};
use crate::grid::{Lattice, low_corner};
use crate::{Buffer, Device, Scalar};

/// The signed distance `φ` from every cell center of `grid` to `mesh`, in the user's unit and in memory order.
///
/// The sign is that of `χ − c` at the cell, `level` being the one number `c`: negative inside, and positive at
/// the level itself. Inside and at distance 0 it is the smallest negative number, so that the sign holds there
/// too. Beyond a [`Band`] `φ` is the width of the band, and no face is named.
///
/// In `f32` the error is a few `ε` times the distance and the extent of the grid, wherever the grid is: places
/// are computed from its low corner. [`isograd::distance::lattice`] computes in `f64` whatever the number type.
pub fn forward<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    grid: &Grid<T>,
    chi: &Buffer<T>,
    level: &Buffer<T>,
    band: Band,
) -> Result<(Buffer<T>, Residual<T>), Error> {
    device.check_number::<T>()?;
    check_length("the field", chi, grid.cells())?;
    check_length("the level", level, 1)?;
    let spacing = grid.spacing();
    let width = match band {
        Band::Full => None,
        Band::Within(width) if width > 0.0 && width.is_finite() => Some(width),
        Band::Within(width) => return Err(Error::Band { width }),
    };
    let tree = Tree::new(device, mesh, grid)?;
    let closest = bvh::cells(device, &tree, grid.shape(), spacing.f64(), width)?;
    let phi = device.empty(grid.cells())?;
    launch!(device, grid.cells() => measure_cells<T>(
        mesh, chi, level, closest, phi, grid, T::of(width.unwrap_or(FAR)), smallest::<T>(),
    ));
    let residual = Residual {
        mesh: mesh.clone(),
        grid: *grid,
        phi: phi.clone(),
        closest,
    };
    Ok((phi, residual))
}

/// The smallest positive normal number.
fn smallest<T: Scalar>() -> T {
    <T as Float>::MIN_POSITIVE
}

/// Distance of each cell to the face that was found for it, with its sign; no face where it is further than the
/// width.
#[cube(launch)]
fn measure_cells<F: Float + CubeElement>(
    mesh: &MeshArrays<F>,
    chi: &Array<F>,
    level: &Array<F>,
    found: &mut Array<u32>,
    phi: &mut Array<F>,
    grid: Lattice<F>,
    width: F,
    smallest: F,
) {
    if ABSOLUTE_POS < phi.len() {
        let face = found[ABSOLUTE_POS];
        let mut distance = width;
        if face != NONE {
            let t = corners::<F>(mesh, face, low_corner::<F>(&grid));
            let q = center::<F>(ABSOLUTE_POS as u32, grid.spacing, grid.ny, grid.nz);
            let measured = closest::<F>(t, q).offset.norm();
            if measured > width {
                found[ABSOLUTE_POS] = NONE;
            } else {
                distance = measured;
            }
        }
        if chi[ABSOLUTE_POS] < level[0] {
            distance = -max(distance, smallest);
        }
        phi[ABSOLUTE_POS] = distance;
    }
}
