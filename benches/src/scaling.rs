//! Time and memory against the number of cells and of points.

use std::hint::black_box;
use std::time::Instant;

use isograd::{Grid, Options, PointCloud, Reconstructor, Resolution, SurfaceResolution};
use isograd_cli::ALLOCATOR;
use isograd_element::vector;
use isograd_shapes::by_name;
use rayon::prelude::*;
use serde::Serialize;

use crate::output::{Json, Outcome};
use crate::sampling::{Body, Draw, SEED, centered_grid, points_only};
use crate::timing::Passes;

/// Grids of the torus with [`SAMPLES`], in cells.
const GRIDS: [usize; 7] = [
    100_000,
    300_000,
    1_000_000,
    3_000_000,
    10_000_000,
    30_000_000,
    100_000_000,
];
const SAMPLES: usize = 50_000;

/// Clouds of the torus on [`GRID`], in points.
const CLOUDS: [usize; 7] = [
    10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000,
];
const GRID: usize = 1_000_000;

/// Sizes from this many times the smallest on are timed once.
const LARGE: usize = 300;
const REPEATS: usize = 3;

/// A body, its number of points, and its grid.
#[derive(Clone, Copy, Debug)]
pub struct Problem {
    /// Name of the body in `isograd-shapes`.
    pub body: &'static str,
    /// Number of samples.
    pub points: usize,
    /// Size of the grid.
    pub cells: Cells,
}

/// Size of a grid.
#[derive(Clone, Copy, Debug)]
pub enum Cells {
    /// Approximate number of cells, in the proportions of the body.
    About(usize),
    /// Cells along each axis.
    Shape([usize; 3]),
}

/// Time and memory of a problem in single precision, with all threads.
#[derive(Clone, Debug, Serialize)]
pub struct Size {
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub points: usize,
    /// Median seconds of a reconstruction without checks.
    pub forward: f64,
    /// Median seconds of its pullback.
    pub backward: f64,
    /// Median seconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
    /// Peak bytes of the first reconstruction, without the cloud.
    pub forward_bytes: usize,
    /// Peak bytes of the first reconstruction and its pullback.
    pub backward_bytes: usize,
}

impl Size {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.shape.iter().product()
    }
}

impl Problem {
    /// Solves it once to allocate, and `repeats` times more.
    pub fn measure(&self, repeats: usize) -> Outcome<Size> {
        let cloud = self.cloud()?;
        let grid = self.grid(&cloud)?;
        let shape = grid.shape();
        eprintln!("{}: {} points, {shape:?} cells", self.body, self.points);
        let before = ALLOCATOR.current_usage();
        let options = Options::default()
            .surface(SurfaceResolution::Grid)
            .checks(false);
        let mut plan = Reconstructor::new(grid, options)?;
        let passes = Passes::measure(&mut plan, &cloud, repeats)?;
        let [forward_bytes, backward_bytes] = passes.peak_bytes.map(|b| b.saturating_sub(before));
        Ok(Size {
            shape,
            points: cloud.len(),
            forward: passes.forward(),
            backward: passes.backward(),
            stages: passes.stages(),
            forward_bytes,
            backward_bytes,
        })
    }

    fn cloud(&self) -> Outcome<PointCloud<f32>> {
        let shape = by_name(self.body)?;
        let samples = shape.sample::<f64>(self.points, &Draw::Random.sampling(), SEED)?;
        points_only(samples.cloud.points())
    }

    fn grid(&self, cloud: &PointCloud<f32>) -> Outcome<Grid<f32>> {
        let padding = 0.1;
        match self.cells {
            Cells::About(cells) => {
                // The proportions are those of any grid around the cloud.
                let coarse = Grid::fit(cloud, Resolution::Cells(100), padding)?;
                let refinement = (cells as f64 / coarse.cells() as f64).cbrt();
                let longest = coarse.shape().into_iter().max().unwrap_or(1);
                let longest = (longest as f64 * refinement).round() as usize;
                Ok(Grid::fit(cloud, Resolution::Cells(longest), padding)?)
            }
            Cells::Shape(shape) => {
                let (low, high) = cloud.bounds().ok_or("a cloud without points")?;
                centered_grid((vector::to_f64(low), vector::to_f64(high)), shape)
            }
        }
    }
}

/// Measures everything, with progress on stderr, and returns it as JSON.
pub fn run() -> Outcome<String> {
    let torus = |points, cells| Problem {
        body: "torus",
        points,
        cells: Cells::About(cells),
    };
    let fish = Problem {
        body: Body::FISH.name,
        points: Body::FISH.samples,
        cells: Cells::Shape(Body::FISH.shape),
    };
    let copy = copy_bytes_per_second();
    let fish = fish.measure(5)?;
    let cells = grow(&GRIDS, |cells| torus(SAMPLES, cells))?;
    let points = grow(&CLOUDS, |points| torus(points, GRID))?;
    let json = Json::default().with("cells", &cells)?;
    let json = json.with("points", &points)?;
    let json = json.with("fish", &[fish])?;
    Ok(json.with("copy_bytes_per_second", &[copy])?.text())
}

/// Problems of increasing size, as far as memory allows.
fn grow(sizes: &[usize], problem: impl Fn(usize) -> Problem) -> Outcome<Vec<Size>> {
    let mut measured: Vec<Size> = Vec::new();
    for (place, &size) in sizes.iter().enumerate() {
        if let Some(last) = measured.last() {
            let growth = size as f64 / sizes[place - 1] as f64;
            let needed = last.backward_bytes as f64 * growth;
            if isograd::available_memory().is_some_and(|free| needed > free) {
                eprintln!("{size} needs {needed:.2e} bytes: more than are free");
                break;
            }
        }
        let repeats = if size >= LARGE * sizes[0] { 1 } else { REPEATS };
        measured.push(problem(size).measure(repeats)?);
    }
    Ok(measured)
}

/// Bytes that a parallel copy of an array larger than all caches reads and writes per second: best of five runs.
fn copy_bytes_per_second() -> f64 {
    const VALUES: usize = 1 << 26;
    const CHUNK: usize = 1 << 16;
    let from = vec![1f32; VALUES];
    let mut to = vec![0f32; VALUES];
    let mut fastest = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        let chunks = to.par_chunks_mut(CHUNK).zip(from.par_chunks(CHUNK));
        chunks.for_each(|(to, from)| to.copy_from_slice(from));
        fastest = fastest.min(start.elapsed().as_secs_f64());
        black_box(&to);
    }
    2.0 * size_of_val(from.as_slice()) as f64 / fastest
}
