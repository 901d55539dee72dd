//! `report.json`: the numbers of one reconstruction. Scripts depend on these names.

use std::path::Path;

use isograd::differential::Spread;
use isograd::isosurface::measure::Measures;
use isograd::orient::doubt::{Doubt, Reason};
use isograd::{Grid, Real, Stage};
use serde::Serialize;

/// The whole report.
#[derive(Debug, Serialize)]
pub struct Report {
    /// Version of the program.
    pub version: &'static str,
    /// Where it was computed: `cpu`, or a backend and its device, such as `vulkan: NVIDIA H100`.
    pub backend: String,
    /// What was read.
    pub input: Input,
    /// The grid.
    pub grid: GridReport,
    /// The normals.
    pub normals: Normals,
    /// Their signs.
    pub orientation: Orientation,
    /// Width of the smoothing of the indicator, in cells.
    pub smoothing: f64,
    /// The level of the surface.
    pub iso_value: f64,
    /// The surface.
    pub surface: Surface,
    /// The field.
    pub sdf: Sdf,
    /// Wall-clock times.
    pub seconds: Seconds,
    /// The most memory that was held at once.
    pub peak_memory_bytes: usize,
    /// What to know before trusting the result.
    pub warnings: Vec<String>,
}

/// What was read.
#[derive(Debug, Serialize)]
pub struct Input {
    /// The file, as it was named.
    pub path: String,
    /// Number of points.
    pub points: usize,
}

/// The grid, in the cloud's unit.
#[derive(Debug, Serialize)]
pub struct GridReport {
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Position of the first value.
    pub origin: [f64; 3],
    /// Cell size.
    pub spacing: f64,
}

/// The neighborhoods and normals.
#[derive(Debug, Serialize)]
pub struct Normals {
    /// Common radius.
    pub radius: f64,
    /// Neighbors of a point, itself included.
    /// The key is part of the format of the report.
    #[serde(rename = "neighbours")]
    pub neighbors: Neighbors,
    /// Points without a well-defined normal.
    pub guarded: usize,
}

/// Neighbors of a point.
#[derive(Debug, Serialize)]
pub struct Neighbors {
    /// Fewest.
    pub min: u32,
    /// Median.
    pub median: u32,
    /// Most.
    pub max: u32,
}

/// The signs of the normals.
#[derive(Debug, Serialize)]
pub struct Orientation {
    /// `auto`, `parity`, `given`, `signs` or `sensors`.
    pub method: &'static str,
    /// Axes whose sign was changed.
    pub flipped: usize,
    /// How sure the signs are.
    pub confidence: Confidence,
    /// How many are doubtful.
    pub doubtful: Doubtful,
}

/// Shares of the points, from 0 to 1; see [`isograd::orient::doubt`].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Doubtful {
    /// Of all points whose sign is doubtful.
    pub share: f64,
    /// Of those where two sheets are close to each other.
    pub thin: f64,
    /// Of those that are far from others.
    pub sparse: f64,
    /// Of those near a rim or hole.
    pub open: f64,
    /// Of those that scatter.
    pub noisy: f64,
    /// Of all others.
    pub unexplained: f64,
}

impl Doubtful {
    /// The shares of a count.
    pub fn new(doubt: &Doubt) -> Self {
        Self {
            share: doubt.share(),
            thin: doubt.share_of(Reason::Thin),
            sparse: doubt.share_of(Reason::Sparse),
            open: doubt.share_of(Reason::Open),
            noisy: doubt.share_of(Reason::Noisy),
            unexplained: doubt.share_of(Reason::Unexplained),
        }
    }
}

/// How sure the signs are, from 0 to 1.
#[derive(Debug, Serialize)]
pub struct Confidence {
    /// 5th percentile.
    pub p05: f64,
    /// Median.
    pub median: f64,
}

/// The surface.
#[derive(Debug, Serialize)]
pub struct Surface {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of faces.
    pub faces: usize,
    /// Number of pieces.
    pub components: usize,
    /// In unit length².
    pub area: f64,
    /// In unit length³.
    pub volume: f64,
    /// `V − E + F`.
    pub euler: i64,
    /// Whether each edge is in exactly two faces, consistently wound.
    pub closed: bool,
}

/// The field.
#[derive(Debug, Serialize)]
pub struct Sdf {
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// How near `|∇φ|` is to 1.
    pub eikonal: Eikonal,
}

/// Statistics of `|∇φ|`; `null` where there are no such cells.
#[derive(Debug, Serialize)]
pub struct Eikonal {
    /// Over all cells.
    pub all: Option<Moments>,
    /// Over the cells with `|φ| < 3h`.
    pub near: Option<Moments>,
}

/// Mean and percentiles.
#[derive(Debug, Serialize)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// 5th percentile.
    pub p05: f64,
    /// 95th percentile.
    pub p95: f64,
}

/// Wall-clock seconds; `total` runs from the start to the report.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading the cloud.
    pub read: f64,
    /// Neighbors, normals, area weights.
    pub normals: f64,
    /// Signs.
    pub orient: f64,
    /// Right-hand side.
    pub splat: f64,
    /// Solve and iso-value.
    pub poisson: f64,
    /// Marching cubes.
    pub isosurface: f64,
    /// Distances.
    pub distance: f64,
    /// Writing all files but the report.
    pub write: f64,
    /// Everything.
    pub total: f64,
}

impl Report {
    /// The report of a computation on `grid`; reading, writing and memory are still to be filled in.
    pub fn new<T: Real>(
        path: &Path,
        backend: String,
        grid: &Grid<T>,
        report: &isograd::Report,
    ) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            backend,
            input: Input::new(path, report.points),
            grid: GridReport {
                shape: grid.shape(),
                origin: grid.center_f64([0; 3]),
                spacing: grid.spacing().f64(),
            },
            normals: Normals::new(report),
            orientation: Orientation::new(report),
            smoothing: report.smoothing,
            iso_value: report.iso_value,
            surface: Surface::new(&report.surface),
            sdf: Sdf {
                min: report.sdf_min,
                max: report.sdf_max,
                eikonal: Eikonal {
                    all: report.eikonal.all.as_ref().map(Moments::new),
                    near: report.eikonal.near.as_ref().map(Moments::new),
                },
            },
            seconds: Seconds::of_stages(report),
            peak_memory_bytes: 0,
            warnings: report.warnings.iter().map(ToString::to_string).collect(),
        }
    }
}

impl Input {
    /// A file, and how many points it has.
    pub fn new(path: &Path, points: usize) -> Self {
        Self {
            path: path.display().to_string(),
            points,
        }
    }
}

impl Normals {
    /// What a report says of them.
    pub fn new(report: &isograd::Report) -> Self {
        let [min, median, max] = report.neighbors;
        Self {
            radius: report.radius,
            neighbors: Neighbors { min, median, max },
            guarded: report.guarded,
        }
    }
}

impl Orientation {
    /// What a report says of it.
    pub fn new(report: &isograd::Report) -> Self {
        Self {
            method: report.orientation,
            flipped: report.flipped,
            confidence: Confidence {
                p05: report.confidence_p05,
                median: report.confidence_median,
            },
            doubtful: Doubtful::new(&report.doubt),
        }
    }
}

impl Surface {
    fn new(measures: &Measures) -> Self {
        Self {
            vertices: measures.vertices,
            faces: measures.faces,
            components: measures.components,
            area: measures.area,
            volume: measures.volume,
            euler: measures.euler,
            closed: measures.closed,
        }
    }
}

impl Moments {
    fn new(spread: &Spread) -> Self {
        Self {
            mean: spread.mean,
            p05: spread.p05,
            p95: spread.p95,
        }
    }
}

impl Seconds {
    fn of_stages(report: &isograd::Report) -> Self {
        let of = |stage| report.seconds.of(stage);
        Self {
            normals: of(Stage::Normals),
            orient: of(Stage::Orient),
            splat: of(Stage::Splat),
            poisson: of(Stage::Poisson),
            isosurface: of(Stage::Isosurface),
            distance: of(Stage::Distance),
            ..Self::default()
        }
    }
}
