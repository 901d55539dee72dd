//! A plan on a device.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use isograd::orient::Method;
use isograd::{Backend, Grid, Options, Orienter, PointCloud, Report, Stage};

use super::result::Samples;
use super::work::Work;
use super::{Error, Number, Reconstruction};
use crate::pipeline::Held;

/// [`isograd::Reconstructor`] on a device: a plan for one grid and one set of options.
pub struct Plan<T: Number> {
    device: Arc<dyn Work<T>>,
    name: String,
    grid: Grid<T>,
    options: Options,
    orienter: Orienter<T>,
    /// With [`Method::Previous`], what the next call starts from.
    before: Option<Before<T>>,
}

/// What a call leaves to the next one.
struct Before<T> {
    held: Held<T>,
    samples: Arc<Samples<T>>,
}

impl<T: Number> Plan<T> {
    /// A plan for clouds that lie on `grid`, at least 2 cells off its walls. The libraries of `backend` are loaded
    /// here, and nowhere before.
    ///
    /// # Errors
    /// A device that can't be had, with the reason and the remedy; options that are not for devices.
    pub fn new(backend: Backend, grid: Grid<T>, options: Options) -> Result<Self, Error> {
        let device = T::open(backend, grid, (&options).into())?;
        let method = match options.orientation {
            Method::Previous => Method::Auto,
            method => method,
        };
        Ok(Self {
            name: format!("{backend}: {}", device.name()),
            device,
            grid,
            orienter: Orienter::new(options.radius, method).with_checks(options.checks),
            options,
            before: None,
        })
    }

    /// The backend, and the name that its driver gives the device, such as `cuda: NVIDIA H100`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The grid that all results are on.
    pub fn grid(&self) -> &Grid<T> {
        &self.grid
    }

    /// The options of the plan.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Runs all stages on a cloud. The results stay on the device.
    ///
    /// # Errors
    /// As [`Error`] lists.
    pub fn reconstruct(&mut self, cloud: &PointCloud<T>) -> Result<Reconstruction<T>, Error> {
        self.reconstruct_observed(cloud, &mut |_| ControlFlow::Continue(()))
    }

    /// The same, calling `observer` before each stage but the checks, which are made when their report is asked
    /// for; where it breaks, so does the work.
    ///
    /// # Errors
    /// As [`Self::reconstruct`], and [`Error::Interrupted`] where the observer breaks.
    pub fn reconstruct_observed(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Reconstruction<T>, Error> {
        let Before { held, samples } = self.hold(cloud, observer)?;
        let mut report = samples.report.clone();
        let mut clock = Clock::new();
        let mut stage_before = Stage::Normals;
        let mut timed = |stage| {
            clock.note(&mut report, stage_before);
            stage_before = stage;
            match stage {
                // Begun on the CPU.
                Stage::Normals => ControlFlow::Continue(()),
                stage => observer(stage),
            }
        };
        let is_given = self.options.orientation == Method::Given;
        let given = cloud.normals().filter(|_| is_given);
        let result = self
            .device
            .reconstruct(cloud.points(), given, &held, &mut timed)?;
        clock.note(&mut report, stage_before);
        if self.options.orientation == Method::Previous {
            let held = held.facing(result.normals.clone())?;
            let samples = samples.clone();
            self.before = Some(Before { held, samples });
        }
        Ok(Reconstruction::new(
            self.device.clone(),
            result,
            self.grid,
            &self.options,
            report,
            samples,
        ))
    }

    /// Radii and sides: those of the call before where they are to be kept, else found on the CPU.
    fn hold(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Before<T>, Error> {
        if observer(Stage::Normals).is_break() {
            return Err(Error::Interrupted(Stage::Normals));
        }
        if let Some(Before { held, samples }) = self.before.take()
            && samples.len() == cloud.len()
        {
            let samples = Arc::new(samples.kept());
            return Ok(Before { held, samples });
        }
        self.orienter.orient(cloud)?;
        if observer(Stage::Orient).is_break() {
            return Err(Error::Interrupted(Stage::Orient));
        }
        let samples = Arc::new(Samples::of(&self.orienter));
        let held = self.device.hold(&self.orienter)?;
        Ok(Before { held, samples })
    }
}

/// Adds the time since it was looked at last to that of a stage.
struct Clock(Instant);

impl Clock {
    fn new() -> Self {
        Self(Instant::now())
    }

    fn note(&mut self, report: &mut Report, stage: Stage) {
        let now = Instant::now();
        let seconds = report.seconds.of(stage) + (now - self.0).as_secs_f64();
        report.seconds.set(stage, seconds);
        self.0 = now;
    }
}
