//! The iso-value as a field: what the indicator is at the samples near by, instead of at all of them.
//!
//! # Map
//! `χ` rises through the surface as a step that the grid has smoothed. Where the surface is curved, thin or
//! sharp, where samples are uneven, and with its place between cell centres, the value of `χ` on it is a little
//! off the mean `c`. The samples know by how much. With `r_i = χ(x_i) + δ_i − c`, trilinear between cell centres,
//! `â_i` the area of a sample in cells², `B` the product of quadratic B-splines, and `ω_i` from 0 to 1 and `δ_i` as
//! below, every cell centre `o` within reach of a sample gets
//!
//! `e_o = Σ_i â_i B_o(x_i) ω_i r_i / D_o`, `D_o = ε + Σ_i â_i B_o(x_i)`, and `χ_o ← χ_o − λ e_o`,
//!
//! a few times over, each time with the `r_i` that are left. Then `χ = c − δ` at the samples, for the linear
//! interpolation that places the vertices too. It is the local part of the screened equation (Kazhdan and
//! Hoppe, *Screened Poisson surface reconstruction*, ACM TOG 2013), as a few weighted means: no further solve.
//!
//! **Samples that are off the surface** must not be followed. Two tests see them, and set the gain `λ`:
//! - does `e` at a sample, found without that sample, foretell `r`? `λ` is the coefficient of the linear fit of
//!   `r` by it, from 0 to 1: 0 for noise that has nothing to do with that of its neighbours;
//! - does `e` rise across the surface, `ρ = Σ a ∇e·∇χ / Σ a |∇χ|²`? What samples on one surface say does not,
//!   but samples scattered over a layer as thick as a cell would flatten `χ`. `ρ r_i` is taken off the forecast,
//!   and `λ` falls to 0 where the passes together would take half of the slope.
//!
//! **Thin parts** hardly show in `χ`: the steps of their two faces cancel. A plate of thickness `t` has on its faces
//! the share `q = 1 − exp(−t²/2w²)` of the slope `s` of a thick body, with `w` the width of the step; `s` is the root
//! mean square over the samples of `n·∇χ`, which is taken with B-splines, and so `t` is known. Lattice points miss what
//! is thinner than a cell: a surface that follows it is full of holes, and jumps when anything moves. `ω_i` rises from
//! 0 to 1 for `t` from 1 to 1.6 cells, and `δ = 0`. [`Level::Thin`](super::Level::Thin) has the rise from 0.1 to 0.3
//! cells, and makes thicker what is left: `δ_i = s t (exp(−t²/8w²) − exp(−1/8w²))`, if that is more than 0, is how much
//! `χ` rises from the face to where that of a plate of one cell would be.
//!
//! # Residual
//! `ω_i`, `δ_i`, and of each pass `λ` and `ω_i r_i`. The sums over cells are computed again.
//!
//! # Pullback
//! Given `χ̄` of what came out; `T_o(x)` are the trilinear weights, and `Ē = −χ̄`. Backwards through the passes,
//! from `r̄ = 0`, with `e`, `D`, `r` those of the pass, and `s = ω r`:
//! ```text
//! ē_o = λ (Ē_o − Σ_i T_o(x_i) r̄_i)        R̄_o = ē_o / D_o        D̄_o = −R̄_o e_o
//! x̂̄_i −= λ r̄_i ∇(Te)(x_i)                  x̂̄_i += â_i Σ_o ∇B_o(x_i) (s_i R̄_o + D̄_o)
//! â̄_i += Σ_o B_o(x_i) (s_i R̄_o + D̄_o)      r̄_i += â_i ω_i Σ_o B_o(x_i) R̄_o
//! ```
//! In the end `r̄_i` is the cotangent of `χ(x_i)`, and `c̄ −= Σ r̄_i`; `χ̄` of what went in is that of what came
//! out, and what [`iso_value::pullback`](super::iso_value::pullback) adds to it for `r̄`.
//!
//! # Not differentiable
//! The gains `λ`, the trust `ω` and the shifts `δ`, which are held. `∇(Te)` jumps where a sample crosses a plane
//! through cell centres.

mod blocks;
mod forward;
mod pullback;
mod stencil;
#[cfg(test)]
mod tests;
mod trust;

pub use forward::{Choice, Scratch, forward};
pub use pullback::{PullbackScratch, pullback};

/// Passes; fewer where the samples say no more. The third takes the missed part of a thin trailing edge from
/// 0.05 to 0.03 cells in the mean, a fourth to 0.029.
const PASSES: usize = 3;

/// `ε`: the area of samples, in cells², whose word counts half.
const LEAST_AREA: f64 = 0.05;

/// Thicknesses, in cells, between which `ω` goes from 0 to 1. Less than a cell here follows more of a thin wing, but
/// the derivative of a fish whose tail ends in an edge then goes up and down within a cell, by 6 to 27 %.
const FOLLOWED: [f64; 2] = [1.0, 1.6];

/// The same for thin parts: below, the dip of `χ` is no larger than its noise.
const FOLLOWED_THIN: [f64; 2] = [0.1, 0.3];

/// What is thinner, in cells, is made that thick: lattice points are in it wherever it lies.
const LEAST_THICKNESS: f64 = 1.0;

/// Share of the slope of `χ` that the passes together stay below.
const FLATTENED: f64 = 0.5;

/// What the pullback needs besides the inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual<T> {
    /// `(N,)` `ω_i`.
    trust: Vec<T>,
    /// `(N,)` `δ_i`; empty where all are 0.
    shifts: Vec<T>,
    passes: Vec<Pass<T>>,
}

/// One pass.
#[derive(Clone, Debug, Default, PartialEq)]
struct Pass<T> {
    /// `λ`.
    gain: T,
    /// `(N,)` `ω_i r_i` before it.
    offsets: Vec<T>,
}

impl<T: crate::Real> Residual<T> {
    /// `λ` of each pass that was made; none where the samples were not followed.
    pub fn gains(&self) -> impl Iterator<Item = f64> + '_ {
        self.passes.iter().map(|pass| pass.gain.f64())
    }

    /// Bytes that are kept.
    pub fn bytes(&self) -> usize {
        let passes = self.passes.iter();
        let offsets = passes.map(|pass| size_of_val(pass.offsets.as_slice()));
        offsets.sum::<usize>()
            + size_of_val(self.trust.as_slice())
            + size_of_val(self.shifts.as_slice())
    }

    /// `ω_i`.
    #[inline(always)]
    fn trust(&self, i: usize) -> T {
        self.trust.get(i).copied().unwrap_or(T::zero())
    }

    /// `δ_i`.
    #[inline(always)]
    fn shift(&self, i: usize) -> T {
        self.shifts.get(i).copied().unwrap_or(T::zero())
    }
}
