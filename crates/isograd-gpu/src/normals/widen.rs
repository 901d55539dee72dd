//! Wider neighborhoods for the axes of samples that scatter: `isograd`'s `normals/widen.rs`, which says why.

use cubecl::prelude::*;
use isograd::normals::widen::{GAIN, RIM, ROUGH, STEPS};

use super::forward::{MOMENTS, fit, moments_within};
use super::pullback::rows;
use super::{Residual, VALUES};
use crate::device::launch;
use crate::element::plane;
use crate::neighbors::{BLOCK, NeighborhoodArrays, scatter};
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// The radii `(N,)` within which axes are to be found, in input order: those of the residual, widened where
/// neighborhoods are rough and wider ones far less so. For automatic radii; one that the user gave stays.
///
/// Only points that are still rough are tried again: their list stays on the device.
pub fn widen<R: Runtime, T: Scalar>(
    device: &Device<R>,
    residual: &Residual<T>,
) -> Result<Buffer<T>, Error> {
    let near = &residual.neighborhoods;
    let n = near.len();
    let (roughness, factors): (Buffer<T>, Buffer<T>) = (device.empty(n)?, device.empty(n)?);
    let widened: Buffer<T> = device.empty(n)?;
    if n == 0 {
        return Ok(widened);
    }
    let limits = [ROUGH, GAIN, RIM].concat();
    let limits: Vec<T> = limits.into_iter().map(<T as isograd::Real>::of).collect();
    let limits = device.upload(&limits)?;
    launch!(device, n, BLOCK => begin_widening<T>(residual.planes, roughness, factors));
    for step in STEPS {
        let rough: Buffer<u32> = device.empty(n)?;
        launch!(device, n, BLOCK => flag_rough<T>(roughness, rough, limits));
        let listed = flags::list(device, &rough)?;
        launch!(device, n, BLOCK => try_wider<T>(
            near, listed.indices, listed.sums, roughness, factors, limits,
            <T as isograd::Real>::of(step),
        ));
    }
    launch!(device, n, BLOCK => finish_widening<T>(near.radii, factors, widened));
    scatter(device, &widened, &near.places)
}

/// Roughness of a neighborhood from its ascending eigenvalues.
#[cube]
fn roughness<F: Float>(values: Vector3<F>) -> F {
    let mut found = F::new(0.0);
    if values.x > F::new(0.0) {
        let by_second = plane::roughness::<F>(values.x, values.y);
        found = by_second + plane::roughness::<F>(values.x, values.z);
    }
    found
}

#[cube(launch)]
fn begin_widening<F: Float>(planes: &Array<F>, rough: &mut Array<F>, factors: &mut Array<F>) {
    let n = rough.len();
    if ABSOLUTE_POS < n {
        rough[ABSOLUTE_POS] = roughness::<F>(rows::<F>(planes, VALUES, n));
        factors[ABSOLUTE_POS] = F::new(1.0);
    }
}

#[cube(launch)]
fn finish_widening<F: Float>(radii: &Array<F>, factors: &Array<F>, widened: &mut Array<F>) {
    if ABSOLUTE_POS < widened.len() {
        widened[ABSOLUTE_POS] = factors[ABSOLUTE_POS] * radii[ABSOLUTE_POS];
    }
}

#[cube(launch)]
fn flag_rough<F: Float + CubeElement>(rough: &Array<F>, flags: &mut Array<u32>, limits: &Array<F>) {
    if ABSOLUTE_POS < flags.len() {
        let is_rough = rough[ABSOLUTE_POS] > limits[0];
        flags[ABSOLUTE_POS] = select(is_rough, 1u32, 0u32);
    }
}

/// One unit tries one of the listed points, of which the last of `sums` says how many there are. `limits` are those of
/// the roughness, of the gain and of the one-sidedness.
#[cube(launch)]
fn try_wider<F: Float + CubeElement>(
    near: &NeighborhoodArrays<F>,
    listed: &Array<u32>,
    sums: &Array<u32>,
    rough: &mut Array<F>,
    factors: &mut Array<F>,
    limits: &Array<F>,
    step: F,
) {
    let count = sums[sums.len() - 1];
    if ABSOLUTE_POS < count as usize {
        let at = listed[ABSOLUTE_POS] as usize;
        let center = Vector3::<F>::at(&near.tree.points, at);
        let mut sums = Array::<F>::new(MOMENTS);
        moments_within::<F>(near, center, step * near.radii[at], &mut sums);
        let fit = fit::<F>(&sums, 0usize, 1usize);
        let second = fit.eigen.second.dot(fit.centroid);
        let third = fit.eigen.third.dot(fit.centroid);
        let one_sided = F::sqrt(second * second + third * third);
        let wider = roughness::<F>(fit.eigen.values);
        let own = rough[at];
        let share = (F::new(1.0) - plane::falling::<F>(own, limits[0], limits[1]))
            * plane::falling::<F>(wider / own, limits[2], limits[3])
            * plane::falling::<F>(one_sided, limits[4], limits[5]);
        if share > F::new(0.0) {
            rough[at] = share * wider + (F::new(1.0) - share) * own;
            factors[at] = share * step + (F::new(1.0) - share) * factors[at];
        }
    }
}
