//! The sign of every normal: outward, away from matter.
//!
//! # Map
//! Axes `(N, 3)` of unit length and arbitrary sign → outward unit normals `(N, 3)` and a confidence for each, by
//! those methods of [`isograd::orient`] that a time loop needs: [`Method::Parity`], the paper's, and
//! [`Method::Signs`]. [`given`] takes normals that the cloud brings, and [`previous`] the signs of the step before.
//! The other methods orient a cloud once, on the CPU: see [`RadiiAndSigns::find`](crate::pipeline::RadiiAndSigns::find).
//!
//! # Pullback
//! The signs are held constant: cotangents of the axes are those of the normals, with the same signs.
//!
//! # Not differentiable
//! The signs, and the confidence.

pub mod given;
mod parity;
pub mod previous;

pub use isograd::orient::ParityOptions;

use cubecl::prelude::*;

use crate::device::{check_length, launch};
use crate::neighbors::Neighborhoods;
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Choice of the signs.
#[derive(Clone, Debug)]
pub enum Method<T> {
    /// By parity along the normal, as the paper prints it. The confidence is 1 where the parities of the two
    /// directions differ, as they must on a closed surface, else 0.
    Parity(ParityOptions),
    /// The side of these `(N, 3)` vectors, outward and of any length but 0. The confidence is the cosine between
    /// vector and axis.
    Signs(Buffer<T>),
}

impl<T> Method<T> {
    /// Its name in a report.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Parity(_) => "parity",
            Self::Signs(_) => "signs",
        }
    }
}

/// Errors of the orientation.
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
    /// `(1,)` number of axes whose sign was changed.
    pub flipped: Buffer<u32>,
    /// Of [`Method::Parity`]: `r_d`, in the unit of the points.
    pub detection_radius: Option<f64>,
}

/// Chooses the sign of each of the `(N, 3)` axes, in input order. Waits for the device.
///
/// # Errors
/// Parity options out of range, a cloud of duplicates for parity, a given vector that is zero or not finite;
/// [`crate::Error::Length`], [`crate::Error::TooLarge`], [`crate::Error::Failed`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
    method: &Method<T>,
) -> Result<Orientation<T>, Error> {
    let n = neighborhoods.len();
    check_length("the axes", axes, 3 * n)?;
    let (normals, confidence) = (device.empty(3 * n)?, device.empty(n)?);
    let detection_radius = match method {
        Method::Parity(options) => Some(parity::forward(
            device,
            neighborhoods,
            axes,
            options,
            [&normals, &confidence],
        )?),
        Method::Signs(given) => {
            given::turn_to(device, axes, given, [&normals, &confidence])?;
            None
        }
    };
    Ok(Orientation {
        flipped: count_flipped(device, axes, &normals)?,
        normals,
        confidence,
        detection_radius,
    })
}

fn count_flipped<R: Runtime, T: Scalar>(
    device: &Device<R>,
    axes: &Buffer<T>,
    normals: &Buffer<T>,
) -> Result<Buffer<u32>, crate::Error> {
    let flipped = device.empty(axes.len() / 3)?;
    if !flipped.is_empty() {
        launch!(device, flipped.len() => flag_flipped<T>(axes, normals, flipped));
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
