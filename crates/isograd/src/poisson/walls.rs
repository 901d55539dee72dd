//! Conditions at the walls of the grid.

use crate::{Grid, Real, parallel};

/// Cells of φ from the wall within which a sample reaches it. Samples keep 2 cells off the walls, and a fitted grid keeps
/// [`Grid::MARGIN_CELLS`] cells off the samples.
const REACH: f64 = 3.5;

/// Condition of the indicator χ at the walls of the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Walls {
    /// No flux, so that the surface may pass through a wall, at right angles: for half of a body that ends there. Holes in
    /// the samples may lead the surface to a wall.
    #[default]
    Free,
    /// χ is 0, which is outside: the surface never reaches a wall.
    Closed,
    /// [`Self::Free`] if a sample lies within 3.5 cells (of φ) of a wall, which is never so on a fitted grid, else
    /// [`Self::Closed`].
    Auto,
}

impl Walls {
    /// Whether the walls are closed, for samples at these points.
    pub fn are_closed<T: Real>(self, points: &[[T; 3]], grid: &Grid<T>) -> bool {
        match self {
            Self::Auto => !reaches_wall(margin(points, grid)),
            Self::Free => false,
            Self::Closed => true,
        }
    }
}

/// Whether a sample that is `margin` cells off a wall reaches it.
pub(crate) fn reaches_wall(margin: f64) -> bool {
    !(margin >= REACH)
}

/// How far the nearest of the points is off the walls, in cells.
pub(crate) fn margin<T: Real>(points: &[[T; 3]], grid: &Grid<T>) -> f64 {
    let shape = grid.shape();
    let of = |i: usize| {
        let x = grid.to_index(points[i]);
        let along = |a: usize| x[a].f64().min(shape[a] as f64 - x[a].f64());
        (0..3).map(along).fold(f64::INFINITY, f64::min)
    };
    parallel::reduce(points.len(), f64::INFINITY, of, f64::min)
}
