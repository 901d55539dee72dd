//! A sample that is drawn on a grid as a disc in its tangent plane: see `isograd::orient::fill`. Lengths in cells.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// A position along an axis of so many cells, kept half a cell inside the grid.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn inside<F: Element>(position: F, cells: F) -> F {
    clamped::<F>(position, F::new(0.5), cells - F::new(0.5))
}

/// Radius of the disc of a sample of this reach. Less than 8.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn radius<F: Element>(reach: F) -> F {
    clamped::<F>(F::new(1.5) * reach, F::new(0.9), F::new(7.5))
}

/// Half the thickness of a disc with this axis: the least that no path through cell faces gets through.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn half<F: Element>(x: F, y: F, z: F) -> F {
    F::new(0.5) * (absolute::<F>(x) + absolute::<F>(y) + absolute::<F>(z))
}

/// Whether a disc covers a cell whose center is so far from its own, squared, and so high above its plane.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn covers<F: Element>(square: F, height: F, half: F, radius: F) -> bool {
    height <= half && -height <= half && square - height * height <= radius * radius
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn absolute<F: Element>(x: F) -> F {
    let mut absolute = x;
    if x < F::new(0.0) {
        absolute = -x;
    }
    absolute
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn clamped<F: Element>(x: F, low: F, high: F) -> F {
    let mut clamped = x;
    if x < low {
        clamped = low;
    }
    if x > high {
        clamped = high;
    }
    clamped
}
