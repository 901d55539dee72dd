//! Axes in sorted order, and how far samples scatter about the planes that they are of.

use cubecl::prelude::*;

use super::in_single;
use crate::device::check_length;
use crate::element::coupling;
use crate::neighbors::{BLOCK, Neighborhoods};
use crate::normals::{CENTROID, Residual, VALUES};
use crate::primitives::fill::zeros;
use crate::vector::Vector3;
use crate::{Buffer, Device, Error, Scalar};

/// Axes `(N, 3)` of unit length, in sorted order; zero where there is no direction.
pub(super) fn take<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
) -> Result<Buffer<f32>, Error> {
    let n = neighborhoods.len();
    let axis = device.empty(3 * n)?;
    if n > 0 {
        take_axes::launch::<T, R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            axes.arg(),
            neighborhoods.places.arg(),
            axis.arg(),
        );
    }
    Ok(axis)
}

/// Spread and side `(N,)` of the samples whose axes are of wider neighborhoods than their own; 0 for others.
pub(super) fn spreads<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
    planes: Option<&Residual<T>>,
    per_spacing: T,
) -> Result<(Buffer<f32>, Buffer<f32>), Error> {
    let n = neighborhoods.len();
    let Some(planes) = planes else {
        return Ok((zeros(device, n)?, zeros(device, n)?));
    };
    let within = &planes.neighborhoods.radii;
    check_length("the planes of the axes", within, n)?;
    let (spread, side) = (device.empty(n)?, device.empty(n)?);
    if n > 0 {
        find_spreads::launch::<T, R>(
            device.client(),
            device.groups(n, BLOCK),
            CubeDim::new_1d(BLOCK),
            planes.planes.arg(),
            within.arg(),
            neighborhoods.radii.arg(),
            neighborhoods.places.arg(),
            axes.arg(),
            spread.arg(),
            side.arg(),
            per_spacing,
        );
    }
    Ok((spread, side))
}

#[cube(launch)]
fn take_axes<F: Float>(axes: &Array<F>, places: &Array<u32>, axis: &mut Array<f32>) {
    if ABSOLUTE_POS < places.len() {
        let given = Vector3::<F>::at(axes, places[ABSOLUTE_POS] as usize);
        let unit = given
            .choose(given.is_finite(), Vector3::<F>::zero())
            .direction();
        in_single::<F>(unit).write(axis, ABSOLUTE_POS);
    }
}

/// `within` are the radii of the planes, whose numbers are in units of them.
#[cube(launch)]
fn find_spreads<F: Float + CubeElement>(
    planes: &Array<F>,
    within: &Array<F>,
    radii: &Array<F>,
    places: &Array<u32>,
    axes: &Array<F>,
    spread: &mut Array<f32>,
    side: &mut Array<f32>,
    per_spacing: F,
) {
    let n = places.len();
    let p = ABSOLUTE_POS;
    if p < n {
        let mut deviation = 0.0f32;
        let mut toward = 0.0f32;
        let value = planes[VALUES * n + p];
        if within[p] > radii[p] && value > F::new(0.0) {
            let centroid = Vector3::<F> {
                x: planes[CENTROID * n + p],
                y: planes[(CENTROID + 1) * n + p],
                z: planes[(CENTROID + 2) * n + p],
            };
            let axis = Vector3::<F>::at(axes, places[p] as usize);
            let off = F::sqrt(value);
            deviation = f32::cast_from(off * within[p] * per_spacing);
            toward = coupling::side(f32::cast_from(-centroid.dot(axis) / off));
        }
        spread[p] = deviation;
        side[p] = toward;
    }
}
