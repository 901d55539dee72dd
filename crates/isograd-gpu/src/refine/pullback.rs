//! Cotangents of refined normals to those of the normals before and of the points.

use cubecl::prelude::*;

use super::Residual;
use super::forward::{gain_from, gain_to, sums_around};
use crate::device::{check_length, launch};
use crate::element::quadric::{CENTER, Center, Pair, pull};
use crate::neighbors::{BLOCK, NeighborhoodArrays, end_of_leaf, first_of_leaf, next_leaf};
use crate::normals::{epsilon, steepness};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Cotangents `(N, 3)` of the points and `(N, 3)` of the normals before, for the cotangents `normals_bar` `(N, 3)` of the
/// refined ones; and `R_i R̄_i` `(N,)` of the radii. All in input order.
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
    normals_bar: &Buffer<T>,
) -> Result<[Buffer<T>; 3], Error> {
    let Residual { near, before } = residual;
    let n = near.len();
    check_length("normals_bar", normals_bar, 3 * n)?;
    let (points, normals) = (device.empty(3 * n)?, device.empty(3 * n)?);
    let radii = device.empty(n)?;
    if n > 0 {
        let centers: Buffer<T> = device.empty(CENTER * n)?;
        launch!(device, n, BLOCK => find_centers<T>(near, before, normals_bar, centers, normals));
        launch!(device, n, BLOCK => gather<T>(near, centers, points, normals, radii));
    }
    Ok([points, normals, radii])
}

/// Centers in sorted order, and the cotangents of their normals, in input order, that do not come through neighbors.
#[cube(launch)]
fn find_centers<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    before: &Array<F>,
    normals_bar: &Array<F>,
    centers: &mut Array<F>,
    direct: &mut Array<F>,
) {
    if ABSOLUTE_POS < near.radii.len() {
        let place = near.places[ABSOLUTE_POS] as usize;
        let sums = sums_around::<F>(near, before, ABSOLUTE_POS);
        let normal = Vector3::<F>::at(before, place);
        let bar = Vector3::<F>::at(normals_bar, place);
        let pulled = pull::<F>(normal, sums, bar, gain_from::<F>(), gain_to::<F>());
        pulled.normal_bar.write(direct, place);
        store::<F>(pulled.center, centers, CENTER * ABSOLUTE_POS);
    }
}

#[cube]
fn store<F: Float>(center: Center<F>, centers: &mut Array<F>, start: usize) {
    center.n.store(centers, start);
    center.t.store(centers, start + 3);
    center.p.u.store(centers, start + 6);
    center.p.v.store(centers, start + 9);
    center.lambda.u.store(centers, start + 12);
    center.lambda.v.store(centers, start + 15);
    centers[start + 18] = center.mean;
    centers[start + 19] = center.of_quadric;
    centers[start + 20] = center.of_plane;
    centers[start + 21] = center.common;
}

#[cube]
fn load<F: Float>(centers: &Array<F>, start: usize) -> Center<F> {
    Center::<F> {
        n: Vector3::<F>::load(centers, start),
        t: Vector3::<F>::load(centers, start + 3),
        p: Pair::<F> {
            u: Vector3::<F>::load(centers, start + 6),
            v: Vector3::<F>::load(centers, start + 9),
        },
        lambda: Pair::<F> {
            u: Vector3::<F>::load(centers, start + 12),
            v: Vector3::<F>::load(centers, start + 15),
        },
        mean: centers[start + 18],
        of_quadric: centers[start + 19],
        of_plane: centers[start + 20],
        common: centers[start + 21],
    }
}

/// Cotangent of each point and of its normal: the sums over the centers that it is a neighbor of, and those as a center. And
/// of each radius.
#[cube(launch)]
fn gather<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    centers: &Array<F>,
    points_bar: &mut Array<F>,
    normals_bar: &mut Array<F>,
    radii_bar: &mut Array<F>,
) {
    let n = near.radii.len();
    if ABSOLUTE_POS < n {
        let point = Vector3::<F>::at(&near.tree.points, ABSOLUTE_POS);
        let radius = near.radii[ABSOLUTE_POS];
        let inverse = F::new(1.0) / radius;
        let own = load::<F>(centers, CENTER * ABSOLUTE_POS);
        let place = near.places[ABSOLUTE_POS] as usize;
        let mut sum = Vector3::<F>::zero();
        let mut of_normal = Vector3::<F>::at(normals_bar, place);
        let mut along = F::new(0.0);
        let mut node = next_leaf::<F>(&near.tree, point, radius, 0usize, true);
        while node < near.tree.links.len() {
            let first = first_of_leaf(&near.tree.links, node);
            for j in first..end_of_leaf(first, n) {
                let offset = Vector3::<F>::at(&near.tree.points, j).sub(point);
                let square = offset.dot(offset);
                let other = load::<F>(centers, CENTER * j);
                if square <= radius * radius {
                    let unit = offset.scale(inverse);
                    let out = own.pair_bar(unit, other.n, epsilon::<F>(), steepness::<F>());
                    along += out.offset.dot(unit);
                    sum = sum.sub(out.offset.scale(inverse));
                    of_normal = of_normal.add(out.center);
                }
                let reach = near.radii[j];
                if square <= reach * reach {
                    let unit = F::new(1.0) / reach;
                    let into = other.pair_bar(
                        offset.scale(-unit),
                        own.n,
                        epsilon::<F>(),
                        steepness::<F>(),
                    );
                    sum = sum.add(into.offset.scale(unit));
                    of_normal = of_normal.add(into.neighbor);
                }
            }
            node = next_leaf::<F>(&near.tree, point, radius, node + 1, true);
        }
        sum.write(points_bar, place);
        of_normal.write(normals_bar, place);
        radii_bar[place] = -along;
    }
}
