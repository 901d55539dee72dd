//! The splat onto blocks of cells.

use super::stencil::{self, REACH, WIDTH};
use super::{Error, Residual, Samples, Scratch, Weights, central_cell};
use crate::data::blocks::{BlockField, Blocks, Marks, NODES, Overlap};
use crate::{Grid, Real, vector};

/// The blocks with cells up to `reach` cells from that of a sample, along each axis.
pub(crate) fn blocks_near<T: Real>(points: &[[T; 3]], grid: &Grid<T>, reach: isize) -> Blocks {
    let mut marks = Marks::new(grid.shape());
    for &point in points {
        if let Some(cell) = central_cell(grid.shape(), grid.to_index(point)) {
            let cell = cell.map(|c| c as isize);
            marks.mark(cell.map(|c| c - reach), cell.map(|c| c + reach));
        }
    }
    marks.build()
}

/// Writes `b` like [`forward`](super::forward), in blocks, which contain those within 2 cells of the samples.
///
/// # Errors
/// As [`Error`] lists; `b` is then left as it was.
pub(crate) fn forward_in_blocks<T: Real>(
    samples: Samples<'_, T>,
    weights: Weights,
    scratch: &mut Scratch,
    residual: &mut Residual,
    b: &mut BlockField<T>,
) -> Result<(), Error> {
    samples.check()?;
    residual.weights = weights;
    scratch.sort(samples.points, &b.grid, &mut residual.order)?;
    b.values.fill(T::zero());
    let (grid, blocks): (_, &Blocks) = (b.grid, &b.blocks);
    let order = &residual.order;
    let corner = |n: usize| {
        let x = grid.to_index(samples.points[order[n] as usize]);
        central_cell(grid.shape(), x).map(|cell| cell.map(|c| c - REACH))
    };
    let add = |block: usize, values: &mut [T], items: &[u32]| {
        for &n in items {
            let i = order[n as usize] as usize;
            samples.add_to_block(i, &grid, weights, blocks.corner(block), values);
        }
    };
    blocks.scatter(&mut b.values, order.len(), WIDTH, corner, add);
    Ok(())
}

impl<T: Real> Samples<'_, T> {
    /// Adds the contribution of sample `i` to the block that begins at cell `block`.
    fn add_to_block(
        &self,
        i: usize,
        grid: &Grid<T>,
        weights: Weights,
        block: [usize; 3],
        values: &mut [T],
    ) {
        debug_assert_eq!(values.len(), NODES);
        let x = grid.to_index(self.points[i]);
        let Some(cell) = central_cell(grid.shape(), x) else {
            return;
        };
        let h = grid.spacing();
        let vector = vector::scale(self.normals[i], self.areas[i] / h / h);
        let f = std::array::from_fn(|a| x[a] - T::of_usize(cell[a]) - T::of(0.5));
        let overlap = Overlap::new(cell.map(|c| c - REACH), WIDTH, block);
        stencil::for_each_term(weights, vector, f, |term| {
            let mut row = ([WIDTH; 2], [T::zero(); WIDTH]);
            overlap.for_each(|[i, j, k], at| {
                if row.0 != [i, j] {
                    row = ([i, j], term.row(i, j));
                }
                values[at] += row.1[k];
            });
        });
    }
}
