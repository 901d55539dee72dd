//! Points along a Z-order curve.

use cubecl::prelude::*;

use super::BLOCK;
use crate::device::launch;
use crate::primitives::morton::spread_bits;
use crate::primitives::sort::order;
use crate::{Buffer, Device, Error, Scalar};

/// Bits of a coordinate in each of the two words of its key.
const BITS: u32 = 10;

/// Points of which the middle is taken for the origin of the curve.
const SAMPLES: usize = 9;

/// The index in the input of each point along the curve. Where keys are equal, input order.
///
/// The order decides about time, not about results: any is right.
pub(super) fn along_curve<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
) -> Result<Buffer<u32>, Error> {
    let count = points.len() / 3;
    let high = device.empty(count)?;
    let low = device.empty(count)?;
    if count == 0 {
        return Ok(low);
    }
    launch!(device, count, BLOCK => fill_keys<T>(points, high, low));
    let limit = 1 << (3 * BITS);
    let by_low = order(device, &low, limit)?.places;
    let by_both = order(device, &gather(device, &high, &by_low, 1)?, limit)?.places;
    gather(device, &by_low, &by_both, 1)
}

/// Row `i` of the result is row `places[i]` of `values`, rows having `width` elements.
pub(crate) fn gather<R: Runtime, E: Numeric + CubeElement>(
    device: &Device<R>,
    values: &Buffer<E>,
    places: &Buffer<u32>,
    width: usize,
) -> Result<Buffer<E>, Error> {
    let gathered = device.empty(width * places.len())?;
    if !gathered.is_empty() {
        launch!(device, gathered.len(), BLOCK => gather_rows<E>(values, places, gathered, width));
    }
    Ok(gathered)
}

/// The other way round: element `i` goes to `places[i]`.
pub(crate) fn scatter<R: Runtime, E: Numeric + CubeElement>(
    device: &Device<R>,
    values: &Buffer<E>,
    places: &Buffer<u32>,
) -> Result<Buffer<E>, Error> {
    let scattered = device.empty(values.len())?;
    if !values.is_empty() {
        launch!(device, values.len(), BLOCK => scatter_elements<E>(values, places, scattered));
    }
    Ok(scattered)
}

#[cube(launch)]
fn scatter_elements<E: Numeric>(values: &Array<E>, places: &Array<u32>, scattered: &mut Array<E>) {
    if ABSOLUTE_POS < values.len() {
        let place = places[ABSOLUTE_POS] as usize;
        scattered[place] = values[ABSOLUTE_POS];
    }
}

#[cube(launch)]
fn gather_rows<E: Numeric>(
    values: &Array<E>,
    places: &Array<u32>,
    gathered: &mut Array<E>,
    #[comptime] width: usize,
) {
    if ABSOLUTE_POS < gathered.len() {
        let row = places[ABSOLUTE_POS / width] as usize;
        gathered[ABSOLUTE_POS] = values[row * width + ABSOLUTE_POS % width];
    }
}

/// The two words of each point's key.
#[cube(launch)]
fn fill_keys<F: Float>(points: &Array<F>, high: &mut Array<u32>, low: &mut Array<u32>) {
    if ABSOLUTE_POS < high.len() {
        let mut upper = 0u32;
        let mut lower = 0u32;
        #[unroll]
        for axis in 0..3usize {
            let offset = points[3 * ABSOLUTE_POS + axis] - middle::<F>(points, axis);
            let offset = f32::cast_from(offset);
            // Both zeros are equal.
            let bits = ordered_bits(select(offset == 0.0f32, 0.0f32, offset)) >> 12u32;
            upper |= spread_bits(bits >> 10u32) << (axis as u32);
            lower |= spread_bits(bits) << (axis as u32);
        }
        high[ABSOLUTE_POS] = upper;
        low[ABSOLUTE_POS] = lower;
    }
}

/// The median of one coordinate of a few points: near most of them, whatever the others are.
#[cube]
fn middle<F: Float>(points: &Array<F>, axis: usize) -> F {
    let stride = (points.len() / 3).div_ceil(SAMPLES);
    let samples = (points.len() / 3).div_ceil(stride);
    let mut middle = points[axis];
    for i in 0..samples {
        let own = points[3 * i * stride + axis];
        let mut rank = 0usize;
        for j in 0..samples {
            let other = points[3 * j * stride + axis];
            if other < own || (other == own && j < i) {
                rank += 1;
            }
        }
        if rank == samples / 2 {
            middle = own;
        }
    }
    middle
}

/// Bits whose order as whole numbers is that of the numbers.
#[cube]
pub(super) fn ordered_bits(x: f32) -> u32 {
    let bits = u32::reinterpret(x);
    let negative = bits >> 31u32;
    select(negative == 1u32, !bits, bits | 0x8000_0000u32)
}
