//! The sheet of surface that a sample lies on, where other sheets pass close by: why, and how it is found, is in
//! `isograd`'s `orient/sheet.rs`.
//!
//! The plane of a sheet is found in single precision: what its samples lie off their mean is taken first and
//! squared then, so that little is lost.

use cubecl::prelude::*;

use super::offset;
use crate::element::coupling::NEIGHBORS;
use crate::element::eigen::{Symmetric, eigen};
use crate::element::sheet::{self, QUORUM, REST, SPANNING};
use crate::neighbors::{BLOCK, Neighborhoods};
use crate::primitives::smallest::ranked;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Numbers of the offsets of a point.
const OFFSETS: usize = 3 * NEIGHBORS;

/// [`QUORUM`] as the kernel counts.
const FITTED: u32 = QUORUM as u32;

/// The axis `(N, 3)` of the own sheet of each point whose neighbors lie on several, else the one given, and how far
/// the samples of the sheet lie off it, else 0; in sorted order.
pub(super) fn find<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    near: &Buffer<u32>,
    given: &Buffer<f32>,
    per_spacing: T,
) -> Result<(Buffer<f32>, Buffer<f32>), Error> {
    let n = neighborhoods.len();
    let (axis, scatter) = (device.empty(3 * n)?, device.empty(n)?);
    if n > 0 {
        find_sheets::launch::<T, R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            neighborhoods.points.arg(),
            near.arg(),
            given.arg(),
            axis.arg(),
            scatter.arg(),
            per_spacing,
        );
    }
    Ok((axis, scatter))
}

#[cube(launch)]
fn find_sheets<F: Float + CubeElement>(
    points: &Array<F>,
    near: &Array<u32>,
    given: &Array<f32>,
    axis: &mut Array<f32>,
    scatter: &mut Array<f32>,
    per_spacing: F,
) {
    let p = ABSOLUTE_POS;
    if p < scatter.len() {
        let x = Vector3::<F>::at(points, p);
        let mut offsets = Array::<f32>::new(OFFSETS);
        #[unroll]
        for slot in 0..NEIGHBORS {
            let d = offset::<F>(points, x, near[NEIGHBORS * p + slot], per_spacing);
            d.store(&mut offsets, 3 * slot);
        }
        let own = Vector3::<f32>::at(given, p);
        let mut distances = Array::<f32>::new(NEIGHBORS);
        measure_distances(&offsets, own, &mut distances);
        let rest_together = ranked::<f32>(&distances, NEIGHBORS, REST);
        let mut fit = ranked::<f32>(&distances, NEIGHBORS, QUORUM);
        // Of the given plane and those spanned by two near neighbors, the one closest to a quorum.
        let mut best_x = own.x;
        let mut best_y = own.y;
        let mut best_z = own.z;
        for j in 0..SPANNING {
            let a = offset::<F>(points, x, near[NEIGHBORS * p + j], per_spacing);
            for k in j + 1..SPANNING {
                let b = offset::<F>(points, x, near[NEIGHBORS * p + k], per_spacing);
                let cross = a.cross(b);
                let square = cross.dot(cross);
                if sheet::spans(square, a.dot(a) * b.dot(b)) {
                    let normal = cross.scale(1.0f32 / f32::sqrt(square));
                    measure_distances(&offsets, normal, &mut distances);
                    if count_below(&distances, fit) >= FITTED {
                        fit = ranked::<f32>(&distances, NEIGHBORS, QUORUM);
                        best_x = normal.x;
                        best_y = normal.y;
                        best_z = normal.z;
                    }
                }
            }
        }
        let normal = Vector3::<f32>::of(best_x, best_y, best_z);
        measure_distances(&offsets, normal, &mut distances);
        let rest = max(ranked::<f32>(&distances, NEIGHBORS, REST), rest_together);
        if sheet::stands_out(fit, rest) {
            let limit = sheet::limit(fit, rest);
            let plane = plane_within::<f32>(&offsets, &distances, limit);
            let turned = plane.normal.scale(-1.0f32);
            let found = turned.choose(plane.normal.dot(own) < 0.0f32, plane.normal);
            found.write(axis, p);
            scatter[p] = sheet::scatter(plane.deviation, limit);
        } else {
            own.write(axis, p);
            scatter[p] = 0.0f32;
        }
    }
}

/// Distances of the neighbors from a plane through the sample.
#[cube]
fn measure_distances(offsets: &Array<f32>, normal: Vector3<f32>, distances: &mut Array<f32>) {
    #[unroll]
    for slot in 0..NEIGHBORS {
        let d = Vector3::<f32>::load(offsets, 3 * slot);
        distances[slot] = d.dot(normal).abs();
    }
}

#[cube]
fn count_below(distances: &Array<f32>, limit: f32) -> u32 {
    let mut count = 0u32;
    #[unroll]
    for slot in 0..NEIGHBORS {
        count += select(distances[slot] < limit, 1u32, 0u32);
    }
    count
}

#[derive(CubeType, Clone, Copy)]
struct Plane<F: Float> {
    normal: Vector3<F>,
    /// Root mean square distance from it.
    deviation: F,
}

/// Least-squares plane of the sample itself and the neighbors whose distance from the plane at hand is within the
/// limit.
#[cube]
fn plane_within<F: Float>(offsets: &Array<F>, distances: &Array<F>, limit: F) -> Plane<F> {
    // The sample itself is one of them, at 0.
    let mut count = F::new(1.0);
    let mut x = F::new(0.0);
    let mut y = F::new(0.0);
    let mut z = F::new(0.0);
    #[unroll]
    for slot in 0..NEIGHBORS {
        let on = select(distances[slot] <= limit, F::new(1.0), F::new(0.0));
        let d = Vector3::<F>::load(offsets, 3 * slot).scale(on);
        count += on;
        x += d.x;
        y += d.y;
        z += d.z;
    }
    let sum = Vector3::<F> { x, y, z };
    let mean = sum.scale(F::new(1.0) / count);
    let mut xx = mean.x * mean.x;
    let mut xy = mean.x * mean.y;
    let mut xz = mean.x * mean.z;
    let mut yy = mean.y * mean.y;
    let mut yz = mean.y * mean.z;
    let mut zz = mean.z * mean.z;
    #[unroll]
    for slot in 0..NEIGHBORS {
        let on = select(distances[slot] <= limit, F::new(1.0), F::new(0.0));
        let d = Vector3::<F>::load(offsets, 3 * slot).sub(mean).scale(on);
        xx += d.x * d.x;
        xy += d.x * d.y;
        xz += d.x * d.z;
        yy += d.y * d.y;
        yz += d.y * d.z;
        zz += d.z * d.z;
    }
    let found = eigen::<F>(Symmetric::<F> {
        xx,
        xy,
        xz,
        yy,
        yz,
        zz,
    });
    let normal = found.first;
    let height = mean.dot(normal);
    let mut squares = height * height;
    #[unroll]
    for slot in 0..NEIGHBORS {
        let on = select(distances[slot] <= limit, F::new(1.0), F::new(0.0));
        let d = Vector3::<F>::load(offsets, 3 * slot).sub(mean);
        let height = on * d.dot(normal);
        squares += height * height;
    }
    Plane::<F> {
        normal,
        deviation: F::sqrt(squares / count),
    }
}
