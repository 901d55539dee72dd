//! The iso-value as a field: what the indicator is at the samples near by, instead of at all of them.
//!
//! # Map
//! `χ` rises through the surface as a step that the grid has smoothed. Where the surface is curved, thin or
//! sharp, where samples are uneven, and with its place between cell centers, the value of `χ` on it is a little
//! off the mean `c`. The samples know by how much. With `r_i = χ(x_i) + δ_i − c`, trilinear between cell centers,
//! `â_i` the area of a sample in cells², `B` the product of quadratic B-splines, and `ω_i` from 0 to 1 and `δ_i` as
//! below, every cell center `o` within reach of a sample gets
//!
//! `e_o = Σ_i â_i B_o(x_i) ω_i r_i / D_o`, `D_o = ε + Σ_i â_i B_o(x_i)`, and `χ_o ← χ_o − λ e_o`,
//!
//! a few times over, each time with the `r_i` that are left. Then `χ = c − δ` at the samples, for the linear
//! interpolation that places the vertices too. It is the local part of the screened equation (Kazhdan and
//! Hoppe, *Screened Poisson surface reconstruction*, ACM TOG 2013), as a few weighted means: no further solve.
//!
//! **Samples that are off the surface** must not be followed. Two tests see them, and set the gain `λ`:
//! - does `p`, which is `e` at a sample, found without that sample, foretell `s = ω r`? `λ` is the coefficient of the
//!   linear fit of `s` by it, from 0 to 1: 0 for noise that has nothing to do with that of its neighbors;
//! - does `e` rise across the surface, `ρ = Σ â w u / Σ â u²`, with the slopes `w` of `e` and `u` of `χ` along the
//!   normals? What samples on one surface say does not, but samples scattered over a layer as thick as a cell would
//!   flatten `χ`. `ρ s` is taken off the forecast, and `λ` falls to 0 where the passes together would take half of the
//!   slope.
//!
//! Slopes are those of quadratic B-splines, which have no seams between cells.
//!
//! **Thin parts** hardly show in `χ`: the steps of their two faces cancel. A plate of thickness `t` has on its faces
//! the share `q = 1 − exp(−t²/2w²)` of the slope `U` of a thick body, with `w` the width of the step; `U` is the root
//! mean square of `u` over the samples, and so `t` is known. Lattice points miss what is thinner than a cell: a surface
//! that follows it is full of holes, and jumps when anything moves. `ω_i` rises from 0 to 1 for `t` from 1 to 2.2 cells,
//! and `δ = 0`. [`Level::Thin`](super::Level::Thin) has the rise from 0.1 to 0.3 cells, and makes thicker what is left:
//! `δ_i = U t (exp(−t²/8w²) − exp(−1/8w²))`, if that is more than 0, is how much `χ` rises from the face to where that
//! of a plate of one cell would be.
//!
//! # Residual
//! `ω_i`; of each pass the sums that `λ` is made of, `s_i` and `u_i`. The sums over cells are computed again, and with
//! them `χ` as it was.
//!
//! # Pullback
//! Given `χ̄` of what came out; `T_o(x)` are the trilinear weights, `Ē = −χ̄`, `M_o = D_o e_o`. Backwards through the
//! passes, from `r̄ = ū = 0`, with the cotangents of `ρ`, of the fit and of the five sums from
//! `λ̄ = Σ Ē_o e_o − Σ r̄_i m_i − Σ ū_i w_i` (`gain`), where `m = (Te)(x)`, `v_o = (M_o − â B_o s)/(D_o − â B_o)` is what
//! a cell says without the sample and `p = Σ T_o v_o`:
//! ```text
//! m̄ = −λ r̄          w̄ = −λ ū + …          p̄ = …          y_o = T_o p̄ / (D_o − â B_o)
//! ē_o = λ Ē_o + Σ_i (T_o m̄ + n·∇B_o w̄)    M̄_o = ē_o / D_o + Σ_i y_o    D̄_o = −e_o ē_o / D_o − Σ_i y_o v_o
//! B̄_o = s M̄_o + D̄_o + y_o (v_o − s)        s̄ = … + â Σ_o B_o M̄_o − â Σ_o B_o y_o
//! x̂̄ += m̄ ∇Te + p̄ Σ_o v_o ∇T_o + w̄ ∇(n·∇e) + â Σ_o ∇B_o B̄_o
//! n̄ += w̄ ∇e          â̄ += … + Σ_o B_o B̄_o          r̄ += ω s̄          ω̄ += r s̄
//! ```
//! where dots are what the sums add. In the end `r̄_i` is the cotangent of `χ(x_i)` and of `δ_i`, and `c̄ −= Σ r̄_i`; `ω̄`
//! and `δ̄` become parts of `ū` and, by `U`, of `â̄` (`trust`); and of `ū`, `n̄ += ū ∇χ`, `x̂̄ += ū ∇(n·∇χ)` and
//! `χ̄_o += Σ_i ū_i n_i·∇B_o`. `χ̄` of what went in is that of what came out, with this and what
//! [`iso_value::pullback`](super::iso_value::pullback) adds for `r̄`. `σ̄` is that of the width of the step.
//!
//! # Not differentiable
//! `∇(Te)` jumps where a sample crosses a plane through cell centers, `∇(n·∇χ)` and `∇(n·∇e)` where it crosses a face
//! of a cell. `λ` has kinks where the fit is 1, where `ρ` or `λ`
//! is 0.

mod blocks;
mod forward;
mod gain;
mod pull_cells;
mod pullback;
mod stencil;
#[cfg(test)]
mod tests;
mod trust;

pub use forward::{Choice, Scratch, forward};
pub use gain::Sums;
pub use pullback::{Found, PullbackScratch, pullback};
pub use trust::{STEEPEST, Step};

/// Passes; fewer where the samples say no more. The third takes the missed part of a thin trailing edge from
/// 0.05 to 0.03 cells in the mean, a fourth to 0.029.
pub const PASSES: usize = 3;

/// Thicknesses, in cells, between which `ω` goes from 0 to 1. Less than a cell here follows more of a thin wing, but
/// the derivative of a fish whose tail ends in an edge then goes up and down within a cell, by 6 to 27 %. So it does, by 8 %,
/// if `ω` is 1 at 1.6 cells already: it then changes so fast that its own derivative does it.
const FOLLOWED: [f64; 2] = [1.0, 2.2];

/// The same for thin parts: below, the dip of `χ` is no larger than its noise.
const FOLLOWED_THIN: [f64; 2] = [0.1, 0.3];

/// What is thinner, in cells, is made that thick: lattice points are in it wherever it lies.
pub const LEAST_THICKNESS: f64 = 1.0;

/// Share of the slope of `χ` that the passes together stay below.
const FLATTENED: f64 = 0.5;

/// What the pullback needs besides the inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residual<T> {
    /// `(N,)` `ω_i`.
    trust: Vec<T>,
    step: Step,
    /// `Σ â_i`.
    area: f64,
    passes: Vec<Pass<T>>,
}

/// One pass.
#[derive(Clone, Debug, Default, PartialEq)]
struct Pass<T> {
    /// `λ`.
    gain: f64,
    sums: Sums,
    /// Share of the slope of `χ` that was gone before it.
    flattened: f64,
    /// `(N,)` `s_i` before it.
    offsets: Vec<T>,
    /// `(N,)` `u_i` before it.
    slopes: Vec<T>,
}

impl<T: crate::Real> Residual<T> {
    /// `λ` of each pass that was made; none where the samples were not followed.
    pub fn gains(&self) -> impl Iterator<Item = f64> + '_ {
        self.passes.iter().map(|pass| pass.gain)
    }

    /// Bytes that are kept.
    pub fn bytes(&self) -> usize {
        let of_pass = |pass: &Pass<T>| [&pass.offsets, &pass.slopes].map(|v| size_of_val(&v[..]));
        let passes = self.passes.iter().flat_map(of_pass);
        passes.sum::<usize>() + size_of_val(&self.trust[..])
    }

    /// `u_i` before the first pass, made or not.
    fn slopes(&mut self) -> &mut Vec<T> {
        if self.passes.is_empty() {
            self.passes.push(Pass::default());
        }
        &mut self.passes[0].slopes
    }
}
