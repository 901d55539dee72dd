//! Sides from where the samples were seen: `isograd`'s `orient/sensors.rs`, which says why.

use cubecl::prelude::*;

use super::Error;
use crate::device::check_length;
use crate::element::evidence;
use crate::neighbors::{BLOCK, Neighborhoods};
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Where a cloud was seen from, in the unit of its points.
#[derive(Clone, Copy, Debug)]
pub enum Sensors<'a, T> {
    /// `(N, 3)` the position from which each point was seen.
    Each(&'a Buffer<T>),
    /// `(S, 3)` positions; from which of them a point was seen is not known.
    Any(&'a Buffer<T>),
}

/// `(N,)` cosine, from −1 to 1, between each of the `(N, 3)` axes and the direction from its point to its sensor; 0
/// where the sensors that may have seen it are on both sides. All in input order. Waits for the device.
pub(super) fn views<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
    sensors: Sensors<'_, T>,
) -> Result<Buffer<f32>, Error> {
    let n = neighborhoods.len();
    let (positions, each) = match sensors {
        Sensors::Each(positions) => {
            check_length("the sensor positions", positions, 3 * n)?;
            (positions, true)
        }
        Sensors::Any(positions) if positions.is_empty() => {
            return Err(isograd::orient::Error::NoSensors.into());
        }
        Sensors::Any(positions) => {
            check_length("the sensor positions", positions, positions.len() / 3 * 3)?;
            (positions, false)
        }
    };
    let (views, bad): (Buffer<f32>, Buffer<u32>) = (device.empty(n)?, device.empty(n)?);
    if n == 0 {
        return Ok(views);
    }
    look::launch::<T, R>(
        device.client(),
        device.groups(n, BLOCK),
        CubeDim::new_1d(BLOCK),
        neighborhoods.points.arg(),
        neighborhoods.places.arg(),
        axes.arg(),
        positions.arg(),
        views.arg(),
        bad.arg(),
        each,
    );
    match flags::first(device, &bad)? {
        Some(index) => Err(isograd::orient::Error::SensorOnPoint { index }.into()),
        None => Ok(views),
    }
}

/// A unit for each sorted point.
#[cube(launch)]
fn look<F: Float>(
    points: &Array<F>,
    places: &Array<u32>,
    axes: &Array<F>,
    sensors: &Array<F>,
    views: &mut Array<f32>,
    bad: &mut Array<u32>,
    #[comptime] each: bool,
) {
    if ABSOLUTE_POS < places.len() {
        let i = places[ABSOLUTE_POS] as usize;
        let x = Vector3::<F>::at(points, ABSOLUTE_POS);
        let axis = Vector3::<F>::at(axes, i);
        let mut first = 0usize.runtime();
        let mut end = sensors.len() / 3;
        if each {
            first = i;
            end = i + 1;
        }
        let mut view = f32::new(0.0);
        let mut blind = 0u32.runtime();
        for s in first..end {
            let sight = Vector3::<F>::at(sensors, s).sub(x);
            // Not finite, or no direction.
            let clear = sight.is_finite() && sight.largest() > F::new(0.0);
            blind = select(clear, blind, 1u32);
            let cosine = f32::cast_from(axis.dot(sight.direction()));
            view = select(s == first, cosine, evidence::agreed::<f32>(view, cosine));
        }
        views[i] = view;
        bad[i] = blind;
    }
}
