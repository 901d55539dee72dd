//! The stages in order, and their pullbacks in reverse: points in, φ out, gradients back, on a device.
//!
//! # Map
//! points → axes, areas → outward normals → `b` → χ → iso-value → surface → φ. What the CPU chose for the
//! cloud, radii and sides, is [`Held`]: found once, it does for the steps of a body that moves a little. After
//! that nothing comes back to the host but a few counts.
//!
//! The iso-value is the mean at the samples ([`isograd::isosurface::Level::Mean`]) and the smoothing a number of
//! cells. Not on devices yet: the local iso-value, automatic smoothing, the screened equation, given normals.
//!
//! # Not differentiable
//! What is held, and what the stages say of themselves.

mod held;

pub use held::Held;

use cubecl::prelude::Runtime;
use isograd::Grid;

use crate::distance::{self, Band, Mesh};
use crate::isosurface::{self, Surface};
use crate::primitives::fill::add;
use crate::splat::{self, SampleCotangent, Samples, Weights};
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

/// What a plan does.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// How samples are spread.
    pub weights: Weights,
    /// Width of the smoothing, in cells; 0 for none.
    pub smoothing: f64,
    /// Where φ is computed.
    pub band: Band,
}

impl Default for Options {
    /// B-splines, a smoothing of one cell, φ everywhere.
    fn default() -> Self {
        Self {
            weights: Weights::default(),
            smoothing: 1.0,
            band: Band::default(),
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
    /// `(nx, ny, nz)` χ.
    pub indicator: Buffer<T>,
    /// `(1,)` the level of the surface.
    pub iso_value: Buffer<T>,
    /// The surface.
    pub surface: Surface<T>,
    /// `(N, 3)` outward unit normals.
    pub normals: Buffer<T>,
    /// `(N,)` areas, in that unit squared.
    pub areas: Buffer<T>,
    points: Buffer<T>,
    axes: Buffer<T>,
    outward: Buffer<T>,
    residuals: Residuals<T>,
}

struct Residuals<T: Scalar> {
    normals: normals::Residual<T>,
    areas: area::Residual<T>,
    splat: splat::Residual<T>,
    iso_value: iso_value::Residual<T>,
    surface: isosurface::Residual<T>,
    distance: distance::lattice::Residual<T>,
}

/// Cotangents of what a reconstruction was made of.
pub struct Cotangent<T> {
    /// `(N, 3)` of the points.
    pub points: Buffer<T>,
    /// `(4,)` of the low corner of the grid and of its cell size, at fixed points.
    pub grid: Buffer<T>,
}

impl<R: Runtime, T: Scalar> Reconstructor<R, T> {
    /// A plan for a grid.
    ///
    /// # Errors
    /// A grid that the device can't hold, or a number type that it does not have.
    pub fn new(device: Device<R>, grid: Grid<T>, options: Options) -> Result<Self, Error> {
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
        let (device, grid) = (&self.device, &self.grid);
        let near = neighbors::forward(device, points, &held.radii)?;
        let (axes, of_normals) = normals::forward(device, &near)?;
        let near = neighbors::with_radii(device, &near, &held.area_radii)?;
        let (areas, of_areas) = area::forward(device, &near, held.common_radius)?;
        let normals = held::turn(device, &axes, &axes, &held.outward)?;
        let samples = Samples {
            points,
            normals: &normals,
            areas: &areas,
        };
        let (b, of_splat) = splat::forward(device, samples, grid, self.options.weights)?;
        if let Some(refused) = of_splat.refused(device)? {
            return Err(Error::Outside {
                count: refused.count,
                first: refused.first,
            });
        }
        let chi = self.solver.solve(device, &b, self.options.smoothing)?;
        let (level, of_level) = iso_value::forward(device, &chi, grid, points, &areas)?;
        let (surface, of_surface) = isosurface::forward(device, &self.surface, &chi, &level, grid)?;
        let mesh = Mesh {
            vertices: surface.vertices.clone(),
            faces: surface.faces.clone(),
        };
        let band = self.options.band;
        let (sdf, of_distance) =
            distance::lattice::forward(device, &mesh, grid, &chi, &level, band)?;
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
                iso_value: of_level,
                surface: of_surface,
                distance: of_distance,
            },
        })
    }

    /// What the cotangent `sdf_bar` `(nx, ny, nz)` of φ means for points and grid.
    ///
    /// # Errors
    /// An array of another length, or [`crate::Error::TooLarge`].
    pub fn pullback(
        &self,
        result: &Reconstruction<T>,
        sdf_bar: &Buffer<T>,
    ) -> Result<Cotangent<T>, Error> {
        let (device, residuals) = (&self.device, &result.residuals);
        let samples = Samples {
            points: &result.points,
            normals: &result.normals,
            areas: &result.areas,
        };
        let of_mesh = distance::lattice::pullback(device, &residuals.distance, sdf_bar)?;
        let of_surface = isosurface::pullback(device, &residuals.surface, &of_mesh.vertices)?;
        let bars = SampleCotangent::zeros(device, samples.len())?;
        iso_value::pullback(
            device,
            &residuals.iso_value,
            &residuals.splat,
            samples,
            &of_surface.level,
            None,
            &of_surface.chi,
            &bars,
        )?;
        let b_bar = self
            .solver
            .solve(device, &of_surface.chi, self.options.smoothing)?;
        splat::pullback(device, &residuals.splat, samples, &b_bar, &bars)?;
        let axes_bar = held::turn(device, &bars.normals, &result.axes, &result.outward)?;
        let by_axes = normals::pullback(device, &residuals.normals, &axes_bar)?;
        let by_areas = area::pullback(device, &residuals.areas, &bars.areas)?;
        add(device, &by_axes, &bars.points)?;
        add(device, &by_areas, &bars.points)?;
        add(device, &of_mesh.grid, &bars.grid)?;
        add(device, &of_surface.grid, &bars.grid)?;
        Ok(Cotangent {
            points: bars.points,
            grid: bars.grid,
        })
    }
}
