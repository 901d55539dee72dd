//! Seconds of the pipeline forward and backward.

use std::time::Instant;

use isograd::{
    CloudCotangent, Cotangent, Options, PullbackScratch, Real, Reconstructor, Seconds, Stage,
};
use isograd_page::statistics::median;
use rayon::ThreadPoolBuilder;
use serde::Serialize;

use crate::Outcome;
use crate::body::{Body, Sampled, narrowed, points_alone};

/// Threads that are measured with.
pub const THREADS: [usize; 2] = [1, 2];

/// Seconds of one body, number type and number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    /// Name of the body.
    pub body: &'static str,
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub samples: usize,
    /// Number type.
    pub precision: &'static str,
    /// Threads.
    pub threads: usize,
    /// Seconds of a reconstruction, checks left out: median.
    pub forward: f64,
    /// Seconds of the pullback of it: median.
    pub backward: f64,
    /// Pullback over the reconstruction just before it: median.
    pub ratio: f64,
    /// Seconds of each stage of the forward: median.
    pub stages: Vec<(&'static str, f64)>,
}

/// Stages that are timed: all but the checks, which are left out.
pub fn stages() -> impl Iterator<Item = Stage> {
    Stage::ALL.into_iter().filter(|&s| s != Stage::Checks)
}

/// Measures a body in both number types, with each number of threads.
///
/// # Errors
/// What the pipeline says, or a system that refuses threads.
pub fn measure(body: &Body, sampled: &Sampled, repeats: usize) -> Outcome<Vec<Cost>> {
    let mut costs = Vec::new();
    for threads in THREADS {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
        let timed = |precision| {
            let run = || -> Result<_, String> {
                let timings = match precision {
                    "f32" => timings::<f32>(sampled, repeats),
                    _ => timings::<f64>(sampled, repeats),
                };
                timings.map_err(|e| e.to_string())
            };
            pool.install(run)
        };
        for precision in ["f32", "f64"] {
            eprintln!("{}: cost, {precision}, {threads} threads", body.name);
            costs.push(timed(precision)?.cost(body, precision, threads));
        }
    }
    Ok(costs)
}

/// What each repetition took.
#[derive(Default)]
struct Timings {
    forward: Vec<f64>,
    backward: Vec<f64>,
    stages: Vec<Seconds>,
}

/// Forward and backward in turn, so that what else the machine does meets both. The first, in which memory is
/// taken, does not count.
fn timings<T: Real>(sampled: &Sampled, repeats: usize) -> Outcome<Timings> {
    let cloud = points_alone::<T>(sampled.cloud.points())?;
    let options = Options::default().checks(false);
    let mut plan = Reconstructor::new(narrowed(&sampled.grid)?, options)?;
    let mut scratch = PullbackScratch::default();
    let mut out = CloudCotangent::default();
    let mut timings = Timings::default();
    for repeat in 0..=repeats {
        let start = Instant::now();
        let result = plan.reconstruct(&cloud)?;
        let forward = start.elapsed().as_secs_f64();
        // A cotangent at every cell: that of Σ φ²/2.
        let cotangent = Cotangent {
            sdf: Some(result.sdf().values()),
            ..Cotangent::default()
        };
        let start = Instant::now();
        result.pullback_into(&cloud, &cotangent, &mut scratch, &mut out)?;
        let backward = start.elapsed().as_secs_f64();
        if repeat > 0 {
            timings.forward.push(forward);
            timings.backward.push(backward);
            timings.stages.push(result.report().seconds);
        }
    }
    Ok(timings)
}

impl Timings {
    fn cost(self, body: &Body, precision: &'static str, threads: usize) -> Cost {
        let pairs = self.backward.iter().zip(&self.forward);
        let of_stage = |stage: Stage| {
            let seconds = self.stages.iter().map(|seconds| seconds.of(stage));
            (stage.name(), median(seconds.collect()))
        };
        Cost {
            body: body.name,
            shape: body.shape,
            samples: body.samples,
            precision,
            threads,
            ratio: median(pairs.map(|(b, f)| b / f).collect()),
            stages: stages().map(of_stage).collect(),
            forward: median(self.forward),
            backward: median(self.backward),
        }
    }
}
