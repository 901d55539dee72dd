//! The nearest other points of every point.

use cubecl::prelude::*;

use super::nearest::{box_square, next_node, square_to};
use super::order::scatter;
use super::tree::IS_LEAF;
use super::walk::{end_of_leaf, first_of_leaf};
use super::{BLOCK, Neighborhoods};
use crate::primitives::smallest::insert;
use crate::primitives::sort::as_they_are;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Points before and after one along the curve, of which some are near.
const MARGIN: usize = 16;

/// Stands for the index of a point that is not found yet.
const NONE: u32 = u32::MAX;

/// So much less than the distance to a box that no rounding can shut out a neighbor.
const SURE: f32 = 0.9999;

/// The sorted positions `(N, k)` of the nearest other points of each sorted point, nearest first, and of equally far
/// ones the lowest index in the input first; where there are too few, the point itself. `k` is at most [`MARGIN`].
pub(crate) fn nearest_others<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    k: usize,
) -> Result<Buffer<u32>, Error> {
    debug_assert!(k > 0 && k <= MARGIN);
    let n = neighborhoods.len();
    let near = device.empty(k * n)?;
    if n > 0 {
        let positions = scatter(device, &as_they_are(device, n)?, &neighborhoods.places)?;
        find_others::launch::<T, R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            neighborhoods.points.arg(),
            neighborhoods.nodes.arg(),
            neighborhoods.links.arg(),
            neighborhoods.places.arg(),
            positions.arg(),
            near.arg(),
            k,
        );
    }
    Ok(near)
}

/// A walk that begins with the distance of the `k`-th nearest of those along the curve.
#[cube(launch)]
fn find_others<F: Float>(
    points: &Array<F>,
    nodes: &Array<F>,
    links: &Array<u32>,
    places: &Array<u32>,
    positions: &Array<u32>,
    near: &mut Array<u32>,
    #[comptime] k: usize,
) {
    let n = places.len();
    let own = ABSOLUTE_POS;
    if own < n {
        let x = Vector3::<F>::at(points, own);
        let mut squares = Array::<F>::new(k);
        let mut indices = Array::<u32>::new(k);
        let bound = bound_along_curve::<F>(points, own, &mut squares, k);
        #[unroll]
        for i in 0..k {
            squares[i] = bound;
            indices[i] = NONE;
        }
        let mut node = 0usize.runtime();
        while node < links.len() {
            let square = box_square::<F>(nodes, node, x);
            // Equal points are in the order of the input: where those before them are in, no later one comes in.
            let all_here = squares[k - 1] == F::new(0.0) && indices[k - 1] != NONE;
            let enter = F::new(SURE) * square <= squares[k - 1] && !all_here;
            if enter && links[node] >= IS_LEAF {
                let first = first_of_leaf(links, node);
                for j in first..end_of_leaf(first, n) {
                    if j != own {
                        let square = square_to::<F>(points, j, x);
                        insert_point::<F>(square, places[j], &mut squares, &mut indices, k);
                    }
                }
            }
            node = next_node(links, node, enter);
        }
        #[unroll]
        for i in 0..k {
            let index = indices[i];
            let found = index != NONE;
            let position = positions[select(found, index, places[own]) as usize];
            near[k * own + i] = position;
        }
    }
}

/// A squared distance within which `k` other points are, as far as there are so many.
#[cube]
fn bound_along_curve<F: Float>(
    points: &Array<F>,
    own: usize,
    squares: &mut Array<F>,
    #[comptime] k: usize,
) -> F {
    let x = Vector3::<F>::at(points, own);
    #[unroll]
    for i in 0..k {
        squares[i] = F::max_value();
    }
    let first = own - min(own, MARGIN);
    for j in first..min(own + MARGIN + 1, points.len() / 3) {
        if j != own {
            insert::<F>(square_to::<F>(points, j, x), squares, k);
        }
    }
    squares[k - 1]
}

/// Puts a point where it belongs among the `k` nearest so far.
#[cube]
fn insert_point<F: Float>(
    square: F,
    index: u32,
    squares: &mut Array<F>,
    indices: &mut Array<u32>,
    #[comptime] k: usize,
) {
    if comes_before::<F>(square, index, squares[k - 1], indices[k - 1]) {
        let mut moved = square;
        let mut moved_index = index;
        #[unroll]
        for i in 0..k {
            let own = squares[i];
            let own_index = indices[i];
            let stays = comes_before::<F>(own, own_index, moved, moved_index);
            squares[i] = select(stays, own, moved);
            indices[i] = select(stays, own_index, moved_index);
            moved = select(stays, moved, own);
            moved_index = select(stays, moved_index, own_index);
        }
    }
}

#[cube]
fn comes_before<F: Float>(square: F, index: u32, other: F, other_index: u32) -> bool {
    square < other || (square == other && index < other_index)
}
