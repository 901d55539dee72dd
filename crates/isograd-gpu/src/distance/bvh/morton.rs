//! Morton codes: places in the order of a curve that keeps neighbors together.

use cubecl::prelude::*;

use super::super::triangle::corners;
use super::super::{Error, Mesh, MeshArrays};
use crate::device::launch;
use crate::primitives::morton::spread_bits;
use crate::primitives::sort;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// The order of the faces by the Morton codes of their centers within `bounds`.
pub(super) fn face_order<T: Scalar, R: Runtime>(
    device: &Device<R>,
    mesh: &Mesh<T>,
    bounds: &Buffer<T>,
) -> Result<sort::Order, Error> {
    let count = mesh.faces.len() / 3;
    let codes = device.empty(count)?;
    launch!(device, count => code_centers<T>(mesh, bounds, codes));
    Ok(sort::order(device, &codes, 1 << 30)?)
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
    let x = spread_bits(ten_bits::<F>(place.x, bounds[0], bounds[3]));
    let y = spread_bits(ten_bits::<F>(place.y, bounds[1], bounds[4]));
    let z = spread_bits(ten_bits::<F>(place.z, bounds[2], bounds[5]));
    (x << 2u32) | (y << 1u32) | z
}

#[cube(launch)]
fn code_centers<F: Float + CubeElement>(
    mesh: &MeshArrays<F>,
    bounds: &Array<F>,
    codes: &mut Array<u32>,
) {
    if ABSOLUTE_POS < codes.len() {
        let t = corners::<F>(mesh, ABSOLUTE_POS as u32, Vector3::<F>::zero());
        let third = F::new(1.0) / F::new(3.0);
        let center = t.a.scale(third).add(t.b.scale(third)).add(t.c.scale(third));
        codes[ABSOLUTE_POS] = morton::<F>(center, bounds);
    }
}
