//! Outward normals to refined ones.

use pulp::Arch;

use super::GAIN;
use crate::element::eigen::perpendicular;
use crate::element::quadric::{self, SUMS, Sums};
use crate::element::vector3::Vector3;
use crate::neighbors::{Candidates, LANES, Neighborhoods, Radius, rule, sum_lanes};
use crate::normals::EPSILON;
use crate::{Real, parallel, simd, vector};

/// Work space of [`forward`], whose memory every call uses again.
#[derive(Clone, Debug, Default)]
pub struct Scratch<T> {
    /// Normals in the order of the cells, an array for each axis, and the refined ones.
    pub(super) normals: [Vec<T>; 3],
    sorted: Vec<[T; 3]>,
}

/// Refines `(N, 3)` outward unit `normals` in place, in input order; see the [module](super). `neighborhoods` are those of
/// their points. Normals stay as they are where the radius was given.
pub fn forward<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    scratch: &mut Scratch<T>,
    normals: &mut [[T; 3]],
) {
    if neighborhoods.rule != Radius::Auto {
        return;
    }
    let Scratch {
        normals: before,
        sorted,
    } = scratch;
    sort(neighborhoods, normals, before);
    let before = before.each_ref().map(|x| &x[..]);
    let arch = Arch::new();
    parallel::resize_large(sorted, normals.len(), [T::zero(); 3]);
    let refined = |i: usize, point, radius, candidates: &_| {
        let normal = normals[i];
        let sums = sums(arch, [point, normal], radius, candidates);
        refined(normal, sums)
    };
    neighborhoods.for_each_neighborhood(before, sorted, &refined);
    let (sorted, position) = (&*sorted, neighborhoods.position());
    parallel::for_each(normals, |i, normal| *normal = sorted[position[i] as usize]);
}

/// Writes the normals in the order of the cells, an array for each axis.
pub(super) fn sort<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    normals: &[[T; 3]],
    out: &mut [Vec<T>; 3],
) {
    let order = neighborhoods.index.order();
    for (axis, out) in out.iter_mut().enumerate() {
        parallel::fill(out, order.len(), |position| {
            normals[order[position] as usize][axis]
        });
    }
}

/// In double precision: of steep quadrics little is left when their equations are solved.
fn refined<T: Real>(normal: [T; 3], sums: Sums<f64>) -> [T; 3] {
    let [from, to] = GAIN;
    let n = Vector3::from(vector::to_f64(normal));
    let fit = quadric::fit(sums, from, to);
    let long: [f64; 3] = quadric::refined(n, perpendicular(n), fit).into();
    match vector::normalized(long) {
        Some(unit) if fit.share > 0.0 => vector::of_f64(unit),
        _ => normal,
    }
}

/// The sums around a point with a normal. The candidates carry their normals.
pub(super) fn sums<T: Real>(
    arch: Arch,
    [point, normal]: [[T; 3]; 2],
    radius: T,
    candidates: &Candidates<T, 3>,
) -> Sums<f64> {
    let n = Vector3::from(normal);
    let frame = Frame {
        point,
        inverse: T::one() / radius,
        n,
        t: perpendicular(n),
    };
    let sums = simd::vectorized!(arch, {
        let mut sums = [[T::zero(); LANES]; SUMS];
        candidates.for_each_lanes(
            radius,
            #[inline(always)]
            |lanes| {
                if !lanes.any_counts(point) {
                    return;
                }
                for l in 0..LANES {
                    let at = [lanes.point[0][l], lanes.point[1][l], lanes.point[2][l]];
                    let normal = [lanes.values[0][l], lanes.values[1][l], lanes.values[2][l]];
                    let terms = frame.terms(at, normal, lanes.limit[l]);
                    for (sum, term) in sums.iter_mut().zip(terms) {
                        sum[l] += term;
                    }
                }
            },
        );
        sums
    });
    Sums::from_array(sums.map(|lanes| sum_lanes(lanes).f64()))
}

/// A point, its normal and a tangent, and one over its radius.
struct Frame<T: Real> {
    point: [T; 3],
    inverse: T,
    n: Vector3<T>,
    t: Vector3<T>,
}

impl<T: Real> Frame<T> {
    /// The terms of a sample with a normal, 0 where the square of its distance is above `limit`.
    #[inline(always)]
    fn terms(&self, at: [T; 3], normal: [T; 3], limit: T) -> [T; SUMS] {
        let offset = vector::sub(at, self.point);
        let counts = vector::norm_squared(offset) <= limit;
        let d = Vector3::from(vector::scale(offset, self.inverse));
        let steepness = T::of(rule::steepness(Radius::Auto));
        let agreement = self.n.dot(Vector3::from(normal));
        let w = quadric::weight(d.dot(d).sqrt(), agreement, T::of(EPSILON), steepness);
        let w = if counts { w } else { T::zero() };
        let b = self.n.cross(self.t);
        quadric::terms(d.dot(self.t), d.dot(b), d.dot(self.n), w).to_array()
    }
}
