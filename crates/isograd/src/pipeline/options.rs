//! Options of a reconstruction, and its errors.

use super::{MemoryError, Solve, SurfaceResolution};
use crate::data::GridError;
use crate::report::Stage;
use crate::{distance, isosurface, neighbors, orient, poisson, sheet, splat};

/// Declares [`Options`] with a default and a setter of the same name for each field.
macro_rules! options {
    ($($(#[$doc:meta])+ $field:ident: $type:ty = $default:expr,)+) => {
        /// Parameters of the reconstruction. `Options::default().screening(4.0)` changes one of them.
        #[derive(Clone, Debug, PartialEq, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        #[non_exhaustive]
        pub struct Options {
            $($(#[$doc])+ pub $field: $type,)+
        }

        impl Default for Options {
            fn default() -> Self {
                Self { $($field: $default,)+ }
            }
        }

        impl Options {
            $($(#[$doc])+ #[must_use]
            pub fn $field(self, $field: $type) -> Self {
                Self { $field, ..self }
            })+
        }
    };
}

options! {
    /// Neighborhood radius of the normals and of the area weights.
    radius: neighbors::Radius = neighbors::Radius::default(),
    /// Method that finds the sign of each normal, or the use of the cloud's own normals.
    orient: orient::Method = orient::Method::default(),
    /// Weights that spread a sample over the cells around it.
    splat: splat::Weights = splat::Weights::default(),
    /// Whether each sample is weighted by the area of surface that it stands for.
    area: bool = true,
    /// Width `σ` of the Gaussian smoothing of the indicator.
    smoothing: poisson::Smoothing = poisson::Smoothing::default(),
    /// `α` of the [screened](poisson::screened) equation: the strength of the pull of the indicator to one value at
    /// the samples. 0 selects the plain equation, which is about 20 times faster.
    screening: f64 = 0.0,
    /// Value of the indicator at the surface.
    level: isosurface::Level = isosurface::Level::default(),
    /// Cell size of the grid that the surface is found on.
    surface: SurfaceResolution = SurfaceResolution::default(),
    /// Whether the indicator is computed at all cells, or at those near the samples.
    solve: Solve = Solve::default(),
    /// Condition of the indicator at the walls of the grid.
    walls: poisson::Walls = poisson::Walls::default(),
    /// Removal of the faces of the mesh that have no samples nearby. φ is not changed by it.
    trim: isosurface::trim::Trim = isosurface::trim::Trim::default(),
    /// Whether the surface is a sheet, such as a membrane or a sail. Its mesh is trimmed, automatically if trimming is off.
    sheet: sheet::Sheet = sheet::Sheet::default(),
    /// Use of samples that are isolated and far from all others.
    outliers: crate::Outliers = crate::Outliers::default(),
    /// Region in which φ is computed.
    band: distance::Band = distance::Band::default(),
    /// Whether φ is computed, by the CPU. If not, it is 0 without closest faces, and nothing is checked: for those who
    /// need the surface alone. A [trimmed](Self::trim) surface and a [sheet](Self::sheet) always have it.
    sdf: bool = true,
    /// Whether to measure the result and to check whether it can be trusted.
    checks: bool = true,
    /// Whether the CPU keeps what the pullback needs, and the closest faces, which an [extension](crate::Reconstruction::extend)
    /// needs too. Without, clouds of more than a million points need less memory.
    residuals: bool = true,
}

impl Options {
    /// Whether the smoothing is a function of the samples.
    pub(super) fn smoothing_follows(&self) -> bool {
        self.smoothing == poisson::Smoothing::Auto
    }
}

/// Errors of a reconstruction, by stage.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The smoothing is negative or not finite.
    #[error("the smoothing is {0:?}; it must be 0 or more cells, and finite")]
    Smoothing(poisson::Smoothing),
    /// The resolution of the surface is out of range.
    #[error(
        "the surface is {0:?}; give cells up to 64 times as fine or as coarse as those of φ: a size above 0 in the cloud's unit, or a factor from 1/64 to 64"
    )]
    Surface(SurfaceResolution),
    /// The grid of the surface has too many or too small cells.
    #[error("the grid of the surface: {0}")]
    Grid(#[from] GridError),
    /// The distance of the trim is out of range.
    #[error(
        "the trim is {0:?}; give a finite distance above 0 in the cloud's unit, 'auto' or 'off'"
    )]
    Trim(isosurface::trim::Trim),
    /// The thickness of the sheet is out of range.
    #[error("the sheet is {0:?}; give a finite thickness above 0 in the cloud's unit, or 'off'")]
    Sheet(sheet::Sheet),
    /// The trim leaves nothing.
    #[error(
        "no face of the surface is within {distance} of samples, so nothing is left of it; use a larger trim"
    )]
    Trimmed {
        /// Distance of the trim.
        distance: f64,
    },
    /// The shell of a sheet.
    #[error(transparent)]
    Shell(#[from] sheet::Error),
    /// The screening is negative or not finite.
    #[error("the screening is {0}; it must be 0 or more, and finite")]
    Screening(f64),
    /// A screened equation has no sparse solve.
    #[error(
        "a screening of {0} needs the dense solve; leave the solve 'auto' or 'dense', or the screening 0"
    )]
    SparseScreening(f64),
    /// A screened equation has free walls.
    #[error("a screening of {0} needs free walls; leave the walls 'free', or the screening 0")]
    ClosedScreening(f64),
    /// A sheet has no sparse solve.
    #[error("the shell of a sheet needs the dense solve; leave the solve 'auto' or 'dense'")]
    SparseSheet,
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
    /// The grid or the points need more memory than there is.
    #[error(transparent)]
    Memory(#[from] MemoryError),
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
