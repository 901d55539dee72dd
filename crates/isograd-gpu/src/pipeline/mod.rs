//! The stages in order, and their pullbacks in reverse: points in, φ out, gradients back, on a device.
//!
//! # Map
//! points → axes, areas → outward normals → `b` → χ → iso-value → surface → φ. What the CPU chose for the
//! cloud, radii and sides, is [`RadiiAndSigns`]: found once, it does for the steps of a body that moves a little. After
//! that nothing comes back to the host but a few counts, and the mean area where the smoothing follows it.
//!
//! [`Reconstructor::extend`] carries attributes of the samples to the surface and the cells around it.
//!
//! # Pullback
//! As [`isograd::Reconstruction::pullback`], of any of the results and of extended attributes:
//! [`Reconstructor::pullback`].
//!
//! # Not differentiable
//! Radii and signs, which are held constant, and the parts that the stages name.

mod extend;
mod forward;
mod held;
mod pullback;

pub use forward::Observer;
pub(crate) use forward::Start;
pub use held::RadiiAndSigns;
pub(crate) use held::{SampleAxes, SearchResult};
pub use pullback::{CloudCotangent, Cotangent, ExtensionCotangent};

use cubecl::prelude::Runtime;
use isograd::isosurface::Level;
use isograd::poisson::Smoothing;
use isograd::{Grid, Stage};

use crate::distance::{self, Band};
use crate::isosurface::{self, Surface, iso_value, local_level as local};
use crate::splat::{self, Weights, area};
use crate::{Buffer, Device, Scalar, neighbors, normals, poisson, refine};

/// Errors of the pipeline.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The device.
    #[error(transparent)]
    Device(#[from] crate::Error),
    /// Of the samples, as on the CPU.
    #[error(transparent)]
    Samples(isograd::Error),
    /// A method of orientation that needs an earlier step.
    #[error("there is no step before here: take its sides by RadiiAndSigns::after")]
    Orientation,
    /// The smoothing makes no sense.
    #[error("the smoothing is {0:?}; it must be 0 or more cells, and finite")]
    Smoothing(Smoothing),
    /// The screening makes no sense.
    #[error("the screening is {0}; it must be 0 or more, and finite")]
    Screening(f64),
    /// The screened equation.
    #[error(transparent)]
    Screened(#[from] poisson::screened::Error),
    /// Samples outside the grid.
    #[error(
        "{count} points, the first of them number {first}, are outside the grid or within 2 cells of its walls; use more padding or larger bounds, or remove them"
    )]
    Outside {
        /// Number of points.
        count: usize,
        /// Index of the first.
        first: usize,
    },
    /// The observer stopped the work.
    #[error("stopped before the stage '{}'", .0.name())]
    Interrupted(Stage),
    /// The surface.
    #[error(transparent)]
    Isosurface(#[from] isosurface::Error),
    /// The distance.
    #[error(transparent)]
    Distance(#[from] distance::Error),
    /// An attribute was not extended, or not pulled back.
    #[error(transparent)]
    Extension(#[from] isograd::distance::extend::Error),
}

impl From<isograd::Error> for Error {
    fn from(error: isograd::Error) -> Self {
        match error {
            isograd::Error::Interrupted(stage) => Self::Interrupted(stage),
            error => Self::Samples(error),
        }
    }
}

impl From<distance::extend::Error> for Error {
    fn from(error: distance::extend::Error) -> Self {
        match error {
            distance::extend::Error::Refused(error) => error.into(),
            distance::extend::Error::Device(error) => error.into(),
        }
    }
}

impl From<neighbors::radius::Error> for Error {
    fn from(error: neighbors::radius::Error) -> Self {
        match error {
            neighbors::radius::Error::Cloud(error) => Self::Samples(error.into()),
            neighbors::radius::Error::Device(error) => error.into(),
        }
    }
}

impl From<crate::orient::Error> for Error {
    fn from(error: crate::orient::Error) -> Self {
        match error {
            crate::orient::Error::Cloud(error) => Self::Samples(error.into()),
            crate::orient::Error::Device(error) => error.into(),
        }
    }
}

/// Options of a plan: those of [`isograd::Options`] that concern the stages after the orientation.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Kernel of the splat.
    pub weights: Weights,
    /// Whether each sample counts by the area of surface that it stands for.
    pub area_weights: bool,
    /// Width of the smoothing of the indicator.
    pub smoothing: Smoothing,
    /// `α` of the [screened](poisson::screened) equation; 0 for the plain one.
    pub screening: f64,
    /// Which value of the indicator the surface is at.
    pub level: Level,
    /// Where φ is computed.
    pub band: Band,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            weights: Weights::default(),
            area_weights: true,
            smoothing: Smoothing::default(),
            screening: 0.0,
            level: Level::default(),
            band: Band::default(),
        }
    }
}

impl From<&isograd::Options> for Options {
    fn from(options: &isograd::Options) -> Self {
        Self {
            weights: options.splat,
            area_weights: options.area,
            smoothing: options.smoothing,
            screening: options.screening,
            level: options.level,
            band: options.band,
        }
    }
}

/// A plan: a device, a grid and options, with the tables of the stages.
pub struct Reconstructor<R: Runtime, T: Scalar> {
    device: Device<R>,
    grid: Grid<T>,
    options: Options,
    solver: poisson::Solver<T>,
    surface: isosurface::Plan,
}

/// Results, and what their pullback needs.
pub struct Reconstruction<T: Scalar> {
    /// `(nx, ny, nz)` φ, in the user's unit, negative inside.
    pub sdf: Buffer<T>,
    /// `(nx, ny, nz)` χ, whose surface is at the iso-value.
    pub indicator: Buffer<T>,
    /// `(1,)` the level of the surface.
    pub iso_value: Buffer<T>,
    /// The surface.
    pub surface: Surface<T>,
    /// `(N, 3)` outward unit normals.
    pub normals: Buffer<T>,
    /// `(N,)` from 0 to 1, how sure their sides are; 1 for given normals.
    pub confidence: Buffer<T>,
    /// `(1,)` how many axes have turned by more than 60° since the step whose sides are [`RadiiAndSigns`], and followed their
    /// neighbors; 0 where these sides were found in this cloud. From 3 % of the points on, find them again.
    pub turned: Buffer<u32>,
    /// `(N,)` areas, in that unit squared; 1 where samples do not count by them.
    pub areas: Buffer<T>,
    pub(crate) points: Buffer<T>,
    /// The confidence that the next step starts from.
    kept_confidence: Buffer<T>,
    residuals: Residuals<T>,
}

/// Residuals of the stages.
struct Residuals<T: Scalar> {
    /// The points in their tree, and the radius that most neighborhoods have.
    near: neighbors::Neighborhoods<T>,
    common_radius: T,
    normals: Source<T>,
    /// None where samples do not count by their areas.
    areas: Option<area::Residual<T>>,
    splat: splat::Residual<T>,
    smoothing: Width,
    iso_value: iso_value::Residual<T>,
    /// None where the level is the mean.
    local_level: Option<local::Residual<T>>,
    surface: isosurface::Residual<T>,
    distance: distance::lattice::Residual<T>,
}

/// Where the outward normals come from.
enum Source<T> {
    /// From axes, turned to the side of `outward`.
    Axes {
        axes: Buffer<T>,
        outward: Buffer<T>,
        /// None where the radius was given.
        refined: Option<Box<refine::Residual<T>>>,
        residual: Box<normals::Residual<T>>,
    },
    /// From vectors that were given.
    Given(Buffer<T>),
}

/// Width of the smoothing, and the areas that it follows.
#[derive(Clone, Copy)]
struct Width {
    /// In cells.
    cells: f64,
    /// Mean of the areas that are not 0, in the user's unit squared, and how many those are.
    areas: (f64, usize),
}

impl<T: Scalar> Reconstruction<T> {
    fn samples(&self) -> splat::Samples<'_, T> {
        splat::Samples {
            points: &self.points,
            normals: &self.normals,
            areas: &self.areas,
        }
    }

    /// `(N, 3)` outward unit normals before they were refined.
    fn unrefined(&self) -> &Buffer<T> {
        match &self.residuals.normals {
            Source::Axes { outward, .. } => outward,
            Source::Given(_) => &self.normals,
        }
    }

    /// `(nx, ny, nz)` the face of the surface closest to each cell center, in C order;
    /// [`NO_TRIANGLE`](distance::NO_TRIANGLE) outside the band.
    pub fn closest(&self) -> &Buffer<u32> {
        self.residuals.distance.closest()
    }

    /// Width of the smoothing of the indicator, in cells.
    pub fn smoothing(&self) -> f64 {
        self.residuals.smoothing.cells
    }
}

impl<R: Runtime, T: Scalar> Reconstructor<R, T> {
    /// A plan for a grid.
    ///
    /// # Errors
    /// A grid that the device can't hold, or a number type that it does not have.
    pub fn new(device: Device<R>, grid: Grid<T>, options: Options) -> Result<Self, Error> {
        if !options.smoothing.is_valid() {
            return Err(Error::Smoothing(options.smoothing));
        }
        if !(options.screening >= 0.0 && options.screening.is_finite()) {
            return Err(Error::Screening(options.screening));
        }
        Ok(Self {
            solver: poisson::Solver::new(&device, grid.shape())?,
            surface: isosurface::Plan::new(&device)?,
            device,
            grid,
            options,
        })
    }

    /// Where it works.
    pub fn device(&self) -> &Device<R> {
        &self.device
    }

    /// The grid that all results are on.
    pub fn grid(&self) -> &Grid<T> {
        &self.grid
    }
}
