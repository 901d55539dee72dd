//! The forward map: signs, counts, sums of the counts, then vertices and faces into their final places.

use cubecl::prelude::*;
use isograd::Grid;
use isograd::isosurface;

use super::error::{Error, bad_level, bad_value, one_sided};
use super::signs::{BLOCK, Bits, Signs, at_lane, case_of, count_crossed, crossed, cubes};
use super::total::Total;
use super::values::{Values, fraction_on};
use super::{Plan, Residual, Surface};
use crate::device::{check_length, launch};
use crate::primitives::scan::exclusive_sum;
use crate::{Buffer, Device, Scalar};

/// The surface `χ = level`, in the user's unit, of `(nx, ny, nz)` values `chi` at the cell centers of `grid`; `level`
/// is one number. Vertices and faces are those of [`isograd::isosurface::forward`], in the same order; positions
/// agree to the rounding of coordinates in `T`. Where triangulations of a loop enclose the same but for rounding, faces
/// may be those of another one.
///
/// # Errors
/// As the CPU's stage. [`TooLarge`](crate::Error::TooLarge), also where the cells (counting rows as if
/// rounded up to 32) or three times their number exceed what 32 bits can count.
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    plan: &Plan,
    chi: &Buffer<T>,
    level: &Buffer<T>,
    grid: &Grid<T>,
) -> Result<(Surface<T>, Residual<T>), Error> {
    check_length("the field", chi, grid.cells())?;
    check_length("the level", level, 1)?;
    let (signs, faults) = Bits::new(device, chi, level, grid.shape())?;
    let (vertices, faces) = counts(device, plan, &signs)?;
    let before = exclusive_sum(device, &vertices)?;
    let before_faces = exclusive_sum(device, &faces)?;
    drop((vertices, faces));
    let total = Total::new(device, &signs, &faults, &before, &before_faces)?;
    let report = total.report();
    if total.bad_level() {
        return Err(bad_level(device, level));
    } else if total.bad_value() {
        return Err(bad_value(device, grid, chi, &faults));
    } else if report.inside == 0 || report.inside == grid.cells() {
        return Err(one_sided(device, chi, level, report.inside == 0));
    }
    check_sizes(device, &total)?;
    let residual = Residual {
        grid: *grid,
        chi: chi.clone(),
        level: level.clone(),
        signs,
        before,
        edges: device.empty(total.vertices)?,
    };
    let surface = Surface {
        vertices: residual.vertices(device)?,
        faces: residual.faces(device, plan, &before_faces, total.faces)?,
        edges: residual.edges.clone(),
        report,
    };
    Ok((surface, residual))
}

/// Coordinates and corners must have 32-bit places. Where the vertices do, the sums have not wrapped: there are
/// fewer than three triangles a vertex.
fn check_sizes<R: Runtime>(device: &Device<R>, total: &Total) -> Result<(), Error> {
    let most = u32::MAX as usize / 3;
    if total.vertices > most {
        let vertices = total.vertices;
        return Err(isosurface::Error::TooManyVertices { vertices }.into());
    }
    if total.faces > most {
        return Err(Error::Device(crate::Error::TooLarge {
            device: device.name().to_owned(),
            bytes: 12 * total.faces as u64,
            limit: 12 * most as u64,
        }));
    }
    Ok(())
}

/// Per word, the vertices on the edges that start from its cells, and the triangles of its cubes.
fn counts<R: Runtime>(
    device: &Device<R>,
    plan: &Plan,
    signs: &Bits,
) -> Result<(Buffer<u32>, Buffer<u32>), crate::Error> {
    let (vertices, faces) = (device.empty(signs.len())?, device.empty(signs.len())?);
    launch!(device, signs.len(), BLOCK => count_words(signs, plan.table, vertices, faces));
    Ok((vertices, faces))
}

impl<T: Scalar> Residual<T> {
    /// The vertices; fills the edges.
    fn vertices<R: Runtime>(&self, device: &Device<R>) -> Result<Buffer<T>, crate::Error> {
        let vertices = device.empty(3 * self.edges.len())?;
        launch!(device, self.signs.units(), BLOCK => emit_vertices<T>(
            self.signs, self.before, self.values(device)?, vertices, self.edges,
        ));
        Ok(vertices)
    }
}

#[cube(launch)]
fn count_words(
    signs: &Signs,
    table: &Array<u32>,
    vertices: &mut Array<u32>,
    faces: &mut Array<u32>,
) {
    if ABSOLUTE_POS < vertices.len() {
        let word = ABSOLUTE_POS as u32;
        let row = word / signs.words;
        let w = word % signs.words;
        vertices[ABSOLUTE_POS] = count_crossed(crossed(signs, row, w), 0xffff_ffffu32);
        let cubes = cubes(signs, row, w);
        let mut rest = cubes.active;
        let mut count = 0u32;
        while rest != 0u32 {
            let case = case_of(&cubes, u32::trailing_zeros(rest)) as usize;
            count += table[case + 1] - table[case];
            rest &= rest - 1u32;
        }
        faces[ABSOLUTE_POS] = count;
    }
}

/// One unit a cell writes the vertices on the edges that start there.
#[cube(launch)]
fn emit_vertices<F: Float + CubeElement>(
    signs: &Signs,
    before: &Array<u32>,
    values: &Values<F>,
    vertices: &mut Array<F>,
    edges: &mut Array<u32>,
) {
    let word = ABSOLUTE_POS as u32 / 32u32;
    let lane = ABSOLUTE_POS as u32 % 32u32;
    if word < signs.nx * signs.ny * signs.words {
        let row = word / signs.words;
        let w = word % signs.words;
        let k = 32u32 * w + lane;
        let of_word = crossed(signs, row, w);
        let own = at_lane(of_word, lane);
        let x = before[word as usize] + count_crossed(of_word, (1u32 << lane) - 1u32);
        let y = x + own.x;
        let z = y + own.y;
        if own.x == 1u32 {
            emit_vertex::<F>(signs, values, row, k, 0u32, vertices, x);
            edges[x as usize] = 3u32 * (row * signs.nz + k);
        }
        if own.y == 1u32 {
            emit_vertex::<F>(signs, values, row, k, 1u32, vertices, y);
            edges[y as usize] = 3u32 * (row * signs.nz + k) + 1u32;
        }
        if own.z == 1u32 {
            emit_vertex::<F>(signs, values, row, k, 2u32, vertices, z);
            edges[z as usize] = 3u32 * (row * signs.nz + k) + 2u32;
        }
    }
}

/// Writes the vertex on the edge along `axis` from cell `k` of a row.
#[cube]
fn emit_vertex<F: Float + CubeElement>(
    signs: &Signs,
    values: &Values<F>,
    row: u32,
    k: u32,
    #[comptime] axis: u32,
    vertices: &mut Array<F>,
    number: u32,
) {
    let eta = fraction_on::<F>(signs, values, (row * signs.nz + k) as usize, axis);
    let zero = F::new(0.0);
    let to = 3 * number as usize;
    vertices[to] = coordinate::<F>(
        values,
        0u32,
        row / signs.ny,
        select(axis == 0u32, eta, zero),
    );
    vertices[to + 1] = coordinate::<F>(
        values,
        1u32,
        row % signs.ny,
        select(axis == 1u32, eta, zero),
    );
    vertices[to + 2] = coordinate::<F>(values, 2u32, k, select(axis == 2u32, eta, zero));
}

/// The coordinate at the fraction `eta` of the way from the center of cell `k` of an axis to the next, and not
/// beyond that. Adding to the center rounds less than the distance from the grid's corner would.
#[cube]
fn coordinate<F: Float + CubeElement>(
    values: &Values<F>,
    #[comptime] axis: u32,
    k: u32,
    eta: F,
) -> F {
    let lower = values.scales[axis as usize];
    let h = values.scales[3];
    let center = fma(h, F::cast_from(k) + F::new(0.5), lower);
    let next = fma(h, F::cast_from(k) + F::new(1.5), lower);
    min(fma(h, eta, center), next)
}
