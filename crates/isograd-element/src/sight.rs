//! What a sample sees along a ray, and what that says about its axis: see `isograd::orient::fill`. Lengths in cells.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// Places along a ray to the nearest free cell.
pub const STEPS: usize = 8;

/// Rays that tell how much of the sky a cell sees.
pub const RAYS: usize = 26;

/// How far along a ray a place is, by its number from 0.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn distance<F: Element>(step: F) -> F {
    F::new(0.75) + F::new(0.5) * step
}

/// Light in a cell of the open air, of whose rays so many out of [`RAYS`] are free: 0.2 for none, 1 for all.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn open_air<F: Element>(free: F, rays: F) -> F {
    let dark = F::new(0.2);
    dark + (F::new(1.0) - dark) * (free / rays)
}

/// What is left of the light of a cell that is met at a place after so many of the [`STEPS`].
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn dimmed<F: Element>(light: F, step: F, steps: F) -> F {
    light * (F::new(1.0) - F::new(0.5) * step / steps)
}

/// The first term of the evidence, from the light in front of a sample and behind it. The others are its differences
/// along four directions round the axis.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn along_axis<F: Element>(front: F, back: F) -> F {
    F::new(2.0) * (front - back)
}

/// The evidence, in −1..1, from the sum of its terms.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn evidence<F: Element>(sum: F) -> F {
    sum / F::new(12.0)
}
