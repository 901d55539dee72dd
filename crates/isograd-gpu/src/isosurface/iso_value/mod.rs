//! The iso-value: the mean of the indicator at the samples, as [`isograd::isosurface::iso_value`].
//!
//! # Map
//! `c = Σ a_i χ(x_i) / Σ a_i`, with `χ` trilinear between cell centers and constant across the walls, and `a_i`
//! the area that sample `i` stands for. Sums are in the number type of the field, by a fixed tree.
//!
//! # Residual
//! The two sums, and `χ` and `∇χ` at every sample: the field itself need not be kept.
//!
//! # Pullback
//! With `w_i` the trilinear weights at `x_i` and `s_i = c̄ a_i / Σ a`: `χ̄ += s_i w_i`, `x̄_i += s_i ∇χ(x_i)`,
//! `ā_i += c̄ (χ(x_i) − c) / Σ a`. `χ̄` is a gather per cell over the samples in the order of the splat.
//!
//! # Not differentiable
//! `∇χ` jumps where a sample crosses a plane through cell centers; the gradient on its side is used.

mod forward;
mod pullback;

pub use forward::forward;
pub use pullback::pullback;

use crate::Buffer;

/// Residual of the pullback, besides the inputs.
#[derive(Clone, Debug)]
pub struct Residual<T> {
    /// `(2,)`: `Σ a_i χ(x_i)` and `Σ a_i`.
    pub sums: Buffer<T>,
    /// `(N, 4)`: `χ(x_i)` and `∇χ(x_i)`, per cell, in input order.
    pub at_samples: Buffer<T>,
}
