//! Weights of a sample on three cells along an axis, those below, at and above its own, and their derivatives. The
//! sample lies `f` cells from the center of its cell, −½ to ½.

#[cfg(cube)]
use cubecl::prelude::*;

use super::{Element, select};

/// A number for each of three cells along an axis.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Triple<F: Element> {
    pub below: F,
    pub center: F,
    pub above: F,
}

#[cfg(not(cube))]
impl<F: Element> From<Triple<F>> for [F; 3] {
    #[inline(always)]
    fn from(w: Triple<F>) -> Self {
        [w.below, w.center, w.above]
    }
}

/// Weights of the quadratic B-spline.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn bspline<F: Element>(f: F) -> Triple<F> {
    Triple::<F> {
        below: F::new(0.5) * (F::new(0.5) - f) * (F::new(0.5) - f),
        center: F::new(0.75) - f * f,
        above: F::new(0.5) * (F::new(0.5) + f) * (F::new(0.5) + f),
    }
}

/// Derivatives of [`bspline`].
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn bspline_slope<F: Element>(f: F) -> Triple<F> {
    Triple::<F> {
        below: f - F::new(0.5),
        center: -(f + f),
        above: F::new(0.5) + f,
    }
}

/// The paper's weights (eq. `alpha_product`), not normalized: `½ max(0, 1 − |Δ|/2)` for a cell whose center is `Δ` cells
/// from the sample.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn hat<F: Element>(f: F) -> Triple<F> {
    Triple::<F> {
        below: hat_at::<F>(f + F::new(1.0)),
        center: hat_at::<F>(f),
        above: hat_at::<F>(f - F::new(1.0)),
    }
}

/// Derivatives of [`hat`]; 0 for a sample at the center of a cell, where there is none.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn hat_slope<F: Element>(f: F) -> Triple<F> {
    Triple::<F> {
        below: hat_slope_at::<F>(f + F::new(1.0)),
        center: hat_slope_at::<F>(f),
        above: hat_slope_at::<F>(f - F::new(1.0)),
    }
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn hat_at<F: Element>(distance: F) -> F {
    let away = select(distance < F::new(0.0), -distance, distance);
    let share = F::new(1.0) - F::new(0.5) * away;
    F::new(0.5) * select(share < F::new(0.0), F::new(0.0), share)
}

#[cfg_attr(cube, cube)]
#[inline(always)]
fn hat_slope_at<F: Element>(distance: F) -> F {
    let falling = select(distance > F::new(0.0), F::new(-0.25), F::new(0.0));
    select(distance < F::new(0.0), F::new(0.25), falling)
}
