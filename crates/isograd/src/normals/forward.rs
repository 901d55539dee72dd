//! Points and neighbourhoods to axes.

use rayon::prelude::*;

use super::eigen::{Symmetric, eigen};
use super::{Plane, Residual};
use crate::neighbors::{Candidates, LANES, Lanes, Neighborhoods};
use crate::{Real, vector};

/// `ε/R_i`: see the table on the module's page.
pub(super) const EPSILON: f64 = 0.2;

/// Gap `(λ₂ − λ₁)/λ₃` up to which a normal is ill defined.
pub(super) const SMALLEST_GAP: f64 = 1e-3;

/// Estimates the axis of the surface at every point; see the [module](super) for the map.
///
/// `neighborhoods` must be those of these points. The memory of `out` is used again. Nothing fails:
/// where the points of a neighbourhood lie on a line or in one place, the axis is some unit vector at a
/// right angle to the line, or any, and is marked [`Plane::guarded`].
pub fn forward<T: Real>(neighborhoods: &Neighborhoods<T>, out: &mut Residual<T>) {
    let n = neighborhoods.index.len();
    let arch = pulp::Arch::new();
    out.sorted.resize(n, Default::default());
    neighborhoods.for_each_neighborhood(&mut out.sorted, &|center, radius, candidates| {
        let epsilon = T::of(EPSILON) * radius;
        let moments = crate::simd::dispatch(
            arch,
            #[inline(always)]
            || Moments::of(center, radius, epsilon, candidates),
        );
        plane(&moments)
    });
    let sorted = &out.sorted;
    let at = |&position: &u32| sorted[position as usize];
    let positions = neighborhoods.position().par_iter();
    positions
        .map(at)
        .unzip_into_vecs(&mut out.normals, &mut out.planes);
}

/// `Σ w`, `Σ w d` and `Σ w d dᵀ` over a neighbourhood.
#[derive(Clone, Copy, Debug)]
struct Moments {
    weight: f64,
    first: [f64; 3],
    second: Symmetric,
}

impl Moments {
    #[inline(always)]
    fn of<T: Real>(center: [T; 3], radius: T, epsilon: T, candidates: &Candidates<T>) -> Self {
        let mut sums = [[T::zero(); LANES]; 10];
        candidates.for_each_lanes(
            radius,
            #[inline(always)]
            |lanes| {
                let terms = moment_terms(center, epsilon, lanes);
                for (sum, term) in sums.iter_mut().zip(&terms) {
                    for l in 0..LANES {
                        sum[l] += term[l];
                    }
                }
            },
        );
        let [weight, x, y, z, second @ ..] = sums.map(|sum| sum.iter().map(|s| s.f64()).sum());
        Self {
            weight,
            first: [x, y, z],
            second,
        }
    }
}

/// `w`, `w d` and `w d dᵀ` of each lane; all 0 outside the radius.
#[inline(always)]
fn moment_terms<T: Real>(center: [T; 3], epsilon: T, lanes: &Lanes<T>) -> [[T; LANES]; 10] {
    let mut terms = [[T::zero(); LANES]; 10];
    for l in 0..LANES {
        let [x, y, z] = [0, 1, 2].map(|a| lanes.point[a][l] - center[a]);
        let d2 = x * x + y * y + z * z;
        let weight = T::one() / (d2.sqrt() + epsilon);
        let w = if d2 <= lanes.limit[l] {
            weight
        } else {
            T::zero()
        };
        let (wx, wy, wz) = (w * x, w * y, w * z);
        let products = [
            w,
            wx,
            wy,
            wz,
            wx * x,
            wx * y,
            wx * z,
            wy * y,
            wy * z,
            wz * z,
        ];
        for (term, product) in terms.iter_mut().zip(products) {
            term[l] = product;
        }
    }
    terms
}

/// Normal and plane from the moments of a neighbourhood.
fn plane<T: Real>(moments: &Moments) -> ([T; 3], Plane<T>) {
    let m = moments.first.map(|x| x / moments.weight);
    let [xx, xy, xz, yy, yz, zz] = moments.second.map(|x| x / moments.weight);
    let covariance = [
        xx - m[0] * m[0],
        xy - m[0] * m[1],
        xz - m[0] * m[2],
        yy - m[1] * m[1],
        yz - m[1] * m[2],
        zz - m[2] * m[2],
    ];
    let found = eigen(covariance);
    let values = found.values.map(|x| x.max(0.0));
    let [normal, second, third] = found.vectors.map(vector::of_f64);
    let sign = sign(normal);
    let plane = Plane {
        centroid: vector::of_f64(m),
        weight: T::of(moments.weight),
        eigenvalues: vector::of_f64(values),
        // Turning two vectors of the three keeps the basis right-handed.
        tangents: [vector::scale(second, sign), third],
        guarded: !(values[1] - values[0] > SMALLEST_GAP * values[2]),
    };
    (vector::scale(normal, sign), plane)
}

/// `+1` or `−1`: what makes the component of largest magnitude (the first among equals) positive.
fn sign<T: Real>(v: [T; 3]) -> T {
    let mut largest = v[0];
    for &component in &v[1..] {
        if component.abs() > largest.abs() {
            largest = component;
        }
    }
    if largest < T::zero() {
        -T::one()
    } else {
        T::one()
    }
}
