//! A plan for the normals alone.

use std::time::Instant;

use super::stages::{check_samples, find_axes};
use super::{Error, Residuals};
use crate::Real;
use crate::data::PointCloud;
use crate::neighbors::Radius;
use crate::orient::{self, Method, Orientation};
use crate::report::{Report, Stage};

/// A plan for outward normals, without a grid: the first two stages of a [`Reconstructor`], whose memory every
/// call uses again.
///
/// [`Reconstructor`]: crate::Reconstructor
#[derive(Default)]
pub struct Orienter<T: Real> {
    radius: Radius,
    method: Method,
    residuals: Residuals<T>,
    scratch: orient::Scratch,
    orientation: Orientation<T>,
    report: Report,
}

impl<T: Real> Orienter<T> {
    /// A plan with this neighbourhood radius and this way to choose signs, which are checked by its calls.
    pub fn new(radius: Radius, method: Method) -> Self {
        Self {
            radius,
            method,
            ..Self::default()
        }
    }

    /// Outward unit normals of a cloud, and the confidence in each.
    ///
    /// # Errors
    /// That of the neighbours or of the orientation, or [`Error::NoPlane`]; the result of an earlier call is
    /// then gone.
    pub fn orient(&mut self, cloud: &PointCloud<T>) -> Result<&Orientation<T>, Error> {
        T::orient(self, cloud)?;
        Ok(&self.orientation)
    }

    /// [`Self::orient`], compiled where it is called: see [`concrete`](crate::concrete).
    pub(crate) fn run(&mut self, cloud: &PointCloud<T>) -> Result<(), Error> {
        let Self {
            residuals,
            orientation,
            report,
            ..
        } = self;
        let (neighborhoods, axes) = (&mut residuals.neighborhoods, &mut residuals.normals);
        *report = Report {
            points: cloud.len(),
            ..Report::default()
        };
        let start = Instant::now();
        let is_given = self.method == Method::Given;
        find_axes(
            cloud,
            self.radius,
            is_given,
            None,
            neighborhoods,
            axes,
            report,
        )?;
        let start = done(report, Stage::Normals, start);
        orient::forward(
            cloud.points(),
            &*axes,
            neighborhoods,
            cloud,
            &self.method,
            &mut self.scratch,
            orientation,
        )?;
        report.orientation = orientation.method.name();
        report.flipped = orientation.flipped;
        let start = done(report, Stage::Orient, start);
        check_samples(cloud.points(), neighborhoods, orientation, report);
        done(report, Stage::Checks, start);
        Ok(())
    }

    /// The last result.
    pub fn orientation(&self) -> &Orientation<T> {
        &self.orientation
    }

    /// Numbers, times and warnings of the last call; what belongs to later stages is empty.
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// The last result and its report, without the plan.
    pub fn into_parts(self) -> (Orientation<T>, Report) {
        (self.orientation, self.report)
    }
}

/// Notes the time of a stage that began at `start`, and returns when the next one begins.
fn done(report: &mut Report, stage: Stage, start: Instant) -> Instant {
    let now = Instant::now();
    report.seconds.set(stage, (now - start).as_secs_f64());
    now
}
