//! The pullback of the cells: to the values at the vertices, and through `β` to the vertices themselves and the grid.

use cubecl::prelude::*;

use super::super::MeshArrays;
use super::super::bvh::center;
use super::super::shares::{ByFace, ByFaceArrays, Corners, by_face};
use super::super::tangent::tangent;
use super::super::triangle::{closest, corners};
use super::neighbor::write_bounded;
use super::{Extension, ExtensionArrays, Residual, Surface, columns};
use crate::device::launch;
use crate::grid::{Lattice, low_corner};
use crate::neighbors::gather;
use crate::primitives::fill::{own_zeros, zeros};
use crate::primitives::segments::{NO_SEGMENT, Rows, join_pieces, sum_rows};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Numbers of a face: of its three corners, of the low corner of the grid, and of its spacing.
const FACE: usize = 13;

/// Cotangents through the cells.
pub(super) struct OfCells<T> {
    /// `(V, 3)` of the vertices.
    pub vertices: Buffer<T>,
    /// `(4,)` of the grid.
    pub grid: Buffer<T>,
    /// Numbers of bounded derivatives.
    pub guarded: Vec<Buffer<u32>>,
}

impl<T: Scalar> OfCells<T> {
    /// Of no cells.
    fn zeros<R: Runtime>(device: &Device<R>, vertices: usize) -> Result<Self, Error> {
        Ok(Self {
            vertices: zeros(device, 3 * vertices)?,
            grid: zeros(device, 4)?,
            guarded: Vec::new(),
        })
    }
}

/// Adds to `bars` `(V, components)` the cotangents of the values at the vertices through the cells.
pub(super) fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    surface: Surface<'_, T>,
    residual: &Residual<T>,
    extension: &Extension<T>,
    values_bar: Option<&Buffer<T>>,
    bars: &Buffer<T>,
) -> Result<OfCells<T>, Error> {
    let Some(values_bar) = values_bar.filter(|bar| !bar.is_empty()) else {
        return OfCells::zeros(device, surface.vertices());
    };
    let faces = gather(device, surface.closest, &extension.cells, 1)?;
    let sorted = by_face::<T, R>(device, surface.mesh, &faces, None)?;
    let corners = Corners::of(device, surface.mesh)?;
    for (first, width) in columns(extension.components) {
        let part = pull_columns(
            device, residual, extension, values_bar, &sorted, first, width,
        )?;
        let part = corners.sum(device, &part, width)?;
        launch!(device, part.len() => add_columns<T>(
            part, bars, width as u32, first as u32, extension.components as u32,
        ));
    }
    let (of_faces, guarded) = pull_weights(device, surface, extension, values_bar, &sorted)?;
    let (grid, not_finite) = (device.empty(4)?, device.empty(1)?);
    let all = device.upload(&[0, surface.faces() as u32])?;
    let rows = Rows::dense(FACE);
    let total = sum_rows(device, &of_faces, rows, None, &all, surface.faces())?;
    launch!(device, 1, 1 => name_total<T>(total, grid, not_finite));
    Ok(OfCells {
        vertices: corners.sum(device, &of_faces, 3)?,
        grid,
        guarded: vec![guarded, not_finite],
    })
}

/// `Σ β_k ū` over the cells of each face, `(F, 3, width)`.
fn pull_columns<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    extension: &Extension<T>,
    values_bar: &Buffer<T>,
    sorted: &ByFace,
    first: usize,
    width: usize,
) -> Result<Buffer<T>, Error> {
    let most = sorted.pieces.most();
    let sums = device.empty(3 * width * most)?;
    launch!(device, most => share_values<T>(
        sorted, residual.barycentric, values_bar, sums, extension.components as u32, first as u32,
        width,
    ));
    let (pieces, cells) = (sorted.pieces.clone(), extension.cells.len());
    join_pieces(device, sums, 3 * width, pieces, cells)
}

/// Cotangents of each face and of the grid through `β`, `(F, 13)`, and the number of bounded cells of each piece.
fn pull_weights<R: Runtime, T: Scalar>(
    device: &Device<R>,
    surface: Surface<'_, T>,
    extension: &Extension<T>,
    values_bar: &Buffer<T>,
    sorted: &ByFace,
) -> Result<(Buffer<T>, Buffer<u32>), Error> {
    let most = sorted.pieces.most();
    let (sums, guarded) = (device.empty(FACE * most)?, device.empty(most)?);
    let thinness = <T as isograd::Real>::f64(<T as Float>::EPSILON).sqrt();
    let thinnest = T::of(thinness * surface.grid.spacing().f64());
    launch!(device, most => pull_cells<T>(
        surface.mesh, extension, values_bar, sorted, sums, guarded, surface.grid, thinnest,
    ));
    let (pieces, cells) = (sorted.pieces.clone(), extension.cells.len());
    Ok((join_pieces(device, sums, FACE, pieces, cells)?, guarded))
}

#[cube(launch)]
fn share_values<F: Float>(
    by_face: &ByFaceArrays,
    barycentric: &Array<F>,
    values_bar: &Array<F>,
    sums: &mut Array<F>,
    components: u32,
    column: u32,
    #[comptime] width: usize,
) {
    if 3 * ABSOLUTE_POS < by_face.table.len() && by_face.table[3 * ABSOLUTE_POS] != NO_SEGMENT {
        let mut sum = own_zeros::<F>(comptime!(3 * width));
        for element in by_face.table[3 * ABSOLUTE_POS + 1]..by_face.table[3 * ABSOLUTE_POS + 2] {
            let b = by_face.order[element as usize] as usize;
            let (y, z) = (barycentric[3 * b + 1], barycentric[3 * b + 2]);
            let x = F::new(1.0) - y - z;
            let row = b * components as usize + column as usize;
            #[unroll]
            for c in 0..width {
                let bar = values_bar[row + c];
                sum[c] += x * bar;
                sum[width + c] += y * bar;
                sum[2 * width + c] += z * bar;
            }
        }
        #[unroll]
        for i in 0..comptime!(3 * width) {
            sums[ABSOLUTE_POS * comptime!(3 * width) + i] = sum[i];
        }
    }
}

/// Adds `(V, width)` to the columns of `bars` from `column` on.
#[cube(launch)]
fn add_columns<F: Float>(
    part: &Array<F>,
    bars: &mut Array<F>,
    width: u32,
    column: u32,
    components: u32,
) {
    if ABSOLUTE_POS < part.len() {
        let (row, own) = (ABSOLUTE_POS / width as usize, ABSOLUTE_POS % width as usize);
        bars[row * components as usize + column as usize + own] += part[ABSOLUTE_POS];
    }
}

/// `Σ_c ū_c (u_b − u_a)`.
#[cube]
fn gain<F: Float>(
    values: &Array<F>,
    a: u32,
    b: u32,
    bars: &Array<F>,
    row: usize,
    components: usize,
) -> F {
    let (a, b) = (a as usize * components, b as usize * components);
    let mut sum = F::new(0.0);
    for c in 0..components {
        sum += bars[row * components + c] * (values[b + c] - values[a + c]);
    }
    sum
}

#[cube(launch)]
fn pull_cells<F: Float + CubeElement>(
    mesh: &MeshArrays<F>,
    extension: &ExtensionArrays<F>,
    values_bar: &Array<F>,
    by_face: &ByFaceArrays,
    sums: &mut Array<F>,
    guarded: &mut Array<u32>,
    grid: Lattice<F>,
    thinnest: F,
) {
    if ABSOLUTE_POS < guarded.len() {
        let mut bounded = 0u32.runtime();
        let face = by_face.table[3 * ABSOLUTE_POS];
        if face != NO_SEGMENT {
            let at = 3 * face as usize;
            let (a, b, c) = (mesh.faces[at], mesh.faces[at + 1], mesh.faces[at + 2]);
            let t = corners::<F>(mesh, face, low_corner::<F>(&grid));
            let mut sum = own_zeros::<F>(FACE);
            let components = extension.components as usize;
            for element in by_face.table[3 * ABSOLUTE_POS + 1]..by_face.table[3 * ABSOLUTE_POS + 2]
            {
                let row = by_face.order[element as usize] as usize;
                let place = center::<F>(extension.cells[row], F::new(1.0), grid.ny, grid.nz);
                let found = closest::<F>(t, place.scale(grid.spacing));
                let gains = Vector3::<F> {
                    x: gain::<F>(&extension.vertices, a, b, values_bar, row, components),
                    y: gain::<F>(&extension.vertices, b, c, values_bar, row, components),
                    z: gain::<F>(&extension.vertices, c, a, values_bar, row, components),
                };
                let moved = tangent::<F>(t, found, gains, thinnest);
                let (g, w) = (moved.gamma, found.weights);
                let (o, q) = (found.offset, moved.query);
                o.scale(g.x).sub(q.scale(w.x)).add_to(&mut sum, 0usize);
                o.scale(g.y).sub(q.scale(w.y)).add_to(&mut sum, 3usize);
                o.scale(g.z).sub(q.scale(w.z)).add_to(&mut sum, 6usize);
                q.add_to(&mut sum, 9usize);
                sum[12] += place.dot(q);
                bounded += select(moved.guarded, 1u32, 0u32);
            }
            for number in 0..FACE {
                sums[ABSOLUTE_POS * FACE + number] = sum[number];
            }
        }
        guarded[ABSOLUTE_POS] = bounded;
    }
}

/// The sum over all faces as the cotangent of the grid, and how many of its numbers were not finite.
#[cube(launch)]
fn name_total<F: Float>(total: &Array<F>, grid: &mut Array<F>, not_finite: &mut Array<u32>) {
    if ABSOLUTE_POS == 0 {
        let mut count = 0u32.runtime();
        for number in 0..4usize {
            count += write_bounded::<F>(grid, number, total[9 + number]);
        }
        not_finite[0] = count;
    }
}
