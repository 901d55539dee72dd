//! Contribution of one neighbor to the local plane, the crowding and the area of a sample: see `isograd::normals` and
//! `isograd::splat::area`.

#[cfg(cube)]
use cubecl::prelude::*;

use super::{Element, select};

/// `s = t²(3 − 2t)` with `t` from 1 down to 0 at the distance `r = 1`, and the `steepness` by which it falls.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn taper<F: Element>(r: F, steepness: F) -> F {
    let t = rim::<F>(r, steepness);
    t * t * (F::new(3.0) - F::new(2.0) * t)
}

/// `t`: 1 inside the rim, 0 from the radius on.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn rim<F: Element>(r: F, steepness: F) -> F {
    to_unit::<F>((F::new(1.0) - r) * steepness)
}

/// A number, at least 0 and at most 1; 0 for one that is not a number.
#[cfg_attr(cube, cube)]
#[inline(always)]
fn to_unit<F: Element>(x: F) -> F {
    let above = select(x > F::new(0.0), x, F::new(0.0));
    select(above < F::new(1.0), above, F::new(1.0))
}

/// 1 up to `from`, 0 from `to` on.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn falling<F: Element>(x: F, from: F, to: F) -> F {
    to_unit::<F>((to - x) / (to - from))
}

/// `w = s/(r + ε)`: weight of a sample at distance `r`, in radii, in the covariance.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weight<F: Element>(r: F, epsilon: F, steepness: F) -> F {
    taper::<F>(r, steepness) / (r + epsilon)
}

/// `−dw/dr`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn weight_fall<F: Element>(r: F, epsilon: F, steepness: F) -> F {
    let t = rim::<F>(r, steepness);
    let fall = F::new(6.0) * t * (F::new(1.0) - t) * steepness;
    (taper::<F>(r, steepness) / (r + epsilon) + fall) / (r + epsilon)
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

/// `λ₁λ/((λ − λ₁)² + λ₁λ/Q)` with `Q = 16`: contribution of one of the two larger eigenvalues to the roughness of a
/// neighborhood. `λ₁` is positive.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn roughness<F: Element>(first: F, value: F) -> F {
    let product = first * value;
    let gap = value - first;
    product / (gap * gap + product / F::new(16.0))
}

/// `−w' (g·e)(n·e)/r`: factor of the offset in its cotangent, 0 at distance 0.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn radial<F: Element>(fall: F, ge: F, ne: F, r: F) -> F {
    if r > F::new(0.0) {
        fall * ge * ne / r
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
