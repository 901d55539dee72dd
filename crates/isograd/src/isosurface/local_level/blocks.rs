//! The cells near the samples, in blocks: memory for a layer of cells round the surface, not for the grid.

use rayon::prelude::*;

use super::stencil::Stencil;
use crate::{Grid, Real};

/// Cells along each side of a block.
pub(super) const EDGE: usize = 8;

/// Cells in a block.
pub(super) const NODES: usize = EDGE * EDGE * EDGE;

/// In the table: no sample is near.
const NONE: u32 = u32::MAX;

/// The blocks that hold a cell of the 3³ round some sample, and which samples those are.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// Blocks of the grid along each axis.
    shape: [usize; 3],
    /// Number of each block of the grid among those that are used.
    table: Vec<u32>,
    /// Place in the table of each block that is used.
    places: Vec<u32>,
    /// Where the samples of each block begin and end.
    starts: Vec<usize>,
    samples: Vec<u32>,
    /// Where the next sample of each block goes.
    next: Vec<usize>,
}

/// Parts of the cells of a block that a cube of cells covers: places in the cube, per axis.
pub(super) struct Overlap {
    corner: [usize; 3],
    block: [usize; 3],
    ranges: [(usize, usize); 3],
}

impl Blocks {
    /// Finds the blocks of these samples, which are visited in this order.
    pub(super) fn build<T: Real>(&mut self, grid: &Grid<T>, points: &[[T; 3]], order: &[u32]) {
        self.shape = grid.shape().map(|n| n.div_ceil(EDGE));
        self.table.clear();
        self.table.resize(self.shape.iter().product(), 0);
        let stencils = || {
            let near = |&i: &u32| Stencil::of(grid, points[i as usize]).map(|s| (i, s.corner));
            order.iter().filter_map(near)
        };
        for (_, corner) in stencils() {
            for_each_touched(self.shape, corner, |place| self.table[place] += 1);
        }
        self.places.clear();
        self.starts.clear();
        let mut end = 0;
        for (place, entry) in self.table.iter_mut().enumerate() {
            if *entry == 0 {
                *entry = NONE;
                continue;
            }
            self.starts.push(end);
            end += *entry as usize;
            *entry = self.places.len() as u32;
            self.places.push(place as u32);
        }
        self.next.clone_from(&self.starts);
        self.starts.push(end);
        self.samples.clear();
        self.samples.resize(end, 0);
        for (i, corner) in stencils() {
            for_each_touched(self.shape, corner, |place| {
                let next = &mut self.next[self.table[place] as usize];
                self.samples[*next] = i;
                *next += 1;
            });
        }
    }

    /// Number of blocks.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Samples within reach of a block, in a fixed order.
    pub(super) fn samples(&self, block: usize) -> impl Iterator<Item = usize> + '_ {
        let samples = &self.samples[self.starts[block]..self.starts[block + 1]];
        samples.iter().map(|&i| i as usize)
    }

    /// The lowest cell of a block.
    pub(super) fn corner(&self, block: usize) -> [usize; 3] {
        let place = self.places[block] as usize;
        let [_, y, z] = self.shape;
        [place / (y * z), place / z % y, place % z].map(|b| b * EDGE)
    }

    /// Places of the cells of a cube of `N`³ cells, all of which are in some block.
    #[inline(always)]
    fn place(&self, [x, y, z]: [usize; 3]) -> usize {
        let [_, ny, nz] = self.shape;
        let table = (x / EDGE * ny + y / EDGE) * nz + z / EDGE;
        let local = (x % EDGE * EDGE + y % EDGE) * EDGE + z % EDGE;
        self.table[table] as usize * NODES + local
    }

    /// What stands at the cells of the cube of `N`³ cells from `corner` on, row by row along z.
    #[inline(always)]
    pub(super) fn read<E: Copy + Default, const N: usize>(
        &self,
        nodes: &[E],
        corner: [usize; 3],
    ) -> [[[E; N]; N]; N] {
        let [x, y, z] = corner;
        let mut out = [[[E::default(); N]; N]; N];
        let whole = z % EDGE + N <= EDGE;
        for (i, plane) in out.iter_mut().enumerate() {
            for (j, row) in plane.iter_mut().enumerate() {
                if whole {
                    let start = self.place([x + i, y + j, z]);
                    row.copy_from_slice(&nodes[start..start + N]);
                } else {
                    for (k, out) in row.iter_mut().enumerate() {
                        *out = nodes[self.place([x + i, y + j, z + k])];
                    }
                }
            }
        }
        out
    }

    /// Runs `f(nodes, cells)` on the rows of cells along z that blocks and grid share; `field` is on a grid of
    /// `shape`. Each task owns some planes of the field.
    pub(super) fn zip_rows<T: Real>(
        &self,
        nodes: &[T],
        shape: [usize; 3],
        field: &mut [T],
        f: impl Fn(&[T], &mut [T]) + Sync,
    ) {
        let [_, ny, nz] = shape;
        let layers = field.par_chunks_mut(EDGE * ny * nz).enumerate();
        layers.for_each(|(layer, cells)| {
            let first = |layer: usize| {
                let place = layer * self.shape[1] * self.shape[2];
                self.places.partition_point(|&p| (p as usize) < place)
            };
            for block in first(layer)..first(layer + 1) {
                let nodes = &nodes[block * NODES..(block + 1) * NODES];
                for (row, nodes) in self.rows(block, shape).zip(nodes.chunks_exact(EDGE)) {
                    if let Some((start, count)) = row {
                        let start = start - layer * EDGE * ny * nz;
                        f(&nodes[..count], &mut cells[start..start + count]);
                    }
                }
            }
        });
    }

    /// Start and length in memory of the row of cells at each row along z of a block; none beyond the grid.
    pub(super) fn rows(
        &self,
        block: usize,
        [nx, ny, nz]: [usize; 3],
    ) -> impl Iterator<Item = Option<(usize, usize)>> {
        let [x, y, z] = self.corner(block);
        let count = EDGE.min(nz - z);
        (0..EDGE * EDGE).map(move |row| {
            let (i, j) = (x + row / EDGE, y + row % EDGE);
            (i < nx && j < ny).then(|| ((i * ny + j) * nz + z, count))
        })
    }
}

impl Overlap {
    /// What a block that begins at `block` has of the cube of `width`³ cells from `corner` on.
    #[inline(always)]
    pub(super) fn new(corner: [usize; 3], width: usize, block: [usize; 3]) -> Self {
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

    /// Runs `f(i, j, k, place)` on the cells shared: places in the cube, and the place in the block.
    #[inline(always)]
    pub(super) fn for_each(&self, mut f: impl FnMut(usize, usize, usize, usize)) {
        let [(x0, x1), (y0, y1), (z0, z1)] = self.ranges;
        let local = |a: usize, n: usize| self.corner[a] + n - self.block[a];
        for i in x0..x1 {
            for j in y0..y1 {
                let row = (local(0, i) * EDGE + local(1, j)) * EDGE;
                for k in z0..z1 {
                    f(i, j, k, row + local(2, k));
                }
            }
        }
    }
}

/// The blocks, by their place in the table, that the 3³ cells from `corner` on lie in.
#[inline(always)]
fn for_each_touched([_, ny, nz]: [usize; 3], corner: [usize; 3], mut f: impl FnMut(usize)) {
    let [x, y, z] = corner.map(|c| (c / EDGE, (c + 2) / EDGE));
    for i in x.0..=x.1 {
        for j in y.0..=y.1 {
            for k in z.0..=z.1 {
                f((i * ny + j) * nz + k);
            }
        }
    }
}
