//! Axes between one step of a moving body and the next: see `isograd::orient::Method::Previous`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// An axis whose cosine with the normal of the step before is smaller than this has turned far.
pub const FAR: f32 = 0.5;

/// Where more than this share of the axes has turned far, the points are not those of the step before.
const MOST_FAR: f64 = 0.03;

/// Whether so few of the axes have turned far that these may be the points of the step before.
pub fn are_few(turned: usize, points: usize) -> bool {
    turned as f64 <= MOST_FAR * points as f64
}

/// Offsets shorter than this share of a neighborhood's radius have no direction to speak of.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn blunt<F: Element>(radius: F) -> F {
    let share = radius / F::new(10.0);
    share * share
}

/// What the word of a neighbor weighs, by the square of its distance.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weight<F: Element>(square: F, blunt: F) -> F {
    F::new(1.0) / (square + blunt)
}

/// What a neighbor says of an axis, −1 to 1: their cosine, once its normal is reflected at the plane half-way
/// between the two, so that it turns with the surface round an edge, and changes sides across a thin body.
/// `parallel` is the cosine of axis and normal, `axis_along` and `normal_along` their products with the offset
/// between the two, and `weight` is that of the neighbor.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn carried<F: Element>(parallel: F, axis_along: F, normal_along: F, weight: F) -> F {
    parallel - F::new(2.0) * normal_along * weight * axis_along
}
