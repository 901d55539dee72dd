//! A plate that is thinner than the step of the indicator is wide, and how far samples on it are followed: see
//! `isograd::isosurface::local_level`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// `ε = 1/20`: the area of samples, in cells², whose word counts half.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn least_area<F: Element>() -> F {
    F::new(1.0) / F::new(20.0)
}

/// From 0 to 1 as a thickness goes from `low` to `high`.
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

/// `ω = t²(3 − 2t)`, where `t` is what [`followed`] says.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn trust<F: Element>(t: F) -> F {
    t * t * (F::new(3.0) - F::new(2.0) * t)
}

/// Cotangent of the thickness for that of `ω`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn trust_pullback<F: Element>(trust_bar: F, t: F, low: F, high: F) -> F {
    trust_bar * F::new(6.0) * t * (F::new(1.0) - t) / (high - low)
}

/// How much less the dip of `χ` is, of its depth, at the faces of a plate whose `depth` there is `least` than at
/// those of this one; 0 if it is more.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn rise<F: Element>(depth: F, least: F) -> F {
    let mut rise = depth - least;
    if rise < F::new(0.0) {
        rise = F::new(0.0);
    }
    rise
}

/// How much a depth grows with the logarithm of the width of the step.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn growth<F: Element>(thickness: F, width: F, depth: F) -> F {
    let t = thickness / width;
    F::new(0.25) * t * t * depth
}

/// Cotangent of the share `q` of the slope of a thick body, for that of the thickness.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn share_pullback<F: Element>(thickness_bar: F, thickness: F, width: F, share: F) -> F {
    thickness_bar * width * width / (thickness * (F::new(1.0) - share))
}
