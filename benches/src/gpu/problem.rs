//! Time and memory of one size of the problem.

use std::ops::ControlFlow;
use std::time::Instant;

use cubecl::prelude::Runtime;
use isograd::Stage;
use isograd::neighbors::Radius;
use isograd_element::vector;
use isograd_gpu::orient::Method;
use isograd_gpu::pipeline::{Cotangent, Options, RadiiAndSigns, Reconstruction, Reconstructor};
use isograd_gpu::{Buffer, Device, Effort};
use isograd_shapes::by_name;
use serde::Serialize;

use crate::output::Outcome;
use crate::sampling::{Body, Draw, SEED, centered_grid};
use crate::statistics::median;

/// Stages that are timed.
const STAGES: [Stage; 5] = [
    Stage::Normals,
    Stage::Splat,
    Stage::Poisson,
    Stage::Isosurface,
    Stage::Distance,
];

/// Time and memory of a problem in single precision, with all data on the device, radii and signs held.
#[derive(Clone, Debug, Serialize)]
pub struct Size {
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub points: usize,
    /// Median seconds of a reconstruction; absent without a GPU.
    pub forward: Option<f64>,
    /// Median seconds of a reconstruction and its pullback.
    pub both: Option<f64>,
    /// Median seconds to choose radii, and signs from given normals.
    pub hold: Option<f64>,
    /// Median seconds of each stage, waiting for the device after each.
    pub stages: Vec<(&'static str, f64)>,
    /// Bytes of device memory, including pools.
    pub bytes: u64,
    /// Kernels and waits of a reconstruction.
    pub forward_effort: Work,
    /// Kernels and waits of its pullback.
    pub backward_effort: Work,
}

/// Work queued on a device.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Work {
    /// Number of kernels queued.
    pub launches: u64,
    /// Number of waits for the device.
    pub waits: u64,
}

impl From<Effort> for Work {
    fn from(effort: Effort) -> Self {
        let Effort { launches, waits } = effort;
        Self { launches, waits }
    }
}

/// A problem on a device.
struct Loaded<R: Runtime> {
    device: Device<R>,
    plan: Reconstructor<R, f32>,
    points: Buffer<f32>,
    normals: Buffer<f32>,
}

/// Solves a problem once, which builds kernels and allocates memory, and then `repeats` times. Without repeats, only memory
/// is measured.
pub fn measure<R: Runtime>(body: &Body, device: &Device<R>, repeats: usize) -> Outcome<Size> {
    let Body {
        name,
        samples,
        shape,
    } = *body;
    eprintln!("{name}: {samples} points, {shape:?} cells");
    device.release()?;
    let before = device.memory()?.reserved;
    let set = Loaded::new(body, device)?;
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
        shape,
        points: samples,
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
        eprintln!("{size:?}");
    }
    Ok(size)
}

impl<R: Runtime> Loaded<R> {
    fn new(body: &Body, device: &Device<R>) -> Outcome<Self> {
        let shape = by_name(body.name)?;
        let sampling = Draw::Random.sampling();
        let cloud = shape.sample::<f32>(body.samples, &sampling, SEED)?.cloud;
        let normals = cloud.normals().ok_or("a body without normals")?;
        let (low, high) = cloud.bounds().ok_or("a cloud without points")?;
        let grid = centered_grid((vector::to_f64(low), vector::to_f64(high)), body.shape)?;
        Ok(Self {
            plan: Reconstructor::new(device.clone(), grid, Options::default())?,
            points: device.upload(cloud.points().as_flattened())?,
            normals: device.upload(normals.as_flattened())?,
            device: device.clone(),
        })
    }

    fn hold(&self) -> Outcome<RadiiAndSigns<f32>> {
        let method = Method::Signs(self.normals.clone());
        let held =
            RadiiAndSigns::find_on_device(&self.device, &self.points, Radius::Auto, &method)?;
        self.device.wait()?;
        Ok(held)
    }

    /// Pulls back the cotangent of `Σ φ²/2`, nonzero at every cell.
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

    fn time(&self, held: &RadiiAndSigns<f32>, repeats: usize, size: &mut Size) -> Outcome {
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

    fn stages(
        &self,
        held: &RadiiAndSigns<f32>,
        repeats: usize,
    ) -> Outcome<Vec<(&'static str, f64)>> {
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
