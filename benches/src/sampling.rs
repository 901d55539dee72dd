//! Samples of the shapes, and the grids around them.

use std::fmt;

use isograd::{Grid, PointCloud, Real};
use isograd_element::vector;
use isograd_shapes::{Density, Layout, Sampling, Shape, SurfaceCoordinate, by_name};
use serde::Serialize;

use crate::output::Outcome;

/// Every cloud is drawn with this seed.
pub const SEED: u64 = 1;
/// Longest side of a grid over longest side of its shape: a tenth of the shape on either side.
pub const AIR: f64 = 1.2;

/// Distribution of the samples over a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Draw {
    /// Independent, uniform by area.
    Random,
    /// Blue noise.
    Even,
    /// Independent, with ten times the density at one end of the x axis than at the other.
    Density10,
}

impl Draw {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Random, Self::Even, Self::Density10];

    /// Settings of the sampler.
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

/// A shape of `isograd-shapes`, the number of its samples, and the grid around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Name of the shape.
    pub name: &'static str,
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub samples: usize,
}

impl Body {
    /// The body with twice the cell size, and samples as far apart in cells.
    #[cfg(test)]
    pub fn halved(self) -> Self {
        Self {
            shape: self.shape.map(|n| n / 2),
            samples: self.samples / 4,
            ..self
        }
    }

    /// The paper's fish.
    pub const FISH: Self = Self {
        name: "fish",
        shape: [338, 120, 151],
        samples: 50_000,
    };
}

/// Samples of a body, with exact normals and their coordinates on the surface.
pub struct Sampled {
    /// The shape.
    pub shape: Shape,
    /// Points and exact normals.
    pub cloud: PointCloud<f64>,
    /// Surface coordinates, which stay with the material.
    pub coordinates: Vec<SurfaceCoordinate>,
    /// The grid around the points.
    pub grid: Grid<f64>,
}

impl Body {
    /// Draws the samples and centers the grid on them.
    pub fn sample(&self, draw: Draw) -> Outcome<Sampled> {
        let shape = by_name(self.name)?;
        let samples = shape.sample(self.samples, &draw.sampling(), SEED)?;
        let bounds = samples.cloud.bounds().ok_or("a cloud without points")?;
        Ok(Sampled {
            grid: centered_grid(bounds, self.shape)?,
            cloud: samples.cloud,
            coordinates: samples.coordinates,
            shape,
        })
    }
}

/// Grid of the given shape around a bounding box, whose center it shares, with cells as small as [`AIR`] allows.
pub fn centered_grid<T: Real>(
    (low, high): ([f64; 3], [f64; 3]),
    shape: [usize; 3],
) -> Outcome<Grid<T>> {
    let needed = |a: usize| AIR * (high[a] - low[a]) / shape[a] as f64;
    let spacing = needed(0).max(needed(1)).max(needed(2));
    let corner = |a: usize| 0.5 * (low[a] + high[a]) - 0.5 * spacing * shape[a] as f64;
    let lower = vector::of_f64(std::array::from_fn(corner));
    Ok(Grid::new(lower, T::of(spacing), shape)?)
}

/// The grid in another number type.
pub fn convert_grid<S: Real, T: Real>(grid: &Grid<S>) -> Outcome<Grid<T>> {
    let lower = vector::of_f64(vector::to_f64(grid.lower()));
    Ok(Grid::new(lower, T::of(grid.spacing().f64()), grid.shape())?)
}

/// The cloud in another number type, with its normals.
pub fn convert<T: Real>(cloud: &PointCloud<f64>) -> Outcome<PointCloud<T>> {
    let points = points_only(cloud.points())?;
    Ok(match cloud.normals() {
        Some(normals) => {
            points.with_normals(normals.iter().map(|&n| vector::of_f64(n)).collect())?
        }
        None => points,
    })
}

/// A cloud without normals, in another number type.
pub fn points_only<T: Real>(points: &[[f64; 3]]) -> Outcome<PointCloud<T>> {
    let points = points.iter().map(|&x| vector::of_f64(x)).collect();
    Ok(PointCloud::new(points)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_is_centered_in_its_grid() {
        let body = Body {
            name: "fish",
            shape: [68, 24, 30],
            samples: 500,
        };
        let Sampled { cloud, grid, .. } = body.sample(Draw::Random).expect("samples");
        let (low, high) = cloud.bounds().expect("points");
        for a in 0..3 {
            let air = [low[a] - grid.lower()[a], grid.upper()[a] - high[a]];
            assert!((air[0] - air[1]).abs() < 1e-12);
            assert!(air[0] > 4.0 * grid.spacing());
        }
        assert_eq!(grid.shape(), body.shape);
    }
}
