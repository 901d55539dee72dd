//! The sign of every normal: outward, away from matter.
//!
//! # Map
//! Axes `(N, 3)` of unit length and arbitrary sign → outward unit normals `(N, 3)` and a confidence for each, by
//! the methods of [`isograd::orient`], whose page says what they do: [`Method::Auto`], the default;
//! [`Method::Parity`], the paper's; [`Method::Sensors`] and [`Method::Signs`], where something is known of the sides.
//! Normals that are trusted as they are, are [`given`], and those of a step before are followed by [`previous`].
//!
//! The automatic method does on the device what concerns single samples, their neighbors and the cells of its grids.
//! The parts of the cloud and the domains that agree are found by the CPU's own code, from a copy of the graph.
//!
//! # Pullback
//! The signs are held constant: cotangents of the axes are those of the normals, with the same signs.
//!
//! # Not differentiable
//! The signs, and the confidence.

pub mod auto;
pub mod given;
mod parity;
pub mod previous;
mod sensors;

pub use isograd::orient::{Decided, ParityOptions};
pub use sensors::Sensors;

use cubecl::prelude::*;

use crate::device::check_length;
use crate::neighbors::{BLOCK, Neighborhoods};
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar, normals};

/// The axes of a cloud.
#[derive(Clone, Copy, Debug)]
pub struct Axes<'a, T> {
    /// `(N, 3)` of unit length, in input order.
    pub normals: &'a Buffer<T>,
    /// What they were found with, where that is known: the automatic method asks it where samples scatter.
    pub residual: Option<&'a normals::Residual<T>>,
    /// Typical distance between neighboring samples, above 0, in the unit of the points: the unit of length of the
    /// automatic method.
    pub spacing: T,
}

/// How the signs are chosen.
#[derive(Clone, Copy, Debug)]
pub enum Method<'a, T> {
    /// From enclosure, sky, sheets and neighbors; nothing to set. The confidence is how clearly these speak.
    Auto,
    /// By parity along the normal, as the paper prints it. The confidence is 1 where the parities of the two
    /// directions differ, as they must on a closed surface, else 0.
    Parity(ParityOptions),
    /// The side of these `(N, 3)` vectors, outward and of any length but 0. The confidence is the cosine between
    /// vector and axis.
    Signs(&'a Buffer<T>),
    /// The side from which the points were seen. The confidence of a clear view is 1; others are settled as in the
    /// automatic method.
    Sensors(Sensors<'a, T>),
}

/// Why there is no orientation.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The cloud or the options have none.
    #[error(transparent)]
    Cloud(#[from] isograd::orient::Error),
    /// The device can't find it.
    #[error(transparent)]
    Device(#[from] crate::Error),
}

/// Outward normals.
#[derive(Clone, Debug)]
pub struct Orientation<T> {
    /// `(N, 3)` outward unit normals, in input order.
    pub normals: Buffer<T>,
    /// `(N,)` from 0 to 1; see [`Method`].
    pub confidence: Buffer<T>,
    /// What decided how many signs.
    pub decided: Decided,
    /// `(1,)` number of axes whose sign was changed.
    pub flipped: Buffer<u32>,
    /// Of [`Method::Parity`]: `r_d`, in the unit of the points.
    pub detection_radius: Option<f64>,
}

/// Chooses the sign of each axis. Waits for the device.
///
/// # Errors
/// Parity options out of range, a cloud of duplicates for parity, a given vector that is zero or not finite, a point
/// at its sensor, no sensors; [`crate::Error::Length`], [`crate::Error::TooLarge`], [`crate::Error::Failed`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Axes<'_, T>,
    method: &Method<'_, T>,
) -> Result<Orientation<T>, Error> {
    check_length("the axes", axes.normals, 3 * neighborhoods.len())?;
    let turned = match method {
        Method::Auto => auto::forward(device, neighborhoods, axes, None),
        Method::Parity(options) => parity::forward(device, neighborhoods, axes.normals, options),
        Method::Signs(given) => given::turn_to(device, axes.normals, given),
        Method::Sensors(sensors) => {
            let views = sensors::views(device, neighborhoods, axes.normals, *sensors)?;
            auto::forward(device, neighborhoods, axes, Some(&views))
        }
    }?;
    Ok(Orientation {
        flipped: count_flipped(device, axes.normals, &turned.normals)?,
        normals: turned.normals,
        confidence: turned.confidence,
        decided: turned.decided,
        detection_radius: turned.detection_radius,
    })
}

/// What a method finds.
struct Turned<T> {
    normals: Buffer<T>,
    confidence: Buffer<T>,
    decided: Decided,
    detection_radius: Option<f64>,
}

fn count_flipped<R: Runtime, T: Scalar>(
    device: &Device<R>,
    axes: &Buffer<T>,
    normals: &Buffer<T>,
) -> Result<Buffer<u32>, crate::Error> {
    let flipped = device.empty(axes.len() / 3)?;
    if !flipped.is_empty() {
        flag_flipped::launch::<T, R>(
            device.client(),
            device.groups(flipped.len(), BLOCK),
            CubeDim::new_1d(BLOCK),
            axes.arg(),
            normals.arg(),
            flipped.arg(),
        );
    }
    flags::count(device, &flipped)
}

#[cube(launch)]
fn flag_flipped<F: Float>(axes: &Array<F>, normals: &Array<F>, flipped: &mut Array<u32>) {
    if ABSOLUTE_POS < flipped.len() {
        let axis = Vector3::<F>::at(axes, ABSOLUTE_POS);
        let along = axis.dot(Vector3::<F>::at(normals, ABSOLUTE_POS));
        flipped[ABSOLUTE_POS] = select(along < F::new(0.0), 1u32, 0u32);
    }
}
