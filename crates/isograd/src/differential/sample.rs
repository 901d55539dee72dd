//! The quantities at arbitrary points.

use rayon::prelude::*;

use super::{Differential, unit};
use crate::data::Grid;
use crate::{Real, vector};

/// What is known of `φ` at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Local<T> {
    /// `∇φ`, per unit length.
    pub gradient: [T; 3],
    /// `∇φ/|∇φ|`, outward; zero where the gradient is.
    pub normal: [T; 3],
    /// `div(∇φ/|∇φ|)`, per unit length; `+2/r` on a sphere of radius `r`.
    pub curvature: T,
}

/// Why nothing can be said at a point.
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
}

impl<T: Real> Differential<T> {
    /// At a point, in the user's unit; `None` outside the grid (NaN included).
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

    /// At `(N, 3)` points, in their order. Overwrites `out`, whose memory is used again.
    ///
    /// # Errors
    /// The first point outside the grid; `out` is then empty.
    pub fn at_points(&self, points: &[[T; 3]], out: &mut Vec<Local<T>>) -> Result<(), Error> {
        out.clear();
        let (lower, upper) = (self.grid.lower(), self.grid.upper());
        if let Some(index) = points.iter().position(|p| !within(*p, lower, upper)) {
            return Err(Error::Outside {
                index,
                point: vector::to_f64(points[index]),
                lower: vector::to_f64(lower),
                upper: vector::to_f64(upper),
            });
        }
        points
            .par_iter()
            .map(|&p| self.at(p).unwrap_or_default())
            .collect_into_vec(out);
        Ok(())
    }
}

#[inline(always)]
fn within<T: Real>(point: [T; 3], lower: [T; 3], upper: [T; 3]) -> bool {
    (0..3).all(|a| lower[a] <= point[a] && point[a] <= upper[a])
}

/// The eight cells whose centres surround a point, as places in memory, with their trilinear weights. In
/// the half cell along a wall the nearest eight, and weights that go on linearly.
#[inline(always)]
fn corners<T: Real>(grid: &Grid<T>, point: [T; 3]) -> Option<[(usize, T); 8]> {
    if !within(point, grid.lower(), grid.upper()) {
        return None;
    }
    let mut base = [0; 3];
    let mut fraction = [0.0; 3];
    for a in 0..3 {
        let x = (point[a].f64() - grid.lower()[a].f64()) / grid.spacing().f64() - 0.5;
        base[a] = (x.max(0.0) as usize).min(grid.shape()[a] - 2);
        fraction[a] = x - base[a] as f64;
    }
    Some(std::array::from_fn(|c| {
        let high = [c >> 2 & 1, c >> 1 & 1, c & 1];
        let cell = std::array::from_fn(|a| base[a] + high[a]);
        let weight = |a: usize| {
            if high[a] == 1 {
                fraction[a]
            } else {
                1.0 - fraction[a]
            }
        };
        (grid.index(cell), T::of(weight(0) * weight(1) * weight(2)))
    }))
}
