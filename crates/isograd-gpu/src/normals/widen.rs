//! Wider neighborhoods for the axes of samples that scatter: `isograd`'s `normals/widen.rs`, which says why.

use cubecl::prelude::*;
use isograd::normals::widen::{GAIN, RIM, ROUGH, STEPS};

use super::forward::{MOMENTS, fit, moments_within};
use super::{Residual, VALUES};
use crate::device::launch;
use crate::element::plane;
use crate::neighbors::{BLOCK, NeighborhoodArrays, scatter};
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// The radii `(N,)` within which axes are to be found, in input order: those of the residual, and wider ones where
/// neighborhoods are rough and wider ones far less so. For automatic radii; one that the user gave stays.
///
/// Only points that are still rough are tried again: their list stays on the device.
pub fn widen<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
) -> Result<Buffer<T>, Error> {
    let near = &residual.neighborhoods;
    let n = near.len();
    let (roughness, widened): (Buffer<T>, Buffer<T>) = (device.empty(n)?, device.empty(n)?);
    if n == 0 {
        return Ok(widened);
    }
    launch!(device, n, BLOCK => begin_widening<T>(residual.planes, near.radii, roughness, widened));
    for step in STEPS {
        let rough: Buffer<u32> = device.empty(n)?;
        launch!(device, n, BLOCK => flag_rough<T>(
            roughness, rough, <T as isograd::Real>::of(ROUGH),
        ));
        let listed = flags::list(device, &rough)?;
        launch!(device, n, BLOCK => try_wider<T>(
            near, listed.indices, listed.sums, roughness, widened, <T as isograd::Real>::of(step),
            <T as isograd::Real>::of(GAIN), <T as isograd::Real>::of(RIM * RIM),
        ));
    }
    scatter(device, &widened, &near.places)
}

/// Roughness of a neighborhood from its ascending eigenvalues; practically infinite if the smallest equals another.
#[cube]
fn roughness<F: Float>(values: Vector3<F>) -> F {
    let mut found = F::new(0.0);
    if values.x > F::new(0.0) {
        found = share::<F>(values.x, values.y) + share::<F>(values.x, values.z);
    }
    found
}

#[cube]
fn share<F: Float>(first: F, value: F) -> F {
    let gap = value - first;
    let mut share = F::new(1e30);
    if gap * gap > F::new(0.0) {
        share = plane::roughness::<F>(first, value);
    }
    share
}

#[cube(launch)]
fn begin_widening<F: Float>(
    planes: &Array<F>,
    radii: &Array<F>,
    rough: &mut Array<F>,
    widened: &mut Array<F>,
) {
    let n = radii.len();
    if ABSOLUTE_POS < n {
        let values = Vector3::<F> {
            x: planes[VALUES * n + ABSOLUTE_POS],
            y: planes[(VALUES + 1) * n + ABSOLUTE_POS],
            z: planes[(VALUES + 2) * n + ABSOLUTE_POS],
        };
        rough[ABSOLUTE_POS] = roughness::<F>(values);
        widened[ABSOLUTE_POS] = radii[ABSOLUTE_POS];
    }
}

#[cube(launch)]
fn flag_rough<F: Float + CubeElement>(rough: &Array<F>, flags: &mut Array<u32>, most: F) {
    if ABSOLUTE_POS < flags.len() {
        let is_rough = rough[ABSOLUTE_POS] > most;
        flags[ABSOLUTE_POS] = select(is_rough, 1u32, 0u32);
    }
}

/// One unit tries one of the listed points, of which the last of `sums` says how many there are.
#[cube(launch)]
fn try_wider<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    listed: &Array<u32>,
    sums: &Array<u32>,
    rough: &mut Array<F>,
    widened: &mut Array<F>,
    step: F,
    gain: F,
    rim_squared: F,
) {
    let count = sums[sums.len() - 1];
    if ABSOLUTE_POS < count as usize {
        let at = listed[ABSOLUTE_POS] as usize;
        let center = Vector3::<F>::at(&near.tree.points, at);
        let radius = step * near.radii[at];
        let mut sums = Array::<F>::new(MOMENTS);
        moments_within::<F>(near, center, radius, &mut sums);
        let fit = fit::<F>(&sums, 0usize, 1usize);
        let second = fit.eigen.second.dot(fit.centroid);
        let third = fit.eigen.third.dot(fit.centroid);
        let is_at_rim = second * second + third * third > rim_squared;
        let found = roughness::<F>(fit.eigen.values);
        if found <= gain * rough[at] && !is_at_rim {
            rough[at] = found;
            widened[at] = radius;
        }
    }
}
