//! The cells of the band, and their values from those at the vertices.

use cubecl::prelude::*;

use super::super::bvh::center;
use super::super::triangle::{closest, corners};
use super::super::{MeshArrays, NO_TRIANGLE};
use super::Surface;
use crate::device::launch;
use crate::grid::{Lattice, low_corner};
use crate::primitives::scan::exclusive_sum;
use crate::{Buffer, Device, Error, Scalar};

/// Cells with φ between two bounds, by exclusive sums of flags.
pub(super) struct Near {
    /// Those that have a closest face.
    pub band: Buffer<u32>,
    /// Cells of the band whose closest face is not part of the surface.
    pub astray: Buffer<u32>,
}

pub(super) fn near<R: Runtime, T: Scalar>(
    device: &Device<R>,
    surface: Surface<'_, T>,
    [least, most]: [T; 2],
) -> Result<Near, Error> {
    let cells = surface.phi.len();
    let (band, astray) = (device.empty(cells)?, device.empty(cells)?);
    launch!(device, cells => flag_cells<T>(
        surface.phi, surface.closest, band, astray, least, most, surface.faces() as u32,
    ));
    Ok(Near {
        band: exclusive_sum(device, &band)?,
        astray: exclusive_sum(device, &astray)?,
    })
}

/// Barycentric coordinates `(B, 3)` of the closest point of each of the cells, and the value `(B, components)` there of
/// `at_vertices` `(V, components)`.
pub(super) fn blend<R: Runtime, T: Scalar>(
    device: &Device<R>,
    surface: Surface<'_, T>,
    cells: &Buffer<u32>,
    at_vertices: &Buffer<T>,
    components: usize,
) -> Result<(Buffer<T>, Buffer<T>), Error> {
    let barycentric = device.empty(3 * cells.len())?;
    let values = device.empty(components * cells.len())?;
    launch!(device, cells.len() => blend_cells<T>(
        surface.mesh, surface.closest, cells, at_vertices, barycentric, values, surface.grid,
        components as u32,
    ));
    Ok((barycentric, values))
}

#[cube(launch)]
fn flag_cells<F: Float + CubeElement>(
    phi: &Array<F>,
    closest: &Array<u32>,
    band: &mut Array<u32>,
    astray: &mut Array<u32>,
    least: F,
    most: F,
    faces: u32,
) {
    if ABSOLUTE_POS < phi.len() {
        let face = closest[ABSOLUTE_POS];
        let value = phi[ABSOLUTE_POS];
        let near = value >= least && value <= most && face != NO_TRIANGLE;
        band[ABSOLUTE_POS] = select(near, 1u32, 0u32);
        astray[ABSOLUTE_POS] = select(near && face >= faces, 1u32, 0u32);
    }
}

/// `Σ_k β_k u_k` as differences from one corner, so that constants are exact.
#[cube(launch)]
fn blend_cells<F: Float + CubeElement>(
    mesh: &MeshArrays<F>,
    found: &Array<u32>,
    cells: &Array<u32>,
    at_vertices: &Array<F>,
    barycentric: &mut Array<F>,
    values: &mut Array<F>,
    grid: Lattice<F>,
    components: u32,
) {
    if ABSOLUTE_POS < cells.len() {
        let cell = cells[ABSOLUTE_POS];
        let face = found[cell as usize];
        let t = corners::<F>(mesh, face, low_corner::<F>(&grid));
        let center = center::<F>(cell, grid.spacing, grid.ny, grid.nz);
        let weights = closest::<F>(t, center).weights;
        weights.write(barycentric, ABSOLUTE_POS);
        let components = components as usize;
        let a = mesh.faces[3 * face as usize] as usize * components;
        let b = mesh.faces[3 * face as usize + 1] as usize * components;
        let c = mesh.faces[3 * face as usize + 2] as usize * components;
        for k in 0..components {
            let from = at_vertices[a + k];
            let rise = weights.y * (at_vertices[b + k] - from);
            let more = weights.z * (at_vertices[c + k] - from);
            values[ABSOLUTE_POS * components + k] = from + (rise + more);
        }
    }
}
