//! `report.json`: settings and measurements of one run. Scripts depend on these names.

use std::path::Path;

use isograd::{Grid, JsonReport, Real};
use isograd_io::Geometry;
use serde::Serialize;

use crate::args::OrientArgs;

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
    /// Whether the normals of the input were used, if it has any.
    #[serde(skip_serializing_if = "Option::is_none")]
    normals: Option<&'static str>,
}

/// Normals of the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Normals {
    /// The input has none, or only zeros.
    Absent,
    /// The orientation is taken from them.
    Used,
    /// The method of the orientation takes no normals.
    Unused,
}

impl Normals {
    /// Normals of a file, for a method of orientation.
    pub fn of(geometry: &Geometry, args: &OrientArgs) -> Self {
        let is_zero = |normal: &[f64; 3]| *normal == [0.0; 3];
        match &geometry.normals {
            Some(_) if args.uses_normals() => Self::Used,
            Some(normals) if !normals.iter().all(is_zero) => Self::Unused,
            _ => Self::Absent,
        }
    }
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
                normals: None,
            },
            grid: None,
            note: None,
            result,
            peak_memory_bytes: crate::ALLOCATOR.peak_usage(),
        }
    }

    /// Adds whether the normals of the input were used.
    pub fn with_normals(mut self, normals: Normals) -> Self {
        self.input.normals = match normals {
            Normals::Absent => None,
            Normals::Used => Some("used"),
            Normals::Unused => Some("unused"),
        };
        self
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
