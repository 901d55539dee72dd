//! Boxes of cells.

use crate::distance::bvh::{LANES, Points};
use crate::vector::{add, norm, norm_squared, scale, sub};
use crate::{Grid, Real};

/// Cells along a side of a block that is solved on its own.
pub(super) const BLOCK: usize = 16;

/// Blocks that a block is cut into.
pub(super) const CHILDREN: usize = 8;

/// Cells along a side of a block whose cells are measured.
const SIDE: usize = 4;

/// Packets in a block of side 4: columns of 2×2×4 cells.
pub(super) const PACKETS: usize = 4;

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
}

/// The cells of a block of side 4.
pub(super) struct Cells {
    /// Their centers along each axis, in the user's unit; that of the last cell inside the grid for those outside.
    pub centers: [[f64; SIDE]; 3],
    /// Cells inside the grid along each axis.
    pub count: [usize; 3],
}

impl Cells {
    pub(super) fn new<T: Real>(grid: &Grid<T>, block: &Block) -> Self {
        let mut centers = [[0.0; SIDE]; 3];
        for step in 0..SIDE {
            let cell = std::array::from_fn(|a| (block.start[a] + step).min(block.end[a] - 1));
            let center = grid.center_f64(cell);
            for a in 0..3 {
                centers[a][step] = center[a];
            }
        }
        Self {
            centers,
            count: std::array::from_fn(|a| block.end[a] - block.start[a]),
        }
    }

    /// The first cell of a packet, from that of the block. The halves of packet `i` are children `2 i` and `2 i + 1`.
    pub(super) fn packet(index: usize) -> [usize; 3] {
        [2 * (index >> 1), 2 * (index & 1), 0]
    }

    /// Whether a cell, from the first one, is in the grid.
    pub(super) fn contain(&self, [x, y, z]: [usize; 3]) -> bool {
        x < self.count[0] && y < self.count[1] && z < self.count[2]
    }

    /// Centers of the children of the block.
    pub(super) fn centers_of_children(&self) -> Points {
        let mut points = [[0.0; LANES]; 3];
        for l in 0..LANES {
            for a in 0..3 {
                let first = 2 * bit(l, a);
                points[a][l] = 0.5 * (self.centers[a][first] + self.centers[a][first + 1]);
            }
        }
        points
    }
}

/// Whether child or lane `index` is the upper one along an axis.
pub(super) fn bit(index: usize, axis: usize) -> usize {
    index >> (2 - axis) & 1
}

/// Center, half diagonal and ends of the box of the cell centers of a block.
#[derive(Clone, Copy)]
pub(super) struct Extent {
    pub low: [f64; 3],
    pub high: [f64; 3],
    pub center: [f64; 3],
    pub radius: f64,
}

impl Extent {
    pub(super) fn new<T: Real>(grid: &Grid<T>, block: &Block) -> Self {
        let low = grid.center_f64(block.start);
        let high = grid.center_f64(block.end.map(|e| e - 1));
        Self {
            low,
            high,
            center: scale(add(low, high), 0.5),
            radius: 0.5 * norm(sub(high, low)),
        }
    }
}

/// The children of a block, with the boxes of those inside the grid.
pub(super) type Children = [(Block, Option<Extent>); CHILDREN];

/// The children of a block and the boxes of their cell centers; `None` for those outside the grid.
pub(super) fn children<T: Real>(grid: &Grid<T>, block: &Block) -> Children {
    std::array::from_fn(|l| {
        let child = block.child(l);
        (
            child,
            (!child.is_empty()).then(|| Extent::new(grid, &child)),
        )
    })
}

/// Centers of the children; `otherwise` for those outside the grid.
pub(super) fn centers(children: &Children, otherwise: [f64; 3]) -> Points {
    let mut points = [[0.0; LANES]; 3];
    for l in 0..LANES {
        let c = children[l].1.map_or(otherwise, |extent| extent.center);
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
