//! A plan for the normals alone.

use std::ops::ControlFlow;
use std::time::Instant;

use super::memory::check_points;
use super::stages::find_axes;
use super::{Error, Pipeline, Residuals};
use crate::Real;
use crate::data::PointCloud;
use crate::large::is_large;
use crate::neighbors::{Neighborhoods, Radius};
use crate::orient::{self, Method, Orientation};
use crate::report::{Report, Stage};
use crate::{normals, refine};

/// A plan for outward normals, without a grid: the first two stages of a [`Reconstructor`], whose memory every
/// call uses again.
///
/// [`Reconstructor`]: crate::Reconstructor
pub struct Orienter<T: Real> {
    radius: Radius,
    method: Method,
    residuals: Residuals<T>,
    checks: bool,
    scratch: orient::Scratch,
    of_refinement: refine::Scratch<T>,
    orientation: Orientation<T>,
    report: Report,
}

impl<T: Pipeline> Default for Orienter<T> {
    fn default() -> Self {
        Self::new(Radius::default(), Method::default())
    }
}

impl<T: Pipeline> Orienter<T> {
    /// A plan with this neighborhood radius and this way to choose signs, which are checked by its calls.
    pub fn new(radius: Radius, method: Method) -> Self {
        Self {
            radius,
            method,
            checks: true,
            residuals: Residuals::default(),
            scratch: orient::Scratch::default(),
            of_refinement: refine::Scratch::default(),
            orientation: Orientation::default(),
            report: Report::default(),
        }
    }

    /// Sets whether calls measure the samples and add warnings.
    pub fn with_checks(self, checks: bool) -> Self {
        Self { checks, ..self }
    }

    /// Outward unit normals of a cloud, and the confidence in each.
    ///
    /// # Errors
    /// [`Error::Memory`], errors of the neighborhoods and of the orientation, or [`Error::NoPlane`]; the result of the previous call is
    /// then lost.
    pub fn orient(&mut self, cloud: &PointCloud<T>) -> Result<&Orientation<T>, Error> {
        self.orient_observed(cloud, &mut |_| ControlFlow::Continue(()))
    }

    /// Like [`orient`](Self::orient), calling `observer` before each of the two stages; `Break` stops the work.
    ///
    /// # Errors
    /// As [`orient`](Self::orient), and [`Error::Interrupted`] if the observer returns `Break`.
    pub fn orient_observed(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<&Orientation<T>, Error> {
        T::orient(self, cloud, observer)?;
        Ok(&self.orientation)
    }

    /// [`Self::orient_observed`], compiled where it is called: see [`concrete`](super::concrete).
    pub(crate) fn run(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<(), Error> {
        let mut begin = |stage| match observer(stage) {
            ControlFlow::Break(()) => Err(Error::Interrupted(stage)),
            ControlFlow::Continue(()) => Ok(()),
        };
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
        check_points::<T>(cloud.len(), orientation.normals.capacity(), 0, false)?;
        begin(Stage::Normals)?;
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
        begin(Stage::Orient)?;
        orient::forward(
            cloud.points(),
            &*axes,
            neighborhoods,
            cloud,
            &self.method,
            &mut self.scratch,
            orientation,
        )?;
        if !is_given {
            let normals = &mut orientation.normals;
            refine::forward(neighborhoods, &mut self.of_refinement, normals);
        }
        if is_large(cloud.len()) {
            self.of_refinement = refine::Scratch::default();
            self.scratch.free();
        }
        report.orientation = orientation.method.name();
        report.flipped = orientation.flipped;
        let start = done(report, Stage::Orient, start);
        if self.checks {
            report.check_samples(cloud.points(), neighborhoods, orientation, false);
        }
        done(report, Stage::Checks, start);
        Ok(())
    }

    /// The neighborhoods of the last cloud.
    pub fn neighborhoods(&self) -> &Neighborhoods<T> {
        &self.residuals.neighborhoods
    }

    /// The axes of the last cloud, before they were turned outward; empty with [`Method::Given`].
    pub fn axes(&self) -> &normals::Residual<T> {
        &self.residuals.normals
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
