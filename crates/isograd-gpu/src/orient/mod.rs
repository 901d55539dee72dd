//! The sign of every normal: outward, away from matter.
//!
//! # Map
//! Axes `(N, 3)` of unit length and arbitrary sign → outward unit normals `(N, 3)` and a confidence for each, by
//! one of two methods of [`isograd::orient`], whose page says what they do: [`Method::Parity`], the paper's, and
//! [`Method::Signs`], the side of normals that are given. Normals that are trusted as they are, are [`given`]. The
//! automatic method and sensors, whose grazing views it settles, are on the CPU alone.
//!
//! # Pullback
//! The signs are held constant: cotangents of the axes are those of the normals, with the same signs.
//!
//! # Not differentiable
//! The signs, and the confidence.

pub mod auto;
pub mod given;
mod parity;

pub use isograd::orient::ParityOptions;

use cubecl::prelude::Runtime;

use crate::device::check_length;
use crate::neighbors::Neighborhoods;
use crate::{Buffer, Device, Scalar};

/// How the signs are chosen.
#[derive(Clone, Copy, Debug)]
pub enum Method<'a, T> {
    /// By parity along the normal, as the paper prints it. The confidence is 1 where the parities of the two
    /// directions differ, as they must on a closed surface, else 0.
    Parity(ParityOptions),
    /// The side of these `(N, 3)` vectors, outward and of any length but 0. The confidence is the cosine between
    /// vector and axis.
    Signs(&'a Buffer<T>),
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
    /// Of [`Method::Parity`]: `r_d`, in the unit of the points.
    pub detection_radius: Option<f64>,
}

/// Chooses the sign of each of the `(N, 3)` axes, which are of unit length and in input order. Waits for the device.
///
/// # Errors
/// Parity options out of range, a cloud of duplicates for parity, a given vector that is zero or not finite;
/// [`crate::Error::Length`], [`crate::Error::TooLarge`], [`crate::Error::Failed`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    axes: &Buffer<T>,
    method: &Method<'_, T>,
) -> Result<Orientation<T>, Error> {
    check_length("the axes", axes, 3 * neighborhoods.len())?;
    match method {
        Method::Parity(options) => parity::forward(device, neighborhoods, axes, options),
        Method::Signs(vectors) => given::turn_to(device, axes, vectors),
    }
}
