//! `report.json`: settings and measurements of one run. Scripts depend on these names.

use std::path::Path;

use isograd::{Grid, JsonReport, Real};
use serde::Serialize;

/// Contents of `report.json`.
#[derive(Debug, Serialize)]
pub struct Report {
    version: &'static str,
    /// `cpu`, or a backend and its device, such as `vulkan: NVIDIA H100`.
    #[serde(skip_serializing_if = "Option::is_none")]
    backend: Option<String>,
    input: Input,
    #[serde(skip_serializing_if = "Option::is_none")]
    grid: Option<GridReport>,
    /// Why the number type is another than the requested one.
    #[serde(skip_serializing_if = "Option::is_none")]
    note: Option<String>,
    #[serde(flatten)]
    result: JsonReport,
    /// Peak of the allocated memory.
    peak_memory_bytes: usize,
}

#[derive(Debug, Serialize)]
struct Input {
    /// The file, as on the command line.
    path: String,
    points: usize,
}

/// The grid, in the cloud's unit.
#[derive(Debug, Serialize)]
struct GridReport {
    shape: [usize; 3],
    /// Center of the first cell.
    origin: [f64; 3],
    spacing: f64,
}

/// Times of the parts of a run outside of the pipeline, in seconds.
#[derive(Clone, Copy, Debug)]
pub struct Times {
    /// Reading the cloud.
    pub read: f64,
    /// Writing all files but the report.
    pub write: f64,
    /// From the start of the program to the report.
    pub total: f64,
}

impl Report {
    /// The report of a command that reads `path`.
    pub fn new(path: &Path, mut result: JsonReport, times: Times) -> Self {
        let points = result.points.take().unwrap_or_default();
        result.seconds.retain(|(name, _)| *name != "total");
        result.seconds.insert(0, ("read", times.read));
        result.seconds.push(("write", times.write));
        result.seconds.push(("total", times.total));
        Self {
            version: env!("CARGO_PKG_VERSION"),
            backend: None,
            input: Input {
                path: path.display().to_string(),
                points,
            },
            grid: None,
            note: None,
            result,
            peak_memory_bytes: crate::ALLOCATOR.peak_usage(),
        }
    }

    /// Adds the grid and the backend of a reconstruction, and a note about its number type.
    pub fn on_grid<T: Real>(self, grid: &Grid<T>, backend: &str, note: Option<String>) -> Self {
        Self {
            note,
            backend: Some(backend.into()),
            grid: Some(GridReport {
                shape: grid.shape(),
                origin: grid.center_f64([0; 3]),
                spacing: grid.spacing().f64(),
            }),
            ..self
        }
    }
}
