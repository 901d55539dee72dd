//! Samples in the order of the grid, so that neighbors in memory are neighbors in space.

use std::ops::Range;

use super::{Error, Residual, stencil::REACH};
use crate::parallel::{self, CHUNK};
use crate::{Grid, Real};

/// Scratch buffers reused between calls.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    /// Row `i n_y + j` of the central cell of each sample.
    rows: Vec<u32>,
    /// End of each row in the sorted order.
    ends: Vec<u32>,
}

impl Scratch {
    /// Sorts the samples by row, and by index in a row.
    ///
    /// # Errors
    /// The first sample that is nearer than 2 cells to a wall.
    pub(super) fn sort<T: Real>(
        &mut self,
        points: &[[T; 3]],
        grid: &Grid<T>,
        order: &mut Vec<u32>,
    ) -> Result<(), Error> {
        self.find_rows(points, grid)?;
        let [nx, ny, _] = grid.shape();
        self.ends.clear();
        self.ends.resize(nx * ny, 0);
        for &row in &self.rows {
            self.ends[row as usize] += 1;
        }
        let mut begin = 0;
        for end in &mut self.ends {
            begin += std::mem::replace(end, begin);
        }
        order.clear();
        order.resize(points.len(), 0);
        // Each row's place to write moves from its beginning to its end.
        for (index, &row) in self.rows.iter().enumerate() {
            let place = &mut self.ends[row as usize];
            order[*place as usize] = index as u32;
            *place += 1;
        }
        Ok(())
    }

    /// Range in the sorted order of the samples whose central cell is in planes `from..to`.
    pub(super) fn planes(&self, from: usize, to: usize, ny: usize) -> Range<usize> {
        let end = |plane: usize| match plane * ny {
            0 => 0,
            rows => self.ends[rows - 1] as usize,
        };
        end(from)..end(to)
    }

    fn find_rows<T: Real>(&mut self, points: &[[T; 3]], grid: &Grid<T>) -> Result<(), Error> {
        self.rows.clear();
        self.rows.resize(points.len(), 0);
        let ny = grid.shape()[1];
        let chunks = self.rows.chunks_mut(CHUNK).zip(points.chunks(CHUNK));
        let first_bad = parallel::map_each(chunks, |chunk, (rows, points)| {
            for (i, (row, &point)) in rows.iter_mut().zip(points).enumerate() {
                match central_cell(grid.shape(), grid.to_index(point)) {
                    Some([x, y, _]) => *row = (x * ny + y) as u32,
                    None => return Some(chunk * CHUNK + i),
                }
            }
            None
        });
        match first_bad.into_iter().flatten().next() {
            Some(index) => Err(Error::Outside {
                index,
                position: grid.to_index(points[index]).map(|x| x.f64()),
                shape: grid.shape(),
            }),
            None => Ok(()),
        }
    }
}

impl Residual {
    /// The samples whose central cell is in these planes across x, in sorted order.
    pub(crate) fn in_planes<T: Real>(
        &self,
        points: &[[T; 3]],
        grid: &Grid<T>,
        planes: Range<usize>,
    ) -> &[u32] {
        let plane = |&i: &u32| {
            let cell = central_cell(grid.shape(), grid.to_index(points[i as usize]));
            cell.map_or(0, |[plane, _, _]| plane)
        };
        let start = self.order.partition_point(|i| plane(i) < planes.start);
        let end = self.order.partition_point(|i| plane(i) < planes.end);
        &self.order[start..end]
    }
}

/// The cell that contains the point of index coordinates `x`; `None` closer than 2 cells to a wall, and
/// for NaN. A point exactly 2 cells from the far wall counts to the cell before it.
#[inline(always)]
pub(crate) fn central_cell<T: Real>(shape: [usize; 3], x: [T; 3]) -> Option<[usize; 3]> {
    let mut cell = [0; 3];
    for axis in 0..3 {
        let last = shape[axis].checked_sub(REACH + 1)?;
        let inside = x[axis] >= T::of_usize(REACH) && x[axis] <= T::of_usize(last + 1);
        if !inside || last < REACH {
            return None;
        }
        cell[axis] = x[axis].to_usize()?.min(last);
    }
    Some(cell)
}
