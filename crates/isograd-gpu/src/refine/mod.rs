//! Outward normals from quadrics fitted to the samples of one side. What it computes, and why, is on the page of
//! [`isograd::refine`].
//!
//! # Map
//! [`Neighborhoods`] with the samples' own radii, and outward unit normals `(N, 3)` → refined
//! ones `(N, 3)`, in input order.
//!
//! # Residual
//! [`Residual`]: the neighborhoods and the normals before. Sums are found again.
//!
//! # Pullback
//! That of [`isograd::refine`]. One walk over the tree gathers the cotangents of a point and of its normal both as a neighbor
//! of others and as a center. No atomics.
//!
//! # Not differentiable
//! As on the CPU.

mod forward;
mod pullback;

pub use forward::forward;
pub use pullback::pullback;

use crate::Buffer;
use crate::neighbors::Neighborhoods;

/// Residual of [`forward`].
#[derive(Clone, Debug)]
pub struct Residual<T> {
    near: Neighborhoods<T>,
    /// `(N, 3)` outward unit normals before they were refined, in input order.
    pub before: Buffer<T>,
}
