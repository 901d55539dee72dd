//! Contribution of one neighbor to the local plane, the crowding and the area of a sample: see `isograd::normals` and
//! `isograd::splat::area`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;

/// `w = 1/(r + ε)`: weight of a sample at distance `r` in the covariance.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weight<F: Element>(r: F, epsilon: F) -> F {
    F::new(1.0) / (r + epsilon)
}

/// `(1 − q)²`, with `q = r²/R²`: contribution of a neighbor to the crowding of a sample.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn crowd<F: Element>(q: F) -> F {
    (F::new(1.0) - q) * (F::new(1.0) - q)
}

/// `πR²/(3 Σ (1 − q)²)`: area represented by a sample.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn area<F: Element>(pi: F, radius: F, crowd: F) -> F {
    pi * radius * radius / (F::new(3.0) * crowd)
}

/// `λ₁λ/(λ − λ₁)²`: contribution of one of the two larger eigenvalues to the roughness of a neighborhood; they
/// differ from the smallest.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn roughness<F: Element>(first: F, value: F) -> F {
    first * value / ((value - first) * (value - first))
}

/// `w² (g·e)(n·e)/r`: factor of the offset in its cotangent, 0 at distance 0.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn radial<F: Element>(w: F, ge: F, ne: F, r: F) -> F {
    if r > F::new(0.0) {
        w * w * ge * ne / r
    } else {
        F::new(0.0)
    }
}

/// `w (g (n·e) + n (g·e)) − radial d`: one component of the cotangent of an offset `d`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn offset_bar<F: Element>(w: F, g: F, ne: F, n: F, ge: F, radial: F, d: F) -> F {
    w * (g * ne + n * ge) - radial * d
}
