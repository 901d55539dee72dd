//! Points and neighborhoods to axes.

use pulp::Arch;

use super::{Plane, Residual, widen};
use crate::element::{eigen::eigen, plane};
use crate::neighbors::{
    self, Candidates, Found, LANES, Lanes, Neighborhoods, Radius, rule, sum_lanes,
};
use crate::parallel::{self, CHUNK};
use crate::{Real, simd, vector};

/// `ε/R_i`: see the table on the module's page.
pub(crate) const EPSILON: f64 = 0.2;

/// Gap `(λ₂ − λ₁)/λ₃` up to which a normal is ill defined.
pub(super) const SMALLEST_GAP: f64 = 1e-3;

/// Estimates the axis of the surface at every point; see the [module](super) for the map.
///
/// `neighborhoods` must be those of these points. The memory of `out` is used again. Nothing fails:
/// where the points of a neighborhood lie on a line or in one place, the axis is some unit vector at a
/// right angle to the line, or any, and is marked [`Plane::guarded`].
pub fn forward<T: Real>(neighborhoods: &Neighborhoods<T>, out: &mut Residual<T>) {
    find_in_own(neighborhoods, out);
    widen::choose(neighborhoods, out);
}

/// Axes in the neighborhoods as they are.
fn find_in_own<T: Real>(neighborhoods: &Neighborhoods<T>, out: &mut Residual<T>) {
    let (arch, rule) = (Arch::new(), neighborhoods.rule);
    let points = neighborhoods.index.len();
    parallel::resize_large(&mut out.sorted, points, Found::default());
    neighborhoods.for_each_neighborhood([], &mut out.sorted, &|_, center, radius, candidates| {
        Found::only(moments(arch, rule, center, radius, candidates))
    });
    find_all_planes(neighborhoods, arch, out);
}

/// [`neighbors::forward`] and [`forward`] in one walk over all neighbors, in four fifths of the time of both.
///
/// # Errors
/// As [`neighbors::forward`].
pub fn forward_with_neighborhoods<T: Real>(
    points: &[[T; 3]],
    radius: Radius,
    neighborhoods: &mut Neighborhoods<T>,
    out: &mut Residual<T>,
) -> Result<(), neighbors::Error> {
    let arch = Arch::new();
    let sorted = &mut out.sorted;
    neighbors::forward_with(
        points,
        radius,
        neighborhoods,
        sorted,
        &|center, within, candidates| moments(arch, radius, center, within, candidates),
    )?;
    find_all_planes(neighborhoods, arch, out);
    widen::choose(neighborhoods, out);
    Ok(())
}

/// `Σ w`, `Σ w d` and `Σ w d dᵀ` over a neighborhood: `xx, xy, xz, yy, yz, zz`.
pub(super) type Moments<T> = [T; 10];

pub(super) fn moments<T: Real>(
    arch: Arch,
    rule: Radius,
    center: [T; 3],
    radius: T,
    candidates: &Candidates<T>,
) -> Moments<T> {
    let scales = [
        T::one() / radius,
        T::of(EPSILON),
        T::of(rule::steepness(rule)),
    ];
    let sums = simd::vectorized!(arch, {
        let mut sums = [[T::zero(); LANES]; 10];
        candidates.for_each_lanes(
            radius,
            #[inline(always)]
            |lanes| {
                let terms = moment_terms(center, scales, lanes);
                for (sum, term) in sums.iter_mut().zip(&terms) {
                    for l in 0..LANES {
                        sum[l] += term[l];
                    }
                }
            },
        );
        sums
    });
    sums.map(sum_lanes)
}

/// `w`, `w d` and `w d dᵀ` of each lane; all 0 outside the radius. `scales` are `1/R`, `ε/R` and the steepness.
#[inline(always)]
fn moment_terms<T: Real>(
    center: [T; 3],
    [inverse, epsilon, steepness]: [T; 3],
    lanes: &Lanes<T>,
) -> [[T; LANES]; 10] {
    let mut terms = [[T::zero(); LANES]; 10];
    for l in 0..LANES {
        let [x, y, z] = [0, 1, 2].map(|a| lanes.point[a][l] - center[a]);
        let d2 = x * x + y * y + z * z;
        let weight = plane::weight(d2.sqrt() * inverse, epsilon, steepness) * inverse;
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

/// Normals and planes from the moments in sorted order.
fn find_all_planes<T: Real>(neighborhoods: &Neighborhoods<T>, arch: Arch, out: &mut Residual<T>) {
    let n = neighborhoods.index.len();
    out.radius.clone_from(&neighborhoods.radius);
    out.count.clone_from(&neighborhoods.count);
    parallel::resize(&mut out.normals, n, [T::zero(); 3]);
    parallel::resize_large(&mut out.planes, n, Plane::default());
    let sorted = &out.sorted;
    let normals = out.normals.chunks_mut(CHUNK);
    let planes = out.planes.chunks_mut(CHUNK);
    let positions = neighborhoods.position().chunks(CHUNK);
    let chunks = normals.zip(planes).zip(positions);
    parallel::each(chunks, |_, ((normals, planes), positions)| {
        simd::vectorized!(arch, find_planes(sorted, positions, normals, planes));
    });
}

/// Normals and planes of the points at these sorted positions, from the moments in sorted order.
#[inline(always)]
pub(super) fn find_planes<T: Real>(
    sorted: &[Found<T, Moments<T>>],
    positions: &[u32],
    normals: &mut [[T; 3]],
    planes: &mut [Plane<T>],
) {
    let groups = positions.chunks(LANES);
    let places = normals.chunks_mut(LANES).zip(planes.chunks_mut(LANES));
    for (positions, (normals, planes)) in groups.zip(places) {
        // Lanes without a point repeat the last one.
        let mut group = [[0.0; LANES]; 10];
        for l in 0..LANES {
            let position = positions[l.min(positions.len() - 1)] as usize;
            for (group, moment) in group.iter_mut().zip(sorted[position].sum) {
                group[l] = moment.f64();
            }
        }
        let found = planes_of(&group);
        for (l, (normal, plane)) in normals.iter_mut().zip(planes).enumerate() {
            (*normal, *plane) = found.lane(l);
        }
    }
}

/// [`LANES`] planes, an array for each number.
struct Planes {
    centroid: [[f64; LANES]; 3],
    weight: [f64; LANES],
    values: [[f64; LANES]; 3],
    vectors: [[[f64; LANES]; 3]; 3],
}

#[inline(always)]
fn planes_of(moments: &Moments<[f64; LANES]>) -> Planes {
    let mut found = Planes {
        centroid: [[0.0; LANES]; 3],
        weight: moments[0],
        values: [[0.0; LANES]; 3],
        vectors: [[[0.0; LANES]; 3]; 3],
    };
    for l in 0..LANES {
        // Plain loops: closures of `array::from_fn` are inlined in some callers only.
        let mut m = [0.0; 9];
        for (m, moment) in m.iter_mut().zip(&moments[1..]) {
            *m = moment[l] / moments[0][l];
        }
        let covariance = [
            m[3] - m[0] * m[0],
            m[4] - m[0] * m[1],
            m[5] - m[0] * m[2],
            m[6] - m[1] * m[1],
            m[7] - m[1] * m[2],
            m[8] - m[2] * m[2],
        ];
        let eigen = eigen(covariance.into());
        let values: [f64; 3] = eigen.values.into();
        let vectors: [[f64; 3]; 3] = [eigen.first.into(), eigen.second.into(), eigen.third.into()];
        for a in 0..3 {
            found.centroid[a][l] = m[a];
            found.values[a][l] = if values[a] > 0.0 { values[a] } else { 0.0 };
            for (all, vector) in found.vectors.iter_mut().zip(&vectors) {
                all[a][l] = vector[a];
            }
        }
    }
    found
}

impl Planes {
    /// Normal and plane of one lane.
    #[inline(always)]
    fn lane<T: Real>(&self, l: usize) -> ([T; 3], Plane<T>) {
        let of = |v: &[[f64; LANES]; 3]| [T::of(v[0][l]), T::of(v[1][l]), T::of(v[2][l])];
        let [first, second, third] = [self.values[0][l], self.values[1][l], self.values[2][l]];
        let [v1, v2, v3] = &self.vectors;
        let (normal, v2, v3) = (of(v1), of(v2), of(v3));
        let sign = sign(normal);
        let plane = Plane {
            centroid: of(&self.centroid),
            weight: T::of(self.weight[l]),
            eigenvalues: of(&self.values),
            // Turning two vectors of the three keeps the basis right-handed.
            tangents: [vector::scale(v2, sign), v3],
            guarded: !(second - first > SMALLEST_GAP * third),
        };
        (vector::scale(normal, sign), plane)
    }
}

/// `+1` or `−1`: what makes the component of largest magnitude (the first among equals) positive.
#[inline(always)]
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
