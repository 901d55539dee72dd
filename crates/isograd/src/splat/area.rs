//! Area of surface that each sample represents.
//!
//! # Map
//! Neighborhoods → `a_i = 1 / Σ_{j∈N_i} K(r_j)` with `r_j = |x_j − x_i|` and
//! `K(r) = 3/(π R_i²) · (1 − r²/R_i²)²`, whose integral over the disk of radius `R_i` is 1: the sum is the
//! density of samples at `x_i`, in samples a unit of area. The paper has no such weight; without it the
//! reconstructed surface moves away from sparsely sampled parts. An isolated sample (an outlier, see
//! [`Neighborhoods::isolated`]) represents no surface: `a_i = 0`. By the sum alone its area would be
//! about the square of its distance to the surface, and one in a hundred would outweigh the surface.
//!
//! The sum is accumulated while the neighbors are counted ([`crate::neighbors`]): a pass of its own over all
//! neighbors would cost ten times as much.
//!
//! # Residual
//! The areas and the neighborhoods themselves.
//!
//! # Pullback
//! Given `ā_i`, with `d_j = x_j − x_i`:
//! ```text
//! d̄_j = ā_i a_i² · 12/(π R_i⁴) · (1 − r_j²/R_i²) d_j
//! x̄_j += d̄_j,   x̄_i −= Σ_j d̄_j,   R_i R̄_i = 2 a_i ā_i − Σ_j ⟨d̄_j, d_j⟩
//! ```
//! `K` and its derivative are 0 at the radius, so samples enter and leave smoothly. [`pullback`] gathers.
//!
//! # Not differentiable
//! The isolated samples are held constant.

use crate::element::plane;
use crate::neighbors::{Candidates, LANES, Neighborhoods, RadiiCotangent};
use crate::{Real, parallel, vector};

/// Writes the `(N,)` areas `a_i`, in input order and the unit of the points squared; positive, and 0
/// for isolated samples.
///
/// They add up to the area of the surface where the sampling is even; for random samples the sum is
/// lower, by about `3/count` of it, for each sample counts itself.
pub fn forward<T: Real>(neighborhoods: &Neighborhoods<T>, areas: &mut Vec<T>) {
    let count = neighborhoods.radius.len();
    parallel::fill(areas, count, |i| at(neighborhoods, i));
}

/// The area of sample `i`.
pub(crate) fn at<T: Real>(neighborhoods: &Neighborhoods<T>, i: usize) -> T {
    let Neighborhoods {
        radius,
        crowd,
        isolated,
        ..
    } = neighborhoods;
    match isolated[i] {
        true => T::zero(),
        false => plane::area(T::PI(), radius[i], crowd[i]),
    }
}

/// Mean of the positive areas, and their number.
pub fn mean<T: Real>(areas: &[T]) -> (f64, usize) {
    let [sum, count] = parallel::sum_array(areas.len(), |i| {
        let area = areas[i].f64();
        [area, f64::from(u8::from(area > 0.0))]
    });
    (sum / count, count as usize)
}

/// Buffers of the pullback.
#[derive(Clone, Debug, Default)]
pub struct PullbackScratch<T> {
    /// `ā_i a_i² · 12/(π R_i⁴)`, in input order and in that of the cells, 0 there for grown radii.
    factors: Vec<T>,
    sorted_factors: Vec<T>,
    sorted: Vec<[T; 4]>,
}

/// Adds to `points_bar` `(N, 3)` the cotangents of the points from those of the areas, `areas_bar` `(N,)`.
/// `neighborhoods` and `areas` are those of [`forward`]; all in input order. What the radii get is added to `radii_bar`.
pub fn pullback<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    areas: &[T],
    areas_bar: &[T],
    scratch: &mut PullbackScratch<T>,
    points_bar: &mut [[T; 3]],
    radii_bar: &mut RadiiCotangent,
) {
    let PullbackScratch {
        factors,
        sorted_factors,
        sorted,
    } = scratch;
    let factor = |i: usize| {
        let square = neighborhoods.radius[i] * neighborhoods.radius[i];
        let share = areas[i] / square;
        T::of(12.0) * T::FRAC_1_PI() * areas_bar[i] * share * share
    };
    parallel::fill(factors, areas.len(), factor);
    let order = neighborhoods.index.order();
    parallel::fill(sorted_factors, order.len(), |position| {
        let i = order[position] as usize;
        match neighborhoods.has_grown(i) {
            true => T::zero(),
            false => factors[i],
        }
    });
    let (arch, radius) = (pulp::Arch::new(), neighborhoods.common_radius);
    let own = &*sorted_factors;
    let common =
        neighborhoods.add_gathered([own], sorted, points_bar, &|position, point, candidates| {
            crate::simd::vectorized!(arch, gather(point, own[position], radius, candidates))
        });
    // An area grows with the square of the lengths if the offsets and the radius are scaled alike.
    let twice = |i: usize| 2.0 * areas[i].f64() * areas_bar[i].f64();
    let [of_areas] = parallel::sum_array(areas.len(), |i| match neighborhoods.has_grown(i) {
        true => [0.0],
        false => [twice(i)],
    });
    radii_bar.add_common(of_areas - common);
    let factors = &*factors;
    let offset_bar = |i: usize, _, offset| {
        let square = neighborhoods.radius[i] * neighborhoods.radius[i];
        let rise = T::one() - vector::norm_squared(offset) / square;
        vector::scale(offset, factors[i] * rise.max(T::zero()))
    };
    let mut radius_bar = |i: usize, sum: f64| twice(i) - sum;
    let radius = &neighborhoods.radius;
    neighborhoods.add_from_wide(radius, points_bar, radii_bar, &offset_bar, &mut radius_bar);
}

/// `−Σ_c (f_k + f_c)(1 − r_c²/R²) d_c`: cotangent of point `k` as a center, and as a neighbor of others; and
/// `Σ_c f_k (1 − r_c²/R²) r_c²`.
#[inline(always)]
fn gather<T: Real>(center: [T; 3], own: T, radius: T, candidates: &Candidates<T, 1>) -> [T; 4] {
    let scale = T::one() / (radius * radius);
    let mut sums = [[T::zero(); LANES]; 4];
    candidates.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            for l in 0..LANES {
                let [x, y, z] = [0, 1, 2].map(|a| lanes.point[a][l] - center[a]);
                let d2 = x * x + y * y + z * z;
                let rise = if d2 <= lanes.limit[l] {
                    T::one() - d2 * scale
                } else {
                    T::zero()
                };
                let f = (own + lanes.values[0][l]) * rise;
                sums[0][l] -= f * x;
                sums[1][l] -= f * y;
                sums[2][l] -= f * z;
                sums[3][l] += own * rise * d2;
            }
        },
    );
    sums.map(|sum| sum.into_iter().sum())
}

#[cfg(test)]
#[path = "area_tests.rs"]
mod tests;
