//! The triangles that may be closest to some place of a box, listed by a group of units.
//!
//! Of a place `x`, `|q − foot|² − |q − x|²` is linear in `q`; so runs of triangles that are farther than a point of the mesh,
//! the *foot*, from all of the box are soon told, from afar too. The group goes down the pyramid, a test a unit, and keeps
//! a list of the others.

use cubecl::prelude::*;

use super::super::triangle::{Frame, load_frame};
use super::build::{RUN, SLAB, SLAB_RUN, TreeArrays, center_of_box};
use super::search::box_distance_squared;
use crate::vector::Vector3;

/// Units of a group.
pub(super) const UNITS: usize = 64;

/// Room of the list of a group.
pub(super) const ROOM: u32 = 1024;

/// How many times as many runs the next level of the pyramid that is looked at has, at most.
const FINER: u32 = 8;

/// No more than the squared distance from `q` to any triangle of an entry of the pyramid.
#[cube]
fn least_squared<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    entry: u32,
    q: Vector3<F>,
    rounding: F,
) -> F {
    let mut least = box_distance_squared::<F>(&tree.pyramid, entry, q);
    if entry * comptime!(SLAB_RUN) >= (tree.pyramid.len() / 12) as u32 {
        let zero = F::new(0.0);
        let at = (entry * comptime!(SLAB)) as usize;
        let from = q.sub(center_of_box::<F>(&tree.pyramid, entry));
        let along = Vector3::<F>::load(&tree.slabs, at).dot(from);
        let squared = from.dot(from);
        let above = max(tree.slabs[at + 3] - along, along - tree.slabs[at + 4]);
        let axis = F::sqrt(max(squared - along * along, zero));
        let (above, beyond) = (max(above, zero), max(axis - tree.slabs[at + 5], zero));
        least = max(least, above * above + beyond * beyond - rounding * squared);
    }
    least
}

/// A box of places, and what is known of the mesh near it.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Region<F: Float> {
    pub center: Vector3<F>,
    /// Half its side.
    pub half: F,
    /// A point of the mesh.
    pub foot: Vector3<F>,
    /// Squared distance from the center to the foot.
    pub away: F,
    /// Share of a squared distance by which rounding may have made a bound too large.
    pub rounding: F,
}

/// Whether an entry of the pyramid may have a triangle that is as close as the foot to some place of a region.
#[cube]
fn matters<F: Float + CubeElement>(tree: &TreeArrays<F>, entry: u32, region: Region<F>) -> bool {
    let squared = least_squared::<F>(tree, entry, region.center, region.rounding);
    let low = Vector3::<F>::at(&tree.pyramid, (entry * 2u32) as usize).sub(region.foot);
    let high = Vector3::<F>::at(&tree.pyramid, (entry * 2u32 + 1u32) as usize).sub(region.foot);
    let x = max(F::abs(low.x), F::abs(high.x));
    let y = max(F::abs(low.y), F::abs(high.y));
    let z = max(F::abs(low.z), F::abs(high.z));
    let gain = F::new(2.0) * region.half * (x + y + z);
    squared - gain <= region.away + region.rounding * (region.away + gain)
}

/// [`matters`] for one triangle, by its corners: no place of it is nearer than the nearest of them but for a third of the
/// square of its longest edge, in squares.
#[cube]
fn triangle_matters<F: Float>(t: Frame<F>, region: Region<F>) -> bool {
    let base = t.foot + t.back;
    let b = t.origin.add(t.u.scale(base));
    let c = t.origin.add(t.u.scale(t.foot)).add(t.v.scale(t.height));
    let of_a = corner_power::<F>(t.origin, region);
    let least = min(
        of_a,
        min(corner_power::<F>(b, region), corner_power::<F>(c, region)),
    );
    let slack = base * base * F::new(0.334) + region.rounding * region.away;
    least - slack <= region.away
}

/// Least of `|q − corner|² − |q − foot|²` in a region, but for `|center − foot|²`.
#[cube]
fn corner_power<F: Float>(corner: Vector3<F>, region: Region<F>) -> F {
    let from = corner.sub(region.center);
    let to = corner.sub(region.foot);
    let gain = F::new(2.0) * region.half * (F::abs(to.x) + F::abs(to.y) + F::abs(to.z));
    let squared = from.dot(from);
    squared - gain - region.rounding * (squared + gain)
}

/// A list of a group, of which one half is read and the other one written.
#[derive(CubeType)]
pub(super) struct List {
    pub entries: SharedMemory<u32>,
    ranks: SharedMemory<u32>,
}

/// Adds the entries of those units that want it, in the order of the units, and returns how many there are then: more than
/// [`ROOM`] if some are lost.
#[cube]
fn add(list: &mut List, to: u32, count: u32, entry: u32, wanted: bool) -> u32 {
    let unit = UNIT_POS as usize;
    list.ranks[unit] = u32::cast_from(wanted);
    sync_cube();
    let mut reach = 1usize.runtime();
    while reach < UNITS {
        let mut before = 0u32.runtime();
        if unit >= reach {
            before = list.ranks[unit - reach];
        }
        sync_cube();
        list.ranks[unit] += before;
        sync_cube();
        reach *= 2;
    }
    let rank = count + list.ranks[unit];
    if wanted && rank <= comptime!(ROOM) {
        list.entries[(to + rank - 1u32) as usize] = entry;
    }
    let all = count + list.ranks[UNITS - 1];
    sync_cube();
    all
}

/// Which part of a list has what was looked for.
#[derive(CubeType, Clone, Copy)]
pub(super) struct Listed {
    pub first: u32,
    /// More than [`ROOM`] if some are lost.
    pub count: u32,
}

/// Lists the runs of [`RUN`] triangles that matter in a region.
#[cube]
pub(super) fn list_runs<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    list: &mut List,
    region: Region<F>,
) -> Listed {
    let runs = (tree.pyramid.len() / 12) as u32 / comptime!(RUN);
    let mut level = min(comptime!(UNITS as u32), runs);
    let own = level + UNIT_POS;
    let mut wanted = false;
    if UNIT_POS < level {
        wanted = matters::<F>(tree, own, region);
    }
    let mut count = add(list, 0u32, 0u32, own, wanted);
    let mut first = 0u32.runtime();
    while level < runs && count <= comptime!(ROOM) {
        let finer = min(comptime!(FINER), runs / level);
        let to = comptime!(ROOM) - first;
        let tests = count * finer;
        let mut kept = 0u32.runtime();
        let mut begin = 0u32.runtime();
        while begin < tests && kept <= comptime!(ROOM) {
            let test = begin + UNIT_POS;
            let mut entry = 0u32.runtime();
            let mut wanted = false;
            if test < tests {
                entry = list.entries[(first + test / finer) as usize] * finer + test % finer;
                wanted = matters::<F>(tree, entry, region);
            }
            kept = add(list, to, kept, entry, wanted);
            begin += comptime!(UNITS as u32);
        }
        first = to;
        count = kept;
        level *= finer;
    }
    Listed { first, count }
}

/// Lists the triangles that matter in a region, by their places in Morton order.
#[cube]
pub(super) fn list_triangles<F: Float + CubeElement>(
    tree: &TreeArrays<F>,
    list: &mut List,
    region: Region<F>,
) -> Listed {
    let runs = list_runs::<F>(tree, list, region);
    let mut count = runs.count;
    let to = comptime!(ROOM) - runs.first;
    if runs.count <= comptime!(ROOM) {
        let width = (tree.pyramid.len() / 12) as u32;
        let tests = runs.count * comptime!(RUN);
        count = 0u32.runtime();
        let mut begin = 0u32.runtime();
        while begin < tests && count <= comptime!(ROOM) {
            let test = begin + UNIT_POS;
            let mut place = 0u32.runtime();
            let mut wanted = false;
            if test < tests {
                let run = list.entries[(runs.first + test / comptime!(RUN)) as usize];
                place = run * comptime!(RUN) + test % comptime!(RUN) - width;
                if place < tree.faces.len() as u32 {
                    wanted = triangle_matters::<F>(load_frame::<F>(&tree.frames, place), region);
                }
            }
            count = add(list, to, count, place, wanted);
            begin += comptime!(UNITS as u32);
        }
    }
    Listed { first: to, count }
}

#[cube]
pub(super) fn new_list() -> List {
    List {
        entries: SharedMemory::<u32>::new(comptime!(2 * ROOM as usize)),
        ranks: SharedMemory::<u32>::new(UNITS),
    }
}
