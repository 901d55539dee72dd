//! Seconds and peak memory of reconstructions and their pullbacks.

use std::time::Instant;

use isograd::{CloudCotangent, Cotangent, Pipeline, PointCloud, Reconstructor, Seconds, Stage};
use isograd_cli::ALLOCATOR;

use crate::output::Outcome;
use crate::statistics::median;

/// Seconds of repeated forward and backward passes, and peak memory of the first ones.
#[derive(Default)]
pub struct Passes {
    forward: Vec<f64>,
    backward: Vec<f64>,
    stages: Vec<Seconds>,
    /// Bytes in use at the peak of the first forward pass, and of that and its pullback.
    pub peak_bytes: [usize; 2],
    /// Bytes that the first pullback takes at its peak, and the last one, beyond those in use when it starts.
    pub pullback_bytes: [usize; 2],
    /// Bytes of φ, of what is kept for the pullback, and of the workspace that stays with the result.
    pub kept_bytes: [usize; 3],
}

impl Passes {
    /// Reconstructs and pulls back in turn, so that other load on the machine affects both alike. The first pass, which
    /// allocates, is not timed. The cotangent is that of `Σ φ²/2`: nonzero at every cell.
    pub fn measure<T: Pipeline>(
        plan: &mut Reconstructor<T>,
        cloud: &PointCloud<T>,
        repeats: usize,
    ) -> Outcome<Self> {
        let memory = &ALLOCATOR;
        let mut out = CloudCotangent::default();
        let mut passes = Self::default();
        memory.reset_peak_usage();
        for repeat in 0..=repeats {
            let start = Instant::now();
            let result = plan.reconstruct(cloud)?;
            let forward = start.elapsed().as_secs_f64();
            let cotangent = Cotangent {
                sdf: Some(result.sdf().values()),
                ..Cotangent::default()
            };
            let phi_bytes = size_of_val(result.sdf().values());
            passes.kept_bytes = [phi_bytes, result.residual_bytes(), result.work_bytes()];
            let (peak, before) = (memory.peak_usage(), memory.current_usage());
            memory.reset_peak_usage();
            let start = Instant::now();
            result.pullback_into(&cotangent, &mut out)?;
            let backward = start.elapsed().as_secs_f64();
            let taken = memory.peak_usage().saturating_sub(before);
            if repeat == 0 {
                passes.peak_bytes = [peak, peak.max(memory.peak_usage())];
                passes.pullback_bytes = [taken; 2];
            } else {
                passes.forward.push(forward);
                passes.backward.push(backward);
                passes.stages.push(result.report().seconds);
                passes.pullback_bytes[1] = taken;
            }
        }
        Ok(passes)
    }

    /// Median seconds of a reconstruction.
    pub fn forward(&self) -> f64 {
        median(self.forward.clone())
    }

    /// Median seconds of a pullback.
    pub fn backward(&self) -> f64 {
        median(self.backward.clone())
    }

    /// Median ratio of a pullback to the reconstruction before it.
    pub fn ratio(&self) -> f64 {
        let pairs = self.backward.iter().zip(&self.forward);
        median(pairs.map(|(b, f)| b / f).collect())
    }

    /// Median seconds of each stage but the checks.
    pub fn stages(&self) -> Vec<(&'static str, f64)> {
        let of_stage = |stage: Stage| {
            let seconds = self.stages.iter().map(|seconds| seconds.of(stage));
            (stage.name(), median(seconds.collect()))
        };
        let timed = Stage::ALL.into_iter().filter(|&s| s != Stage::Checks);
        timed.map(of_stage).collect()
    }
}
