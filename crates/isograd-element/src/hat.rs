//! The paper's weight of a cell (eq. `alpha_product`, not normalized), and its derivative.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// `½ max(0, 1 − |Δ|/2)` along one axis; `Δ` is how far the point lies from the cell's center, in cells.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weight<F: Element>(distance: F) -> F {
    let mut away = distance;
    if distance < F::new(0.0) {
        away = -distance;
    }
    let mut share = F::new(1.0) - F::new(0.5) * away;
    if share < F::new(0.0) {
        share = F::new(0.0);
    }
    F::new(0.5) * share
}

/// Derivative of [`weight`] within 2 cells; 0 at the center, where there is none.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn slope<F: Element>(distance: F) -> F {
    let mut slope = F::new(0.0);
    if distance > F::new(0.0) {
        slope = F::new(-0.25);
    }
    if distance < F::new(0.0) {
        slope = F::new(0.25);
    }
    slope
}
