//! All that the page is made of.

use isograd_page::program::Outcome;
use peak_alloc::PeakAlloc;

use crate::copy;
use crate::size::{Cells, Problem, Size};

/// Grids, in cells.
const GRIDS: [usize; 7] = [
    100_000,
    300_000,
    1_000_000,
    3_000_000,
    10_000_000,
    30_000_000,
    100_000_000,
];

/// Samples on all of those.
const SAMPLES: usize = 50_000;

/// Clouds, in points.
const CLOUDS: [usize; 7] = [
    10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000,
];

/// Cells of the grid round all of those.
const GRID: usize = 1_000_000;

/// From this many times the smallest problem on, one run after the first has to do.
const LARGE: usize = 300;
const REPEATS: usize = 3;

/// The paper's fish.
const FISH: Problem = Problem {
    body: "fish",
    points: 50_000,
    cells: Cells::Shape([338, 120, 151]),
};

/// All results.
pub struct Results {
    /// The torus on ever finer grids.
    pub cells: Vec<Size>,
    /// The torus with ever more samples.
    pub points: Vec<Size>,
    /// The paper's fish.
    pub fish: Size,
    /// Bytes read and written in a second by a copy.
    pub copy: f64,
}

/// Measures everything; says on stderr where it is.
///
/// # Errors
/// What the pipeline says.
pub fn run() -> Outcome<Results> {
    if PeakAlloc.peak_usage() == 0 {
        return Err("memory is not being counted".into());
    }
    let torus = |points, cells| Problem {
        body: "torus",
        points,
        cells: Cells::About(cells),
    };
    Ok(Results {
        copy: copy::bytes_per_second(),
        fish: FISH.measure(5)?,
        cells: grow(&GRIDS, |cells| torus(SAMPLES, cells))?,
        points: grow(&CLOUDS, |points| torus(points, GRID))?,
    })
}

/// Ever larger problems, as far as memory reaches.
fn grow(sizes: &[usize], problem: impl Fn(usize) -> Problem) -> Outcome<Vec<Size>> {
    let mut measured: Vec<(usize, Size)> = Vec::new();
    for &size in sizes {
        if let Some((last, found)) = measured.last() {
            let needed = found.backward_bytes as f64 * (size as f64 / *last as f64);
            if isograd::available_memory().is_some_and(|free| needed > free) {
                eprintln!("{size} needs {needed:.2e} bytes: more than are free");
                break;
            }
        }
        let repeats = if size >= LARGE * sizes[0] { 1 } else { REPEATS };
        measured.push((size, problem(size).measure(repeats)?));
    }
    Ok(measured.into_iter().map(|(_, found)| found).collect())
}
