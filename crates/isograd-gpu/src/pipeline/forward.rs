//! The stages in order.

use std::ops::ControlFlow;

use cubecl::prelude::Runtime;
use isograd::Stage;
use isograd::isosurface::Level;
use isograd::poisson::Smoothing;

use super::{
    Error, RadiiAndSigns, Reconstruction, Reconstructor, Residuals, SampleAxes, Source, Width,
};
use crate::distance::{self, Mesh};
use crate::isosurface::{self, iso_value, local_level as local};
use crate::orient::previous::Followed;
use crate::splat::{self, Refused, Samples, area};
use crate::{Buffer, Scalar, neighbors, normals, orient, poisson, refine};

/// Called before each stage is queued; where it breaks, so does the work. One that wants to know how long a stage
/// takes must [wait](crate::Device::wait).
pub type Observer<'a> = dyn FnMut(Stage) -> ControlFlow<()> + 'a;

/// Normals that are known before the stages begin.
pub(crate) enum Start<'a, T: Scalar> {
    /// Nothing.
    Points,
    /// They are given.
    Given(&'a Buffer<T>),
    /// Their axes, which the sides were looked for with.
    Axes(SampleAxes<T>),
}

/// Outward normals, the neighborhoods, and where the normals come from.
struct Normals<T> {
    sides: Followed<T>,
    near: neighbors::Neighborhoods<T>,
    source: Source<T>,
}

/// Normals and areas of the samples.
struct SampleFields<T> {
    normals: Normals<T>,
    areas: Buffer<T>,
    of_areas: Option<area::Residual<T>>,
    width: Width,
}

/// The indicator whose surface is at the level, and what its pullback needs.
struct Solved<T> {
    chi: Buffer<T>,
    level: Buffer<T>,
    of_level: iso_value::Residual<T>,
    of_local_level: Option<local::Residual<T>>,
}

impl<R: Runtime, T: Scalar> Reconstructor<R, T> {
    /// The reconstruction of `points` `(N, 3)`, finite, in the user's unit.
    pub fn reconstruct(
        &self,
        points: &Buffer<T>,
        held: &RadiiAndSigns<T>,
    ) -> Result<Reconstruction<T>, Error> {
        self.reconstruct_observed(points, None, held, &mut |_| ControlFlow::Continue(()))
    }

    /// [`Self::reconstruct`] with an observer and, if they are known, `given` outward normals: `(N, 3)` of any length but 0;
    /// of `held` only the radii of areas are then used.
    ///
    /// # Errors
    /// As [`Error`] lists; [`Error::Interrupted`] where the observer breaks.
    pub fn reconstruct_observed(
        &self,
        points: &Buffer<T>,
        given: Option<&Buffer<T>>,
        held: &RadiiAndSigns<T>,
        observer: &mut Observer<'_>,
    ) -> Result<Reconstruction<T>, Error> {
        let start = given.map_or(Start::Points, Start::Given);
        self.reconstruct_from(points, start, held, observer)
    }

    /// [`Self::reconstruct_observed`] with any start.
    pub(crate) fn reconstruct_from(
        &self,
        points: &Buffer<T>,
        start: Start<'_, T>,
        held: &RadiiAndSigns<T>,
        observer: &mut Observer<'_>,
    ) -> Result<Reconstruction<T>, Error> {
        let mut begin = |stage| match observer(stage) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Error::Interrupted(stage)),
        };
        begin(Stage::Normals)?;
        let (device, grid, options) = (&self.device, &self.grid, &self.options);
        let found = self.find_samples(points, start, held)?;
        let samples = Samples {
            points,
            normals: &found.normals.sides.normals,
            areas: &found.areas,
        };
        begin(Stage::Splat)?;
        let (b, of_splat) = splat::forward(device, samples, grid, options.weights)?;
        if let Some(Refused { count, first }) = of_splat.refused(device)? {
            return Err(Error::Outside { count, first });
        }
        begin(Stage::Poisson)?;
        let solved = self.solve(b, samples, found.width, &of_splat)?;
        begin(Stage::Isosurface)?;
        let (chi, level) = (&solved.chi, &solved.level);
        let (surface, of_surface) = isosurface::forward(device, &self.surface, chi, level, grid)?;
        let mesh = Mesh {
            vertices: surface.vertices.clone(),
            faces: surface.faces.clone(),
        };
        begin(Stage::Distance)?;
        let (sdf, of_distance) =
            distance::lattice::forward(device, &mesh, grid, chi, level, options.band)?;
        let Normals {
            sides,
            near,
            source,
        } = found.normals;
        Ok(Reconstruction {
            sdf,
            indicator: solved.chi,
            iso_value: solved.level,
            surface,
            points: points.clone(),
            normals: sides.normals,
            confidence: sides.confidence,
            turned: sides.turned,
            kept_confidence: sides.kept,
            areas: found.areas,
            residuals: Residuals {
                near,
                common_radius: held.common_radius,
                normals: source,
                areas: found.of_areas,
                splat: of_splat,
                smoothing: found.width,
                iso_value: solved.of_level,
                local_level: solved.of_local_level,
                surface: of_surface,
                distance: of_distance,
            },
        })
    }

    /// Outward normals and areas.
    fn find_samples(
        &self,
        points: &Buffer<T>,
        start: Start<'_, T>,
        held: &RadiiAndSigns<T>,
    ) -> Result<SampleFields<T>, Error> {
        let device = &self.device;
        let normals = match start {
            Start::Given(given) => Normals {
                sides: self.take_given(given)?,
                near: neighbors::forward(device, points, &held.area_radii)?,
                source: Source::Given(given.clone()),
            },
            Start::Points => {
                let near = neighbors::forward(device, points, &held.radii)?;
                let (axes, residual) = normals::forward(device, &near)?;
                let residual = residual.into();
                self.turn(SampleAxes { axes, residual }, held)?
            }
            Start::Axes(found) => self.turn(found, held)?,
        };
        let (areas, of_areas) = self.areas(&normals.near, held)?;
        let width = self.width(&areas, held)?;
        Ok(SampleFields {
            normals,
            areas,
            of_areas,
            width,
        })
    }

    /// Axes, turned to the held signs.
    fn turn(
        &self,
        SampleAxes { axes, residual }: SampleAxes<T>,
        held: &RadiiAndSigns<T>,
    ) -> Result<Normals<T>, Error> {
        let near = residual.neighborhoods.clone();
        let mut sides = held.turn(&self.device, &near, &axes)?;
        let outward = sides.normals.clone();
        let mut refined = None;
        if held.refines {
            let own = neighbors::with_radii(&self.device, &near, &held.area_radii)?;
            let (normals, residual) = refine::forward(&self.device, &own, &outward)?;
            sides.normals = normals;
            refined = Some(residual.into());
        }
        let source = Source::Axes {
            axes,
            outward,
            refined,
            residual,
        };
        Ok(Normals {
            sides,
            near,
            source,
        })
    }

    /// Given normals.
    fn take_given(&self, given: &Buffer<T>) -> Result<Followed<T>, Error> {
        let sure = self.device.upload(&vec![T::of(1.0); given.len() / 3])?;
        Ok(Followed {
            normals: orient::given::forward(&self.device, given)?,
            confidence: sure.clone(),
            kept: sure,
            turned: self.device.upload(&[0])?,
        })
    }

    /// The areas that samples count by.
    fn areas(
        &self,
        near: &neighbors::Neighborhoods<T>,
        held: &RadiiAndSigns<T>,
    ) -> Result<(Buffer<T>, Option<area::Residual<T>>), Error> {
        let device = &self.device;
        if !self.options.area_weights {
            return Ok((device.upload(&vec![T::of(1.0); near.len()])?, None));
        }
        let near = neighbors::with_radii(device, near, &held.area_radii)?;
        let (areas, residual) = area::forward(device, &near, held.common_radius)?;
        Ok((areas, Some(residual)))
    }

    /// From the right-hand side, which is let go, to the indicator and its level.
    fn solve(
        &self,
        b: Buffer<T>,
        samples: Samples<'_, T>,
        width: Width,
        splat: &splat::Residual<T>,
    ) -> Result<Solved<T>, Error> {
        let (device, grid) = (&self.device, &self.grid);
        let chi = self.solver.solve(device, &b, width.cells)?;
        drop(b);
        if self.options.screening > 0.0 {
            let equation = self.screened_equation(samples, splat);
            poisson::screened::forward(device, &equation, &chi)?;
        }
        let (level, of_level) =
            iso_value::forward(device, &chi, grid, samples.points, samples.areas)?;
        let (chi, of_local_level) = self.local_level(chi, samples, width, &of_level, splat)?;
        Ok(Solved {
            chi,
            level,
            of_level,
            of_local_level,
        })
    }

    pub(super) fn screened_equation<'a>(
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
        let choice = local::Options {
            area: self.options.area_weights,
            smoothing: width.cells,
            thin: self.options.level == Level::Thin,
        };
        let (chi, residual) = local::forward(&self.device, &chi, samples, choice, mean, splat)?;
        Ok((chi, Some(residual)))
    }

    /// Width of the smoothing.
    fn width(&self, areas: &Buffer<T>, held: &RadiiAndSigns<T>) -> Result<Width, Error> {
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
