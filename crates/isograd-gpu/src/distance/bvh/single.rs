//! The closest triangle of one place, by a group of units.

use cubecl::prelude::*;

use super::super::triangle::{distance_squared, load_frame};
use super::build::{NONE, RUN, TreeArrays};
use super::list::{List, ROOM, Region, UNITS, list_runs, new_list};
use super::search::{Centers, NOTHING_YET, UNPROVEN};
use crate::grid::{cell_at, center_of};
use crate::vector::Vector3;

/// Triangles that a group without a guess begins with.
const SAMPLES: u32 = 512;

/// The closest triangle that is known.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Nearest<F: Float> {
    /// Its place in Morton order, or [`NONE`].
    pub place: u32,
    pub face: u32,
    /// Its squared distance.
    pub squared: F,
}

/// Tries the triangle at `place`. Of triangles equally far the one of the lowest face stays, so that their order does not
/// matter.
#[cube]
pub(super) fn try_place<F: Float + CubeElement>(
    best: &mut Nearest<F>,
    tree: &TreeArrays<F>,
    place: u32,
    q: Vector3<F>,
) {
    let squared = distance_squared::<F>(load_frame::<F>(&tree.frames, place), q);
    if squared <= best.squared {
        let face = tree.faces[place as usize];
        if squared < best.squared || face < best.face {
            best.place = place;
            best.face = face;
        }
        best.squared = squared;
    }
}

/// No triangle yet; only those within the root of `bound` count.
#[cube]
pub(super) fn nothing_within<F: Float>(bound: F) -> Nearest<F> {
    Nearest::<F> {
        place: NONE.runtime(),
        face: NONE.runtime(),
        squared: bound,
    }
}

/// A [`Nearest`] of each unit of a group.
#[derive(CubeType)]
pub(super) struct Shared<F: Float> {
    squared: SharedMemory<F>,
    faces: SharedMemory<u32>,
    places: SharedMemory<u32>,
}

#[cube]
pub(super) fn new_shared<F: Float>(#[comptime] units: usize) -> Shared<F> {
    Shared::<F> {
        squared: SharedMemory::<F>::new(units),
        faces: SharedMemory::<u32>::new(units),
        places: SharedMemory::<u32>::new(units),
    }
}

/// The closest triangle of those that the `units` of a group know.
#[cube]
pub(super) fn closest_of_all<F: Float>(
    shared: &mut Shared<F>,
    own: Nearest<F>,
    #[comptime] units: usize,
) -> Nearest<F> {
    let unit = UNIT_POS as usize;
    shared.squared[unit] = own.squared;
    shared.faces[unit] = own.face;
    shared.places[unit] = own.place;
    sync_cube();
    let mut half = (units / 2).runtime();
    while half > 0 {
        if unit < half {
            let (a, b) = (shared.squared[unit], shared.squared[unit + half]);
            if b < a || (b == a && shared.faces[unit + half] < shared.faces[unit]) {
                shared.squared[unit] = b;
                shared.faces[unit] = shared.faces[unit + half];
                shared.places[unit] = shared.places[unit + half];
            }
        }
        sync_cube();
        half /= 2;
    }
    let closest = Nearest::<F> {
        place: shared.places[0],
        face: shared.faces[0],
        squared: shared.squared[0],
    };
    sync_cube();
    closest
}

/// Memory that the units of a group share.
#[derive(CubeType)]
pub(super) struct Group<F: Float> {
    list: List,
    best: Shared<F>,
}

#[cube]
pub(super) fn new_group<F: Float>() -> Group<F> {
    Group::<F> {
        list: new_list(),
        best: new_shared::<F>(UNITS),
    }
}

/// The place of the triangle closest to `q`, beginning with the place `guess`: not further than the root of `bound`, else
/// [`NONE`]; [`UNPROVEN`] where the list has no room.
#[cube]
pub(super) fn nearest_by_group<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    group: &mut Group<F>,
    q: Vector3<F>,
    cells: Centers<F>,
    guess: u32,
) -> u32 {
    let mut best = nothing_within::<F>(cells.bound);
    if guess < comptime!(NOTHING_YET) {
        try_place::<F>(&mut best, tree, guess, q);
    }
    let listed = list_runs::<F>(
        tree,
        &mut group.list,
        Region::<F> {
            center: q,
            half: F::new(0.0),
            foot: q,
            away: best.squared,
            rounding: cells.rounding,
        },
    );
    let mut result = UNPROVEN | guess;
    if listed.count <= comptime!(ROOM) {
        let width = (tree.pyramid.len() / 12) as u32;
        let mut index = UNIT_POS;
        while index < listed.count * comptime!(RUN) {
            let run = group.list.entries[(listed.first + index / comptime!(RUN)) as usize];
            let place = run * comptime!(RUN) + index % comptime!(RUN) - width;
            if place < tree.faces.len() as u32 {
                try_place::<F>(&mut best, tree, place, q);
            }
            index += comptime!(UNITS as u32);
        }
        result = closest_of_all::<F>(&mut group.best, best, UNITS).place;
    }
    result
}

/// The place of the closest one of some triangles, or [`NOTHING_YET`] where all are further than the root of `bound`.
#[cube]
fn nearest_sample<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    group: &mut Group<F>,
    q: Vector3<F>,
    bound: F,
) -> u32 {
    let mut best = nothing_within::<F>(bound);
    best.place = comptime!(NOTHING_YET).runtime();
    let count = tree.faces.len() as u32;
    let step = (count - 1u32) / comptime!(SAMPLES) + 1u32;
    let mut place = UNIT_POS * step;
    while place < count {
        try_place::<F>(&mut best, tree, place, q);
        place += step * comptime!(UNITS as u32);
    }
    closest_of_all::<F>(&mut group.best, best, UNITS).place
}

/// A group is a cell; `seeds` has the triangle closest to the center of two cells along each axis. Writes the place of
/// the triangle closest to each cell, or [`UNPROVEN`] and the guess where the list has no room.
#[cube(launch)]
pub(super) fn nearest_of_centers<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    seeds: &Array<u32>,
    found: &mut Array<u32>,
    cells: Centers<F>,
    count: u32,
    #[comptime] seeded: bool,
) {
    let mut group = new_group::<F>();
    let own = CUBE_POS as u32;
    if own < count {
        let cell = cell_at(own, cells.ny, cells.nz);
        let q = center_of::<F>(cell).scale(cells.spacing);
        let guess = if comptime!(seeded) {
            let across_y = (cells.ny - 1u32) / 2u32 + 1u32;
            let across_z = (cells.nz - 1u32) / 2u32 + 1u32;
            let above = (cell.i / 2u32 * across_y + cell.j / 2u32) * across_z + cell.k / 2u32;
            seeds[above as usize]
        } else {
            nearest_sample::<F>(tree, &mut group, q, cells.bound)
        };
        let mut result = NONE.runtime();
        if guess != NONE {
            result = nearest_by_group::<F>(tree, &mut group, q, cells, guess);
        }
        if UNIT_POS == 0 {
            found[own as usize] = result;
        }
    }
}
