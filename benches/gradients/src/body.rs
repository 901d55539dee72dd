//! Bodies, their samples, and the grids they are reconstructed on.

use isograd::{Grid, PointCloud, Real};
use isograd_element::vector;
use isograd_shapes::{Density, Layout, Sampling, Shape, SurfaceCoordinate, by_name};
use serde::Serialize;

use crate::Outcome;

/// Every cloud is drawn with this seed.
pub const SEED: u64 = 1;
/// Longest side of a grid over longest side of its body: a tenth of the body on either side.
const AIR: f64 = 1.2;

/// How the samples lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Draw {
    /// Independent, uniform by area.
    Random,
    /// Blue noise.
    Even,
}

impl Draw {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Random, Self::Even];

    /// In the text.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Even => "even",
        }
    }

    /// What the sampler is asked for.
    fn sampling(self) -> Sampling {
        Sampling {
            layout: match self {
                Self::Random => Layout::Random,
                Self::Even => Layout::Even,
            },
            density: Density::Uniform,
        }
    }
}

/// A body and the grid it is measured on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Name in `isograd-shapes`.
    pub name: &'static str,
    /// Cells along each axis.
    pub shape: [usize; 3],
    /// Number of samples.
    pub samples: usize,
}

/// Samples of a body, with its own normals, and where on the surface they are.
pub struct Sampled {
    /// The body.
    pub shape: Shape,
    /// Points and exact normals.
    pub cloud: PointCloud<f64>,
    /// Places that stay with the material.
    pub coordinates: Vec<SurfaceCoordinate>,
    /// The grid round them.
    pub grid: Grid<f64>,
}

impl Body {
    /// Draws the samples and puts the grid round them.
    ///
    /// # Errors
    /// A body that is not there, or a grid that cannot be.
    pub fn sample(&self, draw: Draw) -> Outcome<Sampled> {
        let shape = by_name(self.name)?;
        let samples = shape.sample(self.samples, &draw.sampling(), SEED)?;
        Ok(Sampled {
            grid: self.grid(&samples.cloud)?,
            cloud: samples.cloud,
            coordinates: samples.coordinates,
            shape,
        })
    }

    /// The grid of the wanted shape whose longest side is that of the cloud and some air, centered.
    fn grid(&self, cloud: &PointCloud<f64>) -> Outcome<Grid<f64>> {
        let (low, high) = cloud.bounds().ok_or("a cloud without points")?;
        let longest = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
        let cells = self.shape.into_iter().max().unwrap_or(1);
        let spacing = AIR * longest / cells as f64;
        let corner = |a: usize| 0.5 * (low[a] + high[a]) - 0.5 * spacing * self.shape[a] as f64;
        Ok(Grid::new(std::array::from_fn(corner), spacing, self.shape)?)
    }
}

/// The same grid in another number type.
///
/// # Errors
/// Cells too small for the type.
pub fn narrowed<T: Real>(grid: &Grid<f64>) -> Outcome<Grid<T>> {
    let lower = vector::of_f64(grid.lower());
    Ok(Grid::new(lower, T::of(grid.spacing()), grid.shape())?)
}

/// The points alone, in another number type.
///
/// # Errors
/// Points that are not finite there.
pub fn points_alone<T: Real>(points: &[[f64; 3]]) -> Outcome<PointCloud<T>> {
    let points = points.iter().map(|&x| vector::of_f64(x)).collect();
    Ok(PointCloud::new(points)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_body_is_in_the_middle_of_its_grid() {
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
