//! Weights and derivatives on the cells around a sample: small pure functions.

use crate::isosurface::Interpolation;
use crate::vector::dot;
use crate::{Grid, Real, splat};

/// A sample among its 3³ cells.
#[derive(Clone, Copy)]
pub(in crate::isosurface) struct Stencil<T> {
    /// The lowest of the 3³ cells.
    pub(in crate::isosurface) corner: [usize; 3],
    /// Distance from the center of the middle cell, per axis, −½ to ½.
    offset: [T; 3],
}

/// Interpolation at a sample: the cells that have a weight, among the 3³.
#[derive(Clone, Copy)]
pub(super) struct Corners<T> {
    /// Place of the lowest of them in the 3³.
    pub(super) place: [usize; 3],
    /// Number of cells along each axis: 2 or 3.
    pub(super) count: usize,
    /// Weights along each axis, and their derivatives.
    weights: [[T; 3]; 3],
    slopes: [[T; 3]; 3],
}

impl<T: Real> Stencil<T> {
    /// Stencil of a point; `None` closer than 2 cells to a wall, where the splat refuses it.
    #[inline(always)]
    pub(in crate::isosurface) fn of(grid: &Grid<T>, point: [T; 3]) -> Option<Self> {
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
    pub(in crate::isosurface) fn weights(&self) -> [[T; 3]; 3] {
        splat::bspline_weights(self.offset)
    }

    /// Derivatives of [`Self::weights`].
    #[inline(always)]
    pub(in crate::isosurface) fn slopes(&self) -> [[T; 3]; 3] {
        splat::bspline_slopes(self.offset)
    }

    /// First and second derivatives of `Σ_o B_o v_o`; `row(i, j)` has the 3 values along z of row `(i, j)` of the 3³.
    #[inline(always)]
    pub(super) fn derivatives(&self, row: impl Fn(usize, usize) -> [T; 3]) -> Derivatives<T> {
        let ([x, y, z], [dx, dy, dz]) = (self.weights(), self.slopes());
        let bends = [T::one(), -T::of(2.0), T::one()];
        let zero = T::zero();
        let (mut gradient, mut pure, mut mixed) = ([zero; 3], [zero; 3], [zero; 3]);
        for i in 0..3 {
            for j in 0..3 {
                let row = row(i, j);
                let (along, slope, bend) = (dot(z, row), dot(dz, row), dot(bends, row));
                gradient[0] += dx[i] * y[j] * along;
                gradient[1] += x[i] * dy[j] * along;
                gradient[2] += x[i] * y[j] * slope;
                pure[0] += bends[i] * y[j] * along;
                pure[1] += x[i] * bends[j] * along;
                pure[2] += x[i] * y[j] * bend;
                mixed[0] += x[i] * dy[j] * slope;
                mixed[1] += dx[i] * y[j] * slope;
                mixed[2] += dx[i] * dy[j] * along;
            }
        }
        Derivatives {
            gradient,
            pure,
            mixed,
        }
    }

    /// The cells from which a value at the point is interpolated.
    #[inline(always)]
    pub(super) fn corners(&self, interpolation: Interpolation) -> Corners<T> {
        if interpolation == Interpolation::Spline {
            return Corners {
                place: [0; 3],
                count: 3,
                weights: self.weights(),
                slopes: self.slopes(),
            };
        }
        let (zero, one) = (T::zero(), T::one());
        let mut corners = Corners {
            place: [0; 3],
            count: 2,
            weights: [[zero; 3]; 3],
            slopes: [[-one, one, zero]; 3],
        };
        for a in 0..3 {
            let mut fraction = self.offset[a];
            if fraction < zero {
                fraction += one;
            } else {
                corners.place[a] = 1;
            }
            corners.weights[a] = [one - fraction, fraction, zero];
        }
        corners
    }
}

/// Derivatives per cell, at a sample, of the quadratic B-spline of values at cells.
#[derive(Clone, Copy)]
pub(super) struct Derivatives<T> {
    /// `∇`.
    pub(super) gradient: [T; 3],
    /// `∂²/∂x²`, `∂²/∂y²`, `∂²/∂z²`.
    pure: [T; 3],
    /// `∂²/∂y∂z`, `∂²/∂x∂z`, `∂²/∂x∂y`.
    mixed: [T; 3],
}

impl<T: Real> Derivatives<T> {
    /// `∇(n·∇)`: gradient of the slope along `n`.
    #[inline(always)]
    pub(super) fn bend(&self, [x, y, z]: [T; 3]) -> [T; 3] {
        let ([xx, yy, zz], [yz, xz, xy]) = (self.pure, self.mixed);
        [
            xx * x + xy * y + xz * z,
            xy * x + yy * y + yz * z,
            xz * x + yz * y + zz * z,
        ]
    }
}

impl<T: Real> Corners<T> {
    /// The cells, the last axis fastest.
    #[inline(always)]
    pub(super) fn cells(&self) -> impl Iterator<Item = [usize; 3]> + use<T> {
        let n = self.count;
        (0..n).flat_map(move |i| (0..n).flat_map(move |j| (0..n).map(move |k| [i, j, k])))
    }

    /// Weight and its derivatives of a cell, by its place among [`Self::cells`].
    #[inline(always)]
    pub(super) fn weight_and_slope(&self, [i, j, k]: [usize; 3]) -> (T, [T; 3]) {
        let ([x, y, z], [dx, dy, dz]) = (self.weights, self.slopes);
        let slope = [
            dx[i] * y[j] * z[k],
            x[i] * dy[j] * z[k],
            x[i] * y[j] * dz[k],
        ];
        (x[i] * y[j] * z[k], slope)
    }

    /// Place in the 3³ of one of the cells.
    #[inline(always)]
    pub(super) fn cell(&self, [i, j, k]: [usize; 3]) -> [usize; 3] {
        let [x, y, z] = self.place;
        [x + i, y + j, z + k]
    }
}
