//! Boxes around points that follow each other on the curve.
//!
//! A node at level 0 is a leaf; one at level `l + 1` holds four of level `l`, the last of each level perhaps
//! fewer. All stand in one array, each before its subtrees: what is missing from a full tree would stand after
//! the last leaf.

use cubecl::prelude::*;

use super::{BLOCK, LEAF};
use crate::device::launch;
use crate::{Buffer, Device, Error, Scalar};

/// Children of a node, and the power of two that they are.
const CHILDREN: usize = 4;

/// Numbers of a node.
pub(super) const NODE: usize = 7;

/// Set in the link of a leaf.
pub(super) const IS_LEAF: u32 = 1 << 31;

/// Nodes and links of the tree over sorted points.
pub(super) fn build<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
    radii: &Buffer<T>,
) -> Result<(Buffer<T>, Buffer<u32>), Error> {
    let mut counts = vec![radii.len().div_ceil(LEAF)];
    while let &[.., count] = &counts[..]
        && count > 1
    {
        counts.push(count.div_ceil(CHILDREN));
    }
    let height = counts.len() as u32 - 1;
    let total = match counts[0] {
        0 => 0,
        leaves => place(leaves as u32 - 1, 1, height) as usize + 1,
    };
    let nodes = device.empty(NODE * total)?;
    let links = device.empty(total)?;
    if total == 0 {
        return Ok((nodes, links));
    }
    launch!(device, counts[0], BLOCK => fill_leaves<T>(
        points, radii, nodes, links, counts[0] as u32, height,
    ));
    let mut below = 1u32;
    for level in 1..counts.len() {
        launch!(device, counts[level], BLOCK => fill_level<T>(
            nodes, links, counts[level - 1] as u32, counts[level] as u32, below,
            height - level as u32,
        ));
        below = CHILDREN as u32 * below + 1;
    }
    Ok((nodes, links))
}

/// Where node `i` of a level stands whose full subtrees have `size` nodes, `above` levels below the root.
#[cube]
fn place(i: u32, size: u32, above: u32) -> u32 {
    let mut place = 0u32;
    let mut rest = i;
    let mut each = size;
    for _ in 0..above {
        place += 1u32 + (rest & 3u32) * each;
        rest >>= 2u32;
        each = 4u32 * each + 1u32;
    }
    place
}

#[cube(launch)]
fn fill_leaves<F: Float>(
    points: &Array<F>,
    radii: &Array<F>,
    nodes: &mut Array<F>,
    links: &mut Array<u32>,
    leaves: u32,
    height: u32,
) {
    if ABSOLUTE_POS < leaves as usize {
        let node = place(ABSOLUTE_POS as u32, 1u32, height) as usize;
        let first = ABSOLUTE_POS * LEAF;
        let end = min(first + LEAF, radii.len());
        #[unroll]
        for axis in 0..3usize {
            let mut low = points[3 * first + axis];
            let mut high = low;
            for i in first + 1..end {
                let x = points[3 * i + axis];
                low = select(x < low, x, low);
                high = select(x > high, x, high);
            }
            nodes[NODE * node + axis] = low;
            nodes[NODE * node + 3 + axis] = high;
        }
        let mut reach = radii[first];
        for i in first + 1..end {
            reach = select(radii[i] > reach, radii[i], reach);
        }
        nodes[NODE * node + 6] = reach;
        links[node] = IS_LEAF + ABSOLUTE_POS as u32;
    }
}

/// Nodes round those of the level below, whose full subtrees have `size` nodes.
#[cube(launch)]
fn fill_level<F: Float>(
    nodes: &mut Array<F>,
    links: &mut Array<u32>,
    children: u32,
    count: u32,
    size: u32,
    above: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let whole = 4u32 * size + 1u32;
        let node = place(ABSOLUTE_POS as u32, whole, above) as usize;
        let own = min(children as usize - 4 * ABSOLUTE_POS, 4usize);
        #[unroll]
        for k in 0..NODE {
            let mut extreme = nodes[NODE * (node + 1) + k];
            for child in 1..own {
                let other = nodes[NODE * (node + 1 + child * size as usize) + k];
                if comptime!(k < 3) {
                    extreme = select(other < extreme, other, extreme);
                } else {
                    extreme = select(other > extreme, other, extreme);
                }
            }
            nodes[NODE * node + k] = extreme;
        }
        links[node] = node as u32 + whole;
    }
}
