//! Walks down the tree.

use cubecl::prelude::*;

use super::tree::{IS_LEAF, NODE};
use super::{LEAF, PointTree};
use crate::vector::Vector3;

/// The first leaf at or after node `from` that may hold points within `radius` of `x`, or, if `mutual`, points
/// whose own radius reaches `x`; the number of nodes where there is none.
#[cube]
pub(crate) fn next_leaf<F: Float + CubeElement>(
    tree: &PointTree<F>,
    x: Vector3<F>,
    radius: F,
    from: usize,
    #[comptime] mutual: bool,
) -> usize {
    let (nodes, links) = (&tree.nodes, &tree.links);
    let mut node = from;
    let mut end = links.len();
    while node < end {
        let link = links[node];
        let mut reach = radius;
        if mutual {
            let other = nodes[NODE * node + 6];
            reach = select(other > radius, other, radius);
        }
        // So much more that no rounding can shut out a neighbor.
        let limit = reach * reach * F::new(1.0001);
        let low = Vector3::<F>::load(nodes, NODE * node);
        let high = Vector3::<F>::load(nodes, NODE * node + 3);
        if x.to_box_squared(low, high) <= limit {
            if link >= IS_LEAF {
                end = node;
            } else {
                node += 1;
            }
        } else if link >= IS_LEAF {
            node += 1;
        } else {
            node = link as usize;
        }
    }
    // `end` is the leaf, where one was found.
    select(node < links.len(), node, links.len())
}

/// The first point of a leaf.
#[cube]
pub(crate) fn first_of_leaf(links: &Array<u32>, node: usize) -> usize {
    (links[node] - IS_LEAF) as usize * LEAF
}

/// The point after the last of a leaf that begins at `first`.
#[cube]
pub(crate) fn end_of_leaf(first: usize, count: usize) -> usize {
    min(first + LEAF, count)
}

/// Whether a sample is an outlier: its radius has grown, and of the `others` within it fewer than 1 in 8 have it
/// within theirs (`mutual`).
#[cube]
pub(crate) fn is_isolated<F: Float>(radius: F, common: F, others: u32, mutual: u32) -> bool {
    radius > common && 8u32 * mutual < max(others, 1u32)
}
