//! Sampling of the surface of a shape.

mod candidates;
mod even;
#[cfg(test)]
mod tests;

use isograd::{PointCloud, PointCloudError, Real, data::Attribute};
use isograd_element::vector::of_f64;

use crate::shape::{Shape, SurfaceCoordinate};
use candidates::{Candidate, RejectionSampler};

/// Largest number of samples; even sampling takes some 700 bytes for each.
pub const MAX_SAMPLES: usize = 10_000_000;

/// Candidates per sample of an even sampling.
const OVERSAMPLING: usize = 4;

/// Arrangement of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Layout {
    /// Independent samples, uniform by area: clumps and holes.
    Random,
    /// Blue noise: no sample is much closer to its neighbors than the mean spacing. Weighted sample
    /// elimination from four times as many candidates (Yuksel 2015).
    #[default]
    Even,
}

/// Density of samples over the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Density {
    /// Constant number per area.
    #[default]
    Uniform,
    /// Number per area varying exponentially along an axis of the bounding box: `ratio` times as many at its
    /// high end as at its low end.
    Gradient {
        /// 0, 1 or 2.
        axis: usize,
        /// From 1/1000 to 1000.
        ratio: f64,
    },
}

/// Settings of a sampling.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sampling {
    /// Arrangement of the samples.
    pub layout: Layout,
    /// Density over the surface.
    pub density: Density,
}

/// Errors of a sampling.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    /// More than [`MAX_SAMPLES`].
    #[error("{count} samples exceed the limit of {max}; request fewer")]
    TooMany {
        /// Requested number.
        count: usize,
        /// The limit.
        max: usize,
    },
    /// An invalid density gradient.
    #[error(
        "a density gradient along axis {axis} of ratio {ratio}; the axis must be 0, 1 or 2 and the \
         ratio from 0.001 to 1000"
    )]
    Density {
        /// Axis.
        axis: usize,
        /// Ratio.
        ratio: f64,
    },
    /// Almost all candidates were rejected.
    #[error("the shape has no surface to sample; change its parameters")]
    NoSurface,
    /// The samples are not finite in the number type.
    #[error(transparent)]
    Cloud(#[from] PointCloudError),
}

/// Samples and their surface coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples<T> {
    /// Points, outward unit normals, and for a moving shape the attribute `velocity` of three components.
    pub cloud: PointCloud<T>,
    /// `(N,)` surface coordinates, which follow the material points when parameters or time change.
    pub coordinates: Vec<SurfaceCoordinate>,
}

impl Shape {
    /// Draws exactly `n` samples of the surface. Equal seeds give equal samples.
    ///
    /// Everything is computed in double precision and rounded to `T` at the end. Normals are exact to
    /// rounding. On a union only the outer surface is sampled: no sample is inside another part. Both sides
    /// of thin parts are sampled; a grid should have at least 3 cells across the thinnest part of interest
    /// (the tail fin of the default fish is 0.034 lengths thick at its root, and 0 at its edge).
    ///
    /// The stream of random numbers is the same on every platform; the last bits of a point depend on
    /// the platform's sine and cosine.
    ///
    /// # Errors
    /// Too many samples, an invalid density, or coordinates out of the range of `T`.
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
        let sampler = RejectionSampler::new(&*self.surface, sampling.density, draws);
        let drawn = sampler.draw(draws, seed)?;
        Ok(match sampling.layout {
            Layout::Random => drawn.candidates,
            Layout::Even => even::eliminate(drawn, n),
        })
    }
}
