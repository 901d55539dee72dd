//! Signed distance to a triangle mesh: at every cell center of a grid, and at any point.
//!
//! # Map
//! Mesh and signs → `φ(q) = σ(q) · min_y |q − y|` over all points `y` of the mesh, in the user's unit, negative
//! inside. [`lattice::forward`] fills a grid: the distance is exact, faces, edges and corners alike, and the
//! sign is that of `χ − c` at the same cell, so it cannot disagree with the field that made the mesh.
//! [`lattice::forward_of_mesh`] does so for any mesh: there the sign is that of the winding number.
//! [`Query`] computes distance, gradient and closest point at any point; where no lattice gives the sign, it
//! is that of the angle-weighted pseudonormal of the closest feature (J. A. Bærentzen and H. Aanæs, *Signed
//! distance computation using the angle weighted pseudonormal*, IEEE TVCG 11, 2005).
//!
//! # Residual
//! The closest face of every cell or point. The barycentric weights `β` of the closest point follow from it by
//! [`triangle::closest_point`].
//!
//! # Pullback
//! [`lattice::pullback`] on a grid, [`pull_hits`] at points. By the envelope theorem, with `β` held constant:
//! `ȳ_k += −β_k φ̄ ∇φ` for the corners `y_k` of the closest face, `q̄ += φ̄ ∇φ` for the point, with `∇φ = σ (q − y)/|q − y|`, or the normal of
//! the face at distance 0.
//!
//! The closest point itself is `p = Σ β_k y_k`. With the corners of the feature that holds it, `E`, `γ` and `o` as
//! in [`extend`] and `δ_k = p̄·(y_k − y_0)`: `q̄ += G`, `ȳ_k += β_k (p̄ − G) + γ_k o`; `G = E γ` is the part of `p̄` in
//! the plane of the face, or along the edge.
//!
//! # Not differentiable
//! On the medial axis, where the closest point jumps, and on the mesh itself at its edges and corners. The sign
//! is discrete.

mod bvh;
mod concrete;
pub mod extend;
pub mod interpolate;
mod lanes;
pub mod lattice;
mod pseudonormals;
mod query;
mod query_pullback;
pub(crate) mod samples;
mod tangent;
pub mod triangle;
mod winding;

#[cfg(test)]
mod tests;

pub use concrete::Distance;
pub use lattice::{Band, NO_TRIANGLE, Scratch, Sign};
pub use query::{Hit, Query};
pub(crate) use query::{cell_agrees, corners_agree, hits_within};
pub use query_pullback::pull_hits;

/// Errors of the distance stage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// The mesh has no triangle.
    #[error(
        "the mesh has no triangle, so there is no distance to it; check that the surface crosses the grid"
    )]
    Empty,
    /// Squares of the lengths are out of the range of double precision.
    #[error(
        "coordinates up to {magnitude:e} and an extent of {extent:e} cannot be squared in f64; use another unit of length"
    )]
    Range {
        /// The largest absolute coordinate.
        magnitude: f64,
        /// The longest side of the bounding box.
        extent: f64,
    },
    /// Arguments of the pullback have different lengths.
    #[error(
        "{what} has {length} entries for {expected} points; give the points and hits of one query, and one cotangent a hit"
    )]
    Mismatch {
        /// The array.
        what: &'static str,
        /// Its length.
        length: usize,
        /// Number of points.
        expected: usize,
    },
    /// A hit names a face that does not exist.
    #[error("a hit names face {face}, which the mesh does not have; give the hits of this query")]
    Face {
        /// The face.
        face: u32,
    },
    /// The width of the band is not a positive number.
    #[error(
        "the band has a width of {width}; give a positive, finite length in the unit of the points, or use the full field"
    )]
    Band {
        /// Distance from the surface to the end of the band.
        width: f64,
    },
}
