//! Triangles: of each loop of crossed edges, the triangulation that encloses the most.

use cubecl::prelude::*;

use super::signs::{BLOCK, Signs, case_of, cubes, vertex_on};
use super::values::{Values, fraction_on};
use super::{LOOPS, Plan, Residual};
use crate::device::launch;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

impl<T: Scalar> Residual<T> {
    /// The triangles, of which there are `count`; `before` is how many come before each word.
    pub(super) fn faces<R: Runtime>(
        &self,
        device: &Device<R>,
        plan: &Plan,
        before: &Buffer<u32>,
        count: usize,
    ) -> Result<Buffer<u32>, crate::Error> {
        let faces = device.empty(3 * count)?;
        launch!(device, self.signs.units(), BLOCK => emit_faces<T>(
            self.signs, self.before, before, self.values(device)?, plan.table, faces, BLOCK,
        ));
        Ok(faces)
    }
}

/// One unit a cube counts its triangles, adds up those of the cubes before it in its word, and writes its own.
#[cube(launch)]
fn emit_faces<F: Float + CubeElement>(
    signs: &Signs,
    before_vertices: &Array<u32>,
    before_faces: &Array<u32>,
    values: &Values<F>,
    table: &Array<u32>,
    faces: &mut Array<u32>,
    #[comptime] block: usize,
) {
    let mut shared = SharedMemory::<u32>::new(block);
    let unit = UNIT_POS as usize;
    let word = ABSOLUTE_POS as u32 / 32u32;
    let lane = ABSOLUTE_POS as u32 % 32u32;
    let row = word / signs.words;
    let w = word % signs.words;
    let mut case = 0usize.runtime();
    if word < signs.nx * signs.ny * signs.words {
        let cubes = cubes(signs, row, w);
        if (cubes.active >> lane) & 1u32 == 1u32 {
            case = case_of(&cubes, lane) as usize;
        }
    }
    let own = table[case + 1] - table[case];
    shared[unit] = own;
    sync_cube();
    let mut reach = 1usize.runtime();
    while reach < 32 {
        let mut more = 0u32;
        if lane as usize >= reach {
            more = shared[unit - reach];
        }
        sync_cube();
        shared[unit] += more;
        sync_cube();
        reach *= 2;
    }
    if own > 0u32 {
        let mut to = 3u32 * (before_faces[word as usize] + shared[unit] - own);
        let k = 32u32 * w + lane;
        for place in table[LOOPS + case]..table[LOOPS + case + 1] {
            let of = table[place as usize];
            let first = triangulation::<F>(signs, values, table, of, row, k);
            for triangle in first..first + ((of >> 16u32) & 255u32) {
                for corner in 0..3u32 {
                    let edge = (table[triangle as usize] >> (8u32 * corner)) & 255u32;
                    faces[to as usize] = vertex_of_cube(signs, before_vertices, row, k, edge);
                    to += 1u32;
                }
            }
        }
    }
}

/// The first triangle of the triangulation of a loop that encloses the most.
#[cube]
fn triangulation<F: Float + CubeElement>(
    signs: &Signs,
    values: &Values<F>,
    table: &Array<u32>,
    of: u32,
    row: u32,
    k: u32,
) -> u32 {
    let first = of & 0xffffu32;
    let count = (of >> 16u32) & 255u32;
    let all = of >> 24u32;
    let mut best = first;
    if all > 1u32 {
        let origin = point_on::<F>(signs, values, row, k, table[first as usize] & 255u32);
        let mut largest = F::new(0.0);
        for choice in 0..all {
            let from = first + choice * count;
            let mut volume = F::new(0.0);
            // The first triangle has the first vertex.
            for triangle in from + 1u32..from + count {
                let edges = table[triangle as usize];
                let a = point_on::<F>(signs, values, row, k, edges & 255u32);
                let b = point_on::<F>(signs, values, row, k, (edges >> 8u32) & 255u32);
                let c = point_on::<F>(signs, values, row, k, (edges >> 16u32) & 255u32);
                volume += a.sub(origin).dot(b.sub(origin).cross(c.sub(origin)));
            }
            if choice == 0u32 {
                largest = volume;
            } else if volume > largest + values.scales[5] {
                largest = volume;
                best = from;
            }
        }
    }
    best
}

/// Where edge `4·axis + 2·u + v` starts of the cube whose low corner is cell `k` of a row.
#[derive(CubeType, Clone, Copy)]
struct Edge {
    row: u32,
    k: u32,
    axis: u32,
    u: u32,
    v: u32,
}

#[cube]
fn edge_of_cube(signs: &Signs, row: u32, k: u32, edge: u32) -> Edge {
    let axis = edge / 4u32;
    let u = (edge >> 1u32) & 1u32;
    let v = edge & 1u32;
    // Along x the two other axes are y and z, along y they are x and z, along z x and y.
    let rows = select(
        axis == 0u32,
        u,
        select(axis == 1u32, u * signs.ny, u * signs.ny + v),
    );
    let cells = select(axis == 2u32, 0u32, v);
    Edge {
        row: row + rows,
        k: k + cells,
        axis,
        u,
        v,
    }
}

/// The vertex on an edge of the cube whose low corner is cell `k` of a row, from that corner, in cells.
#[cube]
fn point_on<F: Float + CubeElement>(
    signs: &Signs,
    values: &Values<F>,
    row: u32,
    k: u32,
    edge: u32,
) -> Vector3<F> {
    let of = edge_of_cube(signs, row, k, edge);
    let p = (of.row * signs.nz + of.k) as usize;
    let eta = fraction_on::<F>(signs, values, p, of.axis);
    let u = F::cast_from(of.u);
    let v = F::cast_from(of.v);
    Vector3::<F> {
        x: select(of.axis == 0u32, eta, u),
        y: select(of.axis == 1u32, eta, select(of.axis == 0u32, u, v)),
        z: select(of.axis == 2u32, eta, v),
    }
}

/// The number of the vertex on an edge of the cube whose low corner is cell `k` of a row.
#[cube]
fn vertex_of_cube(signs: &Signs, before: &Array<u32>, row: u32, k: u32, edge: u32) -> u32 {
    let of = edge_of_cube(signs, row, k, edge);
    vertex_on(signs, before, of.row, of.k, of.axis)
}
