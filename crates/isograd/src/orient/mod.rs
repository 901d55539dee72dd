//! The sign of every normal: outward, away from matter.
//!
//! # Map
//! Axes `(N, 3)` of unit length and arbitrary sign (from [`normals`]), or the cloud's
//! own normals → unit normals `(N, 3)` that point outward, with a confidence for each. Six methods:
//!
//! - [`Method::Auto`], the default, combines five kinds of evidence. *Exterior fill*: the samples are drawn on a
//!   grid as discs in their tangent planes, and the regions that they enclose are matter (a cavity
//!   inside matter is air again, and so on). *Visibility*: where the samples leave holes, the inner side of the
//!   surface is the one from which fewer of 26 directions lead out of the grid. *Sheets*: where neighbors
//!   lie on several sheets, a robust fit separates the one through the sample from the others; a parallel
//!   sheet close by is the other side of a thin body, or of a narrow gap. Closer sheets than the steps of rounded
//!   coordinates, of voxels or of slices explain are none, and neither are the planes of scan lines. Where noise has
//!   merged the two sides of a thin body into one layer, a sample above the middle of the layer belongs to the upper side.
//!   *Neighbors*: the signs of adjacent axes are coupled by a reflection at the plane half-way between their
//!   samples, which holds along a sheet, around an edge, and across a thin body or a narrow gap. Belief propagation
//!   on the neighbor graph spreads this evidence. Points that agree form domains; between domains that contradict
//!   each other the *winding number* decides: with the correct signs it is ½ on the surface.
//!   Where signs within a domain contradict the couplings, as along the border of a patch beside a hole, it is cut
//!   into segments, and these are decided between in the same way.
//!   Patches of doubtful samples, such as the narrow top of a wall, turn where the winding number of all others falls
//!   against their normals.
//!   Signs are those of the sheets; an axis far from that of its sheet, as beside an edge, gets the side of its neighbors.
//!   Thin bodies and narrow gaps are locally the same, above all in stacks of plates, where sheets lie on both sides
//!   of a sample; where that matters, both interpretations are solved, and
//!   the winding number selects one. Time and memory are `O(N log N)`, regardless of outliers.
//! - [`Method::Parity`]: the paper's method as printed (its §2.2), with its hyperparameters.
//! - [`Method::Given`]: the cloud's own normals, trusted as they are.
//! - [`Method::Signs`]: each axis, turned to the side of the cloud's own normal: for normals whose side is
//!   known better than their direction (from a scanner, a coarser mesh, the step before), and for those who
//!   need the derivative with respect to the points alone.
//! - [`Method::Sensors`]: each axis, turned to the side from which the sample was seen; grazing views, and
//!   points of which the sensors disagree, are settled as in the automatic method.
//! - [`Method::Previous`], in a plan: each axis, turned to the side of the normal that the same point had in
//!   the call before; axes that have turned by more than 60° follow their neighbors. The first call orients
//!   automatically, and so does one with another number of points, or where more than 3 % have turned so far.
//!   *The result then depends on the calls before it*, in whose order it can be had again.
//!
//! Doubtful signs have [reasons](doubt).
//!
//! An open surface has no outside: its signs agree with each other, and its hollow side counts as the
//! inner one. With open air on both sides, as terrain has, the neighbors count for more than light and winding
//! number. A part without any evidence (a flat patch, a handful of points) points away from its centroid, with
//! confidence 0.
//!
//! Known limits: where the wall of a hollow body is thinner than about a spacing, or a sharp edge is, its
//! sheets can't be told apart beyond doubt, and a few per cent of the signs there are wrong. Noise throws
//! samples of a thin body to its other side, where nothing tells them from those that belong there: of
//! bodies as thick as four, two, one deviation of the noise about 2, 16 and 31 % of the signs. Faces
//! of two bodies that lie in the same place have samples of both signs mixed, which nothing can separate.
//! Where lines of samples are ten times as far apart as the samples on them, about one per cent of the signs are wrong, and
//! three at twenty times.
//!
//! # Residual
//! [`Orientation::normals`] holds the sign that was chosen: the stage multiplies by it.
//!
//! # Pullback
//! `s_i` is held constant: `axis̄_i = s_i n̄_i` ([`axes_pullback`]). Given normals `g_i` are divided by their
//! length: `ḡ_i = (n̄_i − n_i (n_i·n̄_i)) / |g_i|` ([`given_pullback`]).
//!
//! # Not differentiable
//! The signs are discrete; nothing of how they are chosen has a derivative. The confidence has none.

mod auto;
mod clusters;
mod confidence;
mod coupling;
mod disc;
mod domains;
pub mod doubt;
mod error;
mod evidence;
mod field;
mod fill;
mod graph;
#[cfg(test)]
mod grid_tests;
#[cfg(test)]
mod known_tests;
mod lattice;
mod layers;
mod lines;
mod orientation;
mod parity;
#[cfg(test)]
mod parity_tests;
mod previous;
mod pullback;
mod regions;
pub(crate) mod rim;
mod sensors;
#[cfg(test)]
mod shapes;
mod sheet;
mod sheets;
mod sight;
mod signs;
mod sites;
#[cfg(test)]
mod tests;
mod turned;
mod visibility;
mod winding;

pub use error::Error;
pub use orientation::{Decided, MethodUsed, Orientation};
pub use parity::ParityOptions;
pub(crate) use pullback::hold;
pub use pullback::{axes_pullback, given_pullback};

use crate::data::Sensors;
use crate::neighbors::Neighborhoods;
use crate::normals::{self, Plane};
use crate::{PointCloud, Real, vector};
use signs::{Decision, Verdict};

/// Confidence below which a sign is [doubtful](Orientation::doubtful).
const DOUBTFUL: f64 = 0.1;

/// Method that chooses the signs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Method {
    /// From exterior fill, visibility, sheets and neighbors; no parameters.
    #[default]
    Auto,
    /// By parity along the normal, as the paper prints it.
    Parity(ParityOptions),
    /// The cloud's own normals.
    Given,
    /// The side of the cloud's own normals.
    Signs,
    /// The side of the cloud's sensors.
    Sensors,
    /// The side of the normals of the call before.
    Previous,
}

/// Scratch buffers reused between calls.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    auto: auto::Auto,
    parity: Vec<parity::Verdict>,
    previous: previous::Previous,
    views: Vec<f32>,
}

impl Scratch {
    /// Frees all but what a later call of [`Method::Previous`] follows.
    pub(crate) fn free(&mut self) {
        *self = Self {
            previous: std::mem::take(&mut self.previous),
            ..Self::default()
        };
    }
}

/// The axes of a cloud, in input order.
#[derive(Clone, Copy, Debug)]
pub struct Axes<'a, T> {
    /// `(N, 3)` unit vectors of any sign.
    pub normals: &'a [[T; 3]],
    /// `(N,)` the radius that each was found within; empty where that is not known.
    pub radius: &'a [T],
    /// `(N,)` the plane there; empty where that is not known.
    pub planes: &'a [Plane<T>],
}

impl<'a, T> From<&'a normals::Residual<T>> for Axes<'a, T> {
    fn from(residual: &'a normals::Residual<T>) -> Self {
        Self {
            normals: &residual.normals,
            radius: &residual.radius,
            planes: &residual.planes,
        }
    }
}

impl<'a, T> From<&'a Vec<[T; 3]>> for Axes<'a, T> {
    fn from(normals: &'a Vec<[T; 3]>) -> Self {
        Self {
            normals,
            radius: &[],
            planes: &[],
        }
    }
}

/// Information about the orientation of a cloud beside its points.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a, T> {
    /// `(N, 3)` normals of any length, for [`Method::Given`] and [`Method::Signs`].
    pub normals: Option<&'a [[T; 3]]>,
    /// Where the points were seen from, for [`Method::Sensors`].
    pub sensors: Option<&'a Sensors<T>>,
}

impl<'a, T> From<Option<&'a [[T; 3]]>> for Known<'a, T> {
    fn from(normals: Option<&'a [[T; 3]]>) -> Self {
        Self {
            normals,
            sensors: None,
        }
    }
}

impl<'a, T: Real> From<&'a PointCloud<T>> for Known<'a, T> {
    fn from(cloud: &'a PointCloud<T>) -> Self {
        Self {
            normals: cloud.normals(),
            sensors: cloud.sensors(),
        }
    }
}

/// Chooses the sign of every axis, or takes the given normals; see the [module](self) for the map.
///
/// `axes` are those of [`normals`], or `(N, 3)` bare unit vectors of any sign (not read by
/// [`Method::Given`], and may then be empty); `neighborhoods` must be those of `points` `(N, 3)`; `known` are the
/// cloud's own normals, and where it was seen from. The memory of `scratch` and `out` is used again; for [`Method::Previous`], `scratch` holds the
/// call before. The same input gives the same bits on any number of threads.
///
/// # Errors
/// [`Method::Given`] or [`Method::Signs`] without normals, [`Method::Sensors`] without sensors; a number of
/// vectors that is not the number of points; a vector that is zero or not finite; a point at its sensor; parity
/// options out of range, or a cloud of duplicates for parity.
pub fn forward<'a, T: Real>(
    points: &[[T; 3]],
    axes: impl Into<Axes<'a, T>>,
    neighborhoods: &Neighborhoods<T>,
    known: impl Into<Known<'a, T>>,
    method: &Method,
    scratch: &mut Scratch,
    out: &mut Orientation<T>,
) -> Result<(), Error> {
    let (axes, known) = (axes.into(), known.into());
    out.clear();
    if *method != Method::Given {
        take_axes(points, axes.normals, out)?;
    }
    match method {
        Method::Auto => {
            automatically(points, &axes, neighborhoods, None, &mut scratch.auto, out);
        }
        Method::Parity(options) => by_parity(neighborhoods, options, scratch, out)?,
        Method::Given => take_given(points, known.normals, out)?,
        Method::Signs => by_given_sides(points, known.normals, out)?,
        Method::Sensors => by_sensors(points, &axes, neighborhoods, &known, scratch, out)?,
        Method::Previous => by_previous(points, &axes, neighborhoods, scratch, out),
    }
    Ok(())
}

/// Copies the axes to the output.
fn take_axes<T: Real>(
    points: &[[T; 3]],
    axes: &[[T; 3]],
    out: &mut Orientation<T>,
) -> Result<(), Error> {
    check_count(points, axes, "axes")?;
    let has_direction = |v: &[T; 3]| vector::normalized(*v).is_some();
    if let Some(index) = axes.iter().position(|v| !has_direction(v)) {
        return Err(Error::NoDirection {
            index,
            kind: "the axis",
        });
    }
    out.normals.extend_from_slice(axes);
    out.confidence.resize(axes.len(), T::zero());
    Ok(())
}

fn check_count<T>(points: &[T], vectors: &[T], kind: &'static str) -> Result<(), Error> {
    let (points, vectors) = (points.len(), vectors.len());
    if points == vectors {
        Ok(())
    } else {
        Err(Error::Count {
            points,
            vectors,
            kind,
        })
    }
}

/// The cloud's own normals, each of unit length.
fn units<'a, T: Real>(
    points: &[[T; 3]],
    given: Option<&'a [[T; 3]]>,
) -> Result<impl Iterator<Item = Result<[T; 3], Error>> + 'a, Error> {
    let given = given.ok_or(Error::NoNormals)?;
    check_count(points, given, "normals")?;
    Ok(given.iter().enumerate().map(|(index, &normal)| {
        vector::normalized(normal).ok_or(Error::NoDirection {
            index,
            kind: "the normal",
        })
    }))
}

fn take_given<T: Real>(
    points: &[[T; 3]],
    given: Option<&[[T; 3]]>,
    out: &mut Orientation<T>,
) -> Result<(), Error> {
    out.normals.reserve_exact(points.len());
    for normal in units(points, given)? {
        out.normals.push(normal?);
    }
    out.confidence.resize(points.len(), T::one());
    out.method = MethodUsed::Given;
    out.decided.given = points.len();
    Ok(())
}

/// Turns every axis to the side of the given normal.
fn by_given_sides<T: Real>(
    points: &[[T; 3]],
    given: Option<&[[T; 3]]>,
    out: &mut Orientation<T>,
) -> Result<(), Error> {
    for (index, normal) in units(points, given)?.enumerate() {
        let cosine = vector::dot(out.normals[index], normal?).f64();
        out.set_sign(index, cosine < 0.0, cosine.abs().min(1.0));
    }
    out.method = MethodUsed::Signs;
    out.decided.given = points.len();
    Ok(())
}

fn by_parity<T: Real>(
    neighborhoods: &Neighborhoods<T>,
    options: &ParityOptions,
    scratch: &mut Scratch,
    out: &mut Orientation<T>,
) -> Result<(), Error> {
    let detection_radius =
        parity::forward(&out.normals, neighborhoods, options, &mut scratch.parity)?;
    for (&i, verdict) in neighborhoods.index.order().iter().zip(&scratch.parity) {
        let confidence = if verdict.closed { 1.0 } else { 0.0 };
        out.set_sign(i as usize, verdict.flip, confidence);
    }
    out.method = MethodUsed::Parity { detection_radius };
    out.decided.parity = out.normals.len();
    Ok(())
}

/// `views` are cosines between axes and lines of sight, in input order, where those are known.
fn automatically<T: Real>(
    points: &[[T; 3]],
    axes: &Axes<'_, T>,
    neighborhoods: &Neighborhoods<T>,
    views: Option<&[f32]>,
    auto: &mut auto::Auto,
    out: &mut Orientation<T>,
) {
    auto.run(axes, neighborhoods, views);
    let mut far = Vec::new();
    for (i, verdict, cosine) in auto.verdicts() {
        match views
            .map(|views| views[i])
            .filter(|&view| evidence::is_clear(view))
        {
            Some(view) => {
                out.set_sign(i, view < 0.0, 1.0);
                out.decided.given += 1;
            }
            None if turned::is_far(cosine.into()) => far.push((i, verdict)),
            None => take_verdict(i, verdict, out),
        }
    }
    turned::take_sides_of_neighbors(&far, points, neighborhoods, out);
    out.method = MethodUsed::Auto;
}

fn take_verdict<T: Real>(i: usize, verdict: Verdict, out: &mut Orientation<T>) {
    out.set_sign(i, verdict.flip, f64::from(verdict.confidence));
    match verdict.by {
        Decision::Evidence => out.decided.evidence += 1,
        Decision::Neighbors => out.decided.neighbors += 1,
        Decision::Rule => out.decided.rule += 1,
    }
}

/// Turns every axis to the side from which its point was seen.
fn by_sensors<T: Real>(
    points: &[[T; 3]],
    axes: &Axes<'_, T>,
    neighborhoods: &Neighborhoods<T>,
    known: &Known<'_, T>,
    scratch: &mut Scratch,
    out: &mut Orientation<T>,
) -> Result<(), Error> {
    let Scratch { auto, views, .. } = scratch;
    sensors::views(points, &out.normals, known, views)?;
    automatically(points, axes, neighborhoods, Some(views), auto, out);
    out.method = MethodUsed::Sensors;
    Ok(())
}

/// Turns every axis to the side of the call before, or orients automatically.
fn by_previous<T: Real>(
    points: &[[T; 3]],
    axes: &Axes<'_, T>,
    neighborhoods: &Neighborhoods<T>,
    scratch: &mut Scratch,
    out: &mut Orientation<T>,
) {
    let Scratch { auto, previous, .. } = scratch;
    if !previous.follow(points, neighborhoods, out) {
        automatically(points, axes, neighborhoods, None, auto, out);
        previous.keep(out);
    }
}
