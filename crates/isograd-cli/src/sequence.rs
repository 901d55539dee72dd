//! Clouds that are steps in time: one grid, one plan, and sides of normals that are carried from frame to frame.

use isograd::orient::Method;
use isograd::{Grid, Outliers, PointCloud, Real, Verdict};
use isograd_backend::{Number, Plan};
use isograd_io::{Attributes, Dtype, Geometry};

use crate::args::{self, Precision};
use crate::batch::Batch;
use crate::error::{Error, file_name};
use crate::progress::Progress;
use crate::reconstruct::{self, Job};
use crate::rounding;

/// Reconstructs the frames in order.
///
/// # Errors
/// As [`batch::run`](crate::batch::run), and where no frame can be read for the grid of all.
pub fn run(batch: &mut Batch) -> Result<(), Error> {
    if (0..batch.clouds.len()).all(|k| batch.is_skipped(k)) {
        return batch.go(&mut |job, geometry, progress| job.alone(geometry, progress));
    }
    let args = batch.args;
    let (corners, stored) = corners(batch)?;
    let first = &batch.clouds[0].path;
    let grid = common_grid::<f64>(args, &corners).map_err(Error::input(first))?;
    let note = rounding::rounding(args, stored, &grid);
    if let Some(note) = &note {
        batch.progress.warn(note);
    }
    if note.is_some() || args.precision == Precision::F64 {
        return Sequence::new(batch, grid, note)?.go(batch);
    }
    let grid = common_grid::<f32>(args, &corners).map_err(Error::input(first))?;
    Sequence::new(batch, grid, None)?.go(batch)
}

/// Low and high corners of every frame, without outliers, and the number type of the last one. Empty if the grid is given.
///
/// # Errors
/// That of the first frame, if none can be read.
fn corners(batch: &mut Batch) -> Result<(Vec<[f64; 3]>, Option<Dtype>), Error> {
    let args = batch.args;
    let (mut corners, mut stored) = (Vec::new(), None);
    if args.grid.cells.bounds.is_some() {
        return Ok((corners, stored));
    }
    let mut first_error = None;
    for cloud in batch.clouds {
        batch.progress.step("bounds");
        let read = reconstruct::read(args, &cloud.path, Attributes::Sensors);
        let read = read.and_then(|geometry| {
            stored = Some(geometry.dtype);
            PointCloud::new(geometry.points).map_err(Error::input(&cloud.path))
        });
        match read {
            Ok(cloud) => {
                let used = args.grid.outliers.select(cloud.points());
                let used = used.cloud(&cloud);
                corners.extend(used.bounds().into_iter().flat_map(<[_; 2]>::from));
            }
            // It is printed when the frame is reached.
            Err(error) => first_error = first_error.or(Some(error)),
        }
    }
    match first_error {
        Some(error) if corners.is_empty() => Err(error),
        _ => Ok((corners, stored)),
    }
}

/// The grid around all frames, or the given one.
fn common_grid<T: Real>(
    args: &args::Reconstruct,
    corners: &[[f64; 3]],
) -> Result<Grid<T>, Box<dyn std::error::Error>> {
    let corners = corners.iter().map(|corner| corner.map(T::of)).collect();
    let cloud = PointCloud::new(corners)?;
    Ok(args.grid.cells.grid(&cloud, Outliers::Keep)?)
}

/// The plan of all frames.
struct Sequence<T: Number> {
    grid: Grid<T>,
    plan: Plan<T>,
    note: Option<String>,
    orient: Method,
    /// Number of points and name of the first frame.
    first: Option<(usize, String)>,
}

impl<T: Number> Sequence<T> {
    fn new(batch: &Batch, grid: Grid<T>, note: Option<String>) -> Result<Self, Error> {
        let args = batch.args;
        let orient = match args.method.normals.orient {
            Some(_) => args.method.normals.method(),
            None => Method::Previous,
        };
        let first = &batch.clouds[0].path;
        Ok(Self {
            grid,
            plan: reconstruct::plan(args, first, grid, orient, &batch.progress)?,
            note,
            orient,
            first: None,
        })
    }

    fn go(mut self, batch: &mut Batch) -> Result<(), Error> {
        batch.go(&mut |job, geometry, progress| self.step(job, geometry, progress))
    }

    fn step(
        &mut self,
        job: &Job,
        geometry: Geometry,
        progress: &mut Progress,
    ) -> Result<Option<Verdict>, Error> {
        self.check_points(job)?;
        let note = self.note.as_deref();
        let cloud = job.cloud(geometry)?;
        let verdict = job.with_plan(&mut self.plan, &cloud, &self.grid, note, progress)?;
        let first = || (job.points, file_name(job.cloud));
        self.first.get_or_insert_with(first);
        Ok(verdict)
    }

    /// Refuses another number of points than that of the first frame, if sides are carried over.
    fn check_points(&self, job: &Job) -> Result<(), Error> {
        match &self.first {
            Some((points, first)) if self.orient == Method::Previous && *points != job.points => {
                Err(Error::input(job.cloud)(format!(
                    "it has {} points, and {first} has {points}; sides of normals are carried over between as many points in the same order; give --orient auto to find them in each frame",
                    job.points
                )))
            }
            _ => Ok(()),
        }
    }
}
