//! Outward normals from quadrics fitted to the samples of one side.
//!
//! The plane of [`normals`](crate::normals) is that of all samples within a radius, of which a part three spacings thick has
//! two sides, and of which an edge, a tip or a tube has more. Once it is known which way is out, the samples of the other
//! side can be left out, and what is left may be curved: a quadric follows it where a plane does not.
//!
//! # Map
//! Neighborhoods and outward unit normals `n_i` → refined outward unit normals, `(N, 3)`. With `d_j = (x_j − x_i)/R_i`,
//! tangents `t`, `b = n_i × t`, and `x = t·d_j`, `y = b·d_j`, `z = n_i·d_j`, `u = (1, x, y)`, `v = (x², xy, y²)`:
//! ```text
//! w_j = w(r_j) max(0, n_i·n_j)
//! p   = argmin Σ w_j (z_j − p·(u_j, v_j))² + ρ W pᵀ D p,   W = Σ w_j,   ρ = 3·10⁻⁴
//! S₂  = (Σ w_j z_j² − p·Σ w_j z_j (u_j, v_j))/W,   S₀ = Σ w_j z_j²/W − (Σ w_j z_j/W)²
//! σ   = 1 up to (S₂ + f)/(S₀ + f) = 0.4, falling to 0 at 0.7,   f = 10⁻⁵
//! n   ← n_i − σ (p_x t + p_y b), normalized
//! ```
//! `w` is the weight of [`normals`](crate::normals), `pᵀ D p` the squares of the slopes and curvatures, the same for all
//! tangents. So a normal changes only where the quadric explains most of how the samples of its side scatter about the plane
//! at hand: not where that is noise, of which six coefficients explain a part, nor where they lie in the plane.
//!
//! Source of the fit: F. Cazals, M. Pouget, "Estimating differential quantities using polynomial fitting of osculating jets"
//! (2005), for which neighborhoods hold one side. The weights by agreement and the share are ours. They apply with
//! [`Radius::Auto`](crate::neighbors::Radius::Auto); with a radius that was given, normals are those of the plane.
//!
//! # Residual
//! The normals before. The sums are found again by the pullback.
//!
//! # Pullback
//! With `s̄_x = −t·m̄`, `s̄_y = −b·m̄` for the cotangent `m̄` of the normal before it is normalized, `λ` the solution of the fit's
//! equations for `(0, σ s̄_x, σ s̄_y, 0, 0, 0)`, `e_j = z_j − p·(u_j, v_j)`, `l_j = λ·(u_j, v_j)` and `S̄₂`, `S̄₀` through `σ`:
//! ```text
//! w̄_j = e_j l_j + S̄₂ e_j²/W + S̄₀ (z_j − z̄)²/W − κ,   κ = ρ λᵀ D p + S̄₂ (S₂ − ρ pᵀ D p)/W + S̄₀ S₀/W
//! z̄_j = w_j (l_j + 2 S̄₂ e_j/W + 2 S̄₀ (z_j − z̄)/W)
//! (ū_j, v̄_j) = w_j (e_j λ − (l_j + 2 S̄₂ e_j/W) p)
//! ```
//! from where they go to the offsets, and through the agreement and the tilt of the tangents to the normals before.
//! [`pullback`] gathers: over the neighborhood of a sample, and over all that it belongs to.
//!
//! # Not differentiable
//! Where `n_i·n_j = 0`, and at both ends of the fall of `σ`: there derivatives have a step, but no value has.

mod forward;
mod pullback;
#[cfg(test)]
mod tests;

pub use forward::{Scratch, forward};
pub use pullback::{PullbackScratch, pullback};

/// `(S₂ + f)/(S₀ + f)` up to which all of the slope is taken, and from which nothing is.
pub const GAIN: [f64; 2] = [0.4, 0.7];
