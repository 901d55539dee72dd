//! The stages of a plan, each from the results of the previous ones.

use std::sync::Arc;

use super::open::Open;
use super::sparse::Sparse;
use super::{Error, Reconstruction, Reconstructor, Residuals, Solve, check_memory};
use crate::data::blocks::BlockField;
use crate::data::cells::{Cells, CellsMut};
use crate::data::{Field, Grid, PointCloud};
use crate::isosurface::measure;
use crate::isosurface::{Interpolation, Level, local_level};
use crate::neighbors::{Neighborhoods, Radius};
use crate::poisson::screened;
use crate::report::{Report, Stage, Warning};
use crate::sheet::{self, Sheet};
use crate::{Mesh, Real, distance, isosurface, neighbors, normals, orient, poisson, splat};

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
        if let Some(held) = held.filter(|_| options.orient != orient::Method::Given) {
            let axes = &residuals.normals.normals;
            orient::hold(axes, &held.orientation, orientation);
            return Ok(());
        }
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
        Ok(())
    }

    pub(super) fn splat(&mut self, held: Option<&Reconstruction<T>>) -> Result<(), Error> {
        let (grid, octaves) = self.choose_surface_grid(held)?;
        self.result.residuals.is_refined = match held {
            Some(held) => held.residuals.is_refined,
            None => octaves == 0 && self.result.would_be_refined(&grid),
        };
        let smoothing = self.smoothing(&grid, held);
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
        (options.surface).grid_and_octaves(sdf.grid(), spacing, solve, margin)
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

    /// The indicator and the level of its surface.
    pub(super) fn solve(&mut self) -> Result<(), Error> {
        let smoothing = self.result.residuals.smoothing;
        if self.result.sparse.is_some() {
            self.result.report.smoothing = smoothing;
            return self.solve_in_blocks(smoothing);
        }
        let Reconstruction {
            poisson,
            indicator,
            report,
            ..
        } = &mut self.result;
        report.smoothing = smoothing;
        poisson.solve(indicator.values_mut(), smoothing, &mut self.scratch.poisson)?;
        if self.result.options.screening > 0.0 {
            self.screen()?;
        }
        self.level()
    }

    /// Width `σ` of the smoothing, in cells.
    fn smoothing(&self, grid: &Grid<T>, held: Option<&Reconstruction<T>>) -> f64 {
        let result = &self.result;
        match held.filter(|_| !result.options.smoothing_follows()) {
            Some(held) => held.residuals.smoothing,
            None => {
                let in_cells = result.sample_spacing() / grid.spacing().f64();
                result.options.smoothing.cells(in_cells)
            }
        }
    }

    /// The solution of the screened equation, from that of the plain one.
    fn screen(&mut self) -> Result<(), Error> {
        let is_refined = self.result.residuals.is_refined;
        let Reconstruction {
            options,
            poisson,
            points,
            orientation,
            areas,
            indicator,
            residuals,
            ..
        } = &mut self.result;
        let grid = *indicator.grid();
        let equation = screened::Equation {
            plan: poisson,
            grid: &grid,
            samples: splat::SortedSamples {
                samples: (residuals.thickened).samples(points, &orientation.normals, areas),
                order: &residuals.splat,
            },
            area: options.area,
            screening: options.screening,
        };
        screened::forward(
            &equation,
            indicator.values_mut(),
            &mut self.scratch.screened,
        )?;
        if !is_refined {
            residuals.screened = None;
            return Ok(());
        }
        let (points, chi) = (equation.samples.samples.points, (&*indicator).into());
        let values = residuals.screened.get_or_insert_with(Default::default);
        isosurface::iso_value::forward_on(chi, points, areas, Interpolation::Linear, values)?;
        Ok(())
    }

    /// The iso-value, and the indicator relative to the local one.
    pub(super) fn level(&mut self) -> Result<(), Error> {
        let interpolation = match self.result.residuals.is_refined {
            true => Interpolation::Spline,
            false => Interpolation::Linear,
        };
        let Reconstruction {
            options,
            points,
            orientation,
            areas,
            indicator,
            sparse,
            iso_value,
            residuals,
            report,
            ..
        } = &mut self.result;
        let samples = (residuals.thickened).samples(points, &orientation.normals, areas);
        let level = &mut residuals.iso_value;
        let chi = match sparse {
            Some(sparse) => CellsMut::Blocks(&mut sparse.chi),
            None => {
                let (grid, values) = indicator.split_mut();
                CellsMut::Dense(grid, values)
            }
        };
        let points = samples.points;
        *iso_value =
            isosurface::iso_value::forward_on(chi.cells(), points, areas, interpolation, level)?;
        report.iso_value = iso_value.f64();
        if options.level != Level::Mean {
            local_level::forward_on(
                chi,
                splat::SortedSamples {
                    samples,
                    order: &residuals.splat,
                },
                local_level::Options {
                    area: options.area,
                    smoothing: residuals.smoothing,
                    thin: options.level == Level::Thin,
                },
                level,
                &mut self.scratch.level,
                &mut residuals.local_level,
            );
        }
        Ok(())
    }

    pub(super) fn isosurface(&mut self) -> Result<(), Error> {
        let is_refined = self.result.residuals.is_refined;
        let Reconstruction {
            indicator,
            sparse,
            iso_value,
            refined,
            mesh,
            report,
            ..
        } = &mut self.result;
        let scratch = &mut self.scratch.isosurface;
        let previous = refined.take();
        if is_refined {
            *refined = Some(isosurface::refine::forward(
                indicator, *iso_value, previous,
            )?);
        }
        let mut found = march(indicator, sparse, refined, *iso_value, scratch, mesh);
        if let (Some(_), Err(isosurface::Error::NothingInside { .. })) = (&refined, &found) {
            // A body far smaller than a cell: the spline does not reach the level, which it has at the samples, at the
            // center of any cell, but some coefficient of it does.
            *refined = None;
            found = march(indicator, sparse, refined, *iso_value, scratch, mesh);
        }
        let found = found?;
        if found.touches_wall {
            report.warnings.push(Warning::TouchesWall);
        }
        self.open()
    }

    fn distance(&mut self) -> Result<(), Error> {
        let Reconstruction {
            options,
            indicator,
            sparse,
            refined,
            iso_value,
            mesh,
            open,
            sdf,
            closest,
            ..
        } = &mut self.result;
        if !options.sdf && open.is_none() {
            sdf.values_mut().fill(T::zero());
            closest.clear();
            closest.resize(sdf.values().len(), distance::NO_TRIANGLE);
            return Ok(());
        }
        if let (Some(open), Some(thickness)) = (open, options.sheet.thickness()) {
            let scratch = &mut self.scratch.distance;
            let sheet = open.trimmed();
            sheet::forward(sheet, thickness, options.band, scratch, sdf, closest)?;
            return Ok(());
        }
        distance::lattice::forward_on(
            mesh,
            marched(indicator, sparse, refined),
            *iso_value,
            options.band,
            &mut self.scratch.distance,
            sdf,
            closest,
        )?;
        Ok(())
    }

    /// Measures the result and checks whether it can be trusted.
    fn check(&mut self) {
        let options = &self.result.options;
        if !options.checks || !options.sdf {
            return;
        }
        let Reconstruction {
            points,
            sdf,
            mesh,
            open,
            orientation,
            residuals,
            report,
            ..
        } = &mut self.result;
        let neighborhoods = &residuals.neighborhoods;
        let scratch = &mut self.scratch.measure;
        match open.as_deref() {
            Some(open) if open.is_sheet() => {
                let normals = &orientation.normals;
                let built = &self.scratch.distance;
                report.check_sheet(points, normals, sdf, open.trimmed(), built);
            }
            _ => {
                report.check_field(
                    points,
                    &orientation.normals,
                    sdf,
                    mesh,
                    scratch,
                    Some(&self.scratch.distance),
                );
                report.measure_gaps(mesh, neighborhoods, sdf.grid().spacing());
            }
        }
        if let Some(open) = open {
            report.surface = measure::measure(open.mesh(), scratch);
        }
        let is_sheet = open.as_deref().is_some_and(Open::is_sheet);
        report.check_samples(points, neighborhoods, orientation, is_sheet);
    }
}

impl<T: Real> Reconstruction<T> {
    /// The indicator whose surface the mesh is.
    pub(super) fn marched(&self) -> Cells<'_, T> {
        marched(&self.indicator, &self.sparse, &self.refined)
    }
}

/// [`Reconstruction::marched`].
fn marched<'a, T: Real>(
    indicator: &'a Field<T>,
    sparse: &'a Option<Sparse<T>>,
    refined: &'a Option<BlockField<T>>,
) -> Cells<'a, T> {
    match (refined, sparse) {
        (Some(refined), _) => refined.into(),
        (None, Some(sparse)) => (&sparse.chi).into(),
        (None, None) => indicator.into(),
    }
}

fn march<T: Real>(
    indicator: &Field<T>,
    sparse: &Option<Sparse<T>>,
    refined: &Option<BlockField<T>>,
    level: T,
    scratch: &mut isosurface::Scratch,
    mesh: &mut Mesh<T>,
) -> Result<isosurface::Report, isosurface::Error> {
    use isosurface::{blocks, refine};
    match (refined, sparse) {
        (Some(refined), _) => {
            let place = |edge| refine::on_edge(indicator, &refined.grid, level, edge);
            blocks::forward(refined, level, place, mesh)
        }
        (None, Some(sparse)) => {
            let chi = &sparse.chi;
            blocks::forward(chi, level, |edge| blocks::linear(chi, level, edge), mesh)
        }
        (None, None) => isosurface::forward(indicator, level, scratch, mesh),
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
    report.radius = neighborhoods.common_radius.f64();
    report.sample_spacing = neighborhoods.spacing().f64();
    report.guarded = out.guarded();
    if report.guarded == points.len() {
        let points = points.len();
        return Err(Error::NoPlane { points });
    }
    Ok(())
}
