//! `isograd reconstruct`: field, surface and normals of a cloud.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use isograd::{Field, Grid, JsonReport, Mesh, PointCloud, Real, Stage, Verdict};
use isograd_backend::{Number, Plan, View};
use isograd_io::{Attributes, Geometry};

use crate::args::{self, Precision};
use crate::backend;
use crate::error::{Error, file_name};
use crate::outputs::{Outputs, write_report};
use crate::plot;
use crate::progress::Progress;
use crate::report::{Report, Times};
use crate::{orient, resample};

/// Rounding of the coordinates to single precision, in cells, above which the computation uses double precision.
const TOLERATED_ROUNDING: f64 = 1e-2;

/// Runs the command.
///
/// # Errors
/// See [`Error`]; then no file has been left incomplete.
pub fn run(args: &args::Reconstruct) -> Result<(), Error> {
    let start = Instant::now();
    let outputs = Outputs::new(args)?;
    args.method.normals.check()?;
    // Reading, the stages, writing.
    let mut progress = Progress::new(2 + Stage::ALL.len(), args.running);
    progress.step("read");
    let geometry = read(args, &outputs)?;
    progress.detail(&format!(
        "{} points, stored as {}",
        geometry.points.len(),
        geometry.dtype.name()
    ));
    let read_seconds = start.elapsed().as_secs_f64();
    let job = Job {
        args,
        outputs: &outputs,
        start,
        read_seconds,
    };
    match job.needs_double(&geometry)? {
        Some(note) => {
            progress.warn(&note);
            job.run::<f64>(&geometry, &mut progress, Some(note))
        }
        None if args.precision == Precision::F64 => job.run::<f64>(&geometry, &mut progress, None),
        None => job.run::<f32>(&geometry, &mut progress, None),
    }
}

fn read(args: &args::Reconstruct, outputs: &Outputs) -> Result<Geometry, Error> {
    // Only the file of the points has attributes.
    let attributes = match outputs.points {
        Some(_) => Attributes::All,
        None => Attributes::Sensors,
    };
    let options = args.reading.options(attributes);
    let Some(n) = args.sample else {
        return Ok(options.read_geometry(&args.cloud)?);
    };
    let mesh = options.read_mesh(&args.cloud)?;
    resample::resample(&mesh, n as usize).ok_or_else(|| {
        Error::File(isograd_io::Error::Format {
            file: args.cloud.display().to_string(),
            problem: "its faces have no area; --sample can't be used".into(),
        })
    })
}

/// Results of a reconstruction on any backend.
struct Results<'a, T> {
    sdf: &'a Field<T>,
    mesh: &'a Mesh<T>,
    normals: &'a [[T; 3]],
    confidence: &'a [T],
    report: &'a isograd::Report,
    /// Name of the backend.
    backend: &'a str,
}

impl<'a, T: Number> Results<'a, T> {
    /// Copies the results of a device.
    fn new(view: View<'a, T>) -> Result<Self, isograd_backend::Error> {
        Ok(Self {
            sdf: view.sdf()?,
            mesh: view.mesh()?,
            normals: view.normals()?,
            confidence: view.confidence()?,
            report: view.report()?,
            backend: view.backend(),
        })
    }
}

/// A reconstruction, independent of its number type.
struct Job<'a> {
    args: &'a args::Reconstruct,
    outputs: &'a Outputs,
    start: Instant,
    read_seconds: f64,
}

impl Job<'_> {
    fn cloud<T: Real>(&self, geometry: &Geometry) -> Result<PointCloud<T>, Error> {
        let cloud = geometry.cloud();
        let cloud = cloud.and_then(|cloud| self.args.method.normals.with_sensors(cloud));
        cloud.map_err(Error::input(&self.args.cloud))
    }

    /// The note if single precision was requested and can't represent the coordinates.
    fn needs_double(&self, geometry: &Geometry) -> Result<Option<String>, Error> {
        if self.args.precision == Precision::F64 {
            return Ok(None);
        }
        let cloud =
            PointCloud::new(geometry.points.clone()).map_err(Error::input(&self.args.cloud))?;
        let grid = self.grid(&cloud)?;
        let corners = grid.lower().into_iter().chain(grid.upper());
        let largest = corners.fold(0.0f64, |m, x| m.max(x.abs()));
        let cells = largest * f64::from(f32::EPSILON) / grid.spacing();
        Ok((cells > TOLERATED_ROUNDING).then(|| {
            format!(
                "coordinates reach {largest:.3e} with cells of {:.3e}, which f32 rounds to {cells:.1e} cells; computed in f64",
                grid.spacing()
            )
        }))
    }

    fn grid<T: Real>(&self, cloud: &PointCloud<T>) -> Result<Grid<T>, Error> {
        let grid = self.args.grid.grid(cloud);
        grid.map_err(Error::input(&self.args.cloud))
    }

    fn run<T: Number>(
        &self,
        geometry: &Geometry,
        progress: &mut Progress,
        note: Option<String>,
    ) -> Result<(), Error> {
        let cloud = self.cloud::<T>(geometry)?;
        let grid = self.grid(&cloud)?;
        progress.detail(&format!(
            "grid {:?}, cells of {}",
            grid.shape(),
            grid.spacing()
        ));
        let options = self.args.method.options(self.args.grid.outliers);
        let plan = Plan::new(self.args.backend, grid, options);
        let mut plan =
            plan.map_err(|e| backend::plan_error(self.args.backend, e, &self.args.cloud))?;
        progress.detail(&format!("on {}", plan.name()));
        if let Some(note) = plan.note() {
            progress.warn(note);
        }
        let mut observer = |stage: Stage| {
            progress.step(stage.name());
            ControlFlow::Continue(())
        };
        let result = plan
            .reconstruct_observed(&cloud, &mut observer)
            .and_then(|view| {
                if view.backend() != "cpu" {
                    // On a device the checks run with the report.
                    progress.step(Stage::Checks.name());
                }
                Results::new(view)
            })
            .map_err(Error::input(&self.args.cloud))?;
        progress.warn_of(result.report);
        progress.step("write");
        self.write(&cloud, &result, note, progress)?;
        progress.finish();
        self.summarize(progress, &result);
        match result.report.verdict() {
            Some(Verdict::Bad) if self.args.strict => Err(Error::Bad {
                file: file_name(&self.args.cloud),
            }),
            _ => Ok(()),
        }
    }

    fn write<T: Number>(
        &self,
        cloud: &PointCloud<T>,
        result: &Results<'_, T>,
        note: Option<String>,
        progress: &Progress,
    ) -> Result<(), Error> {
        let begin = Instant::now();
        let outputs = self.outputs;
        outputs.create_folder()?;
        let wrote = |path: &Path| progress.print(&format!("wrote {}", path.display()));
        if let Some(path) = &outputs.mesh {
            isograd_io::write_mesh(path, result.mesh)?;
            wrote(path);
        }
        if let Some(path) = &outputs.sdf {
            isograd_io::write_field(path, result.sdf)?;
            wrote(path);
        }
        if let Some(path) = &outputs.points {
            isograd_io::write_cloud(path, &self.oriented(cloud, result)?)?;
            wrote(path);
        }
        if let Some(path) = &outputs.plot {
            plot::write(path, &plot::slices(result.sdf))?;
            wrote(path);
        }
        if let Some(path) = &outputs.picture {
            self.write_picture(path, &self.oriented(cloud, result)?, result)?;
            wrote(path);
        }
        if let Some(path) = &outputs.report {
            let times = Times {
                read: self.read_seconds,
                write: begin.elapsed().as_secs_f64(),
                total: self.start.elapsed().as_secs_f64(),
            };
            let report = JsonReport::new(result.report);
            let report = Report::new(&self.args.cloud, report, times);
            let report = report.on_grid(result.sdf.grid(), result.backend, note);
            write_report(path, &report)?;
            wrote(path);
        }
        Ok(())
    }

    /// The cloud with estimated normals and their confidence.
    fn oriented<T: Real>(
        &self,
        cloud: &PointCloud<T>,
        result: &Results<'_, T>,
    ) -> Result<PointCloud<T>, Error> {
        orient::oriented(cloud, result.normals, result.confidence)
            .map_err(Error::input(&self.args.cloud))
    }

    fn write_picture<T: Real>(
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
    fn summarize<T: Real>(&self, progress: &Progress, result: &Results<'_, T>) {
        let report = result.report;
        let (surface, grid) = (&report.surface, result.sdf.grid());
        let [nx, ny, nz] = grid.shape();
        progress.print(&format!(
            "{} points, {nx} × {ny} × {nz} cells of {:.4e}, {:.2} s",
            report.points,
            grid.spacing(),
            self.start.elapsed().as_secs_f64()
        ));
        progress.print(&format!(
            "surface: {} faces, {}, {} piece{}, area {:.6}, volume {:.6}",
            surface.faces,
            if surface.closed {
                "closed"
            } else {
                "not closed"
            },
            surface.components,
            if surface.components == 1 { "" } else { "s" },
            surface.area,
            surface.volume
        ));
        progress.conclude(report);
    }
}
