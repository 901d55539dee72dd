//! The closest triangles of the cells of bricks whose lists have no room: a group of units for each cell, which lists again,
//! from its own center, and where that has no room tries nearly all triangles.

use cubecl::prelude::*;

use super::super::Error;
use super::super::triangle::{distance_squared, load_frame};
use super::build::{NONE, Tree, TreeArrays};
use super::list::UNITS;
use super::search::{Centers, Level, NOTHING_YET, UNPROVEN, box_distance_squared, center};
use super::single::{
    Nearest, closest_of_all, nearest_by_group, new_group, new_shared, nothing_within, try_place,
};
use crate::device::launch;
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Groups that settle it, the units of each, and triangles that a unit takes at a time.
const SETTLERS: u32 = 1024;
const SETTLER_UNITS: usize = 256;
const TAKEN: usize = 64;

/// Mask of the place in a result marked [`UNPROVEN`].
const NOT_UNPROVEN: u32 = UNPROVEN - 1;

/// Solves the cells of `level` that are left in `found`, a group each; faces are written where `last`.
pub(super) fn settle<T: Scalar, R: Runtime>(
    device: &Device<R>,
    tree: &Tree<T>,
    level: Level,
    last: bool,
    found: &Buffer<u32>,
) -> Result<(), Error> {
    let count = found.len();
    let flags = device.empty(count)?;
    launch!(device, count => flag_left(found, flags));
    let left = flags::list(device, &flags)?;
    launch!(device, [SETTLERS; UNITS] => search_left<T>(
        tree, left.indices, left.sums, found, level.arg::<R, T>(), last,
    ));
    let taken = tree.width().min(TAKEN);
    launch!(device, [SETTLERS; SETTLER_UNITS] => settle_left<T>(
        tree, left.indices, left.sums, found, level.arg::<R, T>(), (tree.width() / taken) as u32,
        taken as u32, last,
    ));
    Ok(())
}

#[cube]
fn is_left(result: u32) -> bool {
    result >= UNPROVEN && result != NONE
}

/// 1 where a cell is left.
#[cube(launch)]
fn flag_left(found: &Array<u32>, flags: &mut Array<u32>) {
    if ABSOLUTE_POS < found.len() {
        flags[ABSOLUTE_POS] = u32::cast_from(is_left(found[ABSOLUTE_POS]));
    }
}

/// A group lists the runs that matter for one cell after another.
#[cube(launch)]
fn search_left<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    left: &Array<u32>,
    before: &Array<u32>,
    found: &mut Array<u32>,
    cells: Centers<F>,
    #[comptime] last: bool,
) {
    let mut group = new_group::<F>();
    let count = before[before.len() - 1];
    let mut turn = CUBE_POS as u32;
    while turn < count {
        let cell = left[turn as usize];
        let q = center::<F>(cell, cells.spacing, cells.ny, cells.nz);
        let guess = found[cell as usize] & NOT_UNPROVEN;
        let mut result = nearest_by_group::<F>(tree, &mut group, q, cells, guess);
        if last && result < UNPROVEN {
            result = tree.faces[result as usize];
        }
        sync_cube();
        if UNIT_POS == 0 {
            found[cell as usize] = result;
        }
        turn += SETTLERS;
    }
}

/// A group takes one query after another: each unit tries the triangles of some runs, and the closest of all is the
/// answer.
#[cube(launch)]
fn settle_left<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    left: &Array<u32>,
    before: &Array<u32>,
    found: &mut Array<u32>,
    cells: Centers<F>,
    level: u32,
    taken: u32,
    #[comptime] last: bool,
) {
    let mut shared = new_shared::<F>(SETTLER_UNITS);
    let count = before[before.len() - 1];
    let mut turn = CUBE_POS as u32;
    while turn < count {
        let query = left[turn as usize];
        let known = found[query as usize];
        sync_cube();
        if is_left(known) {
            let q = center::<F>(query, cells.spacing, cells.ny, cells.nz);
            let guess = known & NOT_UNPROVEN;
            let own = try_runs::<F>(tree, q, cells.bound, guess, level, taken);
            let closest = closest_of_all::<F>(&mut shared, own, SETTLER_UNITS);
            if UNIT_POS == 0 {
                found[query as usize] = select(last, closest.face, closest.place);
            }
        }
        turn += SETTLERS;
    }
}

/// Tries the triangles of every so many-th run, those of entries `level` to `2 level` of the pyramid, `guess`
/// being the place of one or [`NOTHING_YET`].
#[cube]
fn try_runs<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    q: Vector3<F>,
    bound: F,
    guess: u32,
    level: u32,
    taken: u32,
) -> Nearest<F> {
    let mut best = nothing_within::<F>(bound);
    if guess != NOTHING_YET {
        best.place = guess;
        best.face = tree.faces[guess as usize];
        best.squared = distance_squared::<F>(load_frame::<F>(&tree.frames, guess), q);
    }
    let mut run = UNIT_POS;
    while run < level {
        if box_distance_squared::<F>(&tree.pyramid, level + run, q) <= best.squared {
            let end = min((run + 1u32) * taken, tree.faces.len() as u32);
            for place in run * taken..end {
                try_place::<F>(&mut best, tree, place, q);
            }
        }
        run += comptime!(SETTLER_UNITS as u32);
    }
    best
}
