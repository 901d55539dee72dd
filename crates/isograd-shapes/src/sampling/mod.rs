//! Samples of the surface of a shape.

mod candidates;
mod even;
#[cfg(test)]
mod tests;

use isograd::{PointCloud, PointCloudError, Real, data::Attribute};
use isograd_element::vector::of_f64;

use crate::shape::{Shape, SurfaceCoordinate};
use candidates::{Candidate, Source};

/// The most samples that are drawn at once; even sampling takes some 700 bytes for each.
pub const MAX_SAMPLES: usize = 10_000_000;

/// Candidates for each sample that even sampling keeps.
const OVERSAMPLING: usize = 4;

/// How samples are laid out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Layout {
    /// Independent, each place as likely as its area: clumps and holes.
    Random,
    /// Even: none much closer to its neighbors than the mean spacing (blue noise), by weighted sample
    /// elimination from four times as many (Yuksel 2015).
    #[default]
    Even,
}

/// How many samples go where.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Density {
    /// The same number per area everywhere.
    #[default]
    Uniform,
    /// Number per area as a power law along an axis of the bounding box: `ratio` times as many at its
    /// high end as at its low end.
    Gradient {
        /// 0, 1 or 2.
        axis: usize,
        /// From 1/1000 to 1000.
        ratio: f64,
    },
}

/// What samples are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sampling {
    /// How they are laid out.
    pub layout: Layout,
    /// How many go where.
    pub density: Density,
}

/// Why no samples were drawn.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    /// More samples than are drawn at once.
    #[error("{count} samples are more than the {max} that are drawn at once; ask for fewer")]
    TooMany {
        /// What was asked for.
        count: usize,
        /// The limit.
        max: usize,
    },
    /// A density that means nothing.
    #[error(
        "a density gradient along axis {axis} of ratio {ratio}; the axis must be 0, 1 or 2 and the \
         ratio from 0.001 to 1000"
    )]
    Density {
        /// What was given.
        axis: usize,
        /// What was given.
        ratio: f64,
    },
    /// Next to nothing of the surface was hit.
    #[error("the shape has no surface that could be sampled; change its parameters")]
    NoSurface,
    /// The samples do not fit the number type.
    #[error(transparent)]
    Cloud(#[from] PointCloudError),
}

/// Samples and where on the surface each of them is.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples<T> {
    /// Points, outward unit normals, and, for a shape that moves, the attribute `velocity` of three
    /// components.
    pub cloud: PointCloud<T>,
    /// `(N,)` surface coordinates: the same material points after a change of parameters or time.
    pub coordinates: Vec<SurfaceCoordinate>,
}

impl Shape {
    /// `n` samples of the surface, and no fewer. The same seed gives the same samples.
    ///
    /// Everything is computed in double precision and rounded to `T` at the end. Normals are exact to
    /// rounding. On a union only the outer surface is sampled: no sample is inside another part. Parts
    /// thinner than a few spacings keep the samples of both their sides, which a grid has to resolve:
    /// take at least 3 cells across the thinnest part that matters (the tail fin of the default fish is
    /// 0.034 lengths thick at its root, and 0 at its edge).
    ///
    /// The stream of random numbers is the same on every platform; the last bits of a point depend on
    /// the platform's sine and cosine.
    ///
    /// # Errors
    /// Too many samples, a bad density, or coordinates out of the range of `T`.
    pub fn sample<T: Real>(
        &self,
        n: usize,
        sampling: &Sampling,
        seed: u64,
    ) -> Result<Samples<T>, SampleError> {
        let candidates = self.draw(n, sampling, seed)?;
        let coordinates: Vec<SurfaceCoordinate> = candidates.iter().map(|c| c.coordinate).collect();
        let points = candidates.iter().map(|c| of_f64(c.position)).collect();
        let normals = candidates.iter().map(|c| of_f64(c.normal)).collect();
        let mut cloud = PointCloud::new(points)?.with_normals(normals)?;
        if let Some(velocity) = self.velocity(&coordinates) {
            cloud = cloud.with_attribute(Attribute {
                name: "velocity".into(),
                components: 3,
                values: velocity.into_iter().flat_map(of_f64::<T>).collect(),
            })?;
        }
        Ok(Samples { cloud, coordinates })
    }

    fn draw(
        &self,
        n: usize,
        sampling: &Sampling,
        seed: u64,
    ) -> Result<Vec<Candidate>, SampleError> {
        if n > MAX_SAMPLES {
            return Err(SampleError::TooMany {
                count: n,
                max: MAX_SAMPLES,
            });
        }
        if let Density::Gradient { axis, ratio } = sampling.density
            && !(axis < 3 && (1e-3..=1e3).contains(&ratio))
        {
            return Err(SampleError::Density { axis, ratio });
        }
        let draws = match sampling.layout {
            Layout::Random => n,
            Layout::Even => n * OVERSAMPLING,
        };
        let drawn = Source::new(&*self.surface, sampling.density, draws).draw(draws, seed)?;
        Ok(match sampling.layout {
            Layout::Random => drawn.candidates,
            Layout::Even => even::thinned(drawn, n),
        })
    }
}
