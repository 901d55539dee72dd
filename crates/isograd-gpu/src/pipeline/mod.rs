//! The stages in order, and their pullbacks in reverse: points in, φ out, gradients back, on a device.
//!
//! # Map
//! points → axes, areas → outward normals → `b` → χ → iso-value → surface → φ. What the CPU chose for the
//! cloud, radii and sides, is [`Held`]: found once, it does for the steps of a body that moves a little. After
//! that nothing comes back to the host but a few counts, and the mean area where the smoothing follows it.
//!
//! # Pullback
//! As [`isograd::Reconstruction::pullback`], of any of the results: [`Reconstructor::pullback`].
//!
//! # Not differentiable
//! What is held, and what the stages say of themselves.

mod held;
mod pullback;

pub use held::Held;
pub use pullback::{CloudCotangent, Cotangent};

use std::ops::ControlFlow;

use cubecl::prelude::Runtime;
use isograd::isosurface::Level;
use isograd::poisson::Smoothing;
use isograd::{Grid, Stage};

use crate::distance::{self, Band, Mesh};
use crate::iso_value::local;
use crate::isosurface::{self, Surface};
use crate::splat::{self, Refused, Samples, Weights};
use crate::{Buffer, Device, Scalar, area, iso_value, neighbors, normals, poisson};

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The device.
    #[error(transparent)]
    Device(#[from] crate::Error),
    /// The neighbours.
    #[error(transparent)]
    Neighbors(#[from] isograd::neighbors::Error),
    /// The orientation.
    #[error(transparent)]
    Orient(#[from] isograd::orient::Error),
    /// A way to orient that has nothing to turn.
    #[error(
        "given normals and those of the step before are no choice here: take signs of given normals, or Held::facing"
    )]
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
        /// How many.
        count: usize,
        /// Index of the first.
        first: usize,
    },
    /// The observer asked to stop.
    #[error("stopped before the stage '{}'", .0.name())]
    Interrupted(Stage),
    /// The surface.
    #[error(transparent)]
    Isosurface(#[from] isosurface::Error),
    /// The distance.
    #[error(transparent)]
    Distance(#[from] distance::Error),
}

impl From<neighbors::radius::Error> for Error {
    fn from(error: neighbors::radius::Error) -> Self {
        match error {
            neighbors::radius::Error::Cloud(error) => error.into(),
            neighbors::radius::Error::Device(error) => error.into(),
        }
    }
}

impl From<crate::orient::Error> for Error {
    fn from(error: crate::orient::Error) -> Self {
        match error {
            crate::orient::Error::Cloud(error) => error.into(),
            crate::orient::Error::Device(error) => error.into(),
        }
    }
}

/// What a plan does: those of [`isograd::Options`] that are for devices too.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// How samples are spread.
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

impl Options {
    /// Whether the smoothing follows the areas of the samples, and has a derivative: of a screened solution, what
    /// the smoothing was done to is not kept.
    fn smoothing_follows(&self) -> bool {
        self.smoothing == Smoothing::Auto && self.area_weights && self.screening == 0.0
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
    /// `(N,)` areas, in that unit squared; 1 where samples do not count by them.
    pub areas: Buffer<T>,
    points: Buffer<T>,
    axes: Buffer<T>,
    outward: Buffer<T>,
    residuals: Residuals<T>,
}

/// What the stages kept for their pullbacks.
struct Residuals<T: Scalar> {
    normals: normals::Residual<T>,
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

/// Width of the smoothing, and the areas that it follows.
#[derive(Clone, Copy)]
struct Width {
    /// In cells.
    cells: f64,
    /// Mean of the areas that are not 0, in the user's unit squared, and how many those are.
    areas: (f64, usize),
}

impl<T: Scalar> Reconstruction<T> {
    /// `(nx, ny, nz)` the face of the surface closest to each cell centre, in C order;
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

    /// The reconstruction of `points` `(N, 3)`, finite, in the user's unit.
    ///
    /// # Errors
    /// As [`Error`] lists.
    pub fn reconstruct(
        &self,
        points: &Buffer<T>,
        held: &Held<T>,
    ) -> Result<Reconstruction<T>, Error> {
        self.reconstruct_observed(points, held, &mut |_| ControlFlow::Continue(()))
    }

    /// The same, calling `observer` before each stage is queued; where it breaks, so does the work. One that wants
    /// to know how long a stage takes must [wait](Device::wait).
    ///
    /// # Errors
    /// As [`Self::reconstruct`], and [`Error::Interrupted`] where the observer breaks.
    pub fn reconstruct_observed(
        &self,
        points: &Buffer<T>,
        held: &Held<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<Reconstruction<T>, Error> {
        let mut begin = |stage| match observer(stage) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Interrupted(stage)),
        };
        begin(Stage::Normals)?;
        let (device, grid, options) = (&self.device, &self.grid, &self.options);
        let near = neighbors::forward(device, points, &held.radii)?;
        let (axes, of_normals) = normals::forward(device, &near)?;
        let (areas, of_areas) = self.areas(&near, held)?;
        let normals = held::turn(device, &axes, &axes, &held.outward)?;
        let width = self.width(&areas, held)?;
        let samples = Samples {
            points,
            normals: &normals,
            areas: &areas,
        };
        begin(Stage::Splat)?;
        let (b, of_splat) = splat::forward(device, samples, grid, options.weights)?;
        if let Some(Refused { count, first }) = of_splat.refused(device)? {
            return Err(Error::Outside { count, first });
        }
        begin(Stage::Poisson)?;
        let chi = self.solver.solve(device, &b, width.cells)?;
        drop(b);
        if options.screening > 0.0 {
            let equation = self.screened_equation(samples, &of_splat);
            poisson::screened::forward(device, &equation, &chi)?;
        }
        let (level, of_level) = iso_value::forward(device, &chi, grid, points, &areas)?;
        let (chi, of_local_level) = self.local_level(chi, samples, width, &of_level, &of_splat)?;
        begin(Stage::Isosurface)?;
        let (surface, of_surface) = isosurface::forward(device, &self.surface, &chi, &level, grid)?;
        let mesh = Mesh {
            vertices: surface.vertices.clone(),
            faces: surface.faces.clone(),
        };
        begin(Stage::Distance)?;
        let (sdf, of_distance) =
            distance::lattice::forward(device, &mesh, grid, &chi, &level, options.band)?;
        Ok(Reconstruction {
            sdf,
            indicator: chi,
            iso_value: level,
            surface,
            points: points.clone(),
            outward: held.outward.clone(),
            axes,
            normals,
            areas,
            residuals: Residuals {
                normals: of_normals,
                areas: of_areas,
                splat: of_splat,
                smoothing: width,
                iso_value: of_level,
                local_level: of_local_level,
                surface: of_surface,
                distance: of_distance,
            },
        })
    }

    /// The areas that samples count by.
    fn areas(
        &self,
        near: &neighbors::Neighborhoods<T>,
        held: &Held<T>,
    ) -> Result<(Buffer<T>, Option<area::Residual<T>>), Error> {
        let device = &self.device;
        if !self.options.area_weights {
            return Ok((device.upload(&vec![T::of(1.0); near.len()])?, None));
        }
        let near = neighbors::with_radii(device, near, &held.area_radii)?;
        let (areas, residual) = area::forward(device, &near, held.common_radius)?;
        Ok((areas, Some(residual)))
    }

    fn screened_equation<'a>(
        &'a self,
        samples: Samples<'a, T>,
        splat: &'a splat::Residual<T>,
    ) -> poisson::screened::Equation<'a, T> {
        poisson::screened::Equation {
            solver: &self.solver,
            samples,
            area_weights: self.options.area_weights,
            splat,
            screening: self.options.screening,
        }
    }

    /// The indicator whose surface is at the mean everywhere.
    fn local_level(
        &self,
        chi: Buffer<T>,
        samples: Samples<'_, T>,
        width: Width,
        mean: &iso_value::Residual<T>,
        splat: &splat::Residual<T>,
    ) -> Result<(Buffer<T>, Option<local::Residual<T>>), Error> {
        if self.options.level == Level::Mean {
            return Ok((chi, None));
        }
        let choice = local::Choice {
            area_weights: self.options.area_weights,
            smoothing: width.cells,
            thin: self.options.level == Level::Thin,
        };
        let (chi, residual) = local::forward(&self.device, &chi, samples, choice, mean, splat)?;
        Ok((chi, Some(residual)))
    }

    /// How much the indicator is smoothed.
    fn width(&self, areas: &Buffer<T>, held: &Held<T>) -> Result<Width, Error> {
        let automatic = self.options.smoothing == Smoothing::Auto;
        let areas = match automatic && self.options.area_weights {
            true => area::mean(&self.device, areas)?,
            false => (held.spacing.f64().powi(2), 0),
        };
        let apart = areas.0.sqrt() / self.grid.spacing().f64();
        let cells = self.options.smoothing.cells(apart);
        Ok(Width { cells, areas })
    }
}
