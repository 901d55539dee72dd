//! The radius of every point's neighborhood, found on the device by the rules of [`isograd::neighbors`].
//!
//! # Map
//! Points `(N, 3)` and a [`Radius`] → `R_i`: a radius common to all points, given or automatic, which grows where
//! few samples are within it. The automatic one is that of the CPU but for the rounding of distances, and where samples lie along
//! lines: it holds 24 samples there, too.
//!
//! # Pullback
//! None on the device. Those of normals and areas return the cotangents of the radii, and
//! [`isograd::neighbors::pullback`] takes them to the points.

use cubecl::prelude::*;
use isograd::neighbors::rule::{
    self, AUTO_NEIGHBORS, FEWEST_NEIGHBORS, FEWEST_POINTS, GROWTH_MARGIN,
};
use isograd::neighbors::{Error as Refused, Radius};

use super::nearest::reaches;
use super::{BLOCK, Neighborhoods, forward as sort_points, with_radii};
use crate::device::{check_length, launch};
use crate::primitives::ends::ends;
use crate::primitives::fill::zeros;
use crate::primitives::flags;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// Why there are no radii.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The cloud has none.
    #[error(transparent)]
    Cloud(#[from] Refused),
    /// The device can't find them.
    #[error(transparent)]
    Device(#[from] crate::Error),
}

/// Radii, and the neighborhoods that they make.
#[derive(Clone, Debug)]
pub struct Radii<T> {
    /// `(N,)` the `R_i` in input order, in the unit of the points; at least [`Self::common`].
    pub each: Buffer<T>,
    /// The radius of every point that has enough neighbors within it.
    pub common: T,
    /// Typical distance between neighboring samples, as [`isograd::neighbors::Neighborhoods::spacing`] has it.
    pub spacing: T,
    /// Whether some of the samples lie apart, as [strays](isograd::neighbors::Neighborhoods::strays) do.
    pub has_apart: bool,
    /// The points, sorted, with these radii.
    pub neighborhoods: Neighborhoods<T>,
}

/// The radii of `(N, 3)` points. Waits for the device: the checks of the points, their box and a distance for each point
/// come to the host.
///
/// # Errors
/// As [`isograd::neighbors::forward`]; [`crate::Error::Length`] where they are not whole;
/// [`crate::Error::TooLarge`], [`crate::Error::Failed`].
pub fn forward<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
    radius: Radius,
) -> Result<Radii<T>, Error> {
    let n = points.len() / 3;
    check_length("points", points, 3 * n)?;
    if n < FEWEST_POINTS {
        return Err(Refused::TooFew { points: n }.into());
    }
    check_finite(device, points)?;
    let bounds = bounds(device, points)?;
    rule::check_extent(n, bounds)?;
    let sorted = sort_points(device, points, &zeros(device, n)?)?;
    let (automatic, has_apart) = automatic(device, &sorted, bounds)?;
    let common = rule::common(radius, automatic)?;
    let each = grow(device, &sorted, common)?;
    Ok(Radii {
        neighborhoods: with_radii(device, &sorted, &each)?,
        each,
        common,
        spacing: rule::spacing(automatic, AUTO_NEIGHBORS, n),
        has_apart,
    })
}

fn check_finite<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
) -> Result<(), Error> {
    let bad: Buffer<u32> = device.empty(points.len() / 3)?;
    launch!(device, bad.len(), BLOCK => flag_not_finite<T>(points, bad));
    match flags::first(device, &bad)? {
        Some(index) => Err(Refused::NotFinite { index }.into()),
        None => Ok(()),
    }
}

/// Low and high corner of the box round some points.
pub(crate) fn bounds<R: Runtime, T: Scalar>(
    device: &Device<R>,
    points: &Buffer<T>,
) -> Result<[[T; 3]; 2], crate::Error> {
    let ends = device.download(&ends(device, points, 3)?)?;
    Ok([[ends[0], ends[1], ends[2]], [ends[3], ends[4], ends[5]]])
}

/// The automatic radius, and whether samples lie apart by it.
fn automatic<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    bounds: [[T; 3]; 2],
) -> Result<(T, bool), crate::Error> {
    let n = neighborhoods.len();
    let squares = reaches(device, neighborhoods, AUTO_NEIGHBORS.min(n))?;
    let squares = device.download(&squares)?;
    let mean = rule::middle_half(&squares, &mut Vec::new()).map(|(_, mean)| mean);
    let automatic = rule::automatic(mean, n, bounds);
    let is_apart = |&square: &T| rule::is_apart(square, automatic);
    Ok((automatic, mean.is_some() && squares.iter().any(is_apart)))
}

/// The common radius, or what reaches the 8th sample with a margin, in input order.
fn grow<R: Runtime, T: Scalar>(
    device: &Device<R>,
    neighborhoods: &Neighborhoods<T>,
    common: T,
) -> Result<Buffer<T>, crate::Error> {
    let n = neighborhoods.len();
    let squares = reaches(device, neighborhoods, FEWEST_NEIGHBORS.min(n))?;
    let radii = device.empty(n)?;
    launch!(device, n, BLOCK => grow_radii<T>(
        squares, neighborhoods.places, radii, common, <T as isograd::Real>::of(GROWTH_MARGIN),
    ));
    Ok(radii)
}

#[cube(launch)]
fn flag_not_finite<F: Float>(points: &Array<F>, bad: &mut Array<u32>) {
    if ABSOLUTE_POS < bad.len() {
        let finite = Vector3::<F>::at(points, ABSOLUTE_POS).is_finite();
        bad[ABSOLUTE_POS] = select(finite, 0u32, 1u32);
    }
}

/// `squares` are those of the distances to the 8th sample, in sorted order.
#[cube(launch)]
fn grow_radii<F: Float + CubeElement>(
    squares: &Array<F>,
    places: &Array<u32>,
    radii: &mut Array<F>,
    common: F,
    margin: F,
) {
    if ABSOLUTE_POS < places.len() {
        let place = places[ABSOLUTE_POS] as usize;
        radii[place] = max(common, margin * F::sqrt(squares[ABSOLUTE_POS]));
    }
}
