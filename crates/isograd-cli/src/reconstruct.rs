//! `isograd reconstruct`: field, surface and normals of a cloud.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use isograd::orient::Method;
use isograd::{Field, Grid, JsonReport, Mesh, PointCloud, Real, Stage, Verdict};
use isograd_backend::{Number, Plan, View};
use isograd_io::{Attributes, Geometry, NotFinite, ReadOptions};

use crate::args::{self, Precision};
use crate::error::{Error, file_name};
use crate::inputs::{Inputs, stem};
use crate::outputs::{Outputs, write_report};
use crate::progress::{Progress, decimal};
use crate::report::{Normals, Report, Times};
use crate::{backend, batch, orient, plot, prediction, resample, rounding, surface};

/// Parts of the work on a cloud: reading, the stages, writing.
pub const PARTS: usize = 2 + Stage::ALL.len();

/// Runs the command.
///
/// # Errors
/// See [`Error`]; then no file has been left incomplete.
pub fn run(args: &args::Reconstruct) -> Result<(), Error> {
    args.method.normals.check()?;
    let cloud = match Inputs::new(args)? {
        Inputs::One(cloud) => cloud,
        Inputs::Several(clouds) => return batch::run(args, &clouds),
    };
    let outputs = Outputs::new(args, &cloud, &stem(&cloud), false)?;
    let mut progress = Progress::new(PARTS, args.running);
    if args.skip_existing && outputs.are_up_to_date(&cloud) {
        progress.print(&format!(
            "{} was skipped: its outputs exist",
            cloud.display()
        ));
        return conclude(args, &cloud, outputs.were_bad());
    }
    let (job, geometry) = Job::read(args, &cloud, &outputs, &mut progress)?;
    let verdict = job.alone(geometry, &mut progress)?;
    conclude(args, &cloud, verdict == Some(Verdict::Bad))
}

fn conclude(args: &args::Reconstruct, cloud: &Path, is_bad: bool) -> Result<(), Error> {
    match is_bad && args.strict {
        true => Err(Error::Bad {
            file: file_name(cloud),
        }),
        false => Ok(()),
    }
}

/// Options of the reader of the clouds.
pub fn read(
    args: &args::Reconstruct,
    cloud: &Path,
    attributes: Attributes,
) -> Result<Geometry, Error> {
    let Some(n) = args.sample else {
        let uses_normals = args.method.normals.uses_normals();
        return Ok(args.reading.read(cloud, attributes, uses_normals)?);
    };
    let mesh = ReadOptions {
        not_finite: NotFinite::KeepNormals,
        ..args.reading.options(attributes)
    };
    let mesh = mesh.read_mesh(cloud)?;
    resample::resample(&mesh, n as usize).ok_or_else(|| {
        Error::File(isograd_io::Error::Format {
            file: cloud.display().to_string(),
            problem: "its faces have no area; --sample can't be used".into(),
        })
    })
}

/// A plan for a grid and a method of orientation; errors name the file `cloud`.
pub fn plan<T: Number>(
    args: &args::Reconstruct,
    cloud: &Path,
    grid: Grid<T>,
    orient: Method,
    progress: &Progress,
) -> Result<Plan<T>, Error> {
    progress.detail(&format!(
        "grid {:?}, cells of {}",
        grid.shape(),
        grid.spacing()
    ));
    let options = args.method.options(args.grid.outliers);
    let options = options.orient(orient).residuals(false);
    let plan = Plan::new(args.backend, grid, options)
        .map_err(|error| backend::plan_error(args.backend, error, cloud))?;
    progress.detail(&format!("on {}", plan.name()));
    if let Some(note) = plan.note() {
        progress.warn(note);
    }
    Ok(plan)
}

/// Results of a reconstruction on any backend.
struct Results<'a, T: Number> {
    view: View<'a, T>,
    sdf: &'a Field<T>,
    mesh: &'a Mesh<T>,
    normals: &'a [[T; 3]],
    confidence: &'a [T],
    report: &'a isograd::Report,
}

impl<'a, T: Number> Results<'a, T> {
    /// Copies the results of a device.
    fn new(view: View<'a, T>) -> Result<Self, isograd_backend::Error> {
        Ok(Self {
            view,
            sdf: view.sdf()?,
            mesh: view.mesh()?,
            normals: view.normals()?,
            confidence: view.confidence()?,
            report: view.report()?,
        })
    }
}

/// The reconstruction of one cloud, independent of its number type.
pub struct Job<'a> {
    args: &'a args::Reconstruct,
    /// The file.
    pub cloud: &'a Path,
    outputs: &'a Outputs,
    /// Number of points.
    pub points: usize,
    start: Instant,
    read_seconds: f64,
    normals: Normals,
}

impl<'a> Job<'a> {
    /// Reads a cloud. The geometry comes apart from the job, so that its memory is free while the stages run.
    pub fn read(
        args: &'a args::Reconstruct,
        cloud: &'a Path,
        outputs: &'a Outputs,
        progress: &mut Progress,
    ) -> Result<(Self, Geometry), Error> {
        let start = Instant::now();
        progress.step("read");
        // Neither the field nor the pictures have attributes.
        let attributes = match (&outputs.points, &outputs.mesh) {
            (None, None) => Attributes::Sensors,
            _ => Attributes::All,
        };
        let geometry = read(args, cloud, attributes)?;
        progress.detail(&format!(
            "{} points, stored as {}",
            geometry.points.len(),
            geometry.dtype.name()
        ));
        let job = Self {
            args,
            cloud,
            outputs,
            start,
            read_seconds: start.elapsed().as_secs_f64(),
            normals: Normals::of(&geometry, &args.method.normals),
            points: geometry.points.len(),
        };
        if job.normals == Normals::Unused {
            let of = match args.sample {
                Some(_) => "of the faces".into(),
                None => format!("in {}", file_name(cloud)),
            };
            let text = format!(
                "the normals {of} are not used; if they point outward, --orient signs takes their sides"
            );
            progress.note("normals", &text);
        }
        Ok((job, geometry))
    }

    /// Reconstructs the cloud that was read on a grid of its own.
    pub fn alone(
        &self,
        geometry: Geometry,
        progress: &mut Progress,
    ) -> Result<Option<Verdict>, Error> {
        let cloud = PointCloud::new(geometry.points.clone());
        let grid = self.grid(&cloud.map_err(Error::input(self.cloud))?)?;
        match rounding::rounding(self.args, Some(geometry.dtype), &grid) {
            Some(note) => {
                progress.warn(&note);
                self.alone_in::<f64>(geometry, Some(&note), progress)
            }
            None if self.args.precision == Precision::F64 => {
                self.alone_in::<f64>(geometry, None, progress)
            }
            None => self.alone_in::<f32>(geometry, None, progress),
        }
    }

    fn alone_in<T: Number>(
        &self,
        geometry: Geometry,
        note: Option<&str>,
        progress: &mut Progress,
    ) -> Result<Option<Verdict>, Error> {
        let cloud = self.cloud::<T>(geometry)?;
        let grid = self.grid(&cloud)?;
        let orient = self.args.method.normals.method();
        let mut plan = plan(self.args, self.cloud, grid, orient, progress)?;
        self.with_plan(&mut plan, &cloud, &grid, note, progress)
    }

    /// The cloud that was read, with the sensors of the command line.
    pub fn cloud<T: Real>(&self, geometry: Geometry) -> Result<PointCloud<T>, Error> {
        let cloud = geometry.cloud();
        let cloud = cloud.and_then(|cloud| self.args.method.normals.with_sensors(cloud));
        cloud.map_err(Error::input(self.cloud))
    }

    fn grid<T: Real>(&self, cloud: &PointCloud<T>) -> Result<Grid<T>, Error> {
        let grid = self.args.grid.grid(cloud);
        grid.map_err(Error::input(self.cloud))
    }

    /// Reconstructs [`cloud`](Self::cloud) with a plan for `grid`, writes the outputs and returns the verdict. `note` tells why the
    /// number type is not the one asked for.
    pub fn with_plan<T: Number>(
        &self,
        plan: &mut Plan<T>,
        cloud: &PointCloud<T>,
        grid: &Grid<T>,
        note: Option<&str>,
        progress: &mut Progress,
    ) -> Result<Option<Verdict>, Error> {
        progress.expect(prediction::seconds(cloud.len(), grid.cells()));
        let mut observer = |stage: Stage| {
            progress.step(stage.name());
            ControlFlow::Continue(())
        };
        let result = plan
            .reconstruct_observed(cloud, &mut observer)
            .and_then(|view| {
                if view.backend() != "cpu" {
                    // On a device the checks run with the report.
                    progress.step(Stage::Checks.name());
                }
                Results::new(view)
            })
            .map_err(Error::input(self.cloud))?;
        progress.warn_of(result.report);
        progress.step("write");
        self.write(cloud, &result, note, progress)?;
        progress.finish_cloud();
        self.summarize(progress, &result);
        Ok(result.report.verdict())
    }

    fn write_mesh<T: Number>(
        &self,
        path: &Path,
        cloud: &PointCloud<T>,
        result: &Results<'_, T>,
        progress: &mut Progress,
    ) -> Result<(), Error> {
        let omitted = surface::write(path, result.view, result.mesh, cloud);
        let omitted = omitted.map_err(|error| match error {
            surface::Error::File(error) => Error::File(error),
            error => Error::input(path)(error),
        })?;
        if let Some(note) = &omitted.note {
            progress.note("attributes", note);
        }
        for warning in &omitted.warnings {
            progress.warn(warning);
        }
        progress.wrote(path);
        Ok(())
    }

    fn write<T: Number>(
        &self,
        cloud: &PointCloud<T>,
        result: &Results<'_, T>,
        note: Option<&str>,
        progress: &mut Progress,
    ) -> Result<(), Error> {
        let begin = Instant::now();
        let outputs = self.outputs;
        outputs.create_folder()?;
        if let Some(path) = &outputs.mesh {
            self.write_mesh(path, cloud, result, progress)?;
        }
        if let Some(path) = &outputs.sdf {
            isograd_io::write_field(path, result.sdf)?;
            progress.wrote(path);
        }
        if let Some(path) = &outputs.points {
            isograd_io::write_cloud(path, &self.oriented(cloud, result)?)?;
            progress.wrote(path);
        }
        if let Some(path) = &outputs.plot {
            plot::write(path, &plot::slices(result.sdf))?;
            progress.wrote(path);
        }
        if let Some(path) = &outputs.picture {
            self.write_picture(path, &self.oriented(cloud, result)?, result)?;
            progress.wrote(path);
        }
        if let Some(path) = &outputs.report {
            let times = Times {
                read: self.read_seconds,
                write: begin.elapsed().as_secs_f64(),
                total: self.start.elapsed().as_secs_f64(),
            };
            let report = JsonReport::new(result.report);
            let report = Report::new(self.cloud, report, times).with_normals(self.normals);
            let (grid, backend) = (result.sdf.grid(), result.view.backend());
            let report = report.on_grid(grid, backend, note.map(String::from));
            write_report(path, &report)?;
            progress.wrote(path);
        }
        Ok(())
    }

    /// The cloud with estimated normals and their confidence.
    fn oriented<T: Number>(
        &self,
        cloud: &PointCloud<T>,
        result: &Results<'_, T>,
    ) -> Result<PointCloud<T>, Error> {
        orient::oriented(cloud, result.normals, result.confidence).map_err(Error::input(self.cloud))
    }

    fn write_picture<T: Number>(
        &self,
        path: &Path,
        cloud: &PointCloud<T>,
        result: &Results<'_, T>,
    ) -> Result<(), Error> {
        const WIDTH: usize = 1500;
        let camera = match self.args.view.as_deref() {
            Some(&[azimuth, elevation]) => plot::Camera { azimuth, elevation },
            _ => plot::Camera::default(),
        };
        let picture = plot::overview(cloud, result.mesh, result.sdf, camera, WIDTH);
        Ok(plot::write(path, &picture)?)
    }

    /// Prints a summary, and the verdict last.
    fn summarize<T: Number>(&self, progress: &Progress, result: &Results<'_, T>) {
        let report = result.report;
        let (surface, grid) = (&report.surface, result.sdf.grid());
        let [nx, ny, nz] = grid.shape();
        progress.print_one(&format!(
            "{} points, {nx} × {ny} × {nz} cells of {:.4e}, {:.2} s",
            report.points,
            grid.spacing(),
            self.start.elapsed().as_secs_f64()
        ));
        progress.print_one(&format!(
            "surface: {} faces, {}, {} piece{}, area {}, volume {}",
            surface.faces,
            if surface.closed {
                "closed"
            } else {
                "not closed"
            },
            surface.components,
            if surface.components == 1 { "" } else { "s" },
            decimal(surface.area),
            decimal(surface.volume)
        ));
        progress.conclude(report);
    }
}
