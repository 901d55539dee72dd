//! One reconstruction: body, cloud, grid and options.

use isograd::poisson::Smoothing;
use isograd::{Options, SurfaceResolution, distance, isosurface, orient, splat};
use serde::Serialize;

use super::measure::BAND;
use crate::sampling::Draw;

/// Source of the normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// Exact normals of the body.
    Exact,
    /// D-PCA, oriented by the default method.
    Estimated,
}

/// Splat weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Splat {
    /// The default.
    Bspline,
    /// The weights printed in the paper.
    Paper,
}

impl Splat {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Bspline, Self::Paper];
}

/// Iso-value of the indicator at the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Mean at the samples nearby: the default.
    Local,
    /// Mean at all samples.
    Mean,
}

/// Number type of the pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// Single.
    F32,
    /// Double.
    F64,
}

/// A reconstruction to be measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Name of the body in `isograd-shapes`.
    pub body: &'static str,
    /// Distribution of its samples.
    pub draw: Draw,
    /// Number of samples.
    pub samples: usize,
    /// Cells on the longest side, padding included.
    pub cells: usize,
    /// Source of the normals.
    pub normals: Normals,
    /// Splat weights.
    pub splat: Splat,
    /// Whether samples are weighted by their area.
    pub area: bool,
    /// Width of the smoothing, in cells; automatic if absent.
    pub smoothing: Option<f64>,
    /// `α` of the screened equation.
    pub screening: f64,
    /// Iso-value.
    pub level: Level,
    /// Number type.
    pub precision: Precision,
}

impl Case {
    /// Default options, random samples.
    pub fn new(body: &'static str, samples: usize, cells: usize) -> Self {
        Self {
            body,
            draw: Draw::Random,
            samples,
            cells,
            normals: Normals::Estimated,
            splat: Splat::Bspline,
            area: true,
            smoothing: None,
            screening: 0.0,
            level: Level::Local,
            precision: Precision::F32,
        }
    }

    /// Whether only points are given and all options have their defaults. For such cases the gradient of φ is measured
    /// in all cells; for the others, only the surface and φ near it.
    pub fn is_default(&self) -> bool {
        let Self {
            body,
            draw,
            samples,
            cells,
            precision,
            ..
        } = *self;
        *self
            == Self {
                draw,
                precision,
                ..Self::new(body, samples, cells)
            }
    }

    /// Options of the pipeline for a cell size.
    pub fn options(&self, spacing: f64) -> Options {
        Options::default()
            .surface(SurfaceResolution::Grid)
            .orient(match self.normals {
                Normals::Exact => orient::Method::Given,
                Normals::Estimated => orient::Method::default(),
            })
            .splat(match self.splat {
                Splat::Bspline => splat::Weights::BSpline,
                Splat::Paper => splat::Weights::Paper,
            })
            .area(self.area)
            .smoothing(self.smoothing.map_or(Smoothing::Auto, Smoothing::Cells))
            .screening(self.screening)
            .level(match self.level {
                Level::Local => isosurface::Level::Local,
                Level::Mean => isosurface::Level::Mean,
            })
            .band(if self.is_default() {
                distance::Band::Full
            } else {
                distance::Band::Within((BAND + 1.0) * spacing)
            })
            .checks(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_cases_have_the_defaults_of_the_library() {
        let (ours, theirs) = (Case::new("torus", 1, 32).options(1.0), Options::default());
        let theirs = theirs
            .checks(false)
            .surface(SurfaceResolution::Grid)
            .level(isosurface::Level::Local);
        assert_eq!(format!("{ours:?}"), format!("{theirs:?}"));
        let given = Case {
            normals: Normals::Exact,
            ..Case::new("torus", 1, 32)
        };
        assert!(!given.is_default());
        let even = Case {
            draw: Draw::Even,
            precision: Precision::F64,
            ..Case::new("torus", 1, 32)
        };
        assert!(even.is_default());
    }
}
