//! Time and memory of one size of the problem.

use std::ops::ControlFlow;
use std::time::Instant;

use cubecl::prelude::Runtime;
use isograd::neighbors::Radius;
use isograd::{Grid, PointCloud, Resolution, Stage};
use isograd_element::vector;
use isograd_gpu::orient::Method;
use isograd_gpu::pipeline::{Cotangent, Held, Options, Reconstruction, Reconstructor};
use isograd_gpu::{Buffer, Device, Effort};
use isograd_page::program::Outcome;
use isograd_page::statistics::median;
use isograd_shapes::{Layout, Sampling, by_name};
use serde::Serialize;

/// Every cloud is drawn with this seed.
const SEED: u64 = 1;

/// The stages whose seconds are taken.
const STAGES: [Stage; 5] = [
    Stage::Normals,
    Stage::Splat,
    Stage::Poisson,
    Stage::Isosurface,
    Stage::Distance,
];

/// A problem.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// Name of the body in `isograd-shapes`.
    pub body: &'static str,
    /// Number of samples.
    pub points: usize,
    /// Cells of the grid along each axis.
    pub shape: [usize; 3],
}

/// What it took, in single precision, all data on the device, radii and sides held.
#[derive(Clone, Debug, Serialize)]
pub struct Size {
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub points: usize,
    /// Seconds of a reconstruction: median. Not there where no GPU was.
    pub forward: Option<f64>,
    /// Seconds of a reconstruction and its pullback: median.
    pub both: Option<f64>,
    /// Seconds of the choice of radii, and of sides by given normals: median.
    pub hold: Option<f64>,
    /// Seconds of each stage, waiting for the device before the next: median.
    pub stages: Vec<(&'static str, f64)>,
    /// Bytes of the device's memory that were taken, pools included.
    pub bytes: u64,
    /// What was asked of the device in a reconstruction.
    pub forward_effort: Asked,
    /// And in its pullback.
    pub backward_effort: Asked,
}

/// How often a device was asked to do something.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Asked {
    /// Kernels that were queued.
    pub launches: u64,
    /// Times that the program waited for the device.
    pub waits: u64,
}

impl From<Effort> for Asked {
    fn from(effort: Effort) -> Self {
        let Effort { launches, waits } = effort;
        Self { launches, waits }
    }
}

impl Size {
    /// Cells in all.
    pub fn cells(&self) -> usize {
        self.shape.iter().product()
    }
}

/// A problem on a device.
struct Set<R: Runtime> {
    device: Device<R>,
    plan: Reconstructor<R, f32>,
    points: Buffer<f32>,
    normals: Buffer<f32>,
}

impl Problem {
    /// Solves it `repeats` times more than the first time, which builds kernels and takes memory. Without repeats, memory
    /// alone is measured.
    ///
    /// # Errors
    /// What the pipeline says.
    pub fn measure<R: Runtime>(&self, device: &Device<R>, repeats: usize) -> Outcome<Size> {
        let Self {
            body,
            points,
            shape,
        } = self;
        eprintln!("{body}: {points} points, {shape:?} cells");
        device.release()?;
        let before = device.memory()?.reserved;
        let set = self.set(device)?;
        let held = set.hold()?;
        let begun = device.effort();
        let result = set.plan.reconstruct(&set.points, &held)?;
        let between = device.effort();
        set.queue_pullback(&result)?;
        let end = device.effort();
        device.wait()?;
        drop(result);
        let bytes = device.memory()?.reserved - before;
        let mut size = Size {
            shape: *shape,
            points: *points,
            forward: None,
            both: None,
            hold: None,
            stages: Vec::new(),
            bytes,
            forward_effort: between.since(begun).into(),
            backward_effort: end.since(between).into(),
        };
        if repeats > 0 {
            set.time(&held, repeats, &mut size)?;
        }
        Ok(size)
    }

    fn set<R: Runtime>(&self, device: &Device<R>) -> Outcome<Set<R>> {
        let shape = by_name(self.body)?;
        let sampling = Sampling {
            layout: Layout::Random,
            ..Sampling::default()
        };
        let samples = shape.sample::<f32>(self.points, &sampling, SEED)?;
        let cloud = samples.cloud;
        let normals = cloud.normals().ok_or("a body without normals")?;
        let grid = self.grid(&cloud)?;
        Ok(Set {
            plan: Reconstructor::new(device.clone(), grid, Options::default())?,
            points: device.upload(cloud.points().as_flattened())?,
            normals: device.upload(normals.as_flattened())?,
            device: device.clone(),
        })
    }

    /// Round the middle of the cloud, with cubes as small as leave a tenth of air.
    fn grid(&self, cloud: &PointCloud<f32>) -> Outcome<Grid<f32>> {
        let fitted = Grid::fit(cloud, Resolution::Cells(64), 0.1)?;
        let (low, high) = (fitted.lower(), fitted.upper());
        let size = vector::sub(high, low);
        let needed = (0..3).map(|a| size[a] / self.shape[a] as f32);
        let spacing = needed.fold(0.0, f32::max);
        let lower = std::array::from_fn(|a| {
            0.5 * (low[a] + high[a]) - 0.5 * spacing * self.shape[a] as f32
        });
        Ok(Grid::new(lower, spacing, self.shape)?)
    }
}

impl<R: Runtime> Set<R> {
    fn hold(&self) -> Outcome<Held<f32>> {
        let method = Method::Signs(self.normals.clone());
        let held = Held::find_on_device(&self.device, &self.points, Radius::Auto, &method)?;
        self.device.wait()?;
        Ok(held)
    }

    /// A cotangent at every cell: that of `Σ φ²/2`.
    fn queue_pullback(&self, result: &Reconstruction<f32>) -> Outcome {
        let cotangent = Cotangent {
            sdf: Some(&result.sdf),
            ..Cotangent::default()
        };
        self.plan.pullback(result, &cotangent)?;
        Ok(())
    }

    fn pull(&self, result: &Reconstruction<f32>) -> Outcome {
        self.queue_pullback(result)?;
        Ok(self.device.wait()?)
    }

    fn time(&self, held: &Held<f32>, repeats: usize, size: &mut Size) -> Outcome {
        let seconds = |work: &dyn Fn() -> Outcome| -> Outcome<f64> {
            let mut taken = Vec::new();
            for _ in 0..repeats {
                let start = Instant::now();
                work()?;
                taken.push(start.elapsed().as_secs_f64());
            }
            Ok(median(taken))
        };
        size.hold = Some(seconds(&|| self.hold().map(|_| ()))?);
        size.forward = Some(seconds(&|| {
            self.plan.reconstruct(&self.points, held)?;
            Ok(self.device.wait()?)
        })?);
        size.both = Some(seconds(&|| {
            let result = self.plan.reconstruct(&self.points, held)?;
            self.pull(&result)
        })?);
        size.stages = self.stages(held, repeats)?;
        Ok(())
    }

    fn stages(&self, held: &Held<f32>, repeats: usize) -> Outcome<Vec<(&'static str, f64)>> {
        let mut taken: [Vec<f64>; STAGES.len()] = Default::default();
        for _ in 0..repeats {
            let mut marks = Vec::new();
            let mut observer = |_| match self.device.wait() {
                Ok(()) => {
                    marks.push(Instant::now());
                    ControlFlow::Continue(())
                }
                Err(_) => ControlFlow::Break(()),
            };
            let (plan, points) = (&self.plan, &self.points);
            plan.reconstruct_observed(points, None, held, &mut observer)?;
            self.device.wait()?;
            marks.push(Instant::now());
            for (taken, pair) in taken.iter_mut().zip(marks.windows(2)) {
                taken.push((pair[1] - pair[0]).as_secs_f64());
            }
        }
        let names = STAGES.iter().map(|stage| stage.name());
        Ok(names.zip(taken.map(median)).collect())
    }
}
