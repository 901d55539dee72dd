//! Orientation by parity along the normal, as the paper prints it (its §2.2) and `isograd`'s `orient/parity.rs`
//! does it: the same probes, of which others are skipped.
//!
//! A probe needs no nearest sample, only whether one is in reach and how far it is safe to skip. A sample that is
//! about the nearest decides both but where it is a little out of reach: there the tree is searched for any in reach. So
//! a ray through the center of a sphere, from which all samples are equally far, is no more work than another.

use cubecl::prelude::*;
use isograd::orient::ParityOptions;
use isograd_element::vector;

use super::Error;
use crate::device::{Ready, launch};
use crate::neighbors::radius::bounds;
use crate::neighbors::{
    NeighborhoodArrays, Neighborhoods, SURE_SHARE, about_nearest, any_within, reaches,
};
use crate::primitives::ends::ends;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Lengths in the unit of the points.
#[derive(CubeLaunch, CubeType, Clone, Copy)]
struct Ray<F: Float + CubeElement> {
    radius: F,
    step: F,
    /// Probes that reach their own sample, whatever rounding makes of its distance.
    own: u32,
    /// No ray in a direction of unit length has more.
    probes: u32,
}

/// Writes normals and confidence, and returns the detection radius.
pub(super) fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
    options: &ParityOptions,
    [normals, confidence]: [&Buffer<T>; 2],
) -> Result<f64, Error> {
    options.check()?;
    let n = neighborhoods.len();
    if n == 0 {
        return Ok(0.0);
    }
    let radius = detection_radius(device, neighborhoods, options)?;
    let [low, high] = bounds(device, &neighborhoods.points)?.map(vector::to_f64);
    let diagonal = vector::norm(vector::sub(high, low));
    let step = options.probe_step(radius, diagonal)?;
    let ray = RayLaunch::new(
        <T as isograd::Real>::of(radius),
        <T as isograd::Real>::of(step),
        (radius / step) as u32,
        options.probes(radius, step, diagonal) as u32,
    );
    let (crossings, leading): (Buffer<u32>, Buffer<u32>) =
        (device.empty(2 * n)?, device.empty(2 * n)?);
    launch!(device, 2 * n => look_both_ways<T>(
        neighborhoods, axes, crossings, leading, Ready::new(ray),
    ));
    launch!(device, n => choose_sides<T>(
        crossings, leading, neighborhoods.places, axes, normals, confidence,
        u32::try_from(options.tolerance).unwrap_or(u32::MAX),
    ));
    Ok(radius)
}

/// `r_d`, by the most lonely point.
fn detection_radius<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    options: &ParityOptions,
) -> Result<f64, crate::Error> {
    // The point itself or an equal one is first, so the second is the nearest other.
    let k = neighborhoods.len().min(2);
    let squares = reaches(device, neighborhoods, k)?;
    let largest = device.download(&ends(device, &squares, 1)?)?[1];
    Ok(options.detection_radius(isograd::Real::f64(largest).sqrt()))
}

/// The pattern of every sample along its axis, and then of every sample against it: the number of crossings after
/// the first block, and of entries at the beginning that are not zero.
#[cube(launch)]
fn look_both_ways<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    axes: &Array<F>,
    crossings: &mut Array<u32>,
    leading: &mut Array<u32>,
    ray: Ray<F>,
) {
    let n = near.places.len();
    if ABSOLUTE_POS < crossings.len() {
        let position = ABSOLUTE_POS % n;
        let sign = select(ABSOLUTE_POS < n, F::new(1.0), F::new(-1.0));
        let start = Vector3::<F>::at(&near.tree.points, position);
        let direction = Vector3::<F>::at(axes, near.places[position] as usize).scale(sign);
        let mut m = 0u32.runtime();
        let mut inside = 1u32.runtime();
        let mut blocks = 0u32.runtime();
        let mut first = 0u32.runtime();
        let mut guess = position as u32;
        while m <= ray.probes
            && in_reach_of_box::<F>(
                &near.tree.nodes,
                probe::<F>(start, direction, m, ray.step),
                ray.radius,
            )
        {
            let at = probe::<F>(start, direction, m, ray.step);
            let sample = about_nearest::<F>(&near.tree, at, guess);
            guess = sample.point;
            let distance = F::sqrt(sample.square);
            let mut detected = select(m <= ray.own, 1u32, 0u32);
            // Distance along which the result stays the same.
            let mut same = F::new(0.0);
            if distance <= ray.radius {
                detected = 1u32;
                same = ray.radius - distance;
            } else {
                let sure = F::new(SURE_SHARE) * distance;
                if sure > ray.radius {
                    same = sure - ray.radius;
                } else if any_within::<F>(&near.tree, at, ray.radius * ray.radius) {
                    detected = 1u32;
                }
            }
            if inside == 1u32 && detected == 0u32 {
                first = select(blocks == 0u32, m, first);
                blocks += 1u32;
            }
            inside = detected;
            // A little less than the bound, so that rounding never skips a probe that differs.
            let skipped = min(F::new(0.999) * same / ray.step, F::cast_from(ray.probes));
            m += max(u32::cast_from(skipped), 1u32);
        }
        if inside == 1u32 {
            first = select(blocks == 0u32, m, first);
            blocks += 1u32;
        }
        crossings[ABSOLUTE_POS] = blocks - 1u32;
        leading[ABSOLUTE_POS] = first;
    }
}

/// Where probe `m` of a ray is.
#[cube]
fn probe<F: Float>(start: Vector3<F>, direction: Vector3<F>, m: u32, step: F) -> Vector3<F> {
    start.add(direction.scale(F::cast_from(m) * step))
}

/// Whether any sample can be in reach of a place: the root of the tree is the box of all.
#[cube]
fn in_reach_of_box<F: Float>(nodes: &Array<F>, at: Vector3<F>, radius: F) -> bool {
    at.x >= nodes[0] - radius
        && at.y >= nodes[1] - radius
        && at.z >= nodes[2] - radius
        && at.x <= nodes[3] + radius
        && at.y <= nodes[4] + radius
        && at.z <= nodes[5] + radius
}

/// The three iterations of the paper: each may turn the normal, and the next looks along it as it then stands.
#[cube(launch)]
fn choose_sides<F: Float>(
    crossings: &Array<u32>,
    leading: &Array<u32>,
    places: &Array<u32>,
    axes: &Array<F>,
    normals: &mut Array<F>,
    confidence: &mut Array<F>,
    tolerance: u32,
) {
    let n = places.len();
    if ABSOLUTE_POS < n {
        let along = crossings[ABSOLUTE_POS];
        let against = crossings[n + ABSOLUTE_POS];
        let odd = along % 2u32 == 1u32;
        let own = select(odd, against, along);
        let other = select(odd, along, against);
        let begins = select(odd, leading[n + ABSOLUTE_POS], leading[ABSOLUTE_POS]);
        let doubtful = own != 0u32 || begins > tolerance;
        let last = select(doubtful, other, own);
        let behind = select(doubtful, own, other);
        let mut turns = select(odd, 1u32, 0u32) + select(doubtful, 1u32, 0u32);
        turns += select(last > behind, 1u32, 0u32);
        let sign = select(turns % 2u32 == 1u32, F::new(-1.0), F::new(1.0));
        let place = places[ABSOLUTE_POS] as usize;
        Vector3::<F>::at(axes, place)
            .scale(sign)
            .write(normals, place);
        let closed = along % 2u32 != against % 2u32;
        confidence[place] = select(closed, F::new(1.0), F::new(0.0));
    }
}
