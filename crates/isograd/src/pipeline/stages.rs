//! The stages of a plan, each from the results of those before it.

use super::{Error, Reconstruction, Reconstructor, Residuals};
use crate::data::{Field, Mesh, PointCloud};
use crate::isosurface::{Level, local_level, measure};
use crate::neighbors::{Neighborhoods, Radius};
use crate::orient::Orientation;
use crate::poisson::screened;
use crate::report::{Report, Stage, Warning};
use crate::{Real, checks, distance, isosurface, neighbors, normals, orient, splat};

impl<T: Real> Reconstructor<T> {
    /// One stage, compiled where it is called: see [`concrete`](crate::concrete).
    pub(crate) fn run(
        &mut self,
        stage: Stage,
        cloud: &PointCloud<T>,
        held: Option<&Reconstruction<T>>,
    ) -> Result<(), Error> {
        match stage {
            Stage::Normals => self.normals(cloud, held)?,
            Stage::Orient => self.orient(cloud, held)?,
            Stage::Splat => self.splat(cloud)?,
            Stage::Poisson => self.solve(cloud, held)?,
            Stage::Isosurface => self.isosurface()?,
            Stage::Distance => self.distance()?,
            Stage::Checks if held.is_some() => (),
            Stage::Checks => self.check(cloud),
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

    pub(super) fn splat(&mut self, cloud: &PointCloud<T>) -> Result<(), Error> {
        let Reconstruction {
            options,
            orientation,
            areas,
            indicator,
            residuals,
            ..
        } = &mut self.result;
        let samples = splat::Samples {
            points: cloud.points(),
            normals: &orientation.normals,
            areas,
        };
        splat::forward(
            samples,
            options.splat,
            &mut self.scratch.splat,
            &mut residuals.splat,
            indicator,
        )?;
        Ok(())
    }

    /// The indicator, plain or screened, and the level of its surface.
    pub(super) fn solve(
        &mut self,
        cloud: &PointCloud<T>,
        held: Option<&Reconstruction<T>>,
    ) -> Result<(), Error> {
        let Reconstruction {
            options,
            poisson,
            orientation,
            areas,
            indicator,
            iso_value,
            residuals,
            report,
            ..
        } = &mut self.result;
        let grid = *indicator.grid();
        let held = held.filter(|_| !options.smoothing_follows());
        residuals.smoothing = match held {
            Some(held) => held.residuals.smoothing,
            None => {
                let apart = match options.area {
                    true => splat::area::mean(areas).0.sqrt(),
                    false => residuals.neighborhoods.spacing().f64(),
                };
                options.smoothing.cells(apart / grid.spacing().f64())
            }
        };
        report.smoothing = residuals.smoothing;
        let values = indicator.values_mut();
        poisson.solve(values, residuals.smoothing, &mut self.scratch.poisson)?;
        let samples = splat::Samples {
            points: cloud.points(),
            normals: &orientation.normals,
            areas,
        };
        if options.screening > 0.0 {
            let equation = screened::Equation {
                plan: poisson,
                grid: &grid,
                samples,
                area_weights: options.area,
                order: &residuals.splat,
                screening: options.screening,
            };
            screened::forward(&equation, values, &mut self.scratch.screened)?;
        }
        let level = &mut residuals.iso_value;
        *iso_value = isosurface::iso_value::forward(indicator, samples.points, areas, level)?;
        report.iso_value = iso_value.f64();
        if options.level != Level::Mean {
            local_level::forward(
                indicator,
                samples,
                local_level::Choice {
                    area_weights: options.area,
                    smoothing: residuals.smoothing,
                    thin: options.level == Level::Thin,
                },
                level,
                &residuals.splat,
                &mut self.scratch.level,
                &mut residuals.local_level,
            );
        }
        Ok(())
    }

    fn isosurface(&mut self) -> Result<(), Error> {
        let Reconstruction {
            indicator,
            iso_value,
            mesh,
            report,
            ..
        } = &mut self.result;
        let found = isosurface::forward(indicator, *iso_value, &mut self.scratch.isosurface, mesh)?;
        if found.touches_wall {
            report.warnings.push(Warning::TouchesWall);
        }
        Ok(())
    }

    fn distance(&mut self) -> Result<(), Error> {
        let Reconstruction {
            options,
            indicator,
            iso_value,
            mesh,
            sdf,
            closest,
            ..
        } = &mut self.result;
        distance::lattice::forward(
            mesh,
            indicator,
            *iso_value,
            options.band,
            &mut self.scratch.distance,
            sdf,
            closest,
        )?;
        Ok(())
    }

    /// Measures the result and looks for reasons not to trust it.
    fn check(&mut self, cloud: &PointCloud<T>) {
        if !self.result.options.checks {
            return;
        }
        let Reconstruction {
            sdf,
            mesh,
            orientation,
            residuals,
            report,
            ..
        } = &mut self.result;
        let (points, neighborhoods) = (cloud.points(), &residuals.neighborhoods);
        let scratch = &mut self.scratch.measure;
        report.check_field(points, &orientation.normals, sdf, mesh, scratch);
        report.check_samples(points, neighborhoods, orientation);
    }
}

impl Report {
    /// Measures φ and the surface, and looks for reasons not to trust them: for results that were not made by a
    /// [`Reconstructor`]. `normals` are those of the points, outward; [`Report::sample_spacing`] is there already.
    pub fn check_field<T: Real>(
        &mut self,
        points: &[[T; 3]],
        normals: &[[T; 3]],
        sdf: &Field<T>,
        mesh: &Mesh<T>,
        scratch: &mut measure::Scratch,
    ) {
        self.measure_field(sdf);
        self.surface = measure::measure(mesh, scratch);
        let (warnings, spacing) = (&mut self.warnings, sdf.grid().spacing());
        warnings.extend(checks::thin_and_missed(points, normals, sdf));
        warnings.extend(checks::sparse(self.sample_spacing, spacing.f64()));
        warnings.extend(checks::components(self.surface.components));
        warnings.extend(checks::rounded(points, spacing));
    }

    /// Measures the samples and their normals, and looks for reasons not to trust them. `neighborhoods` are those of
    /// the points; [`Report::guarded`] is there already.
    pub fn check_samples<T: Real>(
        &mut self,
        points: &[[T; 3]],
        neighborhoods: &Neighborhoods<T>,
        orientation: &Orientation<T>,
    ) {
        self.measure_samples(&neighborhoods.count, &orientation.confidence);
        let rims = orient::rim::rims(points, &orientation.normals, neighborhoods);
        let reasons = orient::doubt::reasons_beside(&rims, points, orientation, neighborhoods);
        self.doubt = orient::doubt::Doubt::count(points.len(), &reasons);
        let warnings = &mut self.warnings;
        warnings.extend(checks::open(&rims));
        warnings.extend(checks::doubtful_signs(self.doubt));
        warnings.extend(checks::guarded(self.guarded, points.len()));
    }
}

/// Neighborhoods, with the radii of `held` where there is such a thing, and the axis of every point, unless
/// all normals are given.
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
        Some(held) => normals::hold(neighborhoods, &held.normals, out),
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
