//! The closest triangle of cells.
//!
//! A group of units has a brick of 4 × 4 × 4 cells, and a foot: the point of the triangle that is closest to the center of
//! the brick. It [lists](super::list) the triangles that may be closest to some cell, and each unit tries these for its own.
//!
//! The triangle that is closest to the center of a brick is found [by a group](super::single) that begins with the one of
//! two bricks along each axis, and so on up to a few, which begin with the closest of some triangles.
//!
//! Near the center of a sphere all triangles are about equally far. Where the list has no room for them, groups
//! [settle](super::settle) one cell each.

use cubecl::prelude::*;

use super::super::triangle::{foot, load_frame};
use super::super::{Error, FAR};
use super::build::{NONE, Tree, TreeArrays};
use super::list::{ROOM, Region, UNITS, list_triangles, new_list};
use super::settle::settle;
use super::single::{nearest_of_centers, nothing_within, try_place};
use crate::device::{Ready, launch};
use crate::grid::{Cell, cell_at, center_of};
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Cells along the side of a brick; a unit has one of them.
const BRICK: usize = 4;

/// The coarsest lattice has at most so many cells.
const COARSEST: usize = 64;

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
    /// Share of a squared distance by which rounding may have made a bound too large.
    pub rounding: F,
}

impl Level {
    /// The level as an argument of a kernel.
    pub(super) fn arg<R: Runtime, T: Scalar>(&self) -> Ready<CentersLaunch<T, R>> {
        let [nx, ny, nz] = self.shape.map(|n| n as u32);
        let (spacing, bound) = (T::of(self.spacing), T::of(self.bound));
        let rounding = T::of(32.0 * T::epsilon().f64());
        Ready::new(CentersLaunch::new(nx, ny, nz, spacing, bound, rounding))
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
    let (mut shape, mut spacing, mut side) = (shape, spacing, BRICK);
    while levels.len() == 1 || shape.iter().product::<usize>() > COARSEST {
        shape = shape.map(|n| n.div_ceil(side));
        spacing *= side as f64;
        side = 2;
        levels.push(Level {
            shape,
            spacing,
            // A brick may be as far beyond the band as its corners are from its center.
            bound: bound(0.87 * spacing),
        });
    }
    let mut found = None;
    while let Some(level) = levels.pop() {
        found = Some(solve_level(device, tree, level, found, levels.is_empty())?);
    }
    Ok(found.unwrap_or(device.empty(0)?))
}

/// Places of the triangles closest to the cells of a lattice, or their faces on the last one.
fn solve_level<T: Scalar, R: Runtime>(
    device: &Device<R>,
    tree: &Tree<T>,
    level: Level,
    seeds: Option<Buffer<u32>>,
    last: bool,
) -> Result<Buffer<u32>, Error> {
    let count = level.shape.iter().product();
    let found = device.empty(count)?;
    let centers = level.arg::<R, T>();
    match seeds {
        None => launch!(device, count * UNITS, UNITS => nearest_of_centers<T>(
            tree, device.empty::<u32>(0)?, found, centers, count as u32, false,
        )),
        Some(seeds) if last => {
            let bricks: usize = level.shape.iter().map(|n| n.div_ceil(BRICK)).product();
            launch!(device, bricks * UNITS, UNITS => nearest_of_bricks<T>(
                tree, seeds, found, centers, bricks as u32,
            ));
        }
        Some(seeds) => launch!(device, count * UNITS, UNITS => nearest_of_centers<T>(
            tree, seeds, found, centers, count as u32, true,
        )),
    }
    settle(device, tree, level, last, &found)?;
    Ok(found)
}

/// Squared distance from a place to the box of an entry of the pyramid.
#[cube]
pub(super) fn box_distance_squared<F: Float>(pyramid: &Array<F>, entry: u32, q: Vector3<F>) -> F {
    let low = Vector3::<F>::at(pyramid, (entry * 2u32) as usize);
    let high = Vector3::<F>::at(pyramid, (entry * 2u32 + 1u32) as usize);
    q.to_box_squared(low, high)
}

/// A group is a brick of cells; `seeds` has the triangle closest to the center of each, or [`NONE`] where no cell of it is
/// within the bound. Writes the faces closest to the cells, or what is known where the list has no room.
#[cube(launch)]
fn nearest_of_bricks<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    seeds: &Array<u32>,
    found: &mut Array<u32>,
    cells: Centers<F>,
    bricks: u32,
) {
    let mut list = new_list();
    let brick = CUBE_POS as u32;
    if brick < bricks {
        let (nx, ny, nz) = (cells.nx, cells.ny, cells.nz);
        let across_y = (ny - 1u32) / 4u32 + 1u32;
        let across_z = (nz - 1u32) / 4u32 + 1u32;
        let i = brick / (across_y * across_z) * 4u32;
        let j = brick / across_z % across_y * 4u32;
        let k = brick % across_z * 4u32;
        let seed = seeds[brick as usize];
        let first = center_of::<F>(Cell { i, j, k }).scale(cells.spacing);
        let half = F::new(1.5) * cells.spacing;
        let center = first.add(Vector3::<F>::of(half, half, half));
        let i = i + UNIT_POS / 16u32;
        let j = j + UNIT_POS / 4u32 % 4u32;
        let k = k + UNIT_POS % 4u32;
        let q = center_of::<F>(Cell { i, j, k }).scale(cells.spacing);
        let mut result = NONE.runtime();
        if seed != NONE {
            let foot = foot::<F>(load_frame::<F>(&tree.frames, seed), center);
            let from = foot.sub(center);
            let listed = list_triangles::<F>(
                tree,
                &mut list,
                Region::<F> {
                    center,
                    half,
                    foot,
                    away: from.dot(from),
                    rounding: cells.rounding,
                },
            );
            let mut best = nothing_within::<F>(cells.bound);
            if listed.count <= comptime!(ROOM) {
                // Listed but for rounding: the foot is not quite on it.
                try_place::<F>(&mut best, tree, seed, q);
                for index in 0..listed.count {
                    let place = list.entries[(listed.first + index) as usize];
                    try_place::<F>(&mut best, tree, place, q);
                }
                result = best.face;
            } else {
                result = UNPROVEN | seed;
            }
        }
        if i < nx && j < ny && k < nz {
            found[((i * ny + j) * nz + k) as usize] = result;
        }
    }
}

/// The center of a cell in memory order, from the low corner of the grid.
#[cube]
pub(crate) fn center<F: Float>(cell: u32, spacing: F, ny: u32, nz: u32) -> Vector3<F> {
    center_of::<F>(cell_at(cell, ny, nz)).scale(spacing)
}
