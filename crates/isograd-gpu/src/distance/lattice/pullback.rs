//! Cotangents of φ at the cells to cotangents of the vertices and the grid.
//!
//! The cells are sorted by their closest face, and the cells of a face summed in pieces; then each vertex gets
//! what its corners have, in the order of the faces.

use cubecl::prelude::*;

use super::super::bvh::center;
use super::super::shares::{ByFaceArrays, Corners, FACE, add_share, by_face};
use super::super::triangle::{closest, corners};
use super::super::{Error, MeshArrays};
use super::{Cotangents, Residual};
use crate::device::{check_length, launch};
use crate::grid::{Lattice, low_corner};
use crate::primitives::fill::own_zeros;
use crate::primitives::segments::{NO_SEGMENT, Rows, join_pieces, sum_rows};
use crate::{Buffer, Device, Scalar};

/// Pulls the cotangents `phi_bar` of the distances, in memory order, back to the vertices and the grid. Cells
/// beyond the band count for nothing: there `φ` is constant.
pub fn pullback<T: Scalar, R: Runtime>(
    device: &Device<R>,
    residual: &Residual<T>,
    phi_bar: &Buffer<T>,
) -> Result<Cotangents<T>, Error> {
    check_length(
        "the cotangent of the distances",
        phi_bar,
        residual.grid.cells(),
    )?;
    let of_faces = pull_faces(device, residual, phi_bar)?;
    Ok(Cotangents {
        vertices: Corners::of(device, &residual.mesh)?.sum(device, &of_faces, 3)?,
        grid: total(device, &of_faces)?,
    })
}

/// Sums over the cells of each face, `(F, 10)`.
fn pull_faces<T: Scalar, R: Runtime>(
    device: &Device<R>,
    residual: &Residual<T>,
    phi_bar: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let (mesh, grid) = (&residual.mesh, &residual.grid);
    let cells = by_face(device, mesh, &residual.closest, Some(phi_bar))?;
    let most = cells.pieces.most();
    let sums = device.empty(most * FACE)?;
    launch!(device, most => pull_cells<T>(mesh, residual.phi, phi_bar, cells, sums, grid));
    let pieces = cells.pieces;
    Ok(join_pieces(device, sums, FACE, pieces, grid.cells())?)
}

/// The sum over all faces, as the cotangent of the grid. The weights of a point have the sum 1, so that what
/// the three corners get is, but for its sign, what the cell center gets.
fn total<T: Scalar, R: Runtime>(
    device: &Device<R>,
    of_faces: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let faces = of_faces.len() / FACE;
    let all = device.upload(&[0, faces as u32])?;
    let sum = sum_rows(device, of_faces, Rows::dense(FACE), None, &all, faces)?;
    let grid_bar = device.empty(4)?;
    launch!(device, 4 => name_total<T>(sum, grid_bar));
    Ok(grid_bar)
}

#[cube(launch)]
fn name_total<F: Float>(sum: &Array<F>, grid_bar: &mut Array<F>) {
    if ABSOLUTE_POS < 3 {
        let axis = ABSOLUTE_POS;
        grid_bar[axis] = -(sum[axis] + sum[axis + 3] + sum[axis + 6]);
    }
    if ABSOLUTE_POS == 3 {
        grid_bar[3] = sum[9];
    }
}

/// `−Σ β_k φ̄ ∇φ` for the corners of a face, and `Σ x̂ · φ̄ ∇φ`, over a piece of its cells.
#[cube(launch)]
fn pull_cells<F: Float + CubeElement>(
    mesh: &MeshArrays<F>,
    phi: &Array<F>,
    phi_bar: &Array<F>,
    by_face: &ByFaceArrays,
    sums: &mut Array<F>,
    grid: Lattice<F>,
) {
    if 3 * ABSOLUTE_POS < by_face.table.len() {
        let face = by_face.table[ABSOLUTE_POS * 3];
        if face != NO_SEGMENT {
            let t = corners::<F>(mesh, face, low_corner::<F>(&grid));
            let mut sum = own_zeros::<F>(FACE);
            for element in by_face.table[ABSOLUTE_POS * 3 + 1]..by_face.table[ABSOLUTE_POS * 3 + 2]
            {
                let cell = by_face.order[element as usize];
                let place = center::<F>(cell, F::new(1.0), grid.ny, grid.nz);
                let found = closest::<F>(t, place.scale(grid.spacing));
                let inside = phi[cell as usize] < F::new(0.0);
                let pull = add_share::<F>(&mut sum, found, inside, phi_bar[cell as usize]);
                sum[9] += place.dot(pull);
            }
            for number in 0..FACE {
                sums[ABSOLUTE_POS * FACE + number] = sum[number];
            }
        }
    }
}
