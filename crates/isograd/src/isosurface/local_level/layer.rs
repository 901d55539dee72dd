//! The layer of cells near the samples, in blocks of 8³: memory in proportion to the surface, not to the grid.

use super::stencil::Stencil;
pub(super) use crate::data::blocks::{EDGE, NODES, Overlap};
use crate::data::cells::{Cells, CellsMut};
use crate::splat::SortedSamples;
use crate::{Grid, Real, parallel};

/// Table entry of a block that no sample is near.
const NONE: u32 = u32::MAX;

/// The blocks that contain a cell of the 3³ round some sample, with the samples of each.
#[derive(Clone, Debug, Default)]
pub(super) struct Layer {
    /// Blocks of the grid along each axis.
    shape: [usize; 3],
    /// Index in the layer of each block of the grid.
    table: Vec<u32>,
    /// Place in the table of each block of the layer.
    places: Vec<u32>,
    /// Range of `samples` of each block.
    starts: Vec<usize>,
    samples: Vec<u32>,
    /// While sorting, where the next sample of each block goes.
    next: Vec<usize>,
}

impl Layer {
    /// Builds the layer around the samples, in their sorted order.
    pub(super) fn build<T: Real>(&mut self, grid: &Grid<T>, sorted: SortedSamples<'_, T>) {
        let (points, order) = (sorted.samples.points, &sorted.order.order);
        self.shape = grid.shape().map(|n| n.div_ceil(EDGE));
        self.table.clear();
        self.table.resize(self.shape.iter().product(), 0);
        let stencils = || {
            let stencil = |&i: &u32| Stencil::of(grid, points[i as usize]).map(|s| (i, s.corner));
            order.iter().filter_map(stencil)
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

    /// Place in the layer of a cell of one of its blocks.
    #[inline(always)]
    fn place(&self, [x, y, z]: [usize; 3]) -> usize {
        let [_, ny, nz] = self.shape;
        let table = (x / EDGE * ny + y / EDGE) * nz + z / EDGE;
        let local = (x % EDGE * EDGE + y % EDGE) * EDGE + z % EDGE;
        self.table[table] as usize * NODES + local
    }

    /// The entries of the cube of `N`³ cells from `corner` on, row by row along z.
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

    /// Runs `f(entries, cells)` on the rows of cells along z that blocks and grid share; `nodes` are entries of the
    /// layer. Each task owns some planes of a dense field, or a block.
    pub(super) fn zip_rows<T: Real>(
        &self,
        nodes: &[T],
        field: &mut CellsMut<'_, T>,
        f: impl Fn(&[T], &mut [T]) + Sync,
    ) {
        let (grid, field) = match field {
            CellsMut::Dense(grid, field) => (*grid, &mut **field),
            CellsMut::Blocks(field) => {
                let blocks = &field.blocks;
                let work = field.values.chunks_exact_mut(NODES);
                return parallel::each(work, |block, cells| {
                    let [x, y, z] = blocks.corner(block).map(|c| c / EDGE);
                    let entry = self.table[(x * self.shape[1] + y) * self.shape[2] + z];
                    if entry != NONE {
                        let first = entry as usize * NODES;
                        f(&nodes[first..first + NODES], cells);
                    }
                });
            }
        };
        let shape = grid.shape();
        let [_, ny, nz] = shape;
        parallel::each(field.chunks_mut(EDGE * ny * nz), |layer, cells| {
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

    /// Copies the cells of a block of the layer; those beyond the grid, or absent, stay as they are.
    pub(super) fn copy_block<T: Real>(&self, block: usize, cells: Cells<'_, T>, out: &mut [T]) {
        match cells {
            Cells::Dense(grid, values) => {
                let rows = self.rows(block, grid.shape());
                for (row, out) in rows.zip(out.chunks_exact_mut(EDGE)) {
                    let Some((start, count)) = row else { continue };
                    out[..count].copy_from_slice(&values[start..start + count]);
                }
            }
            Cells::Blocks(field) => {
                if let Some(first) = field.blocks.place(self.corner(block)) {
                    out.copy_from_slice(&field.values[first..first + NODES]);
                }
            }
        }
    }

    /// For each row along z of a block, the place of its first cell in the field and the number of cells; `None`
    /// beyond the grid.
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

/// Visits the blocks that contain a cell of the 3³ from `corner` on, by their place in the table.
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
