//! The quadratic B-spline: weights of the cells below, at and above a point that lies `f` cells from the
//! center of its own, −½ to ½; and their derivatives.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// Weight of the cell below.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn below<F: Element>(f: F) -> F {
    F::new(0.5) * (F::new(0.5) - f) * (F::new(0.5) - f)
}

/// Weight of the cell of the point.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn center<F: Element>(f: F) -> F {
    F::new(0.75) - f * f
}

/// Weight of the cell above.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn above<F: Element>(f: F) -> F {
    F::new(0.5) * (F::new(0.5) + f) * (F::new(0.5) + f)
}

/// Derivative of [`below`].
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn below_slope<F: Element>(f: F) -> F {
    f - F::new(0.5)
}

/// Derivative of [`center`].
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn center_slope<F: Element>(f: F) -> F {
    -(f + f)
}

/// Derivative of [`above`].
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn above_slope<F: Element>(f: F) -> F {
    F::new(0.5) + f
}
