//! Neighborhoods to axes.

use cubecl::prelude::*;

use super::{CENTROID, PLANE, Residual, TANGENT, VALUES, WEIGHT};
use crate::device::launch;
use crate::element::eigen::{Eigen, Symmetric, eigen};
use crate::element::plane::weight;
use crate::neighbors::{
    BLOCK, NeighborhoodArrays, Neighborhoods, end_of_leaf, first_of_leaf, next_leaf,
};
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Sums over a neighborhood: `Σ w`, `Σ w d` and `Σ w d dᵀ` (`xx, xy, xz, yy, yz, zz`), in units of the radius.
pub(crate) const MOMENTS: usize = 10;

/// The axis `(N, 3)` of the surface at every point, in input order, and what the pullback needs; see the
/// [module](super).
///
/// Where the points of a neighborhood lie on a line or in one place, the axis is some unit vector at a right
/// angle to the line, or any, and counts as guarded.
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
) -> Result<(Buffer<T>, Residual<T>), Error> {
    let n = neighborhoods.len();
    let normals = device.empty(3 * n)?;
    let residual = Residual {
        neighborhoods: neighborhoods.clone(),
        planes: device.empty(PLANE * n)?,
        count: device.empty(n)?,
    };
    if n == 0 {
        return Ok((normals, residual));
    }
    let moments: Buffer<T> = device.empty(MOMENTS * n)?;
    launch!(device, n, BLOCK => sum_moments<T>(neighborhoods, moments, residual.count));
    launch!(device, n, BLOCK => find_planes<T>(
        moments, neighborhoods.places, residual.planes, normals,
    ));
    Ok((normals, residual))
}

/// `ε/R = 1/5`, as on the CPU.
#[cube]
pub(crate) fn epsilon<F: Float>() -> F {
    F::new(1.0) / F::new(5.0)
}

/// How steeply weights fall at the radius, as on the CPU.
#[cube]
pub(crate) fn steepness<F: Float>() -> F {
    F::new(5.0)
}

/// Sums and numbers of all neighborhoods. Each leaf is summed by itself, and sums of leaves are added up, so
/// that rounding stays small where many points are close.
#[cube(launch)]
fn sum_moments<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    moments: &mut Array<F>,
    counts: &mut Array<u32>,
) {
    let n = near.radii.len();
    if ABSOLUTE_POS < n {
        let center = Vector3::<F>::at(&near.tree.points, ABSOLUTE_POS);
        let mut sums = Array::<F>::new(MOMENTS);
        let radius = near.radii[ABSOLUTE_POS];
        let count = moments_within::<F>(near, center, radius, &mut sums);
        #[unroll]
        for k in 0..MOMENTS {
            moments[k * n + ABSOLUTE_POS] = sums[k];
        }
        let place = near.places[ABSOLUTE_POS] as usize;
        counts[place] = count;
    }
}

/// Sums over the points within a radius, and their number.
#[cube]
pub(super) fn moments_within<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    center: Vector3<F>,
    radius: F,
    sums: &mut Array<F>,
) -> u32 {
    let n = near.radii.len();
    let mut count = 0u32.runtime();
    let mut of_leaf = Array::<F>::new(MOMENTS);
    #[unroll]
    for k in 0..MOMENTS {
        sums[k] = F::new(0.0);
    }
    let mut node = next_leaf::<F>(&near.tree, center, radius, 0usize, false);
    while node < near.tree.links.len() {
        #[unroll]
        for k in 0..MOMENTS {
            of_leaf[k] = F::new(0.0);
        }
        let first = first_of_leaf(&near.tree.links, node);
        for j in first..end_of_leaf(first, n) {
            let offset = Vector3::<F>::at(&near.tree.points, j).sub(center);
            if offset.dot(offset) <= radius * radius {
                let d = offset.scale(F::new(1.0) / radius);
                let w = weight::<F>(F::sqrt(d.dot(d)), epsilon::<F>(), steepness::<F>());
                add_moments::<F>(d, w, &mut of_leaf);
                count += 1u32;
            }
        }
        #[unroll]
        for k in 0..MOMENTS {
            sums[k] += of_leaf[k];
        }
        node = next_leaf::<F>(&near.tree, center, radius, node + 1, false);
    }
    count
}

/// Adds `w`, `w d` and `w d dᵀ` of an offset.
#[cube]
pub(crate) fn add_moments<F: Float>(d: Vector3<F>, w: F, sums: &mut Array<F>) {
    let wd = d.scale(w);
    sums[0] += w;
    sums[1] += wd.x;
    sums[2] += wd.y;
    sums[3] += wd.z;
    sums[4] += wd.x * d.x;
    sums[5] += wd.x * d.y;
    sums[6] += wd.x * d.z;
    sums[7] += wd.y * d.y;
    sums[8] += wd.y * d.z;
    sums[9] += wd.z * d.z;
}

/// Planes in sorted order and normals in input order.
#[cube(launch)]
fn find_planes<F: Float>(
    moments: &Array<F>,
    places: &Array<u32>,
    planes: &mut Array<F>,
    normals: &mut Array<F>,
) {
    let n = places.len();
    let at = ABSOLUTE_POS;
    if at < n {
        let fit = fit::<F>(moments, at, n);
        let found = fit.eigen;
        let sign = sign::<F>(found.first);
        let normal = found.first.scale(sign);
        normal.write(normals, places[at] as usize);
        // Turning two vectors of the three keeps the basis right-handed.
        let tangent = found.second.scale(sign);
        write_rows::<F>(normal, planes, 0usize, n);
        write_rows::<F>(tangent, planes, TANGENT, n);
        write_rows::<F>(fit.centroid, planes, CENTROID, n);
        write_rows::<F>(found.values, planes, VALUES, n);
        planes[WEIGHT * n + at] = fit.weight;
    }
}

/// `W`, `m` and the eigenvectors of `C`, whose eigenvalues are not negative; in units of the radius.
#[derive(CubeType, Clone, Copy)]
pub(crate) struct Fit<F: Float> {
    pub weight: F,
    pub centroid: Vector3<F>,
    pub eigen: Eigen<F>,
}

/// The plane of the moments at `at`, `at + pitch` and so on.
#[cube]
pub(crate) fn fit<F: Float>(moments: &Array<F>, at: usize, pitch: usize) -> Fit<F> {
    let weight = moments[at];
    let mx = moments[pitch + at] / weight;
    let my = moments[2 * pitch + at] / weight;
    let mz = moments[3 * pitch + at] / weight;
    let found = eigen::<F>(Symmetric::<F> {
        xx: moments[4 * pitch + at] / weight - mx * mx,
        xy: moments[5 * pitch + at] / weight - mx * my,
        xz: moments[6 * pitch + at] / weight - mx * mz,
        yy: moments[7 * pitch + at] / weight - my * my,
        yz: moments[8 * pitch + at] / weight - my * mz,
        zz: moments[9 * pitch + at] / weight - mz * mz,
    });
    Fit::<F> {
        weight,
        centroid: Vector3::<F>::of(mx, my, mz),
        eigen: Eigen::<F> {
            values: Vector3::<F> {
                x: not_negative::<F>(found.values.x),
                y: not_negative::<F>(found.values.y),
                z: not_negative::<F>(found.values.z),
            },
            first: found.first,
            second: found.second,
            third: found.third,
        },
    }
}

/// Writes three of the numbers of this unit's point, from number `k`.
#[cube]
fn write_rows<F: Float>(v: Vector3<F>, planes: &mut Array<F>, #[comptime] k: usize, n: usize) {
    planes[k * n + ABSOLUTE_POS] = v.x;
    planes[(k + 1) * n + ABSOLUTE_POS] = v.y;
    planes[(k + 2) * n + ABSOLUTE_POS] = v.z;
}

#[cube]
fn not_negative<F: Float>(x: F) -> F {
    select(x > F::new(0.0), x, F::new(0.0))
}

/// `+1` or `−1`: what makes the component of largest magnitude (the first among equals) positive.
#[cube]
fn sign<F: Float>(v: Vector3<F>) -> F {
    let of_two = select(v.y.abs() > v.x.abs(), v.y, v.x);
    let largest = select(v.z.abs() > of_two.abs(), v.z, of_two);
    select(largest < F::new(0.0), F::new(-1.0), F::new(1.0))
}
