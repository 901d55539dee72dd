//! What a sample adds to the generalized winding number, in the automatic orientation: see `isograd::orient`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// A sample nearer than this share of the spacing counts as if it were so far: it lies on the same sheet, and
/// only its noise would speak.
const SOFT: f32 = 0.3;

/// The square of the distance that counts, in squares of the spacing.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn softened<F: Element>(square: F) -> F {
    square + F::new(SOFT) * F::new(SOFT)
}

/// The share of a sample whose moment (area times outward normal, over 4π) is `along` its offset from the place, by
/// the softened square of their distance and its root.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn share<F: Element>(along: F, square: F, root: F) -> F {
    along / (square * root)
}
