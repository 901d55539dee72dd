//! Cotangents of the axes to cotangents of the points.
//!
//! All lengths are in units of the radius of a center: `d̂ = d/R`, `ŵ = wR`, `ĝ = R² g/(RW)`. What a center hands
//! out is divided by its `R` at the end.

use cubecl::prelude::*;

use super::forward::{epsilon, steepness};
use super::{CENTROID, Residual, SMALLEST_GAP, TANGENT, VALUES, WEIGHT};
use crate::device::{check_length, launch};
use crate::element::plane;
use crate::neighbors::{BLOCK, NeighborhoodArrays, end_of_leaf, first_of_leaf, next_leaf};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Cotangents `(N, 3)` of the points for the cotangents `normals_bar` `(N, 3)` of the axes, with the sign that
/// [`forward`](super::forward) gave them; their part along the axis drops out. And `R_i R̄_i` `(N,)` of the radii. All in
/// input order.
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    normals_bar: &Buffer<T>,
) -> Result<(Buffer<T>, Buffer<T>), Error> {
    let near = &residual.neighborhoods;
    let n = near.len();
    check_length("normals_bar", normals_bar, 3 * n)?;
    let (points_bar, radii_bar) = (device.empty(3 * n)?, device.empty(n)?);
    if n == 0 {
        return Ok((points_bar, radii_bar));
    }
    let centers: Buffer<T> = device.empty(CENTER * n)?;
    launch!(device, n, BLOCK => fill_centers<T>(residual.planes, near.places, normals_bar, centers));
    launch!(device, n, BLOCK => gather<T>(near, centers, points_bar, radii_bar));
    Ok((points_bar, radii_bar))
}

/// Numbers that a center hands out by: `ĝ/Ŵ`, `n` and `m̂`.
const CENTER: usize = 9;

/// Plane of a center, as its members need it.
#[derive(CubeType, Clone, Copy)]
struct Center<F: Float> {
    g: Vector3<F>,
    n: Vector3<F>,
    mean: Vector3<F>,
}

#[cube]
impl<F: Float> Center<F> {
    fn at(centers: &Array<F>, i: usize) -> Self {
        Center::<F> {
            g: Vector3::<F>::at(centers, 3 * i),
            n: Vector3::<F>::at(centers, 3 * i + 1),
            mean: Vector3::<F>::at(centers, 3 * i + 2),
        }
    }

    /// `d̄` in units of the radius, for an offset `d̂` from the center.
    fn offset_bar(self, d: Vector3<F>) -> Vector3<F> {
        let r = F::sqrt(d.dot(d));
        let w = plane::weight::<F>(r, epsilon::<F>(), steepness::<F>());
        let fall = plane::weight_fall::<F>(r, epsilon::<F>(), steepness::<F>());
        let e = d.sub(self.mean);
        let ge = self.g.dot(e);
        let ne = self.n.dot(e);
        let radial = plane::radial::<F>(fall, ge, ne, r);
        Vector3::<F> {
            x: plane::offset_bar::<F>(w, self.g.x, ne, self.n.x, ge, radial, d.x),
            y: plane::offset_bar::<F>(w, self.g.y, ne, self.n.y, ge, radial, d.y),
            z: plane::offset_bar::<F>(w, self.g.z, ne, self.n.z, ge, radial, d.z),
        }
    }
}

/// Three of the numbers of this unit's point, from number `k`.
#[cube]
pub(super) fn rows<F: Float>(planes: &Array<F>, #[comptime] k: usize, n: usize) -> Vector3<F> {
    Vector3::<F> {
        x: planes[k * n + ABSOLUTE_POS],
        y: planes[(k + 1) * n + ABSOLUTE_POS],
        z: planes[(k + 2) * n + ABSOLUTE_POS],
    }
}

#[cube(launch)]
fn fill_centers<F: Float>(
    planes: &Array<F>,
    places: &Array<u32>,
    normals_bar: &Array<F>,
    centers: &mut Array<F>,
) {
    let n = places.len();
    if ABSOLUTE_POS < n {
        let normal = rows::<F>(planes, 0usize, n);
        let second = rows::<F>(planes, TANGENT, n);
        let values = rows::<F>(planes, VALUES, n);
        let weight = planes[WEIGHT * n + ABSOLUTE_POS];
        let bar = Vector3::<F>::at(normals_bar, places[ABSOLUTE_POS] as usize);
        let third = normal.cross(second);
        let g = second
            .scale(slope::<F>(values.y - values.x, values.z, weight) * second.dot(bar))
            .add(third.scale(slope::<F>(values.z - values.x, values.z, weight) * third.dot(bar)));
        g.write(centers, 3 * ABSOLUTE_POS);
        normal.write(centers, 3 * ABSOLUTE_POS + 1);
        rows::<F>(planes, CENTROID, n).write(centers, 3 * ABSOLUTE_POS + 2);
    }
}

/// `1/((λ₁ − λ_k) W)`; gaps count as at least a thousandth of the largest eigenvalue, and samples in one place,
/// where that is as good as 0, have no derivative.
#[cube]
fn slope<F: Float>(gap: F, largest: F, weight: F) -> F {
    let least = F::new(SMALLEST_GAP) * largest / F::new(1000.0);
    let extends = largest > F::new(1e-30);
    let bounded = select(gap > least, gap, least);
    let divisor = select(extends, bounded * weight, F::new(1.0));
    select(extends, F::new(-1.0) / divisor, F::new(0.0))
}

/// Cotangent of each point: the sum over the centers that it is a neighbor of, less the sum over its own neighbors. And
/// of each radius.
#[cube(launch)]
fn gather<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    centers: &Array<F>,
    points_bar: &mut Array<F>,
    radii_bar: &mut Array<F>,
) {
    let n = near.radii.len();
    if ABSOLUTE_POS < n {
        let point = Vector3::<F>::at(&near.tree.points, ABSOLUTE_POS);
        let radius = near.radii[ABSOLUTE_POS];
        let inverse = F::new(1.0) / radius;
        let own = Center::<F>::at(centers, ABSOLUTE_POS);
        let mut sum = Vector3::<F>::zero();
        let mut along = F::new(0.0);
        let mut node = next_leaf::<F>(&near.tree, point, radius, 0usize, true);
        while node < near.tree.links.len() {
            let first = first_of_leaf(&near.tree.links, node);
            for j in first..end_of_leaf(first, n) {
                let offset = Vector3::<F>::at(&near.tree.points, j).sub(point);
                let square = offset.dot(offset);
                if square <= radius * radius {
                    let unit = offset.scale(inverse);
                    let out = own.offset_bar(unit);
                    along += out.dot(unit);
                    sum = sum.sub(out.scale(inverse));
                }
                let other = near.radii[j];
                if square <= other * other {
                    let unit = F::new(1.0) / other;
                    let into = Center::<F>::at(centers, j).offset_bar(offset.scale(-unit));
                    sum = sum.add(into.scale(unit));
                }
            }
            node = next_leaf::<F>(&near.tree, point, radius, node + 1, true);
        }
        let place = near.places[ABSOLUTE_POS] as usize;
        sum.write(points_bar, place);
        radii_bar[place] = -along;
    }
}
