//! Values at the cells of a grid: at all of them, or at those of some blocks.

use std::sync::Arc;

use super::blocks::{BlockField, Blocks, EDGE};
use super::{Field, Grid, LatticeEdge};
use crate::Real;

/// Read access to a field that is dense or in blocks.
#[derive(Clone, Copy)]
pub enum Cells<'a, T> {
    /// A value at every cell, in C order.
    Dense(&'a Grid<T>, &'a [T]),
    /// Values at the cells of some blocks.
    Blocks(&'a BlockField<T>),
}

/// Write access to a field that is dense or in blocks.
pub enum CellsMut<'a, T> {
    /// A value at every cell, in C order.
    Dense(&'a Grid<T>, &'a mut [T]),
    /// Values at the cells of some blocks.
    Blocks(&'a mut BlockField<T>),
}

impl<'a, T: Real> From<&'a Field<T>> for Cells<'a, T> {
    fn from(field: &'a Field<T>) -> Self {
        Self::Dense(field.grid(), field.values())
    }
}

impl<'a, T> From<&'a BlockField<T>> for Cells<'a, T> {
    fn from(field: &'a BlockField<T>) -> Self {
        Self::Blocks(field)
    }
}

impl<'a, T: Real> Cells<'a, T> {
    /// The grid.
    #[inline(always)]
    pub fn grid(self) -> &'a Grid<T> {
        match self {
            Self::Dense(grid, _) => grid,
            Self::Blocks(field) => &field.grid,
        }
    }

    /// The `N` values along z from a cell on; 0 where there are none.
    #[inline(always)]
    pub fn row<const N: usize>(self, cell: [usize; 3]) -> [T; N] {
        let mut row = [T::zero(); N];
        match self {
            Self::Dense(grid, values) => {
                let start = grid.index(cell);
                row.copy_from_slice(&values[start..start + N]);
            }
            Self::Blocks(field) => {
                let [x, y, z] = cell;
                let mut k = 0;
                while k < N {
                    let count = (EDGE - (z + k) % EDGE).min(N - k);
                    if let Some(place) = field.blocks.place([x, y, z + k]) {
                        row[k..k + count].copy_from_slice(&field.values[place..place + count]);
                    }
                    k += count;
                }
            }
        }
        row
    }

    /// The value of a cell; `None` where there is none.
    #[inline(always)]
    pub(crate) fn at(self, cell: [usize; 3]) -> Option<T> {
        match self {
            Self::Dense(grid, values) => Some(values[grid.index(cell)]),
            Self::Blocks(field) => field.get(cell),
        }
    }

    /// The values at the eight centers from `cell` on.
    #[inline(always)]
    pub(crate) fn corners(self, cell: [usize; 3]) -> impl Iterator<Item = Option<T>> {
        (0..8)
            .map(move |corner: usize| self.at(std::array::from_fn(|a| cell[a] + (corner >> a & 1))))
    }

    /// Whether every cell has a value.
    pub(crate) fn is_whole(self) -> bool {
        matches!(self, Self::Dense(..))
    }

    /// The values at both ends of an edge.
    #[inline(always)]
    pub(crate) fn ends(self, edge: LatticeEdge) -> [T; 2] {
        let (p, axis) = (edge.cell(), edge.axis());
        match self {
            Self::Dense(grid, values) => [values[p], values[p + grid.strides()[axis]]],
            Self::Blocks(field) => {
                let low = field.grid.cell(p);
                let mut high = low;
                high[axis] += 1;
                [low, high].map(|cell| field.get(cell).unwrap_or(T::zero()))
            }
        }
    }

    /// All values.
    pub(crate) fn values(self) -> &'a [T] {
        match self {
            Self::Dense(_, values) => values,
            Self::Blocks(field) => &field.values,
        }
    }
}

impl<T: Real> CellsMut<'_, T> {
    /// Read access.
    pub(crate) fn cells(&self) -> Cells<'_, T> {
        match self {
            Self::Dense(grid, values) => Cells::Dense(grid, values),
            Self::Blocks(field) => Cells::Blocks(field),
        }
    }
}

impl<T: Real> BlockField<T> {
    /// A field that is zero in the blocks.
    pub(crate) fn zeros(grid: Grid<T>, blocks: Arc<Blocks>) -> Self {
        Self {
            grid,
            values: vec![T::zero(); blocks.nodes()],
            blocks,
        }
    }

    /// The value of a cell; `None` where its block is absent.
    #[inline(always)]
    pub(crate) fn get(&self, cell: [usize; 3]) -> Option<T> {
        self.blocks.place(cell).map(|place| self.values[place])
    }

    /// Adds `value(i)` at both cells of edge `i`; absent cells are left out.
    pub(crate) fn add_at_ends(
        &mut self,
        edges: &[LatticeEdge],
        value: impl Fn(usize) -> [T; 2] + Sync,
    ) {
        let (grid, blocks) = (self.grid, &*self.blocks);
        let corner = |i: usize| Some(grid.cell(edges[i].cell()));
        let add = |block: usize, values: &mut [T], items: &[u32]| {
            for &i in items {
                let low = grid.cell(edges[i as usize].cell());
                let mut high = low;
                high[edges[i as usize].axis()] += 1;
                for (cell, part) in [low, high].into_iter().zip(value(i as usize)) {
                    if blocks.of_cell(cell) == Some(block) {
                        values[Blocks::node(cell)] += part;
                    }
                }
            }
        };
        blocks.scatter(&mut self.values, edges.len(), 2, corner, add);
    }
}
