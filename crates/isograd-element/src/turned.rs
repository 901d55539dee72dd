//! Axes of a moving body from one step to the next: see `isograd::orient::Method::Previous`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// Cosine with the normal of the step before below which an axis has turned far.
pub const FAR: f32 = 0.5;

/// Largest share of axes that may turn far between two steps of the same points.
const MOST_FAR: f64 = 0.03;

/// Whether so few of the axes have turned far that the points may be those of the step before.
pub fn are_few(turned: usize, points: usize) -> bool {
    turned as f64 <= MOST_FAR * points as f64
}

/// Square of a tenth of the radius of a neighborhood: the direction of shorter offsets is mostly noise.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn blunt<F: Element>(radius: F) -> F {
    let share = radius / F::new(10.0);
    share * share
}

/// Weight of a neighbor, by the square of its distance.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weight<F: Element>(square: F, blunt: F) -> F {
    F::new(1.0) / (square + blunt)
}

/// Evidence of a neighbor for the sign of an axis, −1 to 1: their cosine after its normal is reflected at the plane half-way
/// between the two, so that it turns with the surface around an edge, and changes sides across a thin body.
/// `parallel` is the cosine of axis and normal, `axis_along` and `normal_along` their products with the offset
/// between the two, and `weight` is that of the neighbor.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn carried<F: Element>(parallel: F, axis_along: F, normal_along: F, weight: F) -> F {
    parallel - F::new(2.0) * normal_along * weight * axis_along
}
