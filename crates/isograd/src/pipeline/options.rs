//! What to compute, and why it may fail.

use crate::report::Stage;
use crate::{distance, isosurface, neighbors, orient, poisson, splat};

/// What to compute, and how. Nothing here says where or on how many threads.
#[derive(Clone, Debug)]
pub struct Options {
    /// Neighborhood radius of the normals and the area weights.
    pub radius: neighbors::Radius,
    /// How the sign of each normal is found, or that the cloud's own normals are to be used.
    pub orientation: orient::Method,
    /// How a sample is spread over the cells round it.
    pub weights: splat::Weights,
    /// Whether each sample counts by the area of surface that it stands for.
    pub area_weights: bool,
    /// Width `σ` of the Gaussian smoothing of the indicator.
    pub smoothing: poisson::Smoothing,
    /// `α`: how strongly the indicator is drawn to one value at the samples, by the
    /// [screened](poisson::screened) equation; 0 for the plain one, which is some 20 times faster.
    pub screening: f64,
    /// Which value of the indicator the surface is at.
    pub level: isosurface::Level,
    /// Where φ is computed.
    pub band: distance::Band,
    /// Whether to measure the result and look for reasons not to trust it.
    pub checks: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            radius: neighbors::Radius::default(),
            orientation: orient::Method::default(),
            weights: splat::Weights::default(),
            area_weights: true,
            smoothing: poisson::Smoothing::default(),
            screening: 0.0,
            level: isosurface::Level::default(),
            band: distance::Band::default(),
            checks: true,
        }
    }
}

impl Options {
    /// Whether the smoothing follows the areas of the samples, and has a derivative: of a screened solution, what the
    /// smoothing was done to is not kept.
    pub(super) fn smoothing_follows(&self) -> bool {
        let automatic = self.smoothing == poisson::Smoothing::Auto;
        automatic && self.area_weights && self.screening == 0.0
    }
}

/// Why a reconstruction failed: which stage, and its own reason.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The smoothing makes no sense.
    #[error("the smoothing is {0:?}; it must be 0 or more cells, and finite")]
    Smoothing(poisson::Smoothing),
    /// The screening makes no sense.
    #[error("the screening is {0}; it must be 0 or more, and finite")]
    Screening(f64),
    /// Neighbors.
    #[error(transparent)]
    Neighbors(#[from] neighbors::Error),
    /// The samples lie on a line, or are isolated points: nothing spans a surface.
    #[error(
        "none of the {points} points has neighbors that span a plane (the points lie on a line or are isolated), so there is no surface; check that the right columns were read as coordinates"
    )]
    NoPlane {
        /// Number of points.
        points: usize,
    },
    /// The grid needs more memory than there is.
    #[error(
        "a grid of {shape:?} cells needs about {needed:.1} GiB, and {available:.1} GiB are free; use a lower resolution, a larger spacing or tighter bounds"
    )]
    Memory {
        /// Cells along each axis.
        shape: [usize; 3],
        /// GiB.
        needed: f64,
        /// GiB.
        available: f64,
    },
    /// Orientation.
    #[error(transparent)]
    Orient(#[from] orient::Error),
    /// Splat.
    #[error(transparent)]
    Splat(#[from] splat::Error),
    /// Poisson.
    #[error(transparent)]
    Poisson(#[from] poisson::Error),
    /// Screened Poisson.
    #[error(transparent)]
    Screened(#[from] poisson::screened::Error),
    /// Iso-value.
    #[error(transparent)]
    IsoValue(#[from] isosurface::iso_value::Error),
    /// Isosurface.
    #[error(transparent)]
    Isosurface(#[from] isosurface::Error),
    /// Distance.
    #[error(transparent)]
    Distance(#[from] distance::Error),
    /// The observer asked to stop.
    #[error("stopped before the stage '{}'", .0.name())]
    Interrupted(Stage),
}
