//! Morton codes: places in the order of a curve that keeps neighbours together.

use cubecl::prelude::*;

use super::triangle::corners;
use super::{Error, Mesh};
use crate::primitives::sort;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Units of a group.
const BLOCK: u32 = 256;

/// Boxes that one unit joins where the bounds of all are sought.
const JOINED: usize = 64;

/// Low and high corner of all vertices.
pub(super) fn bounds<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    origin: [T; 3],
) -> Result<Buffer<T>, Error> {
    let mut items = mesh.vertices.clone();
    let mut count = items.len() / 3;
    let mut points = true;
    while points || count > 1 {
        let joined = count.div_ceil(JOINED);
        let boxes = device.empty(joined * 6)?;
        join_runs::launch::<T, R>(
            device.client(),
            device.groups(joined, BLOCK),
            CubeDim::new_1d(BLOCK),
            items.arg(),
            boxes.arg(),
            origin[0],
            origin[1],
            origin[2],
            count as u32,
            JOINED as u32,
            points,
        );
        (items, count, points) = (boxes, joined, false);
    }
    Ok(items)
}

/// The order of the faces by the Morton codes of their centres.
pub(super) fn face_order<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    origin: [T; 3],
    bounds: &Buffer<T>,
) -> Result<sort::Order, Error> {
    let count = mesh.faces.len() / 3;
    let codes = device.empty(count)?;
    code_centres::launch::<T, R>(
        device.client(),
        device.groups(count, BLOCK),
        CubeDim::new_1d(BLOCK),
        mesh.vertices.arg(),
        mesh.faces.arg(),
        bounds.arg(),
        codes.arg(),
        origin[0],
        origin[1],
        origin[2],
    );
    Ok(sort::order(device, &codes, 1 << 30)?)
}

/// The order of points by their Morton codes within `bounds`.
pub(super) fn point_order<T: Scalar, R: Runtime>(
    device: &Device<R>,
    points: &Buffer<T>,
    bounds: &Buffer<T>,
) -> Result<sort::Order, Error> {
    let count = points.len() / 3;
    let codes = device.empty(count)?;
    code_points::launch::<T, R>(
        device.client(),
        device.groups(count, BLOCK),
        CubeDim::new_1d(BLOCK),
        points.arg(),
        bounds.arg(),
        codes.arg(),
    );
    Ok(sort::order(device, &codes, 1 << 30)?)
}

/// The bounds of each run of `length` points, or of boxes.
#[cube(launch)]
fn join_runs<F: Float + CubeElement>(
    items: &Array<F>,
    boxes: &mut Array<F>,
    x: F,
    y: F,
    z: F,
    count: u32,
    length: u32,
    #[comptime] points: bool,
) {
    if ABSOLUTE_POS < boxes.len() / 6 {
        let first = ABSOLUTE_POS as u32 * length;
        let mut low = Array::<F>::new(3usize);
        let mut high = Array::<F>::new(3usize);
        for item in first..min(first + length, count) {
            for axis in 0..3usize {
                let mut from = item as usize * 6;
                let mut shift = F::new(0.0);
                let mut span = 3usize.runtime();
                if comptime!(points) {
                    from = item as usize * 3;
                    shift = select(axis == 0, x, select(axis == 1, y, z));
                    span = 0usize;
                }
                let a = items[from + axis] - shift;
                let b = items[from + span + axis] - shift;
                let fresh = item == first;
                low[axis] = select(fresh, a, min(low[axis], a));
                high[axis] = select(fresh, b, max(high[axis], b));
            }
        }
        for axis in 0..3usize {
            boxes[ABSOLUTE_POS * 6 + axis] = low[axis];
            boxes[ABSOLUTE_POS * 6 + 3 + axis] = high[axis];
        }
    }
}

/// The lowest ten bits, two places apart.
#[cube]
fn spread(bits: u32) -> u32 {
    let a = (bits | (bits << 16u32)) & 0x0300_00ffu32;
    let b = (a | (a << 8u32)) & 0x0300_f00fu32;
    let c = (b | (b << 4u32)) & 0x030c_30c3u32;
    (c | (c << 2u32)) & 0x0924_9249u32
}

/// Ten bits of where `x` is between two numbers.
#[cube]
fn ten_bits<F: Float>(x: F, low: F, high: F) -> u32 {
    let mut bits = 0u32.runtime();
    if high > low {
        let part = min(max((x - low) / (high - low), F::new(0.0)), F::new(1.0));
        bits = min(u32::cast_from(part * F::new(1024.0)), 1023u32);
    }
    bits
}

/// Morton code of a place within bounds, 30 bits.
#[cube]
fn morton<F: Float>(place: Vector3<F>, bounds: &Array<F>) -> u32 {
    let x = spread(ten_bits::<F>(place.x, bounds[0], bounds[3]));
    let y = spread(ten_bits::<F>(place.y, bounds[1], bounds[4]));
    let z = spread(ten_bits::<F>(place.z, bounds[2], bounds[5]));
    (x << 2u32) | (y << 1u32) | z
}

#[cube(launch)]
fn code_centres<F: Float + CubeElement>(
    vertices: &Array<F>,
    faces: &Array<u32>,
    bounds: &Array<F>,
    codes: &mut Array<u32>,
    x: F,
    y: F,
    z: F,
) {
    if ABSOLUTE_POS < codes.len() {
        let t = corners::<F>(
            vertices,
            faces,
            ABSOLUTE_POS as u32,
            Vector3::<F> { x, y, z },
        );
        let third = F::new(1.0) / F::new(3.0);
        let centre = Vector3::<F> {
            x: t.a.x * third + t.b.x * third + t.c.x * third,
            y: t.a.y * third + t.b.y * third + t.c.y * third,
            z: t.a.z * third + t.b.z * third + t.c.z * third,
        };
        codes[ABSOLUTE_POS] = morton::<F>(centre, bounds);
    }
}

#[cube(launch)]
fn code_points<F: Float>(points: &Array<F>, bounds: &Array<F>, codes: &mut Array<u32>) {
    if ABSOLUTE_POS < codes.len() {
        codes[ABSOLUTE_POS] = morton::<F>(Vector3::<F>::at(points, ABSOLUTE_POS), bounds);
    }
}
