//! The quantities at arbitrary points.

use super::{Differential, unit};
use crate::data::Grid;
use crate::{Real, parallel, vector};

/// Differential quantities of `φ` at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Local<T> {
    /// `∇φ`, per unit length.
    pub gradient: [T; 3],
    /// `∇φ/|∇φ|`, outward; zero where the gradient is.
    pub normal: [T; 3],
    /// `div(∇φ/|∇φ|)`, per unit length; `+2/r` on a sphere of radius `r`.
    pub curvature: T,
}

/// Errors at points and of the pullbacks.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The point is not in the grid.
    #[error(
        "point {index} at {point:?} is outside the grid, which runs from {lower:?} to {upper:?}; leave it out or use a larger grid"
    )]
    Outside {
        /// Index of the point, from 0.
        index: usize,
        /// Where it is.
        point: [f64; 3],
        /// Low corner of the grid.
        lower: [f64; 3],
        /// High corner of the grid.
        upper: [f64; 3],
    },
    /// An array of the pullback has the wrong length.
    #[error("{what} has {length} entries and must have {expected}: one per cell, or one per point")]
    Mismatch {
        /// The array.
        what: &'static str,
        /// Its length.
        length: usize,
        /// The right length.
        expected: usize,
    },
    /// The field lies on another grid than the derivatives.
    #[error("the field is on another grid; give the one that the derivatives were taken of")]
    Grid,
}

impl<T: Real> Differential<T> {
    /// Quantities at a point in the user's unit; `None` outside the grid and for NaN.
    pub fn at(&self, point: [T; 3]) -> Option<Local<T>> {
        let corners = corners(&self.grid, point)?;
        let zero = Local::default();
        let sum = corners.iter().fold(zero, |sum, &(cell, weight)| Local {
            gradient: vector::add(sum.gradient, vector::scale(self.gradient[cell], weight)),
            curvature: sum.curvature + weight * self.curvature[cell],
            ..sum
        });
        Some(Local {
            normal: unit(sum.gradient),
            ..sum
        })
    }

    /// Quantities at `(N, 3)` points, in their order. Overwrites `out`, reusing its memory.
    ///
    /// # Errors
    /// The first point outside the grid; `out` is then empty.
    pub fn at_points(&self, points: &[[T; 3]], out: &mut Vec<Local<T>>) -> Result<(), Error> {
        out.clear();
        check_points(&self.grid, points)?;
        parallel::fill_large(out, points.len(), &|i| {
            self.at(points[i]).unwrap_or_default()
        });
        Ok(())
    }
}

/// Whether all points are in the grid.
pub(super) fn check_points<T: Real>(grid: &Grid<T>, points: &[[T; 3]]) -> Result<(), Error> {
    let (lower, upper) = (grid.lower(), grid.upper());
    match points.iter().position(|p| !within(*p, lower, upper)) {
        Some(index) => Err(Error::Outside {
            index,
            point: vector::to_f64(points[index]),
            lower: vector::to_f64(lower),
            upper: vector::to_f64(upper),
        }),
        None => Ok(()),
    }
}

#[inline(always)]
fn within<T: Real>(point: [T; 3], lower: [T; 3], upper: [T; 3]) -> bool {
    (0..3).all(|a| lower[a] <= point[a] && point[a] <= upper[a])
}

/// The eight cells whose centers surround a point, as places in memory, with their trilinear weights. In
/// the half cell along a wall the nearest eight, and weights that go on linearly.
#[inline(always)]
fn corners<T: Real>(grid: &Grid<T>, point: [T; 3]) -> Option<[(usize, T); 8]> {
    if !within(point, grid.lower(), grid.upper()) {
        return None;
    }
    let place = Place::of(grid, point);
    Some(std::array::from_fn(|c| {
        (grid.index(place.cell(c)), T::of(place.weight(c)))
    }))
}

/// Where a point of the grid is between the eight cell centers around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// The lowest of the eight cells.
    pub(super) base: [usize; 3],
    /// From its center, in cells.
    fraction: [f64; 3],
}

impl Place {
    #[inline(always)]
    pub(super) fn of<T: Real>(grid: &Grid<T>, point: [T; 3]) -> Self {
        let mut base = [0; 3];
        let mut fraction = [0.0; 3];
        for a in 0..3 {
            let x = (point[a].f64() - grid.lower()[a].f64()) / grid.spacing().f64() - 0.5;
            base[a] = (x.max(0.0) as usize).min(grid.shape()[a] - 2);
            fraction[a] = x - base[a] as f64;
        }
        Self { base, fraction }
    }

    /// One of the eight cells; the last axis varies fastest.
    #[inline(always)]
    pub(super) fn cell(&self, corner: usize) -> [usize; 3] {
        std::array::from_fn(|a| self.base[a] + (corner >> (2 - a) & 1))
    }

    /// Its weight along one axis.
    #[inline(always)]
    fn along(&self, corner: usize, a: usize) -> f64 {
        if corner >> (2 - a) & 1 == 1 {
            self.fraction[a]
        } else {
            1.0 - self.fraction[a]
        }
    }

    /// Its trilinear weight.
    #[inline(always)]
    pub(super) fn weight(&self, corner: usize) -> f64 {
        self.along(corner, 0) * self.along(corner, 1) * self.along(corner, 2)
    }

    /// Gradient of its weight, per cell.
    #[inline(always)]
    pub(super) fn slope(&self, corner: usize) -> [f64; 3] {
        std::array::from_fn(|a| {
            let sign = if corner >> (2 - a) & 1 == 1 {
                1.0
            } else {
                -1.0
            };
            sign * self.along(corner, (a + 1) % 3) * self.along(corner, (a + 2) % 3)
        })
    }
}
