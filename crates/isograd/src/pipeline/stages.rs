//! The stages of a plan, each from the results of the previous ones.

use std::sync::Arc;

use super::surface::{CELLS_PER_SPACING, HALVED_PER_SPACING};
use super::{Error, Reconstruction, Reconstructor, Residuals, Solve, check_memory};
use crate::data::{Field, Grid, PointCloud};
use crate::large::is_large;
use crate::neighbors::{Neighborhoods, Radius};
use crate::report::{Report, Stage};
use crate::sheet::Sheet;
use crate::{Real, neighbors, normals, orient, poisson, refine, splat};

impl<T: Real> Reconstructor<T> {
    /// One stage, compiled where it is called: see [`concrete`](super::concrete).
    pub(crate) fn run(
        &mut self,
        stage: Stage,
        cloud: &PointCloud<T>,
        held: Option<&Reconstruction<T>>,
    ) -> Result<(), Error> {
        match stage {
            Stage::Normals => self.normals(cloud, held)?,
            Stage::Orient => self.orient(cloud, held)?,
            Stage::Splat => self.splat(held)?,
            Stage::Poisson => self.solve()?,
            Stage::Isosurface => self.isosurface()?,
            Stage::Distance => self.distance()?,
            Stage::Checks if held.is_some() => (),
            Stage::Checks => self.check(),
        }
        Ok(())
    }

    pub(super) fn normals(
        &mut self,
        cloud: &PointCloud<T>,
        held: Option<&Reconstruction<T>>,
    ) -> Result<(), Error> {
        let Reconstruction {
            options,
            areas,
            residuals,
            report,
            ..
        } = &mut self.result;
        let Residuals {
            neighborhoods,
            normals,
            ..
        } = residuals;
        let held = held.map(|held| &held.residuals);
        let is_given = options.orient == orient::Method::Given;
        find_axes(
            cloud,
            options.radius,
            is_given,
            held,
            neighborhoods,
            normals,
            report,
        )?;
        if options.area {
            splat::area::forward(neighborhoods, areas);
        } else {
            areas.clear();
            areas.resize(cloud.len(), T::one());
        }
        Ok(())
    }

    fn orient(
        &mut self,
        cloud: &PointCloud<T>,
        held: Option<&Reconstruction<T>>,
    ) -> Result<(), Error> {
        let Reconstruction {
            options,
            orientation,
            residuals,
            report,
            ..
        } = &mut self.result;
        let is_given = options.orient == orient::Method::Given;
        if let Some(held) = held.filter(|_| !is_given) {
            let axes = &residuals.normals.normals;
            orient::hold(axes, &held.orientation, orientation);
        } else {
            orient::forward(
                cloud.points(),
                &residuals.normals,
                &residuals.neighborhoods,
                cloud,
                &options.orient,
                &mut self.scratch.orient,
                orientation,
            )?;
            report.orientation = orientation.method.name();
            report.flipped = orientation.flipped;
        }
        if !is_given {
            let scratch = &mut self.scratch.refine;
            refine::forward(&residuals.neighborhoods, scratch, &mut orientation.normals);
        }
        Ok(())
    }

    pub(super) fn splat(&mut self, held: Option<&Reconstruction<T>>) -> Result<(), Error> {
        let (grid, octaves) = self.choose_surface_grid(held)?;
        self.result.residuals.is_refined = match held {
            Some(held) => held.residuals.is_refined,
            None => octaves == 0 && self.result.would_be_refined(&grid),
        };
        let smoothing = self.smoothing(&grid);
        self.result.thicken(&grid, smoothing);
        let Reconstruction {
            options,
            points,
            sdf,
            report,
            ..
        } = &mut self.result;
        let closed = match held {
            Some(held) => held.has_closed_walls(),
            None => options.walls.are_closed(points, sdf.grid()),
        };
        if closed && options.screening > 0.0 {
            return Err(Error::ClosedScreening(options.screening));
        }
        report.walls = if closed { "closed" } else { "free" };
        report.level = options.level;
        report.surface_spacing = grid.spacing().f64();
        if octaves > 0 {
            return self.splat_in_blocks(grid, octaves, closed);
        }
        report.surface_cells = grid.cells();
        self.allocate(grid, closed)?;
        let Reconstruction {
            options,
            points,
            orientation,
            areas,
            indicator,
            residuals,
            ..
        } = &mut self.result;
        let samples = (residuals.thickened).samples(points, &orientation.normals, areas);
        let (scratch, residual) = (&mut self.scratch.splat, &mut residuals.splat);
        splat::forward(samples, options.splat, scratch, residual, indicator)?;
        Ok(())
    }

    /// The grid of the surface, and the octaves of a sparse solve, 0 for a dense one: those of `held` if given.
    fn choose_surface_grid(
        &self,
        held: Option<&Reconstruction<T>>,
    ) -> Result<(Grid<T>, usize), Error> {
        let Reconstruction {
            sdf,
            options,
            points,
            ..
        } = &self.result;
        if let Some(held) = held {
            let octaves = held.sparse.as_ref().map_or(0, |sparse| sparse.count());
            return Ok((held.surface_grid_like(sdf.grid())?, octaves));
        }
        let solve = match options.solve {
            Solve::Sparse if options.screening > 0.0 => {
                return Err(Error::SparseScreening(options.screening));
            }
            Solve::Sparse if options.sheet != Sheet::Off => return Err(Error::SparseSheet),
            Solve::Auto if options.screening > 0.0 || options.sheet != Sheet::Off => Solve::Dense,
            solve => solve,
        };
        let spacing = self.result.sample_spacing();
        let margin = poisson::margin(points, sdf.grid());
        let find = |per_spacing: f64| {
            (options.surface).grid_and_octaves(sdf.grid(), spacing / per_spacing, solve, margin)
        };
        if self.result.keeps_thin_parts() {
            let found = find(HALVED_PER_SPACING)?;
            // A sparse solve has no half cells.
            if found.1 == 0 {
                return Ok(found);
            }
        }
        find(CELLS_PER_SPACING)
    }

    /// Puts the indicator and the Poisson plan of a dense solve on the grid of the surface.
    fn allocate(&mut self, grid: Grid<T>, closed: bool) -> Result<(), Error> {
        let result = &mut self.result;
        result.sparse = None;
        if *result.indicator.grid() != grid {
            // A plan holds the memory of the last one.
            if grid.cells() > result.indicator.values().len() {
                check_memory(&grid)?;
            }
            result.indicator = Field::zeros(grid);
        }
        if result.poisson.shape() != grid.shape() || result.poisson.is_closed() != closed {
            result.poisson = Arc::new(poisson::Plan::with_walls(grid.shape(), closed));
        }
        Ok(())
    }

    /// Width `σ` of the smoothing, in cells.
    fn smoothing(&self, grid: &Grid<T>) -> f64 {
        let in_cells = self.result.sample_spacing() / grid.spacing().f64();
        self.result.options.smoothing.cells(in_cells)
    }
}

/// Neighborhoods, and the axis of every point, unless all normals are given; isolated as in `held` if given.
pub(super) fn find_axes<T: Real>(
    cloud: &PointCloud<T>,
    radius: Radius,
    is_given: bool,
    held: Option<&Residuals<T>>,
    neighborhoods: &mut Neighborhoods<T>,
    out: &mut normals::Residual<T>,
    report: &mut Report,
) -> Result<(), Error> {
    let points = cloud.points();
    match held {
        Some(held) => neighbors::hold(points, &held.neighborhoods, neighborhoods)?,
        None if is_given => neighbors::forward(points, radius, neighborhoods)?,
        None => normals::forward_with_neighborhoods(points, radius, neighborhoods, out)?,
    }
    match held {
        _ if is_given => out.clear(),
        Some(_) => normals::forward(neighborhoods, out),
        None => {}
    }
    if is_large(points.len()) {
        neighborhoods.free_scratch();
        out.free_scratch();
    }
    report.radius = neighborhoods.common_radius.f64();
    report.sample_spacing = neighborhoods.spacing().f64();
    report.guarded = out.guarded();
    if report.guarded == points.len() {
        let points = points.len();
        return Err(Error::NoPlane { points });
    }
    Ok(())
}
