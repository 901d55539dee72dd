//! Plates thinner than the width of the step of the indicator, and how closely the local level follows the samples there:
//! see `isograd::isosurface::local_level`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// `ε = 1/20`: area of samples, in cells², at which their weight is one half.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn least_area<F: Element>() -> F {
    F::new(1.0) / F::new(20.0)
}

/// Ramp from 0 to 1 as a thickness goes from `low` to `high`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn followed<F: Element>(thickness: F, low: F, high: F) -> F {
    let mut t = (thickness - low) / (high - low);
    if t < F::new(0.0) {
        t = F::new(0.0);
    }
    if t > F::new(1.0) {
        t = F::new(1.0);
    }
    t
}

/// `ω = t²(3 − 2t)`, with `t` from [`followed`].
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn trust<F: Element>(t: F) -> F {
    t * t * (F::new(3.0) - F::new(2.0) * t)
}

/// Pullback of [`trust`] and [`followed`]: from the cotangent of `ω` to that of the thickness.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn trust_pullback<F: Element>(trust_bar: F, t: F, low: F, high: F) -> F {
    trust_bar * F::new(6.0) * t * (F::new(1.0) - t) / (high - low)
}

/// Difference between the relative depth of the dip of `χ` at the faces of this plate and `least`, that of another one;
/// 0 if it is negative.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn rise<F: Element>(depth: F, least: F) -> F {
    let mut rise = depth - least;
    if rise < F::new(0.0) {
        rise = F::new(0.0);
    }
    rise
}

/// Derivative of a depth with respect to the logarithm of the width of the step.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn growth<F: Element>(thickness: F, width: F, depth: F) -> F {
    let t = thickness / width;
    F::new(0.25) * t * t * depth
}

/// From the cotangent of the thickness to that of the share `q` of the slope of a thick body.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn share_pullback<F: Element>(thickness_bar: F, thickness: F, width: F, share: F) -> F {
    thickness_bar * width * width / (thickness * (F::new(1.0) - share))
}
