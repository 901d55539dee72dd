//! A value at every cell center.

use super::grid::Grid;
use crate::Real;

/// A grid and one value per cell, at the cell's center; `(nx, ny, nz)` in C order.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<T> {
    grid: Grid<T>,
    values: Vec<T>,
}

/// Why a field was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// The values do not match the grid.
    #[error("{values} values for a grid of {shape:?} cells")]
    Count {
        /// Number of values.
        values: usize,
        /// Cells along each axis.
        shape: [usize; 3],
    },
}

impl<T: Real> Field<T> {
    /// A field of `values` on `grid`.
    ///
    /// # Errors
    /// A number of values other than the number of cells.
    pub fn new(grid: Grid<T>, values: Vec<T>) -> Result<Self, FieldError> {
        if values.len() != grid.cells() {
            return Err(FieldError::Count {
                values: values.len(),
                shape: grid.shape(),
            });
        }
        Ok(Self { grid, values })
    }

    /// A field that is zero everywhere.
    pub fn zeros(grid: Grid<T>) -> Self {
        Self {
            grid,
            values: vec![T::zero(); grid.cells()],
        }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid<T> {
        &self.grid
    }

    /// All values, in C order.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, to be changed in place.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// The grid, and the values to be changed in place.
    pub(crate) fn split_mut(&mut self) -> (&Grid<T>, &mut [T]) {
        (&self.grid, &mut self.values)
    }

    /// The values alone.
    pub fn into_values(self) -> Vec<T> {
        self.values
    }

    /// Value of cell `(i, j, k)`.
    pub fn at(&self, cell: [usize; 3]) -> T {
        self.values[self.grid.index(cell)]
    }
}
