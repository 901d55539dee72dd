//! The cells of the band: which they are, and what they get from the vertices.

use cubecl::prelude::*;

use super::super::NO_TRIANGLE;
use super::super::search::center;
use super::super::triangle::{closest, corners};
use super::{BLOCK, Surface};
use crate::primitives::scan::exclusive_sum;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Cells within a reach of the surface, by exclusive sums of flags.
pub(super) struct Near {
    /// Those that have a closest face.
    pub band: Buffer<u32>,
    /// Those of them whose closest face is not part of the surface.
    pub astray: Buffer<u32>,
}

pub(super) fn near<R: Runtime, T: Scalar>(
    device: &Device<R>,
    surface: Surface<'_, T>,
    reach: T,
) -> Result<Near, Error> {
    let cells = surface.phi.len();
    let (band, astray) = (device.empty(cells)?, device.empty(cells)?);
    flag_cells::launch::<T, R>(
        device.client(),
        device.groups(cells, BLOCK),
        CubeDim::new_1d(BLOCK),
        surface.phi.arg(),
        surface.closest.arg(),
        band.arg(),
        astray.arg(),
        reach,
        surface.faces() as u32,
    );
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
    let ([x, y, z], [_, ny, nz]) = (surface.grid.lower(), surface.grid.shape());
    blend_cells::launch::<T, R>(
        device.client(),
        device.groups(cells.len(), BLOCK),
        CubeDim::new_1d(BLOCK),
        surface.mesh.vertices.arg(),
        surface.mesh.faces.arg(),
        surface.closest.arg(),
        cells.arg(),
        at_vertices.arg(),
        barycentric.arg(),
        values.arg(),
        x,
        y,
        z,
        surface.grid.spacing(),
        ny as u32,
        nz as u32,
        components as u32,
        cells.len() as u32,
    );
    Ok((barycentric, values))
}

#[cube(launch)]
fn flag_cells<F: Float + CubeElement>(
    phi: &Array<F>,
    closest: &Array<u32>,
    band: &mut Array<u32>,
    astray: &mut Array<u32>,
    reach: F,
    faces: u32,
) {
    if ABSOLUTE_POS < phi.len() {
        let face = closest[ABSOLUTE_POS];
        let near = phi[ABSOLUTE_POS].abs() <= reach && face != NO_TRIANGLE;
        band[ABSOLUTE_POS] = select(near, 1u32, 0u32);
        astray[ABSOLUTE_POS] = select(near && face >= faces, 1u32, 0u32);
    }
}

/// `Σ_k β_k u_k` as differences from one corner, so that constants are exact.
#[cube(launch)]
fn blend_cells<F: Float + CubeElement>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    found: &Array<u32>,
    cells: &Array<u32>,
    at_vertices: &Array<F>,
    barycentric: &mut Array<F>,
    values: &mut Array<F>,
    x: F,
    y: F,
    z: F,
    spacing: F,
    ny: u32,
    nz: u32,
    components: u32,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let cell = cells[ABSOLUTE_POS];
        let face = found[cell as usize];
        let t = corners::<F>(vertices, faces, face, Vector3::<F> { x, y, z });
        let weights = closest::<F>(t, center::<F>(cell, spacing, ny, nz)).weights;
        weights.write(barycentric, ABSOLUTE_POS);
        let components = components as usize;
        let a = faces[3 * face as usize] as usize * components;
        let b = faces[3 * face as usize + 1] as usize * components;
        let c = faces[3 * face as usize + 2] as usize * components;
        for k in 0..components {
            let from = at_vertices[a + k];
            let rise = weights.y * (at_vertices[b + k] - from);
            let more = weights.z * (at_vertices[c + k] - from);
            values[ABSOLUTE_POS * components + k] = from + (rise + more);
        }
    }
}
