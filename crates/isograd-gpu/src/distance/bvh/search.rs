//! The closest triangle of cells, by descent into a [`Tree`].
//!
//! The cells of a brick of 4 × 4 × 4 begin with the triangle that is closest to the center of the brick, found
//! in the same way on a lattice of the bricks, and so on up to a few bricks: a bound that is never further off
//! than the brick is wide.
//!
//! Near the center of a sphere all triangles are about equally far, and a descent would try them all. One that
//! takes too many steps is given up, and a whole group of units settles its cell.

use cubecl::prelude::*;

use super::super::triangle::{distance_squared, load_frame};
use super::super::{Error, FAR};
use super::build::{LEAF, NONE, Tree, TreeArrays};
use super::settle::settle;
use crate::device::{Ready, launch};
use crate::grid::{Cell, cell_at};
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Cells along the side of a brick, and units of a group, one a cell.
const BRICK: usize = 4;
const UNITS: usize = 64;

/// The coarsest lattice has at most so many cells: they begin with nothing.
const COARSEST: usize = 64;

/// Children that may wait: one for each bit of a key in the radix tree, 30 of the code and 32 of the place.
const STACK: usize = 64;

/// Steps of a descent before it is given up.
const STEPS: u32 = 2048;

/// A result that is not the last word: above it, the place found so far, or [`NOTHING_YET`].
pub(super) const UNPROVEN: u32 = 1 << 31;
pub(super) const NOTHING_YET: u32 = UNPROVEN - 2;

/// A lattice of cell centers, seen from its low corner.
#[derive(Clone, Copy)]
pub(super) struct Level {
    pub shape: [usize; 3],
    pub spacing: f64,
    /// Greatest squared distance of a triangle that is looked for.
    pub bound: f64,
}

/// [`Level`] in kernels.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
pub(crate) struct Centers<F: Float + CubeElement> {
    pub nx: u32,
    pub ny: u32,
    pub nz: u32,
    pub spacing: F,
    pub bound: F,
}

impl Level {
    /// The level as an argument of a kernel.
    pub(super) fn arg<R: Runtime, T: Scalar>(&self) -> Ready<CentersLaunch<T, R>> {
        let [nx, ny, nz] = self.shape.map(|n| n as u32);
        let (spacing, bound) = (T::of(self.spacing), T::of(self.bound));
        Ready::new(CentersLaunch::new(nx, ny, nz, spacing, bound))
    }
}

/// The face closest to each cell center of a lattice whose low corner is the origin of the tree, or [`NONE`]
/// where it is further than `width`.
pub(crate) fn cells<T: Scalar, R: Runtime>(
    device: &Device<R>,
    tree: &Tree<T>,
    shape: [usize; 3],
    spacing: f64,
    width: Option<f64>,
) -> Result<Buffer<u32>, Error> {
    let bound =
        |beyond: f64| width.map_or(FAR, |width: f64| (width + beyond).powi(2) * (1.0 + 1e-5));
    let mut levels = vec![Level {
        shape,
        spacing,
        bound: bound(0.0),
    }];
    let (mut shape, mut spacing) = (shape, spacing);
    while shape.iter().product::<usize>() > COARSEST {
        shape = shape.map(|n| n.div_ceil(BRICK));
        spacing *= BRICK as f64;
        levels.push(Level {
            shape,
            spacing,
            // A brick may be as far beyond the band as its corners are from its center.
            bound: bound(0.87 * spacing),
        });
    }
    let mut seeds = None;
    while let Some(level) = levels.pop() {
        seeds = Some(solve_level(device, tree, level, seeds, levels.is_empty())?);
    }
    Ok(seeds.unwrap_or(device.empty(0)?))
}

fn solve_level<T: Scalar, R: Runtime>(
    device: &Device<R>,
    tree: &Tree<T>,
    level: Level,
    seeds: Option<Buffer<u32>>,
    last: bool,
) -> Result<Buffer<u32>, Error> {
    let found = device.empty(level.shape.iter().product())?;
    let bricks: usize = level.shape.iter().map(|n| n.div_ceil(BRICK)).product();
    let seeded = seeds.is_some();
    let seeds = seeds.unwrap_or(device.empty(0)?);
    launch!(device, bricks * UNITS, UNITS => nearest_of_cells<T>(
        tree, seeds, found, level.arg::<R, T>(), seeded, last,
    ));
    settle(device, tree, level, last, &found)?;
    Ok(found)
}

/// Squared distance from a place to the box whose low corner is vector `at` of `boxes`.
#[cube]
pub(super) fn box_distance_squared<F: Float>(boxes: &Array<F>, at: u32, q: Vector3<F>) -> F {
    let low = Vector3::<F>::at(boxes, at as usize);
    let high = Vector3::<F>::at(boxes, (at + 1u32) as usize);
    q.to_box_squared(low, high)
}

/// The triangle closest to `q`, as its place in Morton order: not further than the root of `bound`, else
/// [`NONE`]; [`UNPROVEN`] where the descent was given up. `seed` is a guess or [`NONE`]. Of triangles equally far the
/// one of the lowest face, so that the seed does not matter.
#[cube]
fn nearest<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    q: Vector3<F>,
    bound: F,
    seed: u32,
) -> u32 {
    let mut best = NONE.runtime();
    let mut best_face = NONE.runtime();
    let mut least = bound;
    if seed != NONE {
        let d = distance_squared::<F>(load_frame::<F>(&tree.frames, seed), q);
        if d <= least {
            least = d;
            best = seed;
            best_face = tree.faces[seed as usize];
        }
    }
    let mut waiting = Array::<u32>::new(STACK);
    let mut distances = Array::<F>::new(STACK);
    waiting[0] = 0u32;
    distances[0] = F::new(0.0);
    let mut height = 1u32.runtime();
    let mut steps = 0u32.runtime();
    while height > 0u32 && steps < STEPS {
        height -= 1u32;
        steps += 1u32;
        let node = waiting[height as usize];
        if distances[height as usize] <= least {
            if node >= LEAF {
                let first = node & 0x0fff_ffffu32;
                let count = ((node >> 28u32) & 7u32) + 1u32;
                for place in first..first + count {
                    let d = distance_squared::<F>(load_frame::<F>(&tree.frames, place), q);
                    if d <= least {
                        let face = tree.faces[place as usize];
                        if d < least || face < best_face {
                            best = place;
                            best_face = face;
                        }
                        least = d;
                    }
                }
            } else {
                let at = node as usize * 4;
                let a = box_distance_squared::<F>(&tree.boxes, node * 4u32, q);
                let b = box_distance_squared::<F>(&tree.boxes, node * 4u32 + 2u32, q);
                let mut wanted_a = a < least;
                let mut wanted_b = b < least;
                if a == least {
                    wanted_a = tree.children[at + 2] < best_face;
                }
                if b == least {
                    wanted_b = tree.children[at + 3] < best_face;
                }
                // The nearer one on top.
                let b_first = b < a;
                let (left, right) = (tree.children[at], tree.children[at + 1]);
                height = push::<F>(
                    &mut waiting,
                    &mut distances,
                    height,
                    wanted_a && b_first,
                    left,
                    a,
                );
                height = push::<F>(&mut waiting, &mut distances, height, wanted_b, right, b);
                height = push::<F>(
                    &mut waiting,
                    &mut distances,
                    height,
                    wanted_a && !b_first,
                    left,
                    a,
                );
            }
        }
    }
    if height > 0u32 {
        best = UNPROVEN | min(best, NOTHING_YET);
    }
    best
}

/// Puts a child on the stack if it is wanted, and returns the height.
#[cube]
fn push<F: Float>(
    waiting: &mut Array<u32>,
    distances: &mut Array<F>,
    height: u32,
    wanted: bool,
    child: u32,
    distance: F,
) -> u32 {
    if wanted {
        waiting[height as usize] = child;
        distances[height as usize] = distance;
    }
    select(wanted, height + 1u32, height)
}

/// A group is a brick of cells; `seeds` has one place a brick. Places are written for the lattice below, faces
/// on the last one.
#[cube(launch)]
fn nearest_of_cells<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    seeds: &Array<u32>,
    found: &mut Array<u32>,
    level: Centers<F>,
    #[comptime] seeded: bool,
    #[comptime] last: bool,
) {
    let (nx, ny, nz) = (level.nx, level.ny, level.nz);
    let across_y = (ny - 1u32) / 4u32 + 1u32;
    let across_z = (nz - 1u32) / 4u32 + 1u32;
    let brick = CUBE_POS as u32;
    let i = brick / (across_y * across_z) * 4u32 + UNIT_POS / 16u32;
    let j = brick / across_z % across_y * 4u32 + UNIT_POS / 4u32 % 4u32;
    let k = brick % across_z * 4u32 + UNIT_POS % 4u32;
    if i < nx && j < ny && k < nz {
        let q = center_of::<F>(Cell { i, j, k }, level.spacing);
        let mut seed = NONE.runtime();
        if comptime!(seeded) {
            seed = seeds[brick as usize];
        }
        let mut result = NONE.runtime();
        if seed != NONE || !seeded {
            result = nearest::<F>(tree, q, level.bound, seed);
        }
        if last && result < UNPROVEN {
            result = tree.faces[result as usize];
        }
        found[((i * ny + j) * nz + k) as usize] = result;
    }
}

/// The center of a cell in memory order, from the low corner of the grid.
#[cube]
pub(crate) fn center<F: Float>(cell: u32, spacing: F, ny: u32, nz: u32) -> Vector3<F> {
    center_of::<F>(cell_at(cell, ny, nz), spacing)
}

#[cube]
fn center_of<F: Float>(cell: Cell, spacing: F) -> Vector3<F> {
    let half = F::new(0.5);
    Vector3::<F> {
        x: spacing * (F::cast_from(cell.i) + half),
        y: spacing * (F::cast_from(cell.j) + half),
        z: spacing * (F::cast_from(cell.k) + half),
    }
}
