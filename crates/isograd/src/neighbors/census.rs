//! Sums over the samples within a radius: how many there are, and how densely they lie.

use super::candidates::{Candidates, LANES, Lanes, sum_lanes};
use super::rule::GROWTH_MARGIN;
use crate::Real;
use crate::element::plane;

/// Sums over the samples within `R` of a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Census<T> {
    pub count: u32,
    /// Those within `R` over [`GROWTH_MARGIN`].
    pub well_within: u32,
    /// `Σ_j (1 − r_j²/R²)²`: the count, with samples near the radius counting less. The areas are made of
    /// it (`splat::area`); here, beside the count, it costs next to nothing.
    pub crowd: T,
}

impl<T: Real> Census<T> {
    /// Over candidates that hold all samples within the radius.
    pub(crate) fn of(arch: pulp::Arch, center: [T; 3], radius: T, near: &Candidates<T>) -> Self {
        let (counts, crowds) = crate::simd::vectorized!(arch, sum(center, radius, near));
        let [count, well_within] = counts.map(|counts| counts.into_iter().sum());
        Self {
            count,
            well_within,
            crowd: sum_lanes(crowds),
        }
    }
}

#[inline(always)]
fn sum<T: Real>(
    center: [T; 3],
    radius: T,
    near: &Candidates<T>,
) -> ([[u32; LANES]; 2], [T; LANES]) {
    let scale = inverse_square(radius);
    let well = T::of(1.0 / (GROWTH_MARGIN * GROWTH_MARGIN));
    let (mut counts, mut crowds) = ([[0; LANES]; 2], [T::zero(); LANES]);
    near.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            let d2 = distances_squared(center, lanes);
            for l in 0..LANES {
                let within = d2[l] <= lanes.limit[l];
                counts[0][l] += u32::from(within);
                counts[1][l] += u32::from(d2[l] <= well * lanes.limit[l]);
                crowds[l] += if within {
                    plane::crowd(d2[l] * scale)
                } else {
                    T::zero()
                };
            }
        },
    );
    (counts, crowds)
}

#[inline(always)]
fn inverse_square<T: Real>(radius: T) -> T {
    T::one() / (radius * radius)
}

/// `|x_j − center|²` for each lane, rounded as in every query of the index.
#[inline(always)]
fn distances_squared<T: Real>(center: [T; 3], lanes: &Lanes<T>) -> [T; LANES] {
    let mut d2 = [T::zero(); LANES];
    for l in 0..LANES {
        let d = [
            lanes.point[0][l] - center[0],
            lanes.point[1][l] - center[1],
            lanes.point[2][l] - center[2],
        ];
        d2[l] = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    }
    d2
}
