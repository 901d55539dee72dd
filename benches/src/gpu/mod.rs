//! Time and memory on a GPU.

pub mod problem;

use std::time::Instant;

use cubecl::prelude::Runtime;
use isograd_gpu::primitives::fill;
use isograd_gpu::{Buffer, Device};
use serde::Serialize;

use crate::output::Outcome;
use crate::sampling::Body;
use crate::statistics::median;
use problem::{Size, measure};

/// Cells along the axes of cubic grids, with [`SAMPLES`].
const GRIDS: [usize; 7] = [64, 96, 128, 192, 256, 384, 512];
const SAMPLES: usize = 50_000;

/// Clouds, in points, on a cubic grid with [`GRID`] cells along each axis.
const CLOUDS: [usize; 4] = [10_000, 100_000, 1_000_000, 10_000_000];
const GRID: usize = 128;

const REPEATS: usize = 5;

/// Results on one device.
#[derive(Serialize)]
pub struct Results {
    /// Name of the device, as its driver reports it.
    pub device: String,
    /// `CUDA` or `Vulkan`; absent without a GPU.
    pub backend: Option<&'static str>,
    /// Version of the driver, if known.
    pub driver: Option<String>,
    /// Bytes read and written per second when one large field is added to another.
    pub bytes_per_second: Option<f64>,
    /// The paper's fish.
    pub fish: Size,
    /// The torus on grids of increasing size.
    pub cells: Vec<Size>,
    /// The torus with an increasing number of samples.
    pub points: Vec<Size>,
}

/// Measures time and memory, with progress on stderr.
pub fn time_and_memory<R: Runtime>(device: &Device<R>, backend: &'static str) -> Outcome<Results> {
    let torus = |samples, n| Body {
        name: "torus",
        shape: [n; 3],
        samples,
    };
    let cells = GRIDS.map(|n| torus(SAMPLES, n));
    let points = CLOUDS.map(|samples| torus(samples, GRID));
    Ok(Results {
        device: device.name().into(),
        backend: Some(backend),
        driver: driver(),
        bytes_per_second: Some(bytes_per_second(device)?),
        fish: measure(&Body::FISH, device, REPEATS)?,
        cells: up_to_memory(device, &cells)?,
        points: up_to_memory(device, &points)?,
    })
}

/// Measures the memory, kernels and waits of the paper's fish, which hardly depend on the device.
pub fn memory<R: Runtime>(device: &Device<R>) -> Outcome<Results> {
    Ok(Results {
        device: device.name().into(),
        backend: None,
        driver: None,
        bytes_per_second: None,
        fish: measure(&Body::FISH, device, 0)?,
        cells: Vec::new(),
        points: Vec::new(),
    })
}

/// Version of the NVIDIA driver, from its entry in `/proc`.
fn driver() -> Option<String> {
    let text = std::fs::read_to_string("/proc/driver/nvidia/version").ok()?;
    let line = text.lines().next()?.split_once(": ")?.1;
    Some(line.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// Measures problems of increasing size, until one exceeds the memory of the device.
fn up_to_memory<R: Runtime>(device: &Device<R>, bodies: &[Body]) -> Outcome<Vec<Size>> {
    let mut sizes = Vec::new();
    for body in bodies {
        match measure(body, device, REPEATS) {
            Ok(size) => sizes.push(size),
            Err(error) if !sizes.is_empty() => {
                eprintln!("skipped, with all larger ones: {error}");
                break;
            }
            Err(error) => return Err(error),
        }
    }
    Ok(sizes)
}

/// Bandwidth of a kernel that reads two numbers and writes one.
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
    // The first run builds the kernel.
    let seconds = median(taken.split_off(1));
    Ok((3 * size_of::<f32>() * NUMBERS) as f64 / seconds)
}
