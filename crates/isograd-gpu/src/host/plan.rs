//! A plan on a device.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use isograd::orient::Method;
use isograd::{Backend, Grid, Options, PointCloud, Report, Seconds, Stage};

use super::work::Work;
use super::{Error, Number, Reconstruction};
use crate::element::turned;
use crate::pipeline::Held;

/// [`isograd::Reconstructor`] on a device: a plan for one grid and one set of options.
pub struct Plan<T: Number> {
    device: Arc<dyn Work<T>>,
    name: String,
    grid: Grid<T>,
    options: Options,
    /// With [`Method::Previous`], what the next call starts from.
    before: Option<Before<T>>,
}

/// What a call leaves to the next one.
struct Before<T> {
    held: Held<T>,
    /// What its report says of the samples.
    report: Report,
}

impl<T: Number> Plan<T> {
    /// A plan for clouds that lie on `grid`, at least 2 cells off its walls. The libraries of `backend` are loaded
    /// here, and nowhere before.
    ///
    /// # Errors
    /// A device that can't be had, with the reason and the remedy; options that are not for devices.
    pub fn new(backend: Backend, grid: Grid<T>, options: Options) -> Result<Self, Error> {
        let device = T::open(backend, grid, (&options).into())?;
        Ok(Self {
            name: format!("{backend}: {}", device.name()),
            device,
            grid,
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
        if observer(Stage::Normals).is_break() {
            return Err(Error::Interrupted(Stage::Normals));
        }
        let before = self.before.take();
        if let Some(before) = before.filter(|before| before.report.points == cloud.len()) {
            let (result, next) = self.run(cloud, before.next(), observer)?;
            if turned::are_few(result.turned()?, cloud.len()) {
                self.before = next;
                return Ok(result);
            }
        }
        let found = self.find(cloud, observer)?;
        let (result, next) = self.run(cloud, found, observer)?;
        self.before = next;
        Ok(result)
    }

    /// All stages but the orientation; and, with [`Method::Previous`], what the next call starts from.
    fn run(
        &mut self,
        cloud: &PointCloud<T>,
        found: Before<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<(Reconstruction<T>, Option<Before<T>>), Error> {
        let Before { held, report } = found;
        let of_samples = report.clone();
        let mut report = report;
        let mut clock = Clock::new();
        let mut stage_before = Stage::Normals;
        let mut timed = |stage| {
            clock.note(&mut report, stage_before);
            stage_before = stage;
            match stage {
                // Begun before.
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
        let next = match self.options.orientation {
            Method::Previous => Some(Before {
                held: held.clone().after(&result)?,
                report: of_samples,
            }),
            _ => None,
        };
        let result = Reconstruction::new(
            self.device.clone(),
            result,
            &self.options,
            self.grid,
            held,
            report,
        );
        Ok((result, next))
    }

    /// Radii and sides.
    fn find(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Before<T>, Error> {
        let (mut clock, mut of_normals) = (Clock::new(), Report::default());
        let mut begin = || {
            clock.note(&mut of_normals, Stage::Normals);
            observer(Stage::Orient)
        };
        let (radius, method) = (self.options.radius, self.options.orientation);
        let (held, mut report) = self.device.find(cloud, radius, method, &mut begin)?;
        report.seconds = of_normals.seconds;
        clock.note(&mut report, Stage::Orient);
        Ok(Before { held, report })
    }
}

impl<T> Before<T> {
    /// What a call starts from that follows this one.
    fn next(self) -> Self {
        let report = Report {
            orientation: "previous",
            flipped: 0,
            seconds: Seconds::default(),
            ..self.report
        };
        Self { report, ..self }
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
