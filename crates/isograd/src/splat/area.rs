//! The area of surface that each sample stands for.
//!
//! # Map
//! Neighbourhoods → `a_i = 1 / Σ_{j∈N_i} K(r_j)` with `r_j = |x_j − x_i|` and
//! `K(r) = 3/(π R_i²) · (1 − r²/R_i²)²`, whose integral over the disk of radius `R_i` is 1: the sum is the
//! density of samples at `x_i`, in samples a unit of area. The paper has no such weight; without it the
//! reconstructed surface moves away from where samples are few. An isolated sample (an outlier, see
//! [`Neighborhoods::isolated`]) stands for no surface: `a_i = 0`. By the sum alone it would stand for
//! about the square of its distance to the surface, and one in a hundred would outweigh the surface.
//!
//! # Residual
//! The areas and the neighbourhoods themselves.
//!
//! # Pullback
//! Given `ā_i`, with `d_j = x_j − x_i`:
//! ```text
//! d̄_j = ā_i a_i² · 12/(π R_i⁴) · (1 − r_j²/R_i²) d_j
//! x̄_j += d̄_j,   x̄_i −= Σ_j d̄_j
//! ```
//! `K` and its derivative are 0 at the radius, so samples enter and leave smoothly.
//!
//! # Not differentiable
//! The radii and what is isolated, which are held constant.

use rayon::prelude::*;

use crate::Real;
use crate::neighbors::{Candidates, LANES, Lanes, Neighborhoods};

/// Buffers that are used again.
#[derive(Clone, Debug, Default)]
pub struct Scratch<T> {
    /// Areas in the order of the cells.
    sorted: Vec<T>,
}

/// Writes the `(N,)` areas `a_i`, in input order and the unit of the points squared; positive, and 0
/// for isolated samples.
///
/// They add up to the area of the surface where the sampling is even; for random samples the sum is
/// lower, by about `3/count` of it, for each sample counts itself.
pub fn forward<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    scratch: &mut Scratch<T>,
    areas: &mut Vec<T>,
) {
    let arch = pulp::Arch::new();
    scratch.sorted.resize(neighborhoods.index.len(), T::zero());
    neighborhoods.for_each_neighborhood(&mut scratch.sorted, &|center, radius, candidates| {
        area(
            radius,
            crate::simd::dispatch(
                arch,
                #[inline(always)]
                || kernel_sum(center, radius, candidates),
            ),
        )
    });
    let at = |(&position, &isolated): (&u32, &bool)| {
        if isolated {
            T::zero()
        } else {
            scratch.sorted[position as usize]
        }
    };
    let samples = neighborhoods
        .position()
        .par_iter()
        .zip(&neighborhoods.isolated);
    samples.map(at).collect_into_vec(areas);
}

/// `a_i` from `Σ_j (1 − r_j²/R_i²)²`.
#[inline(always)]
fn area<T: Real>(radius: T, kernel_sum: T) -> T {
    T::PI() * radius * radius / (T::of(3.0) * kernel_sum)
}

/// `Σ_j (1 − r_j²/R_i²)²`; at least 1, the sample's own part.
#[inline(always)]
fn kernel_sum<T: Real>(center: [T; 3], radius: T, candidates: &Candidates<T>) -> T {
    let scale = T::one() / (radius * radius);
    let mut sums = [T::zero(); LANES];
    candidates.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            let terms = kernel_terms(center, scale, lanes);
            for l in 0..LANES {
                sums[l] += terms[l];
            }
        },
    );
    sums.into_iter().sum()
}

/// `(1 − r²/R²)²` of each lane, 0 outside the radius.
#[inline(always)]
fn kernel_terms<T: Real>(center: [T; 3], scale: T, lanes: &Lanes<T>) -> [T; LANES] {
    let mut terms = [T::zero(); LANES];
    for l in 0..LANES {
        let [x, y, z] = [0, 1, 2].map(|a| lanes.point[a][l] - center[a]);
        let d2 = x * x + y * y + z * z;
        let s = T::one() - d2 * scale;
        terms[l] = if d2 <= lanes.limit[l] {
            s * s
        } else {
            T::zero()
        };
    }
    terms
}

#[cfg(test)]
#[path = "area_tests.rs"]
mod tests;
