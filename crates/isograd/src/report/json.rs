//! Form of a report in `report.json` and in Python. Scripts depend on these names.

use serde::{Serialize, Serializer};

use super::{Report, Stage, Verdict, Warning};
use crate::differential::Spread;
use crate::isosurface::Level;
use crate::isosurface::measure::Measures;
use crate::orient::doubt::{Doubt, Reason, Region};

/// A [`Report`] as it is serialized; `None` fields are left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct JsonReport {
    /// Number of points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
    /// Of an [`Orienter`](crate::Orienter) there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    outliers: Option<Outliers>,
    normals: Normals,
    orientation: Orientation,
    #[serde(flatten)]
    surface: Option<Reconstructed>,
    /// Wall-clock seconds by name.
    #[serde(serialize_with = "as_map")]
    pub seconds: Vec<(&'static str, f64)>,
    /// See [`Report::verdict`].
    verdict: Option<Verdict>,
    /// The [reasons](Report::reasons) of the verdict.
    warnings: Vec<JsonWarning>,
}

/// A [`Warning`] as it is serialized: its code, severity, text and remedy, and its numbers by name.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct JsonWarning {
    code: &'static str,
    severity: Verdict,
    text: String,
    #[serde(rename = "try")]
    remedy: &'static str,
    #[serde(flatten)]
    numbers: Warning,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Outliers {
    count: usize,
    indices: Vec<u32>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Normals {
    radius: f64,
    sample_spacing: f64,
    neighbors: Neighbors,
    guarded: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Neighbors {
    min: u32,
    median: u32,
    max: u32,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Orientation {
    method: &'static str,
    flipped: usize,
    confidence: Confidence,
    doubtful: Doubt,
    regions: Vec<Region>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Confidence {
    p05: f64,
    median: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Reconstructed {
    surface_spacing: f64,
    surface_cells: usize,
    smoothing: f64,
    walls: &'static str,
    iso_value: f64,
    trim: Option<Trim>,
    surface: Surface,
    sdf: Sdf,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Trim {
    distance: f64,
    faces: usize,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Surface {
    vertices: usize,
    faces: usize,
    components: usize,
    area: f64,
    volume: f64,
    euler: i64,
    closed: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Sdf {
    min: f64,
    max: f64,
    eikonal: Eikonal,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Eikonal {
    all: Option<Moments>,
    near: Option<Moments>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct Moments {
    mean: f64,
    p05: f64,
    p95: f64,
}

impl JsonReport {
    /// The report of a reconstruction.
    pub fn new(report: &Report) -> Self {
        Self {
            outliers: Some(Outliers {
                count: report.outliers.len(),
                indices: report.outliers.clone(),
            }),
            surface: Some(Reconstructed {
                surface_spacing: report.surface_spacing,
                surface_cells: report.surface_cells,
                smoothing: report.smoothing,
                walls: report.walls,
                iso_value: report.iso_value,
                trim: report
                    .trim
                    .map(|(distance, faces)| Trim { distance, faces }),
                surface: surface(&report.surface),
                sdf: Sdf {
                    min: report.sdf_min,
                    max: report.sdf_max,
                    eikonal: Eikonal {
                        all: report.eikonal.all.as_ref().map(moments),
                        near: report.eikonal.near.as_ref().map(moments),
                    },
                },
            }),
            seconds: seconds(report, &Stage::ALL),
            ..Self::samples(report)
        }
    }

    /// The report of an [`Orienter`](crate::Orienter): normals and orientation.
    pub fn samples(report: &Report) -> Self {
        let [min, median, max] = report.neighbors;
        Self {
            points: Some(report.points),
            outliers: None,
            normals: Normals {
                radius: report.radius,
                sample_spacing: report.sample_spacing,
                neighbors: Neighbors { min, median, max },
                guarded: report.guarded,
            },
            orientation: Orientation {
                method: report.orientation,
                flipped: report.flipped,
                confidence: Confidence {
                    p05: report.confidence_p05,
                    median: report.confidence_median,
                },
                doubtful: report.doubt,
                regions: report.doubtful_regions.clone(),
            },
            surface: None,
            seconds: seconds(report, &[Stage::Normals, Stage::Orient, Stage::Checks]),
            verdict: report.verdict(),
            warnings: report
                .reasons()
                .into_iter()
                .map(|warning| JsonWarning::new(warning, report.level))
                .collect(),
        }
    }
}

impl JsonWarning {
    fn new(warning: &Warning, level: Level) -> Self {
        Self {
            code: warning.code(),
            severity: warning.severity(),
            text: warning.to_string(),
            remedy: warning.remedy(level),
            numbers: warning.clone(),
        }
    }
}

/// Shares of the points, from 0 to 1, by reason.
impl Serialize for Doubt {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let reasons = Reason::ALL.map(|reason| (reason.name(), self.share_of(reason)));
        to.collect_map(std::iter::once(("share", self.share())).chain(reasons))
    }
}

fn surface(measures: &Measures) -> Surface {
    Surface {
        vertices: measures.vertices,
        faces: measures.faces,
        components: measures.components,
        area: measures.area,
        volume: measures.volume,
        euler: measures.euler,
        closed: measures.closed,
    }
}

fn moments(spread: &Spread) -> Moments {
    Moments {
        mean: spread.mean,
        p05: spread.p05,
        p95: spread.p95,
    }
}

fn seconds(report: &Report, stages: &[Stage]) -> Vec<(&'static str, f64)> {
    let stages = stages.iter();
    let stages = stages.map(|&stage| (stage.name(), report.seconds.of(stage)));
    stages.chain([("total", report.seconds.total())]).collect()
}

fn as_map<S: Serializer>(entries: &[(&'static str, f64)], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(entries.iter().copied())
}
