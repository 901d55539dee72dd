//! Mean curvature from the unit normal `n = g/|g|` and the Hessian `H` of a field, and its cotangents: see
//! [`crate::differential`].

use crate::element::Element;

/// Part of the second derivatives along the axes in `tr H − nᵀ H n`, with the terms of each taken together.
#[inline(always)]
pub(super) fn plain<F: Element>(xx: F, yy: F, zz: F, nx: F, ny: F, nz: F) -> F {
    xx * (ny * ny + nz * nz) + yy * (nx * nx + nz * nz) + zz * (nx * nx + ny * ny)
}

/// Part of the mixed ones in half of `nᵀ H n`.
#[inline(always)]
pub(super) fn mixed<F: Element>(xy: F, xz: F, yz: F, nx: F, ny: F, nz: F) -> F {
    xy * nx * ny + xz * nx * nz + yz * ny * nz
}

/// `(tr H − nᵀ H n)/|g|`.
#[inline(always)]
pub(super) fn curvature<F: Element>(plain: F, mixed: F, length: F) -> F {
    (plain - F::new(2.0) * mixed) / length
}

/// One component of the cotangent of `g`: `n` is that of the normal, `along` of `H n`, `trace` is `tr H` and
/// `per_length` is `κ̄/|g|`.
#[inline(always)]
pub(super) fn gradient_bar<F: Element>(
    per_length: F,
    n: F,
    trace: F,
    along: F,
    length: F,
    kappa: F,
) -> F {
    let turned = F::new(2.0) * (n * trace - along) / length;
    per_length * (turned - F::new(3.0) * kappa * n)
}

/// The cotangent of the second derivative along an axis.
#[inline(always)]
pub(super) fn plain_bar<F: Element>(per_length: F, n: F) -> F {
    per_length * (F::new(1.0) - n * n)
}

/// The cotangent of the mixed derivative along two axes.
#[inline(always)]
pub(super) fn mixed_bar<F: Element>(per_length: F, n: F, m: F) -> F {
    F::new(-2.0) * per_length * n * m
}
