//! Time and memory of one size of the problem.

use std::time::Instant;

use isograd::{
    CloudCotangent, Cotangent, Grid, Options, PointCloud, PullbackScratch, Reconstructor,
    Resolution, Stage,
};
use isograd_element::vector;
use isograd_page::program::Outcome;
use isograd_page::statistics::median;
use isograd_shapes::{Layout, Sampling, by_name};
use peak_alloc::PeakAlloc;
use serde::Serialize;

/// Every cloud is drawn with this seed.
const SEED: u64 = 1;

/// A problem.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// Name of the body in `isograd-shapes`.
    pub body: &'static str,
    /// Number of samples.
    pub points: usize,
    /// Cells of the grid.
    pub cells: Cells,
}

/// How large the grid is.
#[derive(Clone, Copy, Debug)]
pub enum Cells {
    /// About so many in all, in the proportions of the body.
    About(usize),
    /// So many along each axis.
    Shape([usize; 3]),
}

/// What it took, in single precision with all threads.
#[derive(Clone, Debug, Serialize)]
pub struct Size {
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub points: usize,
    /// Seconds of a reconstruction without its checks: median.
    pub forward: f64,
    /// Seconds of the pullback of it: median.
    pub backward: f64,
    /// Seconds of each stage: median.
    pub stages: Vec<(&'static str, f64)>,
    /// Most bytes in use at once during the first reconstruction, the cloud aside.
    pub forward_bytes: usize,
    /// The same with the pullback.
    pub backward_bytes: usize,
}

impl Size {
    /// Cells in all.
    pub fn cells(&self) -> usize {
        self.shape.iter().product()
    }
}

impl Problem {
    /// Solves it, `repeats` times more than the first time, which takes memory and does not count.
    ///
    /// # Errors
    /// What the pipeline says.
    pub fn measure(&self, repeats: usize) -> Outcome<Size> {
        let cloud = self.cloud()?;
        let grid = self.grid(&cloud)?;
        eprintln!(
            "{}: {} points, {:?} cells",
            self.body,
            self.points,
            grid.shape()
        );
        // The command line's crate, which draws the pictures, has it as the allocator of all that links it.
        let memory = PeakAlloc;
        let before = memory.current_usage();
        memory.reset_peak_usage();
        let options = Options::default().checks(false);
        let mut plan = Reconstructor::new(grid, options)?;
        let (mut scratch, mut out) = (PullbackScratch::default(), CloudCotangent::default());
        let mut peaks = [0; 2];
        let (mut forward, mut backward, mut stages) = (Vec::new(), Vec::new(), Vec::new());
        for repeat in 0..=repeats {
            let start = Instant::now();
            let result = plan.reconstruct(&cloud)?;
            let first = start.elapsed().as_secs_f64();
            peaks[0] = if repeat == 0 {
                memory.peak_usage()
            } else {
                peaks[0]
            };
            // A cotangent at every cell: that of Σ φ²/2.
            let cotangent = Cotangent {
                sdf: Some(result.sdf().values()),
                ..Cotangent::default()
            };
            let start = Instant::now();
            result.pullback_into(&cloud, &cotangent, &mut scratch, &mut out)?;
            if repeat == 0 {
                peaks[1] = memory.peak_usage();
            } else {
                forward.push(first);
                backward.push(start.elapsed().as_secs_f64());
                stages.push(result.report().seconds);
            }
        }
        let of_stage = |stage: Stage| {
            let seconds = stages.iter().map(|seconds| seconds.of(stage));
            (stage.name(), median(seconds.collect()))
        };
        let timed = Stage::ALL.into_iter().filter(|&s| s != Stage::Checks);
        Ok(Size {
            shape: grid.shape(),
            points: cloud.len(),
            stages: timed.map(of_stage).collect(),
            forward: median(forward),
            backward: median(backward),
            forward_bytes: peaks[0].saturating_sub(before),
            backward_bytes: peaks[1].saturating_sub(before),
        })
    }

    fn cloud(&self) -> Outcome<PointCloud<f32>> {
        let sampling = Sampling {
            layout: Layout::Random,
            ..Sampling::default()
        };
        let samples = by_name(self.body)?.sample::<f64>(self.points, &sampling, SEED)?;
        let points = samples.cloud.points().iter().map(|&x| vector::of_f64(x));
        Ok(PointCloud::new(points.collect())?)
    }

    fn grid(&self, cloud: &PointCloud<f32>) -> Outcome<Grid<f32>> {
        let padding = 0.1;
        match self.cells {
            Cells::About(cells) => {
                // The proportions are those of any grid round the cloud.
                let some = Grid::fit(cloud, Resolution::Cells(100), padding)?;
                let finer = (cells as f64 / some.cells() as f64).cbrt();
                let longest = some.shape().into_iter().max().unwrap_or(1);
                let longest = (longest as f64 * finer).round() as usize;
                Ok(Grid::fit(cloud, Resolution::Cells(longest), padding)?)
            }
            Cells::Shape(shape) => {
                let (low, high) = cloud.bounds().ok_or("a cloud without points")?;
                let needed =
                    |a: usize| (1.0 + 2.0 * padding) * (high[a] - low[a]) / shape[a] as f32;
                let spacing = needed(0).max(needed(1)).max(needed(2));
                let corner = |a: usize| 0.5 * (low[a] + high[a]) - 0.5 * spacing * shape[a] as f32;
                Ok(Grid::new(std::array::from_fn(corner), spacing, shape)?)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_about_as_many_cells_as_are_asked_for_and_memory_is_counted() {
        let problem = Problem {
            body: "torus",
            points: 2_000,
            cells: Cells::About(50_000),
        };
        let size = problem.measure(1).expect("a torus");
        let cells = size.cells() as f64;
        assert!((0.8..1.25).contains(&(cells / 50_000.0)), "{cells}");
        assert!(size.forward > 0.0 && size.backward > 0.0);
        // φ, χ and the closest faces at the least.
        assert!(size.forward_bytes > 12 * size.cells());
        assert!(size.backward_bytes >= size.forward_bytes);
    }
}
