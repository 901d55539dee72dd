//! The screened Poisson equation: the indicator is attracted to one value at the samples.
//!
//! # Map
//! `x₀ → χ`, where `x₀` is the solution of the plain equation `A x₀ = b`. `χ` minimizes
//! `½ χᵀAχ − bᵀχ + ½ α Σ_i â_i (χ(x_i) − c)²` over `χ` and `c` (Kazhdan and Hoppe, *Screened Poisson surface
//! reconstruction*, ACM TOG 2013, eq. 4, with samples that count by their area and a level that is free), with
//! `χ(x_i)` trilinear between cell centers and `â_i` the area of a sample in cells². With `S` the rows
//! `√â_i w_iᵀ`, `A⁺` the [direct solve](super::Plan::solve), `d = S 1` and `P = I − d dᵀ/dᵀd`:
//!
//! `χ = x₀ − α A⁺ Sᵀ u`, `P (I + α S A⁺ Sᵀ) P u = P S x₀`, and then `u_i = √â_i (χ(x_i) − c)`.
//!
//! The system has one row for each sample, not for each cell. It is symmetric and positive, its least eigenvalue
//! is 1, and conjugate gradients solve it with one direct solve for each iteration: the same iterates as
//! conjugate gradients over the cells that the direct solve preconditions, with a single field of memory.
//! They end at a residual of `ε^0.7`, relative to the right-hand side, of the number type: `1e-11` in `f64`, and
//! `1e-5` in `f32`.
//!
//! # Residual
//! `χ` and `∇χ` at the samples, and `c`: the residual of the [iso-value](crate::isosurface::iso_value).
//!
//! # Pullback
//! The adjoint of a solve is a solve. With `v` from `P (I + α S A⁺ Sᵀ) P v = −α P S A⁺ χ̄`, `x̄₀ = χ̄ + Sᵀv` and the
//! adjoint field `Λ = A⁺ x̄₀` less its mean `Σ â Λ / Σ â` at the samples, the derivative of the matrix gives
//! ```text
//! x̂̄_i −= α â_i [ Λ(x_i) ∇χ(x_i) + (χ(x_i) − c) ∇Λ(x_i) ]        â̄_i −= α Λ(x_i) (χ(x_i) − c)
//! ```
//! The smoothing of `x₀ = χ + α A⁺ Sᵀ u` has the cotangent that [`smoothing`](super::smoothing) finds for `x₀`. As it is linear
//! in that, [`smoothing_pullback`] adds the part of `α A⁺ Sᵀ u` to that of `χ`.
//!
//! # Not differentiable
//! `∇χ` jumps where a sample crosses a plane through cell centers. `α` is held.

mod forward;
mod pullback;
#[cfg(test)]
mod tests;

pub use forward::{Scratch, forward};
pub use pullback::{pullback, smoothing_pullback};

use super::Plan;
use crate::splat::SortedSamples;
use crate::{Grid, Real};

/// Limit of iterations. At `α = 4` some 30 are needed, and their number grows with `√α`.
pub const MOST_ITERATIONS: usize = 2000;

/// Operator of the screened equation.
#[derive(Clone, Copy)]
pub struct Equation<'a, T: Real> {
    /// The direct solve.
    pub plan: &'a Plan<T>,
    /// Its grid.
    pub grid: &'a Grid<T>,
    /// Samples; their normals are not used.
    pub samples: SortedSamples<'a, T>,
    /// Whether areas count in cells², or each sample as 1.
    pub area: bool,
    /// `α`: 0 or more.
    pub screening: f64,
}

/// Errors of the screened equation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The direct solve failed.
    #[error(transparent)]
    Poisson(#[from] super::Error),
    /// Conjugate gradients did not converge.
    #[error(
        "the screened equation did not converge: relative residual {residual:e} after {iterations} iterations; use less screening, or f64"
    )]
    NotConverged {
        /// Number of iterations.
        iterations: usize,
        /// Residual relative to the right-hand side.
        residual: f64,
    },
}

impl<T: Real> Equation<'_, T> {
    /// `â_i`.
    #[inline(always)]
    fn area_of(&self, i: usize) -> T {
        self.samples.samples.area_in_cells(self.grid, self.area, i)
    }
}
