//! The local iso-value: corrects the indicator near the samples, so that the surface is at one global value.
//!
//! # Map
//! `χ` rises through the surface as a step that the grid has smoothed. Where the surface is curved, thin or
//! sharp, where samples are uneven, and depending on its position between cell centers, the value of `χ` on it
//! differs a little from the mean `c`. The samples measure the difference. Let `r_i = χ(x_i) + δ_i − c`, trilinear
//! between cell centers (where the indicator is refined, by `B`), `â_i` the area of a sample in cells², `B` the product
//! of quadratic B-splines, and the trust `ω_i` (0 to 1) and the shift `δ_i` as below. A pass takes at every cell center `o` within reach of a sample the mean
//! of the offsets `s_i = ω_i r_i`,
//!
//! `e_o = Σ_i â_i B_o(x_i) s_i / D_o`, `D_o = ε + Σ_i â_i B_o(x_i)`, and subtracts it: `χ_o ← χ_o − λ e_o`.
//!
//! After at most [`PASSES`] passes, each with the `r_i` that remain, `χ = c − δ` at the samples, for the same
//! interpolation that places the vertices. It is the local part of the screened equation (Kazhdan and
//! Hoppe, *Screened Poisson surface reconstruction*, ACM TOG 2013), as a few weighted means without another solve.
//!
//! **Samples off the surface** must not be followed. Two tests detect them and set the gain `λ`:
//! - Leave one out: does `p`, the mean `e` at a sample computed without that sample, predict its own offset `s`?
//!   `λ` is the coefficient of the linear fit of `s` by `p`, from 0 to 1. It is 0 for noise that is independent from
//!   sample to sample.
//! - Flattening: does `e` rise across the surface? With `w` and `u` the slopes of `e` and `χ` along the normals,
//!   `ρ = Σ â w u / Σ â u²` is 0 for samples on one surface; samples scattered over a layer as thick as a cell would
//!   flatten `χ`. `ρ s` is subtracted from the prediction, and `λ` falls to 0 where the passes together would remove
//!   half of the slope.
//!
//! Slopes are those of quadratic B-splines, which have no seams between cells.
//!
//! **Samples that scatter** still have offsets in common: on a thin wing, or along an edge, `χ` is off in the same sense at all
//! of them. A last pass, the [`coarse`] one, takes the means `e'` of the offsets that remain on cells [`coarse::CELLS`] times
//! as large, gives each sample `s'_i = γ λ' e'(x_i)`, and takes at every cell center the mean of these, with gain 1. Here too
//! `λ'` is the coefficient of the fit of offsets by predictions that leave one sample out. The share `γ` is 1 for a gain
//! of the first pass up to ¼ and falls to 0 at ¾, so that samples of a surface, whose gain is above 0.95, are not touched. Without
//! it a wing of the size of the noise loses its trailing edge.
//!
//! **Thin parts** hardly show in `χ`: the steps of their two faces cancel. On the faces of a plate of thickness `t`
//! the slope is `q = 1 − exp(−t²/2w²)` of the slope `U` at a thick body, with `w` the width of the step; `U` is
//! estimated as the root mean square of `u` over the samples, which gives `t`. Lattice points miss what is thinner than
//! a cell: a surface that follows it is full of holes, and jumps when anything moves. `ω_i` therefore rises from 0 to 1
//! for `t` from 1 to 2.2 cells, and `δ = 0`. [`Level::Thin`](super::Level::Thin) has the rise from 0.1 to 0.3 cells, and
//! thickens the rest: `δ_i = U t (exp(−t²/8w²) − exp(−1/8w²))`, if positive, is the rise of `χ` from the face to where
//! the face of a plate of one cell would be.
//!
//! # Residual
//! `ω_i`; of each pass `s_i`, `u_i`, `λ` and the sums that determine it; of the coarse one also `γ`. The pullback computes the
//! sums over cells again, and from them the `χ` before the passes.
//!
//! # Pullback
//! Let `χ̄` be the cotangent of the result, `T_o(x)` the trilinear weights, `Ē = −χ̄`, `M_o = D_o e_o`. The passes run
//! in reverse, from `r̄ = ū = 0`. `λ̄ = Σ Ē_o e_o − Σ r̄_i m_i − Σ ū_i w_i` yields the cotangents of `ρ`, of the fit
//! and of its five sums (`gain`). With `m = (Te)(x)`, `v_o = (M_o − â B_o s)/(D_o − â B_o)` the mean of a cell without
//! the sample, and `p = Σ T_o v_o`:
//! ```text
//! m̄ = −λ r̄          w̄ = −λ ū + …          p̄ = …          y_o = T_o p̄ / (D_o − â B_o)
//! ē_o = λ Ē_o + Σ_i (T_o m̄ + n·∇B_o w̄)    M̄_o = ē_o / D_o + Σ_i y_o    D̄_o = −e_o ē_o / D_o − Σ_i y_o v_o
//! B̄_o = s M̄_o + D̄_o + y_o (v_o − s)        s̄ = … + â Σ_o B_o M̄_o − â Σ_o B_o y_o
//! x̂̄ += m̄ ∇Te + p̄ Σ_o v_o ∇T_o + w̄ ∇(n·∇e) + â Σ_o ∇B_o B̄_o
//! n̄ += w̄ ∇e          â̄ += … + Σ_o B_o B̄_o          r̄ += ω s̄          ω̄ += r s̄
//! ```
//! where dots stand for the terms of the sums. The coarse pass uses these lines on both grids, with
//! `s̄' = Σ_o â B_o Ē_o/D_o`, `m̄ = γ λ' s̄'`, and `λ̄ −= 2 λ' Σ s̄' e'(x)` of the first pass where `γ` falls. At the end
//! `r̄_i` is the cotangent of `χ(x_i)` and of `δ_i`, and
//! `c̄ −= Σ r̄_i`; `ω̄` and `δ̄` become parts of `ū` and, through `U`, of `â̄` (`trust`); from `ū` follow
//! `n̄ += ū ∇χ`, `x̂̄ += ū ∇(n·∇χ)` and `χ̄_o += Σ_i ū_i n_i·∇B_o`. The cotangent of the input `χ` is that of the
//! result plus this term, plus the term that [`iso_value::pullback`](super::iso_value::pullback) adds for `r̄`. `σ̄`
//! follows from the width of the step.
//!
//! # Not differentiable
//! `∇(Te)` jumps where a sample crosses a plane through cell centers, `∇(n·∇χ)` and `∇(n·∇e)` where it crosses a face
//! of a cell. `λ` has kinks where the fit is 1, and where `ρ` or `λ` is 0; `γ` where it begins and ends to fall.

pub mod coarse;
mod forward;
mod gain;
mod layer;
mod means;
mod pull_means;
mod pullback;
mod stencil;
mod step;
#[cfg(test)]
mod tests;
mod trust;

pub(crate) use forward::forward_on;
pub use forward::{Options, Scratch, forward};
pub use gain::Sums;
pub(crate) use pullback::pullback_on;
pub use pullback::{Cotangent, PullbackScratch, pullback};
pub(in crate::isosurface) use stencil::Stencil;
pub use step::{STEEPEST, Step};

use super::Interpolation;

/// Most passes; fewer where the gain falls to 0. The third takes the missed part of a thin trailing edge from
/// 0.05 to 0.03 cells in the mean, a fourth to 0.029.
pub const PASSES: usize = 3;

/// Thicknesses, in cells, between which `ω` rises from 0 to 1. A lower start follows more of a thin wing, but
/// the derivative of a fish whose tail ends in an edge then varies within a cell, by 6 to 27 %. It also varies, by 8 %,
/// if `ω` reaches 1 at 1.6 cells: the derivative of so steep a rise dominates.
const FOLLOWED: [f64; 2] = [1.0, 2.2];

/// [`FOLLOWED`] for thin parts: below, the dip of `χ` is no larger than its noise.
const FOLLOWED_THIN: [f64; 2] = [0.1, 0.3];

/// Thickness in cells that thinner parts are given: lattice points lie inside wherever the part is.
pub const LEAST_THICKNESS: f64 = 1.0;

/// Share of the slope of `χ` that the passes together stay below.
const FLATTENED: f64 = 0.5;

/// Values that the pullback needs besides the inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual<T> {
    /// Whether areas count in cells², as in [`Options::area`].
    area: bool,
    interpolation: Interpolation,
    /// `(N,)` `ω_i`.
    trust: Vec<T>,
    step: Step,
    /// `Σ â_i`.
    total_area: f64,
    passes: Vec<Pass<T>>,
    coarse: Option<coarse::Coarse<T>>,
}

/// State of one pass.
#[derive(Clone, Debug, Default, PartialEq)]
struct Pass<T> {
    /// `λ`.
    gain: f64,
    sums: Sums,
    /// Share of the slope of `χ` removed by the passes before.
    flattened: f64,
    /// `(N,)` `s_i` at its start.
    offsets: Vec<T>,
    /// `(N,)` `u_i` at its start.
    slopes: Vec<T>,
}

impl<T> Residual<T> {
    /// All passes, the coarse one last.
    fn all_passes(&self) -> impl Iterator<Item = &Pass<T>> {
        let coarse = self.coarse.iter().map(|coarse| &coarse.pass);
        self.passes.iter().chain(coarse)
    }

    /// `(N,)` `u_i` before the first pass; there must be one.
    fn first_slopes(&self) -> &[T] {
        self.all_passes().next().map_or(&[], |pass| &pass.slopes)
    }
}

impl<T: crate::Real> Residual<T> {
    /// `λ` of each pass but the coarse one; none where the samples were not followed one by one.
    pub fn gains(&self) -> impl Iterator<Item = f64> + '_ {
        self.passes.iter().map(|pass| pass.gain)
    }

    /// `γ λ` of the coarse pass; 0 if there was none.
    pub fn coarse_gain(&self) -> f64 {
        self.coarse.as_ref().map_or(0.0, coarse::Coarse::gain)
    }

    /// Size in bytes.
    pub fn bytes(&self) -> usize {
        let of_pass = |pass: &Pass<T>| [&pass.offsets, &pass.slopes].map(|v| size_of_val(&v[..]));
        let passes = self.all_passes().flat_map(of_pass);
        passes.sum::<usize>() + size_of_val(&self.trust[..])
    }
}
