//! Boxes of cells.

use crate::distance::bvh::{LANES, Points};
use crate::vector::{add, norm, norm_squared, scale, sub};
use crate::{Grid, Real};

/// Cells along a side of a block that is solved on its own.
pub(super) const BLOCK: usize = 16;

/// Blocks that a block is cut into.
pub(super) const CHILDREN: usize = 8;

/// Sides of a packet, which is measured at once.
pub(super) const PACKET: [usize; 3] = [2, 2, 4];

/// A box of cells, clipped to the grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub start: [usize; 3],
    end: [usize; 3],
    side: usize,
}

impl Block {
    pub(super) fn new(start: [usize; 3], side: usize, limit: [usize; 3]) -> Self {
        let end = std::array::from_fn(|a| limit[a].min(start[a] + side));
        Self { start, end, side }
    }

    pub(super) fn is_empty(&self) -> bool {
        (0..3).any(|a| self.start[a] >= self.end[a])
    }

    pub(super) fn child(&self, index: usize) -> Self {
        let half = self.side / 2;
        let start = std::array::from_fn(|a| self.start[a] + half * bit(index, a));
        Self::new(start, half, self.end)
    }

    /// The packets of a block of side 4 that are in the grid, with their numbers: children `2 i` and `2 i + 1`
    /// are the halves of packet `i`.
    pub(super) fn packets(&self) -> impl Iterator<Item = (usize, Self)> {
        (0..4)
            .map(|index| {
                let start = [
                    self.start[0] + 2 * (index >> 1),
                    self.start[1] + 2 * (index & 1),
                    self.start[2],
                ];
                (index, Self { start, ..*self })
            })
            .filter(|(_, packet)| !packet.is_empty())
    }

    /// Whether a cell, from the first one, is in the grid.
    pub(super) fn contains(&self, offset: [usize; 3]) -> bool {
        (0..3).all(|a| self.start[a] + offset[a] < self.end[a])
    }

    /// A cell of the block, from its first one; the last one inside the grid for those outside.
    pub(super) fn clipped(&self, offset: [usize; 3]) -> [usize; 3] {
        std::array::from_fn(|a| (self.start[a] + offset[a]).min(self.end[a] - 1))
    }
}

/// Whether child or lane `index` is the upper one along an axis.
pub(super) fn bit(index: usize, axis: usize) -> usize {
    index >> (2 - axis) & 1
}

/// Centre, half diagonal and ends of the box of the cell centres of a block.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub low: [f64; 3],
    pub high: [f64; 3],
    pub centre: [f64; 3],
    pub radius: f64,
}

impl Extent {
    pub(super) fn new<T: Real>(grid: &Grid<T>, block: &Block) -> Self {
        let low = grid.center_f64(block.start);
        let high = grid.center_f64(block.end.map(|e| e - 1));
        Self {
            low,
            high,
            centre: scale(add(low, high), 0.5),
            radius: 0.5 * norm(sub(high, low)),
        }
    }
}

/// The children of a block, with the boxes of those inside the grid.
pub(super) type Children = [(Block, Option<Extent>); CHILDREN];

/// The children of a block and the boxes of their cell centres; `None` for those outside the grid.
pub(super) fn children<T: Real>(grid: &Grid<T>, block: &Block) -> Children {
    std::array::from_fn(|l| {
        let child = block.child(l);
        (
            child,
            (!child.is_empty()).then(|| Extent::new(grid, &child)),
        )
    })
}

/// Centres of the children; `otherwise` for those outside the grid.
pub(super) fn centres(children: &Children, otherwise: [f64; 3]) -> Points {
    let mut points = [[0.0; LANES]; 3];
    for l in 0..LANES {
        let c = children[l].1.map_or(otherwise, |extent| extent.centre);
        for a in 0..3 {
            points[a][l] = c[a];
        }
    }
    points
}

/// The one of the points that is closest to `q`.
pub(super) fn closest_of<const N: usize>(
    points: [Option<[f64; 3]>; N],
    q: [f64; 3],
) -> Option<[f64; 3]> {
    let mut best = (f64::INFINITY, None);
    for p in points.into_iter().flatten() {
        let squared = norm_squared(sub(p, q));
        if squared < best.0 {
            best = (squared, Some(p));
        }
    }
    best.1
}
