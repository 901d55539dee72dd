//! A uniform grid of cubic cells.

use crate::{Real, vector};

/// A uniform grid of `(nx, ny, nz)` cubic cells. Values sit at cell centers.
///
/// Index coordinates are `x̂ = (x − lower)/h`: cell `(i, j, k)` is centered at `(i+½, j+½, k+½)`.
/// Memory order is C: the last axis is the fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<T> {
    lower: [T; 3],
    spacing: T,
    shape: [usize; 3],
}

/// Cotangent of a grid, at fixed points: by how much a scalar changes as the grid moves or grows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridCotangent<T> {
    /// Of the low corner, per unit length.
    pub lower: [T; 3],
    /// Of the cell size, per unit length, the low corner and the number of cells being held.
    pub spacing: T,
}

impl GridCotangent<f64> {
    /// Takes off what a cotangent of a point (in the user's unit) is worth at fixed index coordinates: a
    /// point that is seen from the grid as `x̂ = (x − lower)/h` has `∂x̂/∂lower = −1/h` and
    /// `∂x̂/∂h = −x̂/h`.
    #[inline(always)]
    pub(crate) fn subtract_point<T: Real>(&mut self, grid: &Grid<T>, x: [T; 3], bar: [T; 3]) {
        let (x, bar) = (vector::to_f64(grid.to_index(x)), vector::to_f64(bar));
        self.lower = vector::sub(self.lower, bar);
        self.spacing -= vector::dot(x, bar);
    }

    /// Adds another one.
    pub(crate) fn add(&mut self, other: &Self) {
        self.lower = vector::add(self.lower, other.lower);
        self.spacing += other.spacing;
    }

    /// Adds what a cotangent of a place of fixed index coordinates, `lower + h x̂`, is worth.
    #[inline(always)]
    pub(crate) fn add_place(&mut self, x: [f64; 3], bar: [f64; 3]) {
        self.lower = vector::add(self.lower, bar);
        self.spacing += vector::dot(x, bar);
    }
}

/// How fine a fitted grid is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution<T> {
    /// Number of cells on the longest side, padding included.
    Cells(usize),
    /// Cell size, in the cloud's unit.
    Spacing(T),
}

/// Why a grid was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// The cell size is not a positive finite number.
    #[error("the cell size is {spacing}; it must be positive and finite")]
    Spacing {
        /// The value given.
        spacing: f64,
    },
    /// A corner is not finite, or the upper is not above the lower.
    #[error(
        "the bounds {lower:?} to {upper:?} enclose no volume; give X0 < X1, Y0 < Y1 and Z0 < Z1, all finite"
    )]
    Bounds {
        /// Low corner.
        lower: [f64; 3],
        /// High corner.
        upper: [f64; 3],
    },
    /// Too few cells along an axis.
    #[error("{cells} cells along axis {axis}; at least {min} are needed")]
    TooFew {
        /// Axis: 0, 1 or 2.
        axis: usize,
        /// The value given.
        cells: usize,
        /// The least.
        min: usize,
    },
    /// More cells than can be indexed.
    #[error(
        "a grid of {shape:?} cells has more than {max} cells, the most that can be indexed; use a coarser one"
    )]
    TooMany {
        /// The value given.
        shape: [usize; 3],
        /// The limit.
        max: usize,
    },
    /// The padding is negative or not finite.
    #[error("the padding is {padding}; it must be a fraction of the longest side, 0 or more")]
    Padding {
        /// The value given.
        padding: f64,
    },
    /// There is nothing to fit to.
    #[error(
        "the cloud has no extent ({points} points, all equal or none); a grid can't be fitted to it"
    )]
    NoExtent {
        /// Number of points.
        points: usize,
    },
    /// A cotangent that does not match the cloud.
    #[error("{entries} cotangents for {points} points; give one a point")]
    Cotangent {
        /// Number of cotangents.
        entries: usize,
        /// Number of points.
        points: usize,
    },
    /// Neighboring cell centers are not distinct numbers of this type.
    #[error(
        "cells of {spacing:?} at coordinates up to {extent:?} can't be told apart in {real}; use {}a coarser grid, or move the cloud toward the origin",
        if *real == "f64" { "" } else { "f64, " }
    )]
    Unresolvable {
        /// Cell size.
        spacing: f64,
        /// Largest coordinate.
        extent: f64,
        /// Name of the number type.
        real: &'static str,
    },
}

impl<T: Real> Grid<T> {
    /// The fewest cells that an axis may have.
    pub const MIN_CELLS: usize = 2;
    /// Cells that a fitted grid keeps between the cloud and each wall, however small the padding.
    pub const MARGIN_CELLS: usize = 4;

    pub(super) const MAX_CELLS: usize = u32::MAX as usize - 1;

    /// Most cells of a grid of which only some blocks are stored.
    const MAX_CELLS_IN_BLOCKS: usize = 1 << 36;

    /// A grid with low corner `lower`, cell size `spacing` and `shape` cells.
    ///
    /// # Errors
    /// A spacing that is not positive, a corner that is not finite, fewer than [`Self::MIN_CELLS`] or too
    /// many cells, or cells too small for the number type at these coordinates.
    pub fn new(lower: [T; 3], spacing: T, shape: [usize; 3]) -> Result<Self, GridError> {
        Self::with_limit(lower, spacing, shape, Self::MAX_CELLS)
    }

    /// Like [`Self::new`], for a grid of which only some blocks are stored: with up to 2³⁶ cells.
    pub(crate) fn in_blocks(
        lower: [T; 3],
        spacing: T,
        shape: [usize; 3],
    ) -> Result<Self, GridError> {
        Self::with_limit(lower, spacing, shape, Self::MAX_CELLS_IN_BLOCKS)
    }

    fn with_limit(
        lower: [T; 3],
        spacing: T,
        shape: [usize; 3],
        max: usize,
    ) -> Result<Self, GridError> {
        if !(spacing > T::zero()) || !spacing.is_finite() {
            return Err(GridError::Spacing {
                spacing: spacing.f64(),
            });
        }
        let upper = std::array::from_fn(|a| lower[a] + spacing * T::of_usize(shape[a]));
        if !vector::is_finite(lower) || !vector::is_finite(upper) {
            return Err(GridError::Bounds {
                lower: vector::to_f64(lower),
                upper: vector::to_f64(upper),
            });
        }
        for axis in 0..3 {
            if shape[axis] < Self::MIN_CELLS {
                return Err(GridError::TooFew {
                    axis,
                    cells: shape[axis],
                    min: Self::MIN_CELLS,
                });
            }
        }
        let cells = shape[0]
            .checked_mul(shape[1])
            .and_then(|n| n.checked_mul(shape[2]));
        if cells.is_none_or(|n| n > max) {
            return Err(GridError::TooMany { shape, max });
        }
        let extent = (0..3).fold(T::zero(), |m, a| m.max(lower[a].abs()).max(upper[a].abs()));
        if extent + spacing / T::of(4.0) == extent {
            return Err(GridError::Unresolvable {
                spacing: spacing.f64(),
                extent: extent.f64(),
                real: T::NAME,
            });
        }
        Ok(Self {
            lower,
            spacing,
            shape,
        })
    }

    /// The grid that covers the box from `lower` to `upper`: whole cubic cells from `lower` on, so the
    /// far walls may lie up to a cell beyond `upper`.
    ///
    /// # Errors
    /// As [`Self::new`], and where the box has no volume.
    pub fn from_bounds(
        lower: [T; 3],
        upper: [T; 3],
        resolution: Resolution<T>,
    ) -> Result<Self, GridError> {
        let extent: [f64; 3] = std::array::from_fn(|a| upper[a].f64() - lower[a].f64());
        if extent.iter().any(|e| !(*e > 0.0) || !e.is_finite()) {
            return Err(GridError::Bounds {
                lower: vector::to_f64(lower),
                upper: vector::to_f64(upper),
            });
        }
        let longest = extent[0].max(extent[1]).max(extent[2]);
        let spacing = match resolution {
            Resolution::Cells(n) => T::of(longest / n.max(1) as f64),
            Resolution::Spacing(h) => h,
        };
        if !(spacing > T::zero()) || !spacing.is_finite() {
            return Err(GridError::Spacing {
                spacing: spacing.f64(),
            });
        }
        // A side that is a whole number of cells up to rounding does not get one more.
        let cells = |e: f64| (e / spacing.f64() * (1.0 - 4.0 * T::epsilon().f64())).ceil();
        let counts = extent.map(cells);
        if counts.iter().any(|&n| n > Self::MAX_CELLS as f64) {
            let shape = counts.map(|n| n as usize);
            return Err(GridError::TooMany {
                shape,
                max: Self::MAX_CELLS,
            });
        }
        Self::new(
            lower,
            spacing,
            counts.map(|n| (n as usize).max(Self::MIN_CELLS)),
        )
    }

    /// Low corner of the grid (of cell `(0, 0, 0)`), in the user's unit.
    pub fn lower(&self) -> [T; 3] {
        self.lower
    }

    /// High corner of the grid.
    pub fn upper(&self) -> [T; 3] {
        std::array::from_fn(|a| self.lower[a] + self.spacing * T::of_usize(self.shape[a]))
    }

    /// Center of cell `(0, 0, 0)`: the position of the first value, what VTK calls the origin.
    pub fn origin(&self) -> [T; 3] {
        self.center([0, 0, 0])
    }

    /// Cell size `h`.
    pub fn spacing(&self) -> T {
        self.spacing
    }

    /// Number of cells along each axis, `(nx, ny, nz)`.
    pub fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.shape[0] * self.shape[1] * self.shape[2]
    }

    /// Distance in memory between neighbors along each axis: `(ny·nz, nz, 1)`.
    pub fn strides(&self) -> [usize; 3] {
        [self.shape[1] * self.shape[2], self.shape[2], 1]
    }

    /// Place in memory of cell `(i, j, k)`.
    #[inline(always)]
    pub fn index(&self, cell: [usize; 3]) -> usize {
        (cell[0] * self.shape[1] + cell[1]) * self.shape[2] + cell[2]
    }

    /// Cell `(i, j, k)` at a place in memory.
    #[inline(always)]
    pub fn cell(&self, index: usize) -> [usize; 3] {
        let (row, k) = (index / self.shape[2], index % self.shape[2]);
        [row / self.shape[1], row % self.shape[1], k]
    }

    /// Center of cell `(i, j, k)`, in the user's unit.
    #[inline(always)]
    pub fn center(&self, cell: [usize; 3]) -> [T; 3] {
        let center = self.center_f64(cell);
        vector::of_f64(center)
    }

    /// Center of cell `(i, j, k)` in double precision, before rounding to `T`.
    #[inline(always)]
    pub fn center_f64(&self, cell: [usize; 3]) -> [f64; 3] {
        let h = self.spacing.f64();
        std::array::from_fn(|a| self.lower[a].f64() + h * (cell[a] as f64 + 0.5))
    }

    /// Index coordinates `x̂ = (x − lower)/h`.
    #[inline(always)]
    pub fn to_index(&self, x: [T; 3]) -> [T; 3] {
        std::array::from_fn(|a| (x[a] - self.lower[a]) / self.spacing)
    }

    /// The user's coordinates of `x̂`: `lower + h x̂`.
    #[inline(always)]
    pub fn from_index(&self, x: [T; 3]) -> [T; 3] {
        std::array::from_fn(|a| self.lower[a] + self.spacing * x[a])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::PointCloud;

    #[test]
    fn huge_numbers_keep_messages_short() {
        let error = Grid::new([1e300f64; 3], 1e200, [4; 3]).expect_err("not resolvable");
        assert!(error.to_string().len() < 250, "{error}");
    }

    #[test]
    fn index_and_cell_are_inverse() {
        let g = Grid::new([0.0f32; 3], 1.0, [3, 4, 5]).expect("valid");
        for i in 0..g.cells() {
            assert_eq!(g.index(g.cell(i)), i);
        }
        assert_eq!(g.strides(), [20, 5, 1]);
        assert_eq!(g.origin(), [0.5; 3]);
    }

    #[test]
    fn bounds_that_are_whole_cells_get_no_extra_cell() {
        let g = Grid::from_bounds([0.0f32; 3], [1.2, 0.3, 0.6], Resolution::Spacing(0.1));
        assert_eq!(g.expect("valid").shape(), [12, 3, 6]);
    }

    #[test]
    fn bad_grids_are_refused_with_a_reason() {
        let bad = |r: Result<Grid<f32>, GridError>| r.expect_err("refused").to_string();
        assert!(bad(Grid::new([0.0; 3], -1.0, [8; 3])).contains("positive"));
        assert!(bad(Grid::new([0.0; 3], 1.0, [8, 1, 8])).contains("axis 1"));
        assert!(bad(Grid::new([0.0; 3], 1.0, [1 << 20; 3])).contains("coarser"));
        assert!(bad(Grid::new([1e6; 3], 1e-3, [8; 3])).contains("f64"));
        assert!(bad(Grid::new([f32::NAN; 3], 1.0, [8; 3])).contains("finite"));
        let point = PointCloud::new(vec![[1.0f32; 3]; 5]).expect("finite");
        assert!(bad(Grid::fit(&point, Resolution::Cells(64), 0.1)).contains("all equal"));
        let huge = Grid::from_bounds([0.0; 3], [1.0; 3], Resolution::Spacing(1e-30));
        assert!(bad(huge).contains("cells"));
    }
}
