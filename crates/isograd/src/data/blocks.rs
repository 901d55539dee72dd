//! Cells of a grid in blocks of 8³, of which only some are there: memory in proportion to a surface, not to the volume.

use std::sync::Arc;

use super::grid::Grid;
use crate::gather::Buckets;
use crate::{Real, parallel};

/// Cells along each side of a block.
pub(crate) const EDGE: usize = 8;

/// Cells in a block.
pub(crate) const NODES: usize = EDGE * EDGE * EDGE;

/// Blocks along each side of a brick: the unit of work.
pub(crate) const BRICK: usize = 5;

/// Table entry of an absent block.
const NONE: u32 = u32::MAX;

/// The blocks that are there, in the order of their bricks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blocks {
    /// Cells of the grid along each axis.
    cells: [usize; 3],
    /// Blocks of the grid along each axis.
    shape: [usize; 3],
    /// Number of each block of the grid, or [`NONE`].
    table: Vec<u32>,
    /// Coordinates of each block.
    places: Vec<[u32; 3]>,
    bricks: Vec<Brick>,
}

/// A cube of [`BRICK`]³ blocks of which some are there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Brick {
    /// The lowest cell.
    pub(crate) corner: [usize; 3],
    /// The first of its blocks, and the first of the next brick.
    pub(crate) blocks: [usize; 2],
}

/// Overlap of a cube of cells with a block: ranges of places in the cube, per axis.
pub(crate) struct Overlap {
    corner: [usize; 3],
    block: [usize; 3],
    ranges: [(usize, usize); 3],
}

/// Marks of the blocks to be.
pub(crate) struct Marks {
    cells: [usize; 3],
    shape: [usize; 3],
    marked: Vec<u32>,
}

impl Marks {
    pub(crate) fn new(cells: [usize; 3]) -> Self {
        let shape = cells.map(|n| n.div_ceil(EDGE));
        Self {
            cells,
            shape,
            marked: vec![NONE; shape.iter().product()],
        }
    }

    /// Marks the blocks with cells from `low` to `high`, both included, inside the grid.
    pub(crate) fn mark(&mut self, low: [isize; 3], high: [isize; 3]) {
        let [x, y, z]: [[usize; 2]; 3] = std::array::from_fn(|a| {
            let last = self.cells[a] as isize - 1;
            [low[a], high[a]].map(|c| c.clamp(0, last) as usize / EDGE)
        });
        for i in x[0]..=x[1] {
            for j in y[0]..=y[1] {
                let row = (i * self.shape[1] + j) * self.shape[2];
                self.marked[row + z[0]..=row + z[1]].fill(0);
            }
        }
    }

    /// Marks blocks by their coordinates.
    pub(crate) fn add_blocks(&mut self, places: &[[usize; 3]]) {
        for [i, j, k] in places {
            self.marked[(i * self.shape[1] + j) * self.shape[2] + k] = 0;
        }
    }

    /// Marks all blocks of a set.
    pub(crate) fn add(&mut self, blocks: &Blocks) {
        for (mark, &there) in self.marked.iter_mut().zip(&blocks.table) {
            if there != NONE {
                *mark = 0;
            }
        }
    }

    /// The marked blocks.
    pub(crate) fn build(self) -> Blocks {
        let Self {
            cells,
            shape,
            marked: mut table,
        } = self;
        let (mut places, mut bricks) = (Vec::new(), Vec::new());
        let [nx, ny, nz] = shape.map(|n| n.div_ceil(BRICK));
        for brick in 0..nx * ny * nz {
            let low = [brick / nz / ny, brick / nz % ny, brick % nz].map(|b| b * BRICK);
            let first = places.len();
            let [x, y, z] = std::array::from_fn(|a| low[a]..shape[a].min(low[a] + BRICK));
            for i in x {
                for j in y.clone() {
                    for k in z.clone() {
                        let entry = &mut table[(i * shape[1] + j) * shape[2] + k];
                        if *entry != NONE {
                            *entry = places.len() as u32;
                            places.push([i as u32, j as u32, k as u32]);
                        }
                    }
                }
            }
            if places.len() > first {
                bricks.push(Brick {
                    corner: low.map(|b| b * EDGE),
                    blocks: [first, places.len()],
                });
            }
        }
        Blocks {
            cells,
            shape,
            table,
            places,
            bricks,
        }
    }
}

impl Blocks {
    /// All blocks of a grid of `cells`.
    pub(crate) fn all(cells: [usize; 3]) -> Self {
        let mut marks = Marks::new(cells);
        marks.marked.fill(0);
        marks.build()
    }

    /// Number of blocks.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Number of values, those of blocks that reach beyond the grid included.
    pub(crate) fn nodes(&self) -> usize {
        self.len() * NODES
    }

    /// Cells of the grid along each axis.
    pub(crate) fn cells(&self) -> [usize; 3] {
        self.cells
    }

    /// Size in bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.table[..]) + size_of_val(&self.places[..])
    }

    /// The lowest cell of a block.
    #[inline(always)]
    pub(crate) fn corner(&self, block: usize) -> [usize; 3] {
        self.places[block].map(|b| b as usize * EDGE)
    }

    /// The block at the place of a block of the grid.
    #[inline(always)]
    pub(crate) fn at(&self, [i, j, k]: [usize; 3]) -> Option<usize> {
        let entry = self.table[(i * self.shape[1] + j) * self.shape[2] + k];
        (entry != NONE).then_some(entry as usize)
    }

    /// The block of a cell.
    #[inline(always)]
    pub(crate) fn of_cell(&self, cell: [usize; 3]) -> Option<usize> {
        self.at(cell.map(|c| c / EDGE))
    }

    /// Place of a cell among the nodes of its block.
    #[inline(always)]
    pub(crate) fn node(cell: [usize; 3]) -> usize {
        let [x, y, z] = cell.map(|c| c % EDGE);
        (x * EDGE + y) * EDGE + z
    }

    /// The cell at a place among the nodes of a block, counted from the corner of the block.
    #[inline(always)]
    pub(crate) fn cell_of(node: usize) -> [usize; 3] {
        [node / EDGE / EDGE, node / EDGE % EDGE, node % EDGE]
    }

    /// Place among the values of a cell.
    #[inline(always)]
    pub(crate) fn place(&self, cell: [usize; 3]) -> Option<usize> {
        Some(self.of_cell(cell)? * NODES + Self::node(cell))
    }

    /// Copies the cube of `side`³ cells from `origin` on into `out`: reflection beyond the walls, even where these are free,
    /// odd where `closed`; 0 in absent blocks. Returns whether any block of the cube is there.
    pub(crate) fn read_cube<T: Real>(
        &self,
        values: &[T],
        origin: [isize; 3],
        side: usize,
        closed: bool,
        out: &mut [T],
    ) -> bool {
        let inside = |a: usize, n: usize| reflect(origin[a] + n as isize, self.cells[a]);
        let mut any = false;
        for (row, out) in out.chunks_exact_mut(side).enumerate() {
            let ((x, x_odd), (y, y_odd)) = (inside(0, row / side), inside(1, row % side));
            let mut n = 0;
            while n < side {
                let (z, z_odd) = inside(2, n);
                let count = match z as isize == origin[2] + n as isize {
                    true => (EDGE - z % EDGE).min(self.cells[2] - z).min(side - n),
                    false => 1,
                };
                let out = &mut out[n..n + count];
                match self.place([x, y, z]) {
                    Some(place) => {
                        out.copy_from_slice(&values[place..place + count]);
                        any = true;
                    }
                    None => out.fill(T::zero()),
                }
                if closed && x_odd ^ y_odd ^ z_odd {
                    out.iter_mut().for_each(|value| *value = -*value);
                }
                n += count;
            }
        }
        any
    }

    /// Runs `f(brick, values)` on the values of the blocks of each brick, in parallel.
    pub(crate) fn for_each_brick<T: Send>(
        &self,
        mut values: &mut [T],
        f: impl Fn(&Brick, &mut [T]) + Sync,
    ) {
        let work = self.bricks.iter().map(|brick| {
            let count = (brick.blocks[1] - brick.blocks[0]) * NODES;
            let (own, rest) = std::mem::take(&mut values).split_at_mut(count);
            values = rest;
            (brick, own)
        });
        parallel::each(work, |_, (brick, own)| f(brick, own));
    }

    /// Copies the values into a field of the whole grid in C order.
    pub(crate) fn write_dense<T: Real>(&self, values: &[T], field: &mut [T]) {
        let [_, ny, nz] = self.cells;
        parallel::each(field.chunks_mut(nz), |row, out| {
            for (k, out) in out.chunks_mut(EDGE).enumerate() {
                let count = out.len();
                match self.place([row / ny, row % ny, k * EDGE]) {
                    Some(place) => out.copy_from_slice(&values[place..place + count]),
                    None => out.fill(T::zero()),
                }
            }
        });
    }

    /// Copies from a field of the whole grid; nodes beyond it become 0.
    pub(crate) fn read_dense<T: Real>(&self, field: &[T], values: &mut [T]) {
        let [nx, ny, nz] = self.cells;
        parallel::each(values.chunks_exact_mut(NODES), |block, values| {
            let [x, y, z] = self.corner(block);
            for (row, out) in values.chunks_exact_mut(EDGE).enumerate() {
                let (i, j) = (x + row / EDGE, y + row % EDGE);
                out.fill(T::zero());
                if i < nx && j < ny {
                    let count = EDGE.min(nz - z);
                    let start = (i * ny + j) * nz + z;
                    out[..count].copy_from_slice(&field[start..start + count]);
                }
            }
        });
    }

    /// Runs `f(block, values, items)` on every block with the items, in ascending order, whose box of cells reaches into it:
    /// `width` cells along each axis from `corner(item)` on.
    pub(crate) fn scatter<T: Send>(
        &self,
        values: &mut [T],
        items: usize,
        width: usize,
        corner: impl Fn(usize) -> Option<[usize; 3]>,
        f: impl Fn(usize, &mut [T], &[u32]) + Sync,
    ) {
        let mut buckets = Buckets::default();
        buckets.fill(self.len(), items, |item| {
            let ends = corner(item).map(|low| {
                let last = |a: usize| self.cells[a].min(low[a] + width) - 1;
                [0, 1, 2].map(|a| [low[a] / EDGE, last(a) / EDGE])
            });
            ends.into_iter().flat_map(move |[x, y, z]| {
                let grid = (x[0]..=x[1]).flat_map(move |i| {
                    (y[0]..=y[1]).flat_map(move |j| (z[0]..=z[1]).map(move |k| [i, j, k]))
                });
                grid.filter_map(|place| self.at(place).map(|block| block as u32))
            })
        });
        parallel::each(values.chunks_exact_mut(NODES), |block, values| {
            f(block, values, buckets.of(block));
        });
    }
}

impl Overlap {
    /// Of the cube of `width`³ cells from `corner` on with the block that begins at `block`.
    #[inline(always)]
    pub(crate) fn new(corner: [usize; 3], width: usize, block: [usize; 3]) -> Self {
        let mut ranges = [(0, 0); 3];
        for a in 0..3 {
            ranges[a] = (
                block[a].saturating_sub(corner[a]),
                width.min((block[a] + EDGE).saturating_sub(corner[a])),
            );
        }
        Self {
            corner,
            block,
            ranges,
        }
    }

    /// Runs `f([i, j, k], place)` on the shared cells: the place in the cube, and the place in the block.
    #[inline(always)]
    pub(crate) fn for_each(&self, mut f: impl FnMut([usize; 3], usize)) {
        let [(x0, x1), (y0, y1), (z0, z1)] = self.ranges;
        let local = |a: usize, n: usize| self.corner[a] + n - self.block[a];
        for i in x0..x1 {
            for j in y0..y1 {
                let row = (local(0, i) * EDGE + local(1, j)) * EDGE;
                for k in z0..z1 {
                    f([i, j, k], row + local(2, k));
                }
            }
        }
    }
}

/// The cell of an axis of `n` cells whose reflection at the walls is at `x`, and whether the number of reflections is odd.
#[inline(always)]
fn reflect(x: isize, n: usize) -> (usize, bool) {
    let place = x.rem_euclid(2 * n as isize) as usize;
    match place < n {
        true => (place, false),
        false => (2 * n - 1 - place, true),
    }
}

/// A value at every cell of the blocks that are there.
#[derive(Clone, Debug)]
pub struct BlockField<T> {
    pub(crate) grid: Grid<T>,
    pub(crate) blocks: Arc<Blocks>,
    pub(crate) values: Vec<T>,
}
