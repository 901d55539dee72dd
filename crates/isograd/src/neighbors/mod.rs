//! Which samples are close to which: a service shared by the stages.
//!
//! # Map
//! Points `(N, 3)` → a radius `R_i` per point and the neighborhoods `N_i = {j : |x_j − x_i| ≤ R_i}`,
//! each of which contains `i`. The radius is common to all points (given, or chosen so that a sample
//! has about 24 neighbors), and grows where few samples are within it:
//! `R_i = max(R, 1.05 · distance to the 8th neighbor)`, counting `i` itself. With 10:1 density a
//! common radius would leave one or two. A sample whose neighbors do not have it as theirs is marked as
//! isolated.
//!
//! Where samples lie along lines, as those of scanners and of structured meshes, an automatic radius has more than 24 neighbors, so
//! that it reaches the next lines, and grows where these are farther than most: to 1.15 times the distance within which there are
//! samples on either side of the line of `i`.
//!
//! # Residual
//! [`Neighborhoods`] is its own residual: the tree and the radii.
//!
//! # Pullback
//! Radii are distances between samples, or means of such: [`pullback`] takes their cotangents, which the pullbacks of
//! normals and areas return, to the points. What those pullbacks share, sums over all centers that have a point as a
//! neighbor, is in `gather.rs`.
//!
//! # Not differentiable
//! Which sample is the 8th or the 24th, which points are isolated, whether samples lie along lines, how many reach the next ones,
//! and which lie on either side. Radii are continuous where the 8th and the 24th change. `j ∈ N_i` and `i ∈ N_j` are the same where
//! both radii are the common one, not where one has grown.

mod candidates;
mod cell_index;
mod cells;
mod census;
mod gather;
mod growth;
pub(crate) mod lines;
mod near_cells;
mod nearest;
mod nearest_of_all;
#[cfg(test)]
mod order_tests;
mod radius;
mod radius_pullback;
pub mod rule;
mod strays;
#[cfg(test)]
mod strays_tests;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use candidates::{Candidates, LANES, Lanes, sum_lanes};
pub use cell_index::CellIndex;
pub(crate) use cells::Search;
pub(crate) use census::Census;
pub(crate) use near_cells::NearCells;
pub use radius::{Error, Neighborhoods, Radii, Radius, forward, with_lines, with_radii};
pub(crate) use radius::{Found, forward_with, hold};
pub use radius_pullback::{RadiiCotangent, pullback};
pub use strays::strays;
