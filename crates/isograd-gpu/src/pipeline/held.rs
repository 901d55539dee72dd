//! Radii and signs, found once, on the CPU or on the device, and then held: no derivative goes through them.

use std::ops::ControlFlow;

use cubecl::prelude::*;
use isograd::neighbors::Radius;
use isograd::orient::Method;
use isograd::{Orienter, PointCloud, Stage};

use super::{Error, Reconstruction};
use crate::device::{check_length, launch};
use crate::neighbors::radius;
use crate::orient::previous::{self, Before, Followed};
use crate::primitives::fill::zeros;
use crate::vector::Vector3;
use crate::{Buffer, Device, Scalar};

/// The radii of a cloud's neighborhoods, and which way is out at each of its points. Of a body that moves a
/// little, those of an earlier step will do: see [`RadiiAndSigns::after`].
#[derive(Clone, Debug)]
pub struct RadiiAndSigns<T> {
    /// `(N,)` within which normals are found, in the user's unit.
    pub radii: Buffer<T>,
    /// `(N,)` within which areas are found.
    pub area_radii: Buffer<T>,
    /// The radius of every point that has enough neighbors within it.
    pub common_radius: T,
    /// Typical distance between neighboring samples, which the smoothing follows where areas do not count.
    pub spacing: T,
    /// Number of samples in the automatic radius where they lie along lines: [`isograd::neighbors::Neighborhoods::lines`]. Radii
    /// that are found on the device do not follow lines.
    pub lines: Option<usize>,
    /// Whether normals are [refined](crate::refine): where the radius is automatic.
    pub refines: bool,
    /// `(N, 3)` roughly outward: a normal is turned to the side of its vector here.
    pub outward: Buffer<T>,
    /// `(N,)` from 0 to 1, how sure that is: see [`Orientation::confidence`](isograd::orient::Orientation::confidence).
    pub confidence: Buffer<T>,
    /// Whether the sides are those of an earlier step, since which axes may have turned far: these then follow their
    /// neighbors.
    pub has_moved: bool,
}

/// Radii and signs of a cloud, with statistics of the search.
pub(crate) struct SearchResult<T: Scalar> {
    pub held: RadiiAndSigns<T>,
    /// The axes that were oriented, if they are on the device.
    pub axes: Option<SampleAxes<T>>,
    /// Name of the method, for a report.
    pub method: &'static str,
    /// Points whose axis is ill defined.
    pub guarded: usize,
    /// Axes whose sign was changed.
    pub flipped: usize,
    /// See [`Radii::has_apart`](radius::Radii::has_apart).
    pub has_apart: bool,
}

/// The axes of a cloud's samples, and the neighborhoods that they were found in.
pub struct SampleAxes<T: Scalar> {
    pub(crate) axes: Buffer<T>,
    pub(crate) residual: Box<crate::normals::Residual<T>>,
}

impl<T: Scalar> RadiiAndSigns<T> {
    /// Finds all of it on the CPU. `method` is any but [`Method::Previous`], which [`Self::after`] takes the place
    /// of. With [`Method::Given`] there are no axes to turn: for
    /// [`reconstruct_observed`](super::Reconstructor::reconstruct_observed) with given normals.
    ///
    /// # Errors
    /// Errors of the neighbors, the normals or the orientation; [`Error::Device`].
    pub fn find<R: Runtime>(
        device: &Device<R>,
        cloud: &PointCloud<T>,
        radius: Radius,
        method: &Method,
    ) -> Result<Self, Error> {
        let begin = &mut || ControlFlow::Continue(());
        Ok(Self::search_on_cpu(device, cloud, radius, method, begin)?.held)
    }

    /// [`Self::find`] with statistics; `begin` is called before the signs are chosen.
    pub(crate) fn search_on_cpu<R: Runtime>(
        device: &Device<R>,
        cloud: &PointCloud<T>,
        radius: Radius,
        method: &Method,
        begin: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<SearchResult<T>, Error> {
        if *method == Method::Previous {
            return Err(Error::Orientation);
        }
        let mut plan = Orienter::new(radius, *method).with_checks(false);
        plan.orient_observed(cloud, &mut |stage| match stage {
            Stage::Orient => begin(),
            _ => ControlFlow::Continue(()),
        })?;
        let found = plan.orientation();
        Ok(SearchResult {
            held: Self::of(device, &plan)?,
            axes: None,
            method: found.method.name(),
            guarded: plan.axes().guarded(),
            flipped: found.flipped,
            has_apart: plan.neighborhoods().has_apart(),
        })
    }

    /// Radii and signs of the last cloud of a plan on the CPU.
    pub fn of<R: Runtime>(device: &Device<R>, plan: &Orienter<T>) -> Result<Self, crate::Error> {
        let (near, axes, found) = (plan.neighborhoods(), plan.axes(), plan.orientation());
        // Empty where all normals were given.
        let radii = match axes.radius.is_empty() {
            true => &near.radius,
            false => &axes.radius,
        };
        // Before they were refined, as in later steps; none where they were given.
        let mut outward = axes.normals.clone();
        isograd::orient::axes_pullback(&found.normals, &axes.normals, &mut outward);
        if outward.is_empty() {
            outward.clone_from(&found.normals);
        }
        Ok(Self {
            radii: device.upload(radii)?,
            area_radii: device.upload(&near.radius)?,
            common_radius: near.common_radius,
            spacing: near.spacing(),
            lines: near.lines(),
            refines: near.rule == Radius::Auto,
            outward: device.upload(outward.as_flattened())?,
            confidence: device.upload(&found.confidence)?,
            has_moved: false,
        })
    }

    /// Finds all of it on the device, from `(N, 3)` points that are there.
    ///
    /// # Errors
    /// Errors of the neighbors or the orientation; [`Error::Device`].
    pub fn find_on_device<R: Runtime>(
        device: &Device<R>,
        points: &Buffer<T>,
        radius: Radius,
        method: &crate::orient::Method<T>,
    ) -> Result<Self, Error> {
        let begin = &mut || ControlFlow::Continue(());
        Ok(Self::search_on_device(device, points, radius, method, begin)?.held)
    }

    /// [`Self::find_on_device`] with statistics; `begin` is called before the signs are chosen.
    pub(crate) fn search_on_device<R: Runtime>(
        device: &Device<R>,
        points: &Buffer<T>,
        radius: Radius,
        method: &crate::orient::Method<T>,
        begin: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<SearchResult<T>, Error> {
        let found = radius::forward(device, points, radius)?;
        let (mut axes, mut residual) = crate::normals::forward(device, &found.neighborhoods)?;
        let mut radii = found.each.clone();
        if radius == Radius::Auto {
            radii = crate::normals::widen(device, &residual)?;
            let wider = crate::neighbors::with_radii(device, &found.neighborhoods, &radii)?;
            (axes, residual) = crate::normals::forward(device, &wider)?;
        }
        let guarded = residual.guarded(device)?;
        if begin().is_break() {
            return Err(Error::Interrupted(Stage::Orient));
        }
        let oriented = crate::orient::forward(device, &found.neighborhoods, &axes, method)?;
        let flipped = device.download(&oriented.flipped)?[0] as usize;
        let held = Self {
            radii,
            area_radii: found.each,
            common_radius: found.common,
            spacing: found.spacing,
            lines: None,
            refines: radius == Radius::Auto,
            outward: oriented.normals,
            confidence: oriented.confidence,
            has_moved: false,
        };
        let residual = residual.into();
        Ok(SearchResult {
            held,
            axes: Some(SampleAxes { axes, residual }),
            method: method.name(),
            guarded,
            flipped,
            has_apart: found.has_apart,
        })
    }

    /// The radii alone, for normals that are given.
    pub(crate) fn search_radii<R: Runtime>(
        device: &Device<R>,
        points: &Buffer<T>,
        radius: Radius,
    ) -> Result<SearchResult<T>, Error> {
        let found = radius::forward(device, points, radius)?;
        let held = Self {
            radii: found.each.clone(),
            outward: zeros(device, points.len())?,
            confidence: zeros(device, found.each.len())?,
            area_radii: found.each,
            common_radius: found.common,
            spacing: found.spacing,
            lines: None,
            refines: false,
            has_moved: false,
        };
        Ok(SearchResult {
            held,
            axes: None,
            method: "given",
            guarded: 0,
            flipped: 0,
            has_apart: found.has_apart,
        })
    }

    /// These radii, with the signs of other `(N, 3)` vectors of any length, roughly outward. Axes that are more
    /// than 60° off follow their neighbors.
    pub fn facing(self, outward: Buffer<T>) -> Result<Self, crate::Error> {
        check_length("the outward vectors", &outward, self.outward.len())?;
        Ok(Self {
            outward,
            has_moved: true,
            ..self
        })
    }

    /// For the next step of a body that moves a little: the same radii, with the sides of this step. See
    /// [`Reconstruction::turned`] for when that is no longer good enough.
    ///
    /// # Errors
    /// [`crate::Error::Length`] where `result` is of other points.
    pub fn after(self, result: &Reconstruction<T>) -> Result<Self, crate::Error> {
        let held = self.facing(result.unrefined().clone())?;
        Ok(Self {
            confidence: result.kept_confidence.clone(),
            ..held
        })
    }

    /// Turns `(N, 3)` axes to the held signs.
    pub(super) fn turn<R: Runtime>(
        &self,
        device: &Device<R>,
        near: &crate::neighbors::Neighborhoods<T>,
        axes: &Buffer<T>,
    ) -> Result<Followed<T>, Error> {
        if self.has_moved {
            let before = Before {
                outward: &self.outward,
                confidence: &self.confidence,
            };
            return Ok(previous::forward(
                device,
                near,
                &self.area_radii,
                axes,
                before,
            )?);
        }
        Ok(Followed {
            normals: turn(device, axes, axes, &self.outward)?,
            confidence: self.confidence.clone(),
            kept: self.confidence.clone(),
            turned: device.upload(&[0])?,
        })
    }
}

/// `vectors` `(N, 3)`, each multiplied by the sign that turns its axis to the side of `outward`. Its own
/// pullback.
pub(super) fn turn<R: Runtime, T: Scalar>(
    device: &Device<R>,
    vectors: &Buffer<T>,
    axes: &Buffer<T>,
    outward: &Buffer<T>,
) -> Result<Buffer<T>, crate::Error> {
    check_length("the outward vectors", outward, axes.len())?;
    check_length("the vectors to turn", vectors, axes.len())?;
    let turned = device.empty(axes.len())?;
    launch!(device, axes.len() / 3 => turn_vectors<T>(
        vectors, axes, outward, turned, (axes.len() / 3) as u32,
    ));
    Ok(turned)
}

#[cube(launch)]
fn turn_vectors<F: Float>(
    vectors: &Array<F>,
    axes: &Array<F>,
    outward: &Array<F>,
    turned: &mut Array<F>,
    count: u32,
) {
    if ABSOLUTE_POS < count as usize {
        let axis = Vector3::<F>::at(axes, ABSOLUTE_POS);
        let along = axis.dot(Vector3::<F>::at(outward, ABSOLUTE_POS));
        let sign = select(along < F::new(0.0), F::new(-1.0), F::new(1.0));
        let vector = Vector3::<F>::at(vectors, ABSOLUTE_POS);
        vector.scale(sign).write(turned, ABSOLUTE_POS);
    }
}
