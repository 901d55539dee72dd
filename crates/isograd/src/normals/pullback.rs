//! Cotangents of the axes to cotangents of the points.
//!
//! All lengths are in units of the radius, so that nothing overflows or vanishes whatever the unit of the
//! cloud: `d̂ = d/R`, `ŵ = wR`, `ĝ = R² g/(RW)`. The result is divided by `R` once.

use super::forward::{EPSILON, SMALLEST_GAP};
use super::{Plane, Residual, widen_pullback};
use crate::element::plane;
use crate::neighbors::{Candidates, LANES, Neighborhoods, RadiiCotangent, rule};
use crate::vector::{add, dot, norm, scale};
use crate::{Real, parallel, vector};

/// Values that each candidate carries: `ĝ/Ŵ`, `n` and `m̂`.
const VALUES: usize = 9;

/// Buffers of the pullback.
#[derive(Clone, Debug, Default)]
pub struct Scratch<T> {
    /// `ĝ/Ŵ` of every point, in input order.
    slopes: Vec<[T; 3]>,
    /// [`VALUES`] of every point in the order of the cells; `ĝ` is 0 there where the radius is wider.
    values: [Vec<T>; VALUES],
    sorted: Vec<[T; 4]>,
}

/// Adds to the `(N, 3)` `points_bar` what the cotangents `normals_bar` `(N, 3)` of the axes (with the sign
/// that [`Residual::normals`] has) mean for the points. Returns how many guarded planes met a cotangent that
/// is not zero: their derivative was bounded.
///
/// `neighborhoods` and `residual` are those of [`forward`](super::forward); all in input order. What the radii get is
/// added to `radii_bar`.
pub fn pullback<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    residual: &Residual<T>,
    normals_bar: &[[T; 3]],
    scratch: &mut Scratch<T>,
    points_bar: &mut [[T; 3]],
    radii_bar: &mut RadiiCotangent,
) -> usize {
    let Scratch {
        slopes,
        values,
        sorted,
    } = scratch;
    let slope = |i: usize| slope(&residual.planes[i], residual.radius[i], normals_bar[i]);
    parallel::fill(slopes, normals_bar.len(), slope);
    sort_values(neighborhoods, residual, slopes, values);
    let (arch, radius) = (pulp::Arch::new(), neighborhoods.common_radius);
    let steepness = T::of(rule::steepness(neighborhoods.rule));
    let values = values.each_ref().map(|v| &v[..]);
    let common = neighborhoods.add_gathered(
        values,
        sorted,
        points_bar,
        &|position, point, candidates| {
            let own = values.map(|v| v[position]);
            crate::simd::vectorized!(arch, gather(point, &own, radius, steepness, candidates))
        },
    );
    // A normal has no unit: it stays if the offsets and the radius are scaled alike.
    radii_bar.add_common(-common);
    let slopes = &*slopes;
    let offset_bar = |i: usize, _, offset| {
        let radius = residual.radius[i];
        let center = Center {
            g: slopes[i],
            n: residual.normals[i],
            mean: scale(residual.planes[i].centroid, T::one() / radius),
        };
        let unit = scale(offset, T::one() / radius);
        scale(
            center.offset_bar(unit, norm(unit), steepness),
            T::one() / radius,
        )
    };
    let mut widened = Vec::new();
    neighborhoods.add_from_wide(
        &residual.radius,
        points_bar,
        radii_bar,
        &offset_bar,
        &mut |i, sum| {
            if residual.radius[i] > neighborhoods.radius[i] && sum != 0.0 {
                widened.push((i as u32, -sum));
            }
            -sum
        },
    );
    widen_pullback::pullback(neighborhoods, &widened, points_bar, radii_bar);
    let guarded =
        |(plane, bar): &(&Plane<T>, &[T; 3])| plane.guarded && bar.iter().any(|&x| x != T::zero());
    residual
        .planes
        .iter()
        .zip(normals_bar)
        .filter(guarded)
        .count()
}

/// `ĝ/Ŵ`; the gaps between eigenvalues count as at least [`SMALLEST_GAP`] of the largest one.
fn slope<T: Real>(plane: &Plane<T>, radius: T, bar: [T; 3]) -> [T; 3] {
    let radius = radius.f64();
    let [first, .., largest] = plane.eigenvalues.map(|x| x.f64());
    if !(largest > 0.0) {
        return [T::zero(); 3];
    }
    let mut sum = [0.0; 3];
    for (tangent, value) in plane.tangents.iter().zip(&plane.eigenvalues[1..]) {
        let gap = (value.f64() - first).max(SMALLEST_GAP * largest);
        let (v, bar) = (vector::to_f64(*tangent), vector::to_f64(bar));
        sum = add(sum, scale(v, -dot(v, bar) * (radius / gap) * radius));
    }
    vector::of_f64(scale(sum, 1.0 / (radius * plane.weight.f64())))
}

/// Writes the values of all points, in the order of the cells.
fn sort_values<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    residual: &Residual<T>,
    slopes: &[[T; 3]],
    values: &mut [Vec<T>; VALUES],
) {
    let order = neighborhoods.index.order();
    let common = neighborhoods.common_radius;
    let inverse = T::one() / common;
    parallel::for_each(values, |m, out| {
        let (what, axis) = (m / 3, m % 3);
        out.clear();
        out.extend(order.iter().map(|&i| {
            let i = i as usize;
            match what {
                0 if residual.radius[i] > common => T::zero(),
                0 => slopes[i][axis],
                1 => residual.normals[i][axis],
                _ => residual.planes[i].centroid[axis] * inverse,
            }
        }));
    });
}

/// The center of a neighborhood: `ĝ/Ŵ`, `n` and `m̂`.
struct Center<T> {
    g: [T; 3],
    n: [T; 3],
    mean: [T; 3],
}

impl<T: Real> Center<T> {
    #[inline(always)]
    fn of(v: &[T; VALUES]) -> Self {
        Self {
            g: [v[0], v[1], v[2]],
            n: [v[3], v[4], v[5]],
            mean: [v[6], v[7], v[8]],
        }
    }

    /// `d̄` in units of the radius, for an offset `d̂` of length `r̂ > 0` from the center:
    /// `ŵ (g (n·e) + n (g·e)) + ŵ' (g·e)(n·e) d̂/r̂` with `e = d̂ − m̂` and `g` standing for `ĝ/Ŵ`.
    #[inline(always)]
    fn offset_bar(&self, d: [T; 3], r: T, steepness: T) -> [T; 3] {
        let Self { g, n, mean } = self;
        let w = plane::weight(r, T::of(EPSILON), steepness);
        let fall = plane::weight_fall(r, T::of(EPSILON), steepness);
        let e = [d[0] - mean[0], d[1] - mean[1], d[2] - mean[2]];
        let (ge, ne) = (dot(*g, e), dot(*n, e));
        let radial = plane::radial(fall, ge, ne, r);
        [0, 1, 2].map(
            #[inline(always)]
            |a| plane::offset_bar(w, g[a], ne, n[a], ge, radial, d[a]),
        )
    }
}

/// Cotangent of a point as a neighbor of the others, minus its cotangents as a center; and `Σ ⟨d̄_j, d_j⟩` of these.
#[inline(always)]
fn gather<T: Real>(
    center: [T; 3],
    own: &[T; VALUES],
    radius: T,
    steepness: T,
    candidates: &Candidates<T, VALUES>,
) -> [T; 4] {
    let inverse = T::one() / radius;
    let own = Center::of(own);
    let mut sums = [[T::zero(); LANES]; 4];
    candidates.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            for l in 0..LANES {
                let offset = [0, 1, 2].map(
                    #[inline(always)]
                    |a| lanes.point[a][l] - center[a],
                );
                let d2 = offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2];
                let d = [0, 1, 2].map(
                    #[inline(always)]
                    |a| offset[a] * inverse,
                );
                let r = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
                let back = [-d[0], -d[1], -d[2]];
                let out = own.offset_bar(d, r, steepness);
                let other = Center::of(&std::array::from_fn(
                    #[inline(always)]
                    |m| lanes.values[m][l],
                ));
                let into = other.offset_bar(back, r, steepness);
                let counts = d2 <= lanes.limit[l];
                for a in 0..3 {
                    sums[a][l] += if counts { into[a] - out[a] } else { T::zero() };
                }
                sums[3][l] += if counts { dot(out, d) } else { T::zero() };
            }
        },
    );
    let [x, y, z, along] = sums.map(|sum| sum.into_iter().sum::<T>());
    [x * inverse, y * inverse, z * inverse, along]
}
