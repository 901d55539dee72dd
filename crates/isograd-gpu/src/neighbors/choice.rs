//! Points that are sampled for the automatic radius: those that the CPU samples.
//!
//! They are a fixed stride of the order of the CPU's k-d tree, which halves the points along the longest side of
//! their box until no more than 16 are together. So that the device asks the same ones, it halves them in the same
//! way, after J. Bentley, "Multidimensional binary search trees" (1975), with points sorted along each axis
//! beforehand: the box of a part is then at the ends of its three lists, its middle in the middle of one, and the
//! others follow by a stable partition, which is a sum from the beginning and a move.

use cubecl::prelude::*;
use isograd::neighbors::rule::AUTO_SAMPLES;

use super::BLOCK;
use super::order::{gather, ordered_bits};
use crate::device::launch;
use crate::primitives::scan::exclusive_sum;
use crate::primitives::sort::{as_they_are, order};
use crate::{Buffer, Device, Error, Scalar};

/// Most points of the CPU's cells.
const CELL: usize = 16;

/// The indices of the chosen ones among `(N, 3)` finite points, none of whose coordinates is larger than `largest`;
/// N is not 0.
pub(super) fn choose<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
    largest: f64,
) -> Result<Buffer<u32>, Error> {
    let n = points.len() / 3;
    let stride = n.div_ceil(AUTO_SAMPLES);
    if stride == 1 {
        return as_they_are(device, n);
    }
    let mut levels = 0;
    while n.div_ceil(1 << levels) > CELL {
        levels += 1;
    }
    let mut lists = along_axes(device, points, largest)?;
    for level in 0..levels {
        lists = halve(device, points, &lists, level)?;
    }
    let chosen: Buffer<u32> = device.empty(n.div_ceil(stride))?;
    launch!(device, chosen.len(), BLOCK => choose_from_cells(
        lists, chosen, n as u32, levels, stride as u32,
    ));
    Ok(chosen)
}

/// The indices of the points in ascending order of x, then all in that of y, then of z; of equal ones the lowest
/// first. Coordinates in double precision are told apart by three words, down to 2⁻⁷² of the largest.
fn along_axes<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
    largest: f64,
) -> Result<Buffer<u32>, Error> {
    let n = points.len() / 3;
    let (words, scale) = match T::NAME {
        "f32" => (1u32, 1.0),
        _ => (3, (-largest.log2().ceil()).exp2()),
    };
    let lists: Buffer<u32> = device.empty(3 * n)?;
    for axis in 0..3u32 {
        let mut list = as_they_are(device, n)?;
        for word in (0..words).rev() {
            let keys = device.empty(n)?;
            launch!(device, n, BLOCK => fill_words<T>(
                points, list, keys, <T as isograd::Real>::of(scale), axis, word,
            ));
            let by_word = order(device, &keys, u32::MAX)?.places;
            list = gather(device, &list, &by_word, 1)?;
        }
        launch!(device, n, BLOCK => put_list(list, lists, axis));
    }
    Ok(lists)
}

/// One level further down: of each part first the half below the middle of its longest side.
fn halve<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
    lists: &Buffer<u32>,
    level: u32,
) -> Result<Buffer<u32>, Error> {
    let n = lists.len() / 3;
    let sides: Buffer<u32> = device.empty(n)?;
    launch!(device, n, BLOCK => find_sides<T>(points, lists, sides, level));
    let flags = gather(device, &sides, lists, 1)?;
    let before = exclusive_sum(device, &flags)?;
    let halved: Buffer<u32> = device.empty(3 * n)?;
    launch!(device, 3 * n, BLOCK => move_halves(lists, before, halved, level));
    Ok(halved)
}

/// Places of a list that belong together, from the first to the one after the last.
#[derive(CubeType, Clone, Copy)]
struct Part {
    start: u32,
    end: u32,
}

#[cube]
impl Part {
    fn middle(self) -> u32 {
        self.start + (self.end - self.start) / 2u32
    }
}

/// The part that holds a place of a list of `n`, after `level` halvings.
#[cube]
fn part_at(place: u32, n: u32, level: u32) -> Part {
    let mut start = 0u32.runtime();
    let mut end = n;
    for _ in 0..level {
        let middle = start + (end - start) / 2u32;
        if place < middle {
            end = middle;
        } else {
            start = middle;
        }
    }
    Part { start, end }
}

/// A word of the coordinate of each point in a list: what is left of it after the words before, as bits whose order
/// is that of the numbers.
#[cube(launch)]
fn fill_words<F: Float + CubeElement>(
    points: &Array<F>,
    list: &Array<u32>,
    keys: &mut Array<u32>,
    scale: F,
    axis: u32,
    word: u32,
) {
    if ABSOLUTE_POS < keys.len() {
        let mut rest = points[3 * list[ABSOLUTE_POS] as usize + axis as usize] * scale;
        let mut part = f32::cast_from(rest);
        for _ in 0..word {
            rest -= F::cast_from(part);
            part = f32::cast_from(rest);
        }
        // Both zeros are equal.
        keys[ABSOLUTE_POS] = ordered_bits(select(part == 0.0f32, 0.0f32, part));
    }
}

#[cube(launch)]
fn put_list(list: &Array<u32>, lists: &mut Array<u32>, axis: u32) {
    let n = lists.len() / 3;
    if ABSOLUTE_POS < n {
        lists[axis as usize * n + ABSOLUTE_POS] = list[ABSOLUTE_POS];
    }
}

/// 1 for the points of the lower halves.
#[cube(launch)]
fn find_sides<F: Float>(points: &Array<F>, lists: &Array<u32>, sides: &mut Array<u32>, level: u32) {
    let n = sides.len();
    if ABSOLUTE_POS < n {
        let part = part_at(ABSOLUTE_POS as u32, n as u32, level);
        let x = length::<F>(points, lists, part, 0usize, n);
        let y = length::<F>(points, lists, part, 1usize, n);
        let z = length::<F>(points, lists, part, 2usize, n);
        let of_two = select(y > x, y, x);
        let axis = select(z > of_two, 2u32, select(y > x, 1u32, 0u32));
        let point = lists[axis as usize * n + ABSOLUTE_POS] as usize;
        sides[point] = select((ABSOLUTE_POS as u32) < part.middle(), 1u32, 0u32);
    }
}

/// How long the box of a part is along an axis.
#[cube]
fn length<F: Float>(points: &Array<F>, lists: &Array<u32>, part: Part, axis: usize, n: usize) -> F {
    let first = lists[axis * n + part.start as usize] as usize;
    let last = lists[axis * n + part.end as usize - 1] as usize;
    points[3 * last + axis] - points[3 * first + axis]
}

/// The lower halves before the upper ones, the order within them kept; `before` counts the lower ones.
#[cube(launch)]
fn move_halves(lists: &Array<u32>, before: &Array<u32>, halved: &mut Array<u32>, level: u32) {
    let n = halved.len() / 3;
    if ABSOLUTE_POS < halved.len() {
        let list = ABSOLUTE_POS / n * n;
        let place = (ABSOLUTE_POS - list) as u32;
        let part = part_at(place, n as u32, level);
        let lower = before[ABSOLUTE_POS] - before[list + part.start as usize];
        let is_lower = before[ABSOLUTE_POS + 1] > before[ABSOLUTE_POS];
        let upper = part.middle() + (place - part.start) - lower;
        let to = select(is_lower, part.start + lower, upper);
        halved[list + to as usize] = lists[ABSOLUTE_POS];
    }
}

/// Every so-manyeth point of the cells in their order, those of a cell by index.
#[cube(launch)]
fn choose_from_cells(
    lists: &Array<u32>,
    chosen: &mut Array<u32>,
    n: u32,
    levels: u32,
    stride: u32,
) {
    if ABSOLUTE_POS < chosen.len() {
        let place = ABSOLUTE_POS as u32 * stride;
        let cell = part_at(place, n, levels);
        for own in cell.start..cell.end {
            let index = lists[own as usize];
            let mut rank = 0u32.runtime();
            for other in cell.start..cell.end {
                rank += select(lists[other as usize] < index, 1u32, 0u32);
            }
            if rank == place - cell.start {
                chosen[ABSOLUTE_POS] = index;
            }
        }
    }
}
