//! The axis of the surface at every sample: distance-weighted principal components (D-PCA).
//!
//! # Map
//! Points `(N, 3)` and their neighborhoods `N_i` → unit vectors `(N, 3)` along the surface normal,
//! after the paper's section on normal estimation. With `d_j = x_j − x_i`, `r_j = |d_j|`,
//! `t_j = min(1, 5 (1 − r_j/R_i))` and `w_j = t_j² (3 − 2 t_j)/(r_j + ε)`,
//! `W = Σ w_j`, `m = Σ w_j d_j / W`, `C = Σ w_j d_j d_jᵀ / W − m mᵀ`,
//! and the normal `n = v₁` is the eigenvector of `C` for its smallest eigenvalue, `λ₁ ≤ λ₂ ≤ λ₃`. All is
//! relative to `x_i`, so a cloud far from the origin loses nothing. The sign of `n` is arbitrary, but
//! always the same: its component of largest magnitude is positive. Orientation is the next stage; then
//! [`refine`](crate::refine) leaves out the samples of the other side of thin parts.
//!
//! The paper's weight is `1/(r_j + ε)` up to `R_i`, where it ends with a jump, and a normal jumps where a sample enters or
//! leaves its neighborhood ([`Radius::Cut`](crate::neighbors::Radius::Cut) selects it). The factor makes the weight fall to
//! 0 over the last fifth of the radius.
//!
//! `ε = R_i/5`. The paper asks for a small constant; but a tiny one gives the sample itself nearly all of
//! the weight, so that its own noise tilts the plane. Mean error of the axes in degrees, 6000 uniform random
//! samples of a torus (24 neighbors) with noise along all axes, and of the faces of a cube:
//!
//! | `ε/R_i` | 10⁻⁶ | 10⁻³ | 0.01 | 0.1 | 0.3 | 1 | 10 |
//! |---|---|---|---|---|---|---|---|
//! | torus, no noise | 1.99 | 1.97 | 1.85 | 1.64 | 1.61 | 1.61 | 1.64 |
//! | torus, noise 0.05 R | 3.6 | 3.6 | 3.3 | 2.9 | 2.8 | 2.7 | 2.7 |
//! | torus, noise 0.2 R | 18.3 | 18.0 | 16.3 | 12.0 | 10.6 | 10.1 | 9.8 |
//! | cube, no noise | 5.76 | 5.75 | 5.65 | 5.52 | 5.55 | 5.63 | 5.71 |
//!
//! With the paper's weights up to the radius these are 1.75, 2.6, 9.0 and 6.06 at 0.3.
//!
//! Where samples scatter about their plane by a large part of the radius, from noise or because they lie on
//! both sides of a thin body, neighborhoods of up to `3.1 R_i` are tried, and the radius grows toward that of the first
//! that is far less rough than those before it ([`Residual::radius`]; a radius that the caller has given
//! stays). Mean error of the axes in degrees, with the same radius given and with the automatic one:
//!
//! | cloud | given | automatic |
//! |---|---|---|
//! | torus, noise of 0.25 / 0.5 / 1 % of its length, 30,000 samples | 5.1 / 13 / 32 | 2.4 / 2.5 / 4.8 |
//! | plate 1 / 1.5 / 2 spacings thick, 50,000 samples | 17 / 32 / 15 | 2.2 / 2.6 / 3.2 |
//! | knot, fish, airliner with noise of 0.5 % | 13 / 40 / 37 | 5.1 / 10 / 13 |
//! | the same without noise | 1.1 / 1.1 / 3.8 | 1.1 / 0.9 / 3.0 |
//!
//! The paper takes the vectors from a singular value decomposition of the weighted offsets instead, to
//! keep digits and gradients. Here `C` is formed relative to `x_i`, where its rounding tilts the axis by
//! a few units of rounding of the number type; it is solved in double precision, and the pullback is
//! written out, with its own guard.
//!
//! # Residual
//! [`Residual`]: per point `n`, `m`, `W`, the eigenvalues and the two tangents `v₂`, `v₃`.
//!
//! # Pullback
//! Given `n̄`, the cotangent of the normal (its part along `n` drops out):
//! ```text
//! g   = Σ_{k=2,3} v_k (v_k·n̄) / (λ₁ − λ_k)
//! B   = (g nᵀ + n gᵀ)/2
//! d̄_j = (2 w_j/W) B (d_j − m) + (w_j'/W) [(d_j − m)ᵀ B (d_j − m) − ⟨B, C⟩] d_j/r_j   (0 where r_j = 0)
//! x̄_j += d̄_j,   x̄_i −= Σ_j d̄_j,   R_i R̄_i = −Σ_j ⟨d̄_j, d_j⟩
//! ```
//! `⟨B, C⟩ = gᵀ C n = 0`, because `C n = λ₁ n` and `g` is normal to `n`. Both terms are gathered: over
//! `N_i`, and over all `i` with `j ∈ N_i`: [`pullback`]. Where `R_i` is wider than the point's own radius, its cotangent also
//! goes to the eigenvalues and centroids of the neighborhoods that were tried (`widen_pullback.rs`).
//!
//! # Not differentiable
//! The sign. Where `λ₂ − λ₁` is at most `10⁻³ λ₃` (a line, an isolated point, a corner as thick as it is wide) the axis itself is ill defined:
//! such a plane is marked [`Plane::guarded`], and the pullback bounds `1/(λ₁ − λ_k)` there.

#[cfg(test)]
mod continuity_tests;
mod forward;
mod pullback;
#[cfg(test)]
mod tests;
pub mod widen;
mod widen_pullback;
#[cfg(test)]
mod widen_tests;

pub(crate) use forward::EPSILON;
pub use forward::{forward, forward_with_neighborhoods};
pub use pullback::{Scratch, pullback};
pub use widen_pullback::radii_pullback;

use crate::neighbors::Found;

/// The local plane of one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plane<T> {
    /// `m`: weighted centroid of the neighborhood relative to the sample, in the unit of the points.
    pub centroid: [T; 3],
    /// `W`: sum of the weights, in one over the unit of the points.
    pub weight: T,
    /// `λ₁ ≤ λ₂ ≤ λ₃` of the weighted covariance, in the unit of the points squared; not negative.
    pub eigenvalues: [T; 3],
    /// `v₂` and `v₃`: unit vectors that make a right-handed basis with the normal before them.
    pub tangents: [[T; 3]; 2],
    /// Whether the gap `λ₂ − λ₁` is too small, relative to `λ₃`, for the normal to mean anything.
    pub guarded: bool,
}

/// The axes, and what their pullback needs; all `(N,)` in input order.
#[derive(Clone, Debug, Default)]
pub struct Residual<T> {
    /// Unit normals, each with its component of largest magnitude positive.
    pub normals: Vec<[T; 3]>,
    /// The radius within which each was found: `R_i`, or up to `3.1 R_i`.
    pub radius: Vec<T>,
    /// Number of samples within that radius, the point itself included.
    pub count: Vec<u32>,
    /// The plane around each point.
    pub planes: Vec<Plane<T>>,
    /// Moments in the order of the cells: scratch.
    sorted: Vec<Found<T, forward::Moments<T>>>,
}

impl<T> Residual<T> {
    /// Number of points whose normal is ill defined.
    pub fn guarded(&self) -> usize {
        self.planes.iter().filter(|plane| plane.guarded).count()
    }

    pub(crate) fn free_scratch(&mut self) {
        self.sorted = Vec::new();
    }

    /// Bytes of what the pullback needs, and of work space.
    pub(crate) fn bytes(&self) -> [usize; 2] {
        let needed = size_of_val(self.normals.as_slice())
            + size_of_val(self.radius.as_slice())
            + size_of_val(self.count.as_slice())
            + size_of_val(self.planes.as_slice());
        [needed, size_of_val(self.sorted.as_slice())]
    }

    /// Forgets all points, for a cloud whose normals are given; keeps the memory.
    pub fn clear(&mut self) {
        self.normals.clear();
        self.radius.clear();
        self.count.clear();
        self.planes.clear();
    }
}
