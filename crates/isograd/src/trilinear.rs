//! Trilinear interpolation of a field between its cell centers: value and gradient at a point.
//!
//! Within half a cell of a wall, and outside the grid, the field continues as a constant across the wall
//! (its even reflection): the value is that of the nearest point between the cell centers, and the
//! gradient has no component across the wall. The gradient jumps at the planes through cell centers.

use crate::data::blocks::{Blocks, Overlap};
use crate::data::cells::{Cells, CellsMut};
use crate::element::linear::lerp;
use crate::splat::SortedSamples;
use crate::{Field, Grid, Real, parallel};

/// Planes across x that one task of [`spread`] owns.
const SLAB: usize = 8;

/// The eight cells around a point, and the position of the point between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cube<T> {
    /// The lowest of the eight cells.
    cell: [usize; 3],
    /// Its place in memory.
    base: usize,
    strides: [usize; 3],
    /// Distance from its center, per axis, in cells: 0 to 1.
    fraction: [T; 3],
    /// Whether the point is between cell centers, per axis.
    between: [bool; 3],
}

impl<T: Real> Cube<T> {
    /// The cube around the point of index coordinates `x`.
    #[inline(always)]
    pub(crate) fn new(grid: &Grid<T>, x: [T; 3]) -> Self {
        let (shape, strides) = (grid.shape(), grid.strides());
        let mut cube = Self {
            cell: [0; 3],
            base: 0,
            strides,
            fraction: [T::zero(); 3],
            between: [true; 3],
        };
        for axis in 0..3 {
            let last = shape[axis] - 1;
            let (u, between) = clamp(x[axis] - T::of(0.5), T::of_usize(last));
            let cell = u.to_usize().unwrap_or(0).min(last - 1);
            cube.cell[axis] = cell;
            cube.base += cell * strides[axis];
            cube.fraction[axis] = u - T::of_usize(cell);
            cube.between[axis] = between;
        }
        cube
    }

    /// Places in memory of the eight cells; the last axis varies fastest.
    #[inline(always)]
    pub(crate) fn cells(&self) -> [usize; 8] {
        let [x, y, z] = self.strides;
        std::array::from_fn(|c| self.base + (c >> 2) * x + (c >> 1 & 1) * y + (c & 1) * z)
    }

    /// Weights of the eight cells, in the order of [`Self::cells`].
    #[inline(always)]
    pub(crate) fn weights(&self) -> [T; 8] {
        let pair = |a: usize| [T::one() - self.fraction[a], self.fraction[a]];
        let [x, y, z] = [0, 1, 2].map(pair);
        std::array::from_fn(|c| x[c >> 2] * y[c >> 1 & 1] * z[c & 1])
    }

    /// The value at the point.
    #[inline(always)]
    pub(crate) fn value(&self, values: &[T]) -> T {
        let [x, y, z] = self.fraction;
        let v = self.cells().map(|c| values[c]);
        let edge = |e: usize| lerp(v[2 * e], v[2 * e + 1], z);
        lerp(lerp(edge(0), edge(1), y), lerp(edge(2), edge(3), y), x)
    }

    /// The value at the point, and the gradient in values per cell.
    #[inline(always)]
    pub(crate) fn value_and_gradient(&self, values: &[T]) -> (T, [T; 3]) {
        self.of_corners(self.cells().map(|c| values[c]))
    }

    /// Like [`Self::value_and_gradient`], of a field that is dense or in blocks.
    #[inline(always)]
    pub(crate) fn value_and_gradient_of(&self, field: Cells<'_, T>) -> (T, [T; 3]) {
        let [x, y, z] = self.cell;
        let [a, b, c, d] = [[x, y], [x, y + 1], [x + 1, y], [x + 1, y + 1]]
            .map(|[x, y]| field.row::<2>([x, y, z]));
        self.of_corners([a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1]])
    }

    /// The value and the gradient, from the values of the eight cells.
    #[inline(always)]
    fn of_corners(&self, v: [T; 8]) -> (T, [T; 3]) {
        let [x, y, z] = self.fraction;
        let edge: [T; 4] = std::array::from_fn(|e| lerp(v[2 * e], v[2 * e + 1], z));
        let slope: [T; 4] = std::array::from_fn(|e| v[2 * e + 1] - v[2 * e]);
        let (low, high) = (lerp(edge[0], edge[1], y), lerp(edge[2], edge[3], y));
        let gradient = [
            high - low,
            lerp(edge[1] - edge[0], edge[3] - edge[2], x),
            lerp(lerp(slope[0], slope[1], y), lerp(slope[2], slope[3], y), x),
        ];
        let across = |a: usize| {
            if self.between[a] {
                gradient[a]
            } else {
                T::zero()
            }
        };
        (lerp(low, high, x), std::array::from_fn(across))
    }
}

/// Like [`spread`], to a field that is dense or in blocks.
pub(crate) fn spread_on<T: Real>(
    out: CellsMut<'_, T>,
    sorted: SortedSamples<'_, T>,
    value: impl Fn(usize) -> T + Sync,
) {
    let field = match out {
        CellsMut::Dense(grid, out) => return spread(grid, sorted, value, out),
        CellsMut::Blocks(field) => field,
    };
    let (grid, points) = (&field.grid, sorted.samples.points);
    let cube = |i: usize| Cube::new(grid, grid.to_index(points[i]));
    let blocks: &Blocks = &field.blocks;
    let corner = |i: usize| Some(cube(i).cell);
    blocks.scatter(
        &mut field.values,
        points.len(),
        2,
        corner,
        |block, values, items| {
            for &i in items {
                let (cube, part) = (cube(i as usize), value(i as usize));
                let weights = cube.weights();
                Overlap::new(cube.cell, 2, blocks.corner(block)).for_each(|[i, j, k], at| {
                    values[at] += part * weights[4 * i + 2 * j + k];
                });
            }
        },
    );
}

/// Adds `value(i)` at every sample to the eight cells around it, in memory order: the transpose of
/// [`Cube::value`]. Each task owns some planes.
pub(crate) fn spread<T: Real>(
    grid: &Grid<T>,
    sorted: SortedSamples<'_, T>,
    value: impl Fn(usize) -> T + Sync,
    out: &mut [T],
) {
    let (plane, points) = (grid.strides()[0], sorted.samples.points);
    parallel::each(out.chunks_mut(SLAB * plane), |task, slab| {
        let first = task * SLAB * plane;
        let planes = task * SLAB..task * SLAB + slab.len() / plane;
        // The eight cells reach one plane beyond that of the sample's own cell.
        let near = planes.start.saturating_sub(1)..planes.end + 1;
        for &i in sorted.order.in_planes(points, grid, near) {
            let i = i as usize;
            let cube = Cube::new(grid, grid.to_index(points[i]));
            let part = value(i);
            for (cell, weight) in cube.cells().into_iter().zip(cube.weights()) {
                if let Some(sum) = cell.checked_sub(first).and_then(|at| slab.get_mut(at)) {
                    *sum += part * weight;
                }
            }
        }
    });
}

impl<T: Real> Field<T> {
    /// The value at a point of the user's coordinates, trilinear between cell centers and constant across
    /// the walls. NaN for a NaN point.
    pub fn interpolate(&self, point: [T; 3]) -> T {
        let grid = self.grid();
        Cube::new(grid, grid.to_index(point)).value(self.values())
    }

    /// The value at a point of the user's coordinates, as [`Self::interpolate`], and its gradient there, in
    /// values per unit length. The gradient jumps at the planes through cell centers, and has no component
    /// across a wall that is less than half a cell away.
    pub fn interpolate_with_gradient(&self, point: [T; 3]) -> (T, [T; 3]) {
        let grid = self.grid();
        let cube = Cube::new(grid, grid.to_index(point));
        let (value, gradient) = cube.value_and_gradient(self.values());
        (value, gradient.map(|g| g / grid.spacing()))
    }
}

/// `u` limited to `0..=max`, and whether it was there already. NaN stays NaN.
#[inline(always)]
fn clamp<T: Real>(u: T, max: T) -> (T, bool) {
    if u < T::zero() {
        (T::zero(), false)
    } else if u > max {
        (max, false)
    } else {
        (u, true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `1 + 2x − 3y + z/2 + xy − 2yz + xz + xyz` and its gradient.
    fn trilinear([x, y, z]: [f64; 3]) -> (f64, [f64; 3]) {
        (
            1.0 + 2.0 * x - 3.0 * y + 0.5 * z + x * y - 2.0 * y * z + x * z + x * y * z,
            [
                2.0 + y + z + y * z,
                -3.0 + x - 2.0 * z + x * z,
                0.5 - 2.0 * y + x + x * y,
            ],
        )
    }

    fn sampled() -> Field<f64> {
        let grid = Grid::new([-0.3, 0.2, 1.0], 0.25, [4, 7, 2]).expect("valid");
        let values = (0..grid.cells())
            .map(|i| trilinear(grid.center(grid.cell(i))).0)
            .collect();
        Field::new(grid, values).expect("sizes match")
    }

    #[test]
    fn trilinear_functions_are_reproduced_with_their_gradient() {
        let field = sampled();
        for i in 0..200 {
            let t = |a: f64| (f64::from(i) * a).fract();
            // Anywhere between the first and the last cell center.
            let x = [0.5 + 3.0 * t(0.618), 0.5 + 6.0 * t(0.414), 0.5 + t(0.732)];
            let point = field.grid().from_index(x);
            let (value, gradient) = field.interpolate_with_gradient(point);
            let (expected, slope) = trilinear(point);
            // Rounding of numbers below 20.
            assert!((value - expected).abs() < 1e-13);
            assert_eq!(value, field.interpolate(point));
            for a in 0..3 {
                assert!((gradient[a] - slope[a]).abs() < 1e-12, "{x:?}");
            }
        }
    }

    #[test]
    fn field_is_constant_across_the_walls() {
        let field = sampled();
        let corner = field.at([3, 6, 1]);
        for out in [0.0, 0.1, 1e30, f64::INFINITY] {
            let point = [0.575 + out, 1.825 + out, 1.375 + out];
            let (value, gradient) = field.interpolate_with_gradient(point);
            assert!((value - corner).abs() < 1e-12);
            assert!(out == 0.0 || gradient == [0.0; 3], "{gradient:?}");
        }
        let low = field.interpolate([f64::NEG_INFINITY, -1e30, 0.0]);
        assert_eq!(low, field.at([0, 0, 0]));
    }

    #[test]
    fn point_that_is_not_a_number_has_no_value() {
        assert!(sampled().interpolate([0.0, f64::NAN, 1.2]).is_nan());
    }
}
