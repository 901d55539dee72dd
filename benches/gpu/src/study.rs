//! All that the page is made of.

use std::time::Instant;

use cubecl::prelude::Runtime;
use isograd_gpu::primitives::fill;
use isograd_gpu::{Buffer, Device};
use isograd_page::program::Outcome;
use isograd_page::statistics::median;
use serde::Serialize;

use crate::problem::{Problem, Size};

/// Cells along the axes of cubes.
const GRIDS: [usize; 7] = [64, 96, 128, 192, 256, 384, 512];

/// Samples on all of those.
const SAMPLES: usize = 50_000;

/// Clouds, in points.
const CLOUDS: [usize; 4] = [10_000, 100_000, 1_000_000, 10_000_000];

/// Cells along the axes of the grid round all of those.
const GRID: usize = 128;

/// The paper's fish.
const FISH: Problem = Problem {
    body: "fish",
    points: 50_000,
    shape: [338, 120, 151],
};

const REPEATS: usize = 5;

/// All results.
#[derive(Serialize)]
pub struct Results {
    /// The name that its driver gives the device.
    pub device: String,
    /// CUDA or Vulkan; not there where no GPU was.
    pub backend: Option<&'static str>,
    /// Bytes that one large field added to another reads and writes in a second.
    pub bytes_per_second: Option<f64>,
    /// The paper's fish.
    pub fish: Size,
    /// The torus on ever finer grids.
    pub cells: Vec<Size>,
    /// The torus with ever more samples.
    pub points: Vec<Size>,
}

/// Everything; says on stderr where it is.
///
/// # Errors
/// What the pipeline says.
pub fn all<R: Runtime>(device: &Device<R>, backend: &'static str) -> Outcome<Results> {
    let torus = |points, n| Problem {
        body: "torus",
        points,
        shape: [n; 3],
    };
    let cells = GRIDS.map(|n| torus(SAMPLES, n));
    let points = CLOUDS.map(|points| torus(points, GRID));
    Ok(Results {
        device: device.name().into(),
        backend: Some(backend),
        bytes_per_second: Some(bytes_per_second(device)?),
        fish: FISH.measure(device, REPEATS)?,
        cells: as_far_as_it_goes(device, &cells)?,
        points: as_far_as_it_goes(device, &points)?,
    })
}

/// What the fish takes of the memory.
///
/// # Errors
/// What the pipeline says.
pub fn memory_alone<R: Runtime>(device: &Device<R>) -> Outcome<Results> {
    Ok(Results {
        device: device.name().into(),
        backend: None,
        bytes_per_second: None,
        fish: FISH.measure(device, 0)?,
        cells: Vec::new(),
        points: Vec::new(),
    })
}

/// Ever larger problems, until one is more than the device holds.
fn as_far_as_it_goes<R: Runtime>(device: &Device<R>, problems: &[Problem]) -> Outcome<Vec<Size>> {
    let mut sizes = Vec::new();
    for problem in problems {
        match problem.measure(device, REPEATS) {
            Ok(size) => sizes.push(size),
            Err(error) if !sizes.is_empty() => {
                eprintln!("left out, and all that is larger: {error}");
                break;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(sizes)
}

/// Of a kernel that reads two numbers and writes one.
fn bytes_per_second<R: Runtime>(device: &Device<R>) -> Outcome<f64> {
    const NUMBERS: usize = 1 << 26;
    let from: Buffer<f32> = fill::zeros(device, NUMBERS)?;
    let to: Buffer<f32> = fill::zeros(device, NUMBERS)?;
    let mut taken = Vec::new();
    for _ in 0..=REPEATS {
        device.wait()?;
        let start = Instant::now();
        fill::add(device, &from, &to)?;
        device.wait()?;
        taken.push(start.elapsed().as_secs_f64());
    }
    // The first time builds the kernel.
    let seconds = median(taken.split_off(1));
    Ok((3 * size_of::<f32>() * NUMBERS) as f64 / seconds)
}
