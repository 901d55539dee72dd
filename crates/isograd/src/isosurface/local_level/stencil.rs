//! What a sample has to do with the cells round it: small pure functions.

use crate::{Grid, Real, splat, vector};

/// A sample among its 3³ cells.
#[derive(Clone, Copy)]
pub(super) struct Stencil<T> {
    /// The lowest of the 3³ cells.
    pub(super) corner: [usize; 3],
    /// Distance from the centre of the middle cell, per axis, −½ to ½.
    offset: [T; 3],
}

/// The 2³ cell centres round a sample and its trilinear weights.
#[derive(Clone, Copy)]
pub(super) struct Corners<T> {
    /// The lowest of the cells.
    pub(super) corner: [usize; 3],
    /// Distance from its centre, per axis, 0 to 1.
    fraction: [T; 3],
}

impl<T: Real> Stencil<T> {
    /// That of a point; `None` too near to a wall, where the splat refuses it.
    #[inline(always)]
    pub(super) fn of(grid: &Grid<T>, point: [T; 3]) -> Option<Self> {
        let x = grid.to_index(point);
        let cell = splat::central_cell(grid.shape(), x)?;
        let mut offset = [T::zero(); 3];
        for a in 0..3 {
            offset[a] = x[a] - T::of_usize(cell[a]) - T::of(0.5);
        }
        Some(Self {
            corner: cell.map(|c| c - 1),
            offset,
        })
    }

    /// `B` on the 3 cells along each axis.
    #[inline(always)]
    pub(super) fn weights(&self) -> [[T; 3]; 3] {
        self.offset.map(splat::quadratic_bspline)
    }

    /// Derivatives of [`Self::weights`].
    #[inline(always)]
    pub(super) fn slopes(&self) -> [[T; 3]; 3] {
        self.offset.map(splat::quadratic_bspline_slope)
    }

    /// The cell centres round the point, which are among the 3³.
    #[inline(always)]
    pub(super) fn corners(&self) -> Corners<T> {
        let (mut corner, mut fraction) = (self.corner, self.offset);
        for a in 0..3 {
            if fraction[a] < T::zero() {
                fraction[a] += T::one();
            } else {
                corner[a] += 1;
            }
        }
        Corners { corner, fraction }
    }
}

impl<T: Real> Corners<T> {
    /// Weights of the 2 cells along each axis.
    #[inline(always)]
    pub(super) fn weights(&self) -> [[T; 2]; 3] {
        self.fraction.map(|f| [T::one() - f, f])
    }

    /// Weights of the 2³ cells, the last axis fastest.
    #[inline(always)]
    pub(super) fn products(&self) -> [T; 8] {
        let [x, y, z] = self.weights();
        std::array::from_fn(|c| x[c >> 2] * y[c >> 1 & 1] * z[c & 1])
    }

    /// `∇` of the trilinear interpolant of 2³ values.
    #[inline(always)]
    pub(super) fn gradient(&self, v: [T; 8]) -> [T; 3] {
        let [x, y, z] = self.weights();
        let mut sum = [T::zero(); 3];
        for i in 0..2 {
            for j in 0..2 {
                let [a, b, c] = [
                    v[4 + 2 * i + j] - v[2 * i + j],
                    v[4 * i + 2 + j] - v[4 * i + j],
                    v[4 * i + 2 * j + 1] - v[4 * i + 2 * j],
                ];
                let across = [y[i] * z[j] * a, x[i] * z[j] * b, x[i] * y[j] * c];
                sum = vector::add(sum, across);
            }
        }
        sum
    }
}
