//! Linear fit of sample values at a vertex, and its pullback, in the notation of `isograd::distance::extend`. Most vectors are
//! passed by component.

#[cfg(cube)]
use cubecl::prelude::*;

use super::Element;
use super::vector3::Vector3;

/// `ε₀ = 1e-5`: share of the trace of `C` below which a direction counts as noise.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn noise<F: Element>() -> F {
    F::new(1.0) / F::new(100_000.0)
}

/// `ε₁ = 1/256`: decay of the slope with the distance of a vertex from its samples. It has halved, in the mean
/// direction, where `|m|² = 16 tr C · √(1/3)`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn fading<F: Element>() -> F {
    F::new(1.0) / F::new(256.0)
}

/// `1 − q` inside the radius, else 0, where `q = r²/R²`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn rest<F: Element>(q: F) -> F {
    let mut rest = F::new(1.0) - q;
    if rest < F::new(0.0) {
        rest = F::new(0.0);
    }
    rest
}

/// `K`: `(1 − q)²` inside the radius, else 0.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn kernel<F: Element>(q: F) -> F {
    let rest = rest::<F>(q);
    rest * rest
}

/// `ε = tr C (ε₀ + ε₁ τ²)`, the ridge of the fit.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn ridge<F: Element>(trace: F, tau: F) -> F {
    trace * (noise::<F>() + fading::<F>() * tau * tau)
}

/// `(g·s) 4 ε₁ τ`: factor of `m` in the pullback of `ε`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn ridge_of_mean<F: Element>(tau: F, along: F) -> F {
    F::new(4.0) * fading::<F>() * tau * along
}

/// `(g·s) (ε₀ − ε₁ τ²)`: factor of `e_j` in the pullback of `ε`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn ridge_of_offset<F: Element>(tau: F, along: F) -> F {
    (noise::<F>() - fading::<F>() * tau * tau) * along
}

/// `L D Lᵀ`, a symmetric positive definite matrix.
#[cfg_attr(cube, derive(CubeType))]
#[derive(Clone, Copy, Debug)]
pub struct Factors<F: Element> {
    /// Entry `yx` of `L`.
    pub yx: F,
    /// Entry `zx` of `L`.
    pub zx: F,
    /// Entry `zy` of `L`.
    pub zy: F,
    /// First entry of `D`.
    pub x: F,
    /// Second entry of `D`.
    pub y: F,
    /// Third entry of `D`.
    pub z: F,
}

/// `L D Lᵀ` factors of a symmetric positive definite matrix.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn factors<F: Element>(xx: F, yy: F, zz: F, yz: F, xz: F, xy: F) -> Factors<F> {
    let yx = xy / xx;
    let zx = xz / xx;
    let y = yy - yx * xy;
    let zy = (yz - zx * xy) / y;
    let z = zz - zx * xz - zy * zy * y;
    Factors::<F> {
        yx,
        zx,
        zy,
        x: xx,
        y,
        z,
    }
}

/// The solution of `L D Lᵀ x = b`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn solved<F: Element>(of: Factors<F>, b: Vector3<F>) -> Vector3<F> {
    let lower = b.y - of.yx * b.x;
    let z = (b.z - of.zx * b.x - of.zy * lower) / of.z;
    let y = (b.y - of.yx * b.x) / of.y - of.zy * z;
    Vector3::<F>::of(b.x / of.x - of.yx * y - of.zx * z, y, z)
}

/// `D_j` from `ρ_j`, `t_j`, `|e_j|²`, `m·e_j` and the factors of the ridge.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn pull<F: Element>(rho: F, t: F, ee: F, me: F, of_offset: F, of_mean: F) -> F {
    rho * t + of_offset * ee + of_mean * me
}

/// Term of `d̄_j` through the ridge, over `p_j`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn ridge_bar<F: Element>(m: F, of_mean: F, e: F, of_offset: F) -> F {
    m * of_mean + e * (F::new(2.0) * of_offset)
}

/// Term of `d̄_j` through the fit, the ridge included, over `p_j`.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn fit_bar<F: Element>(g: F, t: F, s: F, rho: F, of_ridge: F) -> F {
    g * -t + s * -rho + of_ridge
}

/// `−4 w̄_j (a_j + a₀)(1 − q)`: factor of `d_j` in the term of `d̄_j` through the weight.
#[cfg_attr(cube, cube)]
#[inline(always)]
pub fn radial<F: Element>(weight_bar: F, area: F, rest: F) -> F {
    F::new(-4.0) * weight_bar * area * rest
}
