//! Cotangents of the vertices to cotangents of the indicator, the level and the grid.

use cubecl::prelude::*;

use super::Residual;
use super::signs::{BLOCK, Signs, inside, vertex_on};
use super::sums::fold;
use super::values::{Values, fraction_on, stride};
use crate::device::{Ready, check_length, launch};
use crate::element::crossing::bounded;
use crate::grid::{cell_at, center_of};
use crate::primitives::ends::ends;
use crate::primitives::reduce::{groups_for, sum_of_group};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Sums over the vertices: of the level, of the low corner, of the spacing.
const SUMS: usize = 5;

/// Cotangents of the field, the level and the grid.
#[derive(Clone)]
pub struct Cotangent<T> {
    /// `(nx, ny, nz)` cotangent of `χ`; 0 in cells without a vertex on any of their edges.
    pub chi: Buffer<T>,
    /// `(1,)` cotangent of the level.
    pub level: Buffer<T>,
    /// `(4,)` cotangent of the low corner of the grid and, that and the number of cells being held, of its spacing.
    pub grid: Buffer<T>,
    /// `(1,)` vertices on edges along which `χ` hardly changes: their derivative was bounded.
    pub guarded: Buffer<u32>,
}

/// Cotangents of the inputs of [`forward`](super::forward) from those of the vertices, `(V, 3)`:
/// [`isograd::isosurface::pullback`], whose guard is used, with sums in `T`.
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    vertices_bar: &Buffer<T>,
) -> Result<Cotangent<T>, Error> {
    let count = residual.edges.len();
    check_length("the cotangent of the vertices", vertices_bar, 3 * count)?;
    let ends = ends(device, &residual.chi, 1)?;
    let groups = groups_for(count);
    let partial: Buffer<T> = device.empty(SUMS * groups)?;
    let partly_guarded: Buffer<u32> = device.empty(groups)?;
    let out = Cotangent {
        chi: device.empty(residual.chi.len())?,
        level: device.empty(1)?,
        grid: device.empty(4)?,
        guarded: device.empty(1)?,
    };
    let bars = || Ready::new(BarsLaunch::new(ends.arg(), vertices_bar.arg()));
    launch!(device, residual.signs.units(), BLOCK => gather_chi<T>(
        residual.signs, residual.before, residual.values(device)?, bars(), out.chi,
    ));
    launch!(device, [groups; BLOCK] => add_vertices<T>(
        residual.signs, residual.edges, residual.values(device)?, bars(), partial, partly_guarded,
        BLOCK,
    ));
    fold(device, &partial, groups, 0, &out.level);
    fold(device, &partial, groups, 1, &out.grid);
    fold(device, &partly_guarded, groups, 0, &out.guarded);
    Ok(out)
}

/// Cotangents of the vertices, and the ends of the range of `χ`.
#[derive(CubeLaunch, CubeType)]
struct Bars<F: Float + CubeElement> {
    ends: Array<F>,
    vertices: Array<F>,
}

/// A vertex seen from its edge.
#[derive(CubeType)]
struct OnEdge<F: Float + CubeElement> {
    eta: F,
    /// `s/(χ_q − χ_p)`, in which `s = ȳ·(q − p)`.
    pull: F,
    /// 1 where the difference was bounded and that matters.
    guarded: u32,
}

/// The vertex of this number on the edge along `axis` from the cell at place `p` in memory.
#[cube]
fn on_edge<F: Float + CubeElement>(
    signs: &Signs,
    values: &Values<F>,
    bars: &Bars<F>,
    p: usize,
    axis: u32,
    vertex: u32,
) -> OnEdge<F> {
    let difference = values.chi[p + stride(signs, axis)] - values.chi[p];
    let smallest = values.scales[4] * (bars.ends[1] - bars.ends[0]);
    let s = bars.vertices[3 * vertex as usize + axis as usize] * values.scales[3];
    OnEdge::<F> {
        eta: fraction_on::<F>(signs, values, p, axis),
        pull: s / bounded::<F>(difference, smallest),
        guarded: select(
            F::abs(difference) < smallest && s != F::new(0.0),
            1u32,
            0u32,
        ),
    }
}

/// One unit a cell adds up what the vertices on its edges mean for it, in the order of the edges.
#[cube(launch)]
fn gather_chi<F: Float + CubeElement>(
    signs: &Signs,
    before: &Array<u32>,
    values: &Values<F>,
    bars: &Bars<F>,
    chi_bar: &mut Array<F>,
) {
    let word = ABSOLUTE_POS as u32 / 32u32;
    let row = word / signs.words;
    let k = 32u32 * (word % signs.words) + ABSOLUTE_POS as u32 % 32u32;
    if row < signs.nx * signs.ny && k < signs.nz {
        let i = row / signs.ny;
        let j = row % signs.ny;
        let mut sum = F::new(0.0);
        if i > 0u32 {
            let below = row - signs.ny;
            sum += part::<F>(signs, before, values, bars, below, k, 0u32, true);
        }
        if j > 0u32 {
            let below = row - 1u32;
            sum += part::<F>(signs, before, values, bars, below, k, 1u32, true);
        }
        if k > 0u32 {
            let below = k - 1u32;
            sum += part::<F>(signs, before, values, bars, row, below, 2u32, true);
        }
        if i + 1u32 < signs.nx {
            sum += part::<F>(signs, before, values, bars, row, k, 0u32, false);
        }
        if j + 1u32 < signs.ny {
            sum += part::<F>(signs, before, values, bars, row, k, 1u32, false);
        }
        if k + 1u32 < signs.nz {
            sum += part::<F>(signs, before, values, bars, row, k, 2u32, false);
        }
        chi_bar[(row * signs.nz + k) as usize] = sum;
    }
}

/// Cotangent of the vertex on the edge along `axis` from cell `k` of a row, if there is one, for the cell at the
/// edge's end or at its start.
#[cube]
fn part<F: Float + CubeElement>(
    signs: &Signs,
    before: &Array<u32>,
    values: &Values<F>,
    bars: &Bars<F>,
    row: u32,
    k: u32,
    #[comptime] axis: u32,
    #[comptime] at_end: bool,
) -> F {
    let next_row = row + select(axis == 0u32, signs.ny, select(axis == 1u32, 1u32, 0u32));
    let next_k = k + select(axis == 2u32, 1u32, 0u32);
    let mut part = F::new(0.0);
    if inside(signs, row, k) != inside(signs, next_row, next_k) {
        let vertex = vertex_on(signs, before, row, k, axis);
        let p = (row * signs.nz + k) as usize;
        let edge = on_edge::<F>(signs, values, bars, p, axis, vertex);
        if at_end {
            part = -edge.pull * edge.eta;
        } else {
            part = edge.pull * (edge.eta - F::new(1.0));
        }
    }
    part
}

/// The sums of each group, all of one kind side by side.
#[cube(launch)]
fn add_vertices<F: Float + CubeElement>(
    signs: &Signs,
    edges: &Array<u32>,
    values: &Values<F>,
    bars: &Bars<F>,
    partial: &mut Array<F>,
    partly_guarded: &mut Array<u32>,
    #[comptime] block: usize,
) {
    let groups = partly_guarded.len();
    let mut level = F::new(0.0);
    let mut lower = Vector3::<F>::zero();
    let mut spacing = F::new(0.0);
    let mut guarded = 0u32;
    let mut vertex = ABSOLUTE_POS;
    while vertex < edges.len() {
        let p = edges[vertex] / 3u32;
        let axis = edges[vertex] % 3u32;
        let edge = on_edge::<F>(signs, values, bars, p as usize, axis, vertex as u32);
        let bar = Vector3::<F>::at(&bars.vertices, vertex);
        level += edge.pull;
        lower = lower.add(bar);
        // The place of the vertex in index coordinates: that of the cell's center, and η along the edge.
        let center = center_of::<F>(cell_at(p, signs.ny, signs.nz));
        let along = select(axis == 0u32, bar.x, select(axis == 1u32, bar.y, bar.z));
        spacing += bar.dot(center) + along * edge.eta;
        guarded += edge.guarded;
        vertex += groups * block;
    }
    let mut shared = SharedMemory::<F>::new(block);
    let mut counts = SharedMemory::<u32>::new(block);
    let level = sum_of_group::<F>(level, &mut shared);
    let lower_x = sum_of_group::<F>(lower.x, &mut shared);
    let lower_y = sum_of_group::<F>(lower.y, &mut shared);
    let lower_z = sum_of_group::<F>(lower.z, &mut shared);
    let spacing = sum_of_group::<F>(spacing, &mut shared);
    let guarded = sum_of_group::<u32>(guarded, &mut counts);
    if UNIT_POS == 0u32 {
        let next = groups;
        partial[CUBE_POS] = level;
        partial[CUBE_POS + next] = lower_x;
        partial[CUBE_POS + 2 * next] = lower_y;
        partial[CUBE_POS + 3 * next] = lower_z;
        partial[CUBE_POS + 4 * next] = spacing;
        partly_guarded[CUBE_POS] = guarded;
    }
}
