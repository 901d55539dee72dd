//! What is reconstructed: one body, one cloud, one grid, one choice of options.

use std::fmt;

use isograd::poisson::Smoothing;
use isograd::{Options, distance, isosurface, orient, splat};
use isograd_shapes::{Density, Layout, Sampling};
use serde::Serialize;

use crate::measure::BAND;

/// How the samples lie on the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Draw {
    /// Independent, uniform by area.
    Random,
    /// Blue noise.
    Even,
    /// Independent, ten times as many per area at one end of the x axis as at the other.
    Density10,
}

impl Draw {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Random, Self::Even, Self::Density10];

    /// What the sampler is asked for.
    pub fn sampling(self) -> Sampling {
        let (layout, density) = match self {
            Self::Random => (Layout::Random, Density::Uniform),
            Self::Even => (Layout::Even, Density::Uniform),
            Self::Density10 => (
                Layout::Random,
                Density::Gradient {
                    axis: 0,
                    ratio: 10.0,
                },
            ),
        };
        Sampling { layout, density }
    }
}

impl fmt::Display for Draw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Random => "random",
            Self::Even => "even",
            Self::Density10 => "10:1 density",
        })
    }
}

/// Where the normals come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// The body's own, in closed form.
    Exact,
    /// D-PCA, oriented by the default method.
    Estimated,
}

impl fmt::Display for Normals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Exact => "exact",
            Self::Estimated => "estimated",
        })
    }
}

/// How a sample is spread over its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Splat {
    /// The default.
    Bspline,
    /// The paper's weights, as printed.
    Paper,
}

impl Splat {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Bspline, Self::Paper];
}

impl fmt::Display for Splat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bspline => "bspline",
            Self::Paper => "paper",
        })
    }
}

/// Which value of the indicator the surface is at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// What it is at the samples near by: the default.
    Local,
    /// The mean at all samples.
    Mean,
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Local => "local",
            Self::Mean => "mean",
        })
    }
}

/// The number type of the whole pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// Single.
    F32,
    /// Double.
    F64,
}

/// One reconstruction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Name of the body in `isograd-shapes`.
    pub body: &'static str,
    /// How its samples lie.
    pub draw: Draw,
    /// How many they are.
    pub samples: usize,
    /// Cells on the longest side, padding included.
    pub cells: usize,
    /// Where the normals come from.
    pub normals: Normals,
    /// Splat weights.
    pub splat: Splat,
    /// Whether samples count by the area they stand for.
    pub area_weights: bool,
    /// Width of the smoothing, in cells; automatic where there is none.
    pub smoothing: Option<f64>,
    /// `α` of the screened equation.
    pub screening: f64,
    /// Level of the surface.
    pub level: Level,
    /// Number type.
    pub precision: Precision,
}

impl Case {
    /// All options at their defaults, random samples.
    pub fn new(body: &'static str, samples: usize, cells: usize) -> Self {
        Self {
            body,
            draw: Draw::Random,
            samples,
            cells,
            normals: Normals::Estimated,
            splat: Splat::Bspline,
            area_weights: true,
            smoothing: None,
            screening: 0.0,
            level: Level::Local,
            precision: Precision::F32,
        }
    }

    /// Whether nothing is known but the points and no option was changed: of such a case the gradient of φ is
    /// measured too, everywhere; of the others only the surface and φ near it are.
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

    /// The options of the pipeline.
    pub fn options(&self, spacing: f64) -> Options {
        Options::default()
            .orient(match self.normals {
                Normals::Exact => orient::Method::Given,
                Normals::Estimated => orient::Method::default(),
            })
            .splat(match self.splat {
                Splat::Bspline => splat::Weights::BSpline,
                Splat::Paper => splat::Weights::Paper,
            })
            .area(self.area_weights)
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
    fn the_defaults_here_are_those_of_the_library() {
        let (ours, theirs) = (Case::new("torus", 1, 32).options(1.0), Options::default());
        assert_eq!(format!("{ours:?}"), format!("{:?}", theirs.checks(false)));
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
