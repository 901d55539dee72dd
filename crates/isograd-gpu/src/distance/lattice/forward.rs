//! Mesh and signs to φ.

use cubecl::prelude::*;
use isograd::Grid;

use super::super::search::center;
use super::super::tree::{NONE, Tree};
use super::super::triangle::{closest, corners};
use super::super::{Band, Error, FAR, Mesh, search};
use super::Residual;
use crate::device::check_length;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

const BLOCK: u32 = 64;

/// The signed distance `φ` from every cell center of `grid` to `mesh`, in the user's unit and in memory order.
///
/// The sign is that of `χ − c` at the cell, `level` being the one number `c`: negative inside, and positive at
/// the level itself. Inside and at distance 0 it is the smallest negative number, so that the sign holds there
/// too. Beyond a [`Band`] `φ` is the width of the band, and no face is named.
///
/// In `f32` the error is a few `ε` times the distance and the extent of the grid, wherever the grid is: places
/// are computed from its low corner. [`isograd::distance::lattice`] computes in `f64` whatever the number type.
///
/// # Errors
/// [`Error::Empty`], [`Error::Band`], [`Error::Triples`], and those of the device.
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
    let tree = Tree::new(device, mesh, grid.lower())?;
    let closest = search::cells(device, &tree, grid.shape(), spacing.f64(), width)?;
    let phi = device.empty(grid.cells())?;
    let ([x, y, z], [_, ny, nz]) = (grid.lower(), grid.shape());
    measure_cells::launch::<T, R>(
        device.client(),
        device.groups(grid.cells(), BLOCK),
        CubeDim::new_1d(BLOCK),
        mesh.vertices.arg(),
        mesh.faces.arg(),
        chi.arg(),
        level.arg(),
        closest.arg(),
        phi.arg(),
        x,
        y,
        z,
        spacing,
        T::of(width.unwrap_or(FAR)),
        smallest::<T>(),
        ny as u32,
        nz as u32,
    );
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
    vertices: &Array<F>,
    faces: &Array<u32>,
    chi: &Array<F>,
    level: &Array<F>,
    found: &mut Array<u32>,
    phi: &mut Array<F>,
    x: F,
    y: F,
    z: F,
    spacing: F,
    width: F,
    smallest: F,
    ny: u32,
    nz: u32,
) {
    if ABSOLUTE_POS < phi.len() {
        let face = found[ABSOLUTE_POS];
        let mut distance = width;
        if face != NONE {
            let t = corners::<F>(vertices, faces, face, Vector3::<F> { x, y, z });
            let q = center::<F>(ABSOLUTE_POS as u32, spacing, ny, nz);
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
