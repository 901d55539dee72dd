//! Linear interpolation.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// The value at `t` between `a` at 0 and `b` at 1.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn lerp<F: Element>(a: F, b: F, t: F) -> F {
    a + (b - a) * t
}
