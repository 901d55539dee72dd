//! The nearest points of a place, by walks down the tree.

use cubecl::prelude::*;

use super::tree::{IS_LEAF, NODE};
use super::walk::{end_of_leaf, first_of_leaf};
use super::{BLOCK, LEAF, Neighborhoods, PointTree};
use crate::device::{Ready, launch};
use crate::primitives::smallest::insert;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Points along the curve, around the leaf nearest to a place, that bound the distance to its nearest points; more
/// where more are asked for.
const WINDOW: usize = 32;

/// The squared distance of each sorted point to its `k`-th nearest, `k` being at most the number of points. The first
/// is the point itself.
pub(crate) fn reaches<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    k: usize,
) -> Result<Buffer<T>, Error> {
    debug_assert!(k > 0 && k <= neighborhoods.len());
    let squares = device.empty(neighborhoods.len())?;
    launch!(device, squares.len(), BLOCK => find_reaches<T>(
        Ready::new(neighborhoods.tree()), squares, k,
    ));
    Ok(squares)
}

#[cube(launch)]
fn find_reaches<F: Float + CubeElement>(
    tree: &PointTree<F>,
    squares: &mut Array<F>,
    #[comptime] k: usize,
) {
    if ABSOLUTE_POS < squares.len() {
        let x = Vector3::<F>::at(&tree.points, ABSOLUTE_POS);
        squares[ABSOLUTE_POS] = reach_squared::<F>(tree, x, k);
    }
}

/// The squared distance of `x` to its `k`-th nearest point; there must be as many.
#[cube]
pub(crate) fn reach_squared<F: Float + CubeElement>(
    tree: &PointTree<F>,
    x: Vector3<F>,
    #[comptime] k: usize,
) -> F {
    let (points, nodes, links) = (&tree.points, &tree.nodes, &tree.links);
    let window = comptime!(if k > WINDOW { k } else { WINDOW });
    let margin = comptime!((window - LEAF) / 2);
    let mut nearest = Array::<F>::new(k);
    #[unroll]
    for i in 0..k {
        nearest[i] = F::max_value();
    }
    // Any k points bound the distance; those around the nearest leaf bound it well.
    let n = points.len() / 3;
    let first = first_of_leaf(links, leaf_towards::<F>(nodes, links, x));
    let begin = min(first - min(first, margin), n - min(n, window));
    for j in begin..min(begin + window, n) {
        insert::<F>(square_to::<F>(points, j, x), &mut nearest, k);
    }
    let bound = nearest[k - 1];
    // However many points lie there, none is nearer.
    if bound > F::new(0.0) {
        #[unroll]
        for i in 0..k {
            nearest[i] = bound;
        }
        let mut node = 0usize.runtime();
        while node < links.len() {
            let inside = box_square::<F>(nodes, node, x) < nearest[k - 1];
            if inside && links[node] >= IS_LEAF {
                let first = first_of_leaf(links, node);
                for j in first..end_of_leaf(first, n) {
                    insert::<F>(square_to::<F>(points, j, x), &mut nearest, k);
                }
            }
            node = next_node(links, node, inside);
        }
    }
    nearest[k - 1]
}

/// Squared distance from a place to a node's box.
#[cube]
pub(super) fn box_square<F: Float>(nodes: &Array<F>, node: usize, x: Vector3<F>) -> F {
    let low = Vector3::<F>::load(nodes, NODE * node);
    let high = Vector3::<F>::load(nodes, NODE * node + 3);
    x.to_box_squared(low, high)
}

#[cube]
pub(super) fn square_to<F: Float>(points: &Array<F>, j: usize, x: Vector3<F>) -> F {
    let offset = Vector3::<F>::at(points, j).sub(x);
    offset.dot(offset)
}

/// The node to look at after this one: below it, if it is to be entered, else after its subtree.
#[cube]
pub(super) fn next_node(links: &Array<u32>, node: usize, enter: bool) -> usize {
    let link = links[node];
    let step = enter || link >= IS_LEAF;
    select(step, node + 1, link as usize)
}

/// A leaf near a place: from the root always on to the nearest box.
#[cube]
fn leaf_towards<F: Float>(nodes: &Array<F>, links: &Array<u32>, x: Vector3<F>) -> usize {
    let mut node = 0usize.runtime();
    while links[node] < IS_LEAF {
        let end = min(links[node] as usize, links.len());
        let mut nearest = node + 1;
        let mut least = box_square::<F>(nodes, nearest, x);
        let mut child = next_node(links, node + 1, false);
        while child < end {
            let square = box_square::<F>(nodes, child, x);
            if square < least {
                least = square;
                nearest = child;
            }
            child = next_node(links, child, false);
        }
        node = nearest;
    }
    node
}

/// A point, and how far it is from a place, squared.
#[derive(CubeType, Clone, Copy)]
pub(crate) struct Near<F: Float> {
    pub point: u32,
    pub square: F,
}

/// No point is nearer to the place than this share of the distance to the one that [`about_nearest`] found.
pub(crate) const SURE_SHARE: f32 = 0.7;

/// A point that is about the nearest to `x`, beginning with `guess`. To know the nearest itself would take a look at
/// most of the points where they are about equally far, as at the center of a sphere; to know it to a third takes a
/// few.
#[cube]
pub(crate) fn about_nearest<F: Float + CubeElement>(
    tree: &PointTree<F>,
    x: Vector3<F>,
    guess: u32,
) -> Near<F> {
    let (points, nodes, links) = (&tree.points, &tree.nodes, &tree.links);
    let n = points.len() / 3;
    let share = F::new(SURE_SHARE) * F::new(SURE_SHARE);
    let mut point = guess;
    let mut square = square_to::<F>(points, guess as usize, x);
    let mut node = 0usize.runtime();
    while node < links.len() {
        let enter = box_square::<F>(nodes, node, x) < share * square;
        if enter && links[node] >= IS_LEAF {
            let first = first_of_leaf(links, node);
            for j in first..end_of_leaf(first, n) {
                let other = square_to::<F>(points, j, x);
                if other < square {
                    square = other;
                    point = j as u32;
                }
            }
        }
        node = next_node(links, node, enter);
    }
    Near::<F> { point, square }
}

/// Whether any point is within the distance of `x` whose square is `limit`.
#[cube]
pub(crate) fn any_within<F: Float + CubeElement>(
    tree: &PointTree<F>,
    x: Vector3<F>,
    limit: F,
) -> bool {
    let (points, nodes, links) = (&tree.points, &tree.nodes, &tree.links);
    let n = points.len() / 3;
    let mut found = 0u32.runtime();
    let mut node = 0usize.runtime();
    while node < links.len() && found == 0u32 {
        let enter = box_square::<F>(nodes, node, x) <= limit;
        if enter && links[node] >= IS_LEAF {
            let first = first_of_leaf(links, node);
            for j in first..end_of_leaf(first, n) {
                if square_to::<F>(points, j, x) <= limit {
                    found = 1u32;
                }
            }
        }
        node = next_node(links, node, enter);
    }
    found == 1u32
}
