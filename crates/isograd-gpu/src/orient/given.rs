//! Normals that the cloud brings: as they are, or for their side alone.
//!
//! # Map
//! `(N, 3)` vectors `g_i` → `n_i = g_i/|g_i|`.
//!
//! # Pullback
//! `ḡ_i = (n̄_i − n_i (n_i·n̄_i)) / |g_i|`. The vectors are their own residual.

use cubecl::prelude::*;

use super::Error;
use crate::device::{check_length, launch};
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// The `(N, 3)` given vectors, each of length 1. Waits for the device.
///
/// # Errors
/// A vector that is zero or not finite, by the first one; [`crate::Error::Length`], [`crate::Error::TooLarge`],
/// [`crate::Error::Failed`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    given: &Buffer<T>,
) -> Result<Buffer<T>, Error> {
    let n = given.len() / 3;
    check_length("the given normals", given, 3 * n)?;
    let normals = device.empty(3 * n)?;
    if n == 0 {
        return Ok(normals);
    }
    let bad: Buffer<u32> = device.empty(n)?;
    launch!(device, n => normalize<T>(given, normals, bad));
    match flags::first(device, &bad)? {
        Some(index) => Err(isograd::orient::Error::NoDirection {
            index,
            kind: "the normal",
        }
        .into()),
        None => Ok(normals),
    }
}

/// Cotangents `(N, 3)` of the `given` vectors from those of the normals, `normals_bar` `(N, 3)`; finite for every
/// vector that [`forward`] takes.
pub fn pullback<R: Runtime, T: Scalar>(
    device: &Device<R>,
    given: &Buffer<T>,
    normals_bar: &Buffer<T>,
) -> Result<Buffer<T>, crate::Error> {
    check_length("normals_bar", normals_bar, given.len())?;
    let given_bar = device.empty(given.len())?;
    if !given.is_empty() {
        launch!(device, given.len() / 3 => pull_normalized<T>(
            given, normals_bar, given_bar, (given.len() / 3) as u32,
        ));
    }
    Ok(given_bar)
}

/// Turns every axis to the side of the given vector.
pub(super) fn turn_to<R: Runtime, T: Scalar>(
    device: &Device<R>,
    axes: &Buffer<T>,
    given: &Buffer<T>,
    [normals, confidence]: [&Buffer<T>; 2],
) -> Result<(), Error> {
    check_length("the given normals", given, axes.len())?;
    let units = forward(device, given)?;
    let n = axes.len() / 3;
    if n > 0 {
        launch!(device, n => turn_axes<T>(axes, units, normals, confidence));
    }
    Ok(())
}

#[cube(launch)]
fn normalize<F: Float>(given: &Array<F>, normals: &mut Array<F>, bad: &mut Array<u32>) {
    if ABSOLUTE_POS < bad.len() {
        let v = Vector3::<F>::at(given, ABSOLUTE_POS);
        let known = v.choose(v.is_finite(), Vector3::<F>::zero());
        let has_direction = known.largest() > F::new(0.0);
        known.direction().write(normals, ABSOLUTE_POS);
        bad[ABSOLUTE_POS] = select(has_direction, 0u32, 1u32);
    }
}

#[cube(launch)]
fn pull_normalized<F: Float>(
    given: &Array<F>,
    normals_bar: &Array<F>,
    given_bar: &mut Array<F>,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let v = Vector3::<F>::at(given, ABSOLUTE_POS);
        let bar = Vector3::<F>::at(normals_bar, ABSOLUTE_POS);
        let n = v.direction();
        // By the largest component first, whose square may be more or less than the number type holds.
        let scale = v.largest();
        let length = v.divide(scale).norm();
        let tangential = bar.sub(n.scale(n.dot(bar))).divide(length).divide(scale);
        let most = F::max_value();
        let held = Vector3::<F> {
            x: max(min(tangential.x, most), -most),
            y: max(min(tangential.y, most), -most),
            z: max(min(tangential.z, most), -most),
        };
        held.write(given_bar, ABSOLUTE_POS);
    }
}

#[cube(launch)]
fn turn_axes<F: Float>(
    axes: &Array<F>,
    units: &Array<F>,
    normals: &mut Array<F>,
    confidence: &mut Array<F>,
) {
    if ABSOLUTE_POS < confidence.len() {
        let axis = Vector3::<F>::at(axes, ABSOLUTE_POS);
        let cosine = axis.dot(Vector3::<F>::at(units, ABSOLUTE_POS));
        let sign = select(cosine < F::new(0.0), F::new(-1.0), F::new(1.0));
        axis.scale(sign).write(normals, ABSOLUTE_POS);
        confidence[ABSOLUTE_POS] = min(F::abs(cosine), F::new(1.0));
    }
}
