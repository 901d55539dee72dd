//! A plan on a device.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use isograd::isosurface::trim::Trim;
use isograd::neighbors::{self, Radius};
use isograd::orient::Method;
use isograd::poisson::Walls;
use isograd::sheet::Sheet;
use isograd::{
    Backend, Grid, Options, Outliers, PointCloud, Report, RestoreError, Seconds, Selection, Solve,
    Stage, SurfaceResolution,
};

use super::work::{CallStart, Work};
use super::{Error, Number, Reconstruction};
use crate::Buffer;
use crate::element::turned;
use crate::pipeline::RadiiAndSigns;

/// [`isograd::Reconstructor`] on a device: a plan for one grid and one set of options.
pub struct Plan<T: Number> {
    device: Arc<dyn Work<T>>,
    name: String,
    grid: Grid<T>,
    options: Options,
    /// With [`Method::Previous`], the start of the next call, and the strays among the samples that are not far from all others.
    before: Option<(CallStart<T>, Vec<u32>)>,
}

impl<T: Number> Plan<T> {
    /// A plan for clouds that lie on `grid`, at least 2 cells off its walls. The libraries of `backend` are loaded
    /// here, and nowhere before.
    ///
    /// # Errors
    /// An unavailable device, with the reason and the remedy; invalid options.
    pub fn new(backend: Backend, grid: Grid<T>, options: Options) -> Result<Self, Error> {
        use SurfaceResolution::{Auto, Factor, Grid};
        if !matches!(options.surface, Auto | Grid | Factor(1.0)) {
            return Err(Error::Surface(options.surface));
        }
        if options.solve == Solve::Sparse {
            return Err(Error::Sparse);
        }
        if options.walls == Walls::Closed {
            return Err(Error::Walls);
        }
        if let Radius::Cut(radius) = options.radius {
            return Err(Error::Radius(radius));
        }
        if options.trim != Trim::Off || options.sheet != Sheet::Off {
            return Err(Error::Open);
        }
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
    pub fn reconstruct(&mut self, cloud: &PointCloud<T>) -> Result<Reconstruction<T>, Error> {
        self.reconstruct_observed(cloud, &mut |_| ControlFlow::Continue(()))
    }

    /// [`Self::reconstruct`], calling `observer` before each stage; it stops the work by breaking. The checks run with
    /// the first request for the report.
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
        let far = self.options.outliers.select(cloud.points());
        if let Some(result) = self.follow(cloud, &far, observer)? {
            return Ok(result);
        }
        let method = self.options.orient;
        let (mut selection, mut strays) = (far, Vec::new());
        let mut used = selection.cloud(cloud);
        let mut points = self.device.upload(used.points())?;
        let mut begun = self.find(&used, &points, method, observer)?;
        if begun.has_apart && self.options.outliers == Outliers::Ignore {
            strays = leave_out_strays(&used, &mut selection)?;
        }
        if !strays.is_empty() {
            used = selection.cloud(cloud);
            points = self.device.upload(used.points())?;
            let again = &mut |_| ControlFlow::Continue(());
            begun = self.find(&used, &points, method, again)?;
        }
        let given = used.normals().filter(|_| method == Method::Given);
        let (mut result, held) = self.run(&points, given, begun, observer)?;
        if method == Method::Previous {
            self.before = Some((next(held, &result)?, strays));
        }
        result.set_selection(selection);
        Ok(result)
    }

    /// All stages with radii, signs and strays of the call before, where that was of as many samples and few of their axes have
    /// turned far. `far` are the samples that are far from all others.
    fn follow(
        &mut self,
        cloud: &PointCloud<T>,
        far: &Selection,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Option<Reconstruction<T>>, Error> {
        let Some((before, strays)) = self.before.take() else {
            return Ok(None);
        };
        let samples = before.report.points;
        if samples + strays.len() + far.left_out().len() != cloud.len() {
            return Ok(None);
        }
        let mut selection = far.clone();
        selection.leave_out(&strays);
        let points = self.device.upload(selection.cloud(cloud).points())?;
        let (mut result, held) = self.run(&points, None, before, observer)?;
        if !turned::are_few(result.turned()?, samples) {
            return Ok(None);
        }
        self.before = Some((next(held, &result)?, strays));
        result.set_selection(selection);
        Ok(Some(result))
    }

    /// The result again that a plan with the same grid and options made of `cloud`, with these normals: as
    /// [`isograd::Reconstructor::restore`], but the normals are enough, for the signs; all else is computed anew.
    ///
    /// # Errors
    /// As [`Self::reconstruct`]; another number of normals.
    pub fn restore(
        &self,
        cloud: &PointCloud<T>,
        normals: &[[T; 3]],
    ) -> Result<Reconstruction<T>, Error> {
        if normals.len() != cloud.len() {
            return Err(Error::Restore(RestoreError::Length {
                what: "list of normals",
                found: normals.len(),
                expected: cloud.len(),
            }));
        }
        let mut selection = self.options.outliers.select(cloud.points());
        // Those of samples that were left out are 0.
        if (selection.gather(normals, 1)).contains(&[T::default(); 3]) {
            leave_out_strays(&selection.cloud(cloud), &mut selection)?;
        }
        let used = selection.cloud(cloud);
        let mut result = self.restore_used(&used, selection.gather(normals, 1))?;
        result.set_selection(selection);
        Ok(result)
    }

    /// Restores the result of the samples that are used.
    fn restore_used(
        &self,
        cloud: &PointCloud<T>,
        normals: Vec<[T; 3]>,
    ) -> Result<Reconstruction<T>, Error> {
        let mut observer = |_| ControlFlow::Continue(());
        let points = self.device.upload(cloud.points())?;
        if self.options.orient == Method::Given {
            let begun = self.find(cloud, &points, Method::Given, &mut observer)?;
            return Ok(self.run(&points, cloud.normals(), begun, &mut observer)?.0);
        }
        let sided = PointCloud::new(cloud.points().to_vec())
            .and_then(|cloud| cloud.with_normals(normals))?;
        let begun = self.find(&sided, &points, Method::Signs, &mut observer)?;
        Ok(self.run(&points, None, begun, &mut observer)?.0)
    }

    /// All stages after the orientation; returns the radii and signs too.
    fn run(
        &self,
        points: &Buffer<T>,
        given: Option<&[[T; 3]]>,
        begun: CallStart<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<(Reconstruction<T>, RadiiAndSigns<T>), Error> {
        let (held, mut report) = (begun.held.clone(), begun.report.clone());
        report.level = self.options.level;
        let mut clock = Clock::new();
        let mut stage_before = Stage::Normals;
        let mut timed = |stage| {
            clock.note(&mut report, stage_before);
            stage_before = stage;
            match stage {
                // CallStart before.
                Stage::Normals => ControlFlow::Continue(()),
                stage => observer(stage),
            }
        };
        let result = self.device.reconstruct(points, given, begun, &mut timed)?;
        clock.note(&mut report, stage_before);
        let result = Reconstruction::new(
            self.device.clone(),
            result,
            &self.options,
            self.grid,
            held.clone(),
            report,
        );
        Ok((result, held))
    }

    /// Radii and signs.
    fn find(
        &self,
        cloud: &PointCloud<T>,
        points: &Buffer<T>,
        method: Method,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<CallStart<T>, Error> {
        let (mut clock, mut of_normals) = (Clock::new(), Report::default());
        let mut begin = || {
            clock.note(&mut of_normals, Stage::Normals);
            observer(Stage::Orient)
        };
        // As the signs of the plan, so that a result that is restored has the radii that it had.
        let on_cpu = matches!(
            self.options.orient,
            Method::Auto | Method::Sensors | Method::Previous
        );
        let method = match method {
            Method::Previous => Method::Auto,
            method => method,
        };
        let radius = self.options.radius;
        let mut begun = self
            .device
            .find(cloud, points, radius, method, on_cpu, &mut begin)?;
        begun.report.seconds = of_normals.seconds;
        clock.note(&mut begun.report, Stage::Orient);
        Ok(begun)
    }
}

/// Leaves the strays of the samples that are used out, and returns their numbers among these.
fn leave_out_strays<T: Number>(
    used: &PointCloud<T>,
    selection: &mut Selection,
) -> Result<Vec<u32>, Error> {
    let strays = neighbors::strays(used.points()).map_err(isograd::Error::from)?;
    selection.leave_out(&strays);
    Ok(strays)
}

/// Start of the call after the one that made `result`.
fn next<T: Number>(
    held: RadiiAndSigns<T>,
    result: &Reconstruction<T>,
) -> Result<CallStart<T>, Error> {
    let report = Report {
        orientation: "previous",
        flipped: 0,
        seconds: Seconds::default(),
        ..result.begun().clone()
    };
    Ok(CallStart {
        held: result.hold_after(held)?,
        axes: None,
        report,
        has_apart: false,
    })
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
