//! When a plane through a sample counts as the sheet that it lies on: see `isograd::orient::graph`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::coupling::NEIGHBORS;

/// Nearest neighbors whose pairs span the planes that are tried.
pub const SPANNING: usize = 9;

/// Neighbors that a plane has to fit.
pub const QUORUM: usize = 6;

/// Rank of the neighbor that stands for those off the plane.
pub const REST: usize = (NEIGHBORS + QUORUM) / 2;

/// A plane is taken for a sheet where it fits its quorum this much better than the rest. Noise does not: of
/// all planes the best fits its quorum about 7 times better than the rest, seldom 20 times.
const RESOLVED: f32 = 0.05;

/// Neighbors within this many times the fit of the quorum lie on the sheet, and so do those within this
/// share of the distance of the rest.
const ON: f32 = 3.0;
const ROUNDED: f32 = 0.02;

/// The square of the sine under which two neighbors must be seen to span a plane: 0.3.
const SLIVER: f32 = 0.3 * 0.3;

/// Whether two offsets span a plane, by the square of their cross product and the product of their squares.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn spans(cross: f32, squares: f32) -> bool {
    cross > SLIVER * squares
}

/// Whether a plane that fits its quorum so well stands out from the rest.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn stands_out(fit: f32, rest: f32) -> bool {
    rest > 0.0f32 && fit <= RESOLVED * rest
}

/// How far from the plane a neighbor may lie to be on the sheet.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn limit(fit: f32, rest: f32) -> f32 {
    let near = ON * fit;
    let rounded = ROUNDED * rest;
    if near > rounded { near } else { rounded }
}

/// How far samples lie off the sheet, whose root mean square distance is `found`; above 0.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn scatter(found: f32, limit: f32) -> f32 {
    let least = limit / ON;
    if found > least { found } else { least }
}
