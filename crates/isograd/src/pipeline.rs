//! The stages in order: a plan ([`Reconstructor`]) and what it makes ([`Reconstruction`]).

mod extend;

use std::ops::ControlFlow;
use std::time::Instant;

use crate::data::{Field, Grid, Mesh, PointCloud};
use crate::isosurface::measure;
use crate::report::{Report, Stage, Warning};
use crate::{Real, checks, distance, isosurface, neighbors, normals, orient, poisson, splat};

/// What to compute, and how. Nothing here says where or on how many threads.
#[derive(Clone, Debug)]
pub struct Options {
    /// Neighbourhood radius of the normals and the area weights.
    pub radius: neighbors::Radius,
    /// How the sign of each normal is found, or that the cloud's own normals are to be used.
    pub orientation: orient::Method,
    /// How a sample is spread over the cells round it.
    pub weights: splat::Weights,
    /// Whether each sample counts by the area of surface that it stands for.
    pub area_weights: bool,
    /// Width `σ` of the Gaussian smoothing of the indicator, in cells; 0 for none.
    pub smoothing: f64,
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
            smoothing: 0.0,
            band: distance::Band::default(),
            checks: true,
        }
    }
}

/// Why a reconstruction failed: which stage, and its own reason.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The options make no sense.
    #[error("the smoothing is {0} cells; it must be 0 or more, and finite")]
    Smoothing(f64),
    /// Neighbours.
    #[error(transparent)]
    Neighbors(#[from] neighbors::Error),
    /// The samples lie on a line, or are isolated points: nothing spans a surface.
    #[error(
        "none of the {points} points has neighbours that span a plane (the points lie on a line or are isolated), so there is no surface; check that the right columns were read as coordinates"
    )]
    NoPlane {
        /// Number of points.
        points: usize,
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

/// A plan for one grid and one set of options: Fourier tables and all memory, used again by every call.
///
/// A second [`reconstruct`](Self::reconstruct) with as many points allocates nothing of the size of a
/// field.
pub struct Reconstructor<T: Real> {
    options: Options,
    poisson: poisson::Plan<T>,
    scratch: Scratch<T>,
    result: Reconstruction<T>,
}

/// Memory that the stages use again and nobody looks at.
#[derive(Default)]
struct Scratch<T: Real> {
    areas: splat::area::Scratch<T>,
    orient: orient::Scratch,
    splat: splat::Scratch,
    poisson: poisson::Scratch<T>,
    isosurface: isosurface::Scratch,
    measure: measure::Scratch,
    distance: distance::Scratch<T>,
}

impl<T: Real> Reconstructor<T> {
    /// A plan for clouds that lie on `grid`, at least 2 cells off its walls.
    ///
    /// # Errors
    /// [`Error::Smoothing`] for a smoothing that is negative or not finite. Other options are checked by
    /// the stages that use them.
    pub fn new(grid: Grid<T>, options: Options) -> Result<Self, Error> {
        if !(options.smoothing >= 0.0) || !options.smoothing.is_finite() {
            return Err(Error::Smoothing(options.smoothing));
        }
        Ok(Self {
            poisson: T::poisson_plan(grid.shape()),
            result: Reconstruction::empty(grid),
            scratch: Scratch::default(),
            options,
        })
    }

    /// The grid that all results are on.
    pub fn grid(&self) -> &Grid<T> {
        self.result.sdf.grid()
    }

    /// The options of the plan.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Runs all stages on a cloud. The result stays in the plan, whose memory the next call uses again:
    /// clone it, or [take it](Self::into_reconstruction), to keep it.
    ///
    /// # Errors
    /// The error of the stage that failed; the result of an earlier call is then gone.
    pub fn reconstruct(&mut self, cloud: &PointCloud<T>) -> Result<&Reconstruction<T>, Error> {
        self.reconstruct_observed(cloud, &mut |_| ControlFlow::Continue(()))
    }

    /// The same, calling `observer` before each stage; where it breaks, so does the work.
    ///
    /// # Errors
    /// As [`reconstruct`](Self::reconstruct), and [`Error::Interrupted`] where the observer breaks.
    pub fn reconstruct_observed(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<&Reconstruction<T>, Error> {
        self.result.report = Report {
            points: cloud.len(),
            ..Report::default()
        };
        for stage in Stage::ALL {
            if observer(stage).is_break() {
                return Err(Error::Interrupted(stage));
            }
            let start = Instant::now();
            T::run(self, stage, cloud)?;
            let seconds = start.elapsed().as_secs_f64();
            self.result.report.seconds.set(stage, seconds);
        }
        Ok(&self.result)
    }

    /// One stage, compiled where it is called: see [`concrete`](crate::concrete).
    pub(crate) fn run(&mut self, stage: Stage, cloud: &PointCloud<T>) -> Result<(), Error> {
        match stage {
            Stage::Normals => self.normals(cloud)?,
            Stage::Orient => self.orient(cloud)?,
            Stage::Splat => self.splat(cloud)?,
            Stage::Poisson => self.solve(cloud)?,
            Stage::Isosurface => self.isosurface()?,
            Stage::Distance => self.distance()?,
            Stage::Checks => self.check(cloud),
        }
        Ok(())
    }

    /// The last result, without the plan.
    pub fn into_reconstruction(self) -> Reconstruction<T> {
        self.result
    }

    fn normals(&mut self, cloud: &PointCloud<T>) -> Result<(), Error> {
        let Reconstruction {
            areas,
            residuals,
            report,
            ..
        } = &mut self.result;
        let neighborhoods = &mut residuals.neighborhoods;
        neighbors::forward(cloud.points(), self.options.radius, neighborhoods)?;
        if self.options.orientation == orient::Method::Given {
            residuals.normals.clear();
        } else {
            normals::forward(neighborhoods, &mut residuals.normals);
        }
        if self.options.area_weights {
            splat::area::forward(neighborhoods, &mut self.scratch.areas, areas);
        } else {
            areas.clear();
            areas.resize(cloud.len(), T::one());
        }
        report.radius = neighborhoods.common_radius.f64();
        report.sample_spacing = neighborhoods.spacing().f64();
        report.guarded = residuals.normals.guarded();
        if report.guarded == cloud.len() {
            return Err(Error::NoPlane {
                points: cloud.len(),
            });
        }
        Ok(())
    }

    fn orient(&mut self, cloud: &PointCloud<T>) -> Result<(), Error> {
        let Reconstruction {
            orientation,
            residuals,
            report,
            ..
        } = &mut self.result;
        orient::forward(
            cloud.points(),
            &residuals.normals.normals,
            &residuals.neighborhoods,
            cloud.normals(),
            &self.options.orientation,
            &mut self.scratch.orient,
            orientation,
        )?;
        report.orientation = orientation.method.name();
        report.flipped = orientation.flipped;
        Ok(())
    }

    fn splat(&mut self, cloud: &PointCloud<T>) -> Result<(), Error> {
        let Reconstruction {
            orientation,
            areas,
            indicator,
            residuals,
            ..
        } = &mut self.result;
        splat::forward(
            cloud.points(),
            &orientation.normals,
            areas,
            self.options.weights,
            &mut self.scratch.splat,
            &mut residuals.splat,
            indicator,
        )?;
        Ok(())
    }

    fn solve(&mut self, cloud: &PointCloud<T>) -> Result<(), Error> {
        let Reconstruction {
            areas,
            indicator,
            iso_value,
            residuals,
            report,
            ..
        } = &mut self.result;
        let values = indicator.values_mut();
        self.poisson
            .solve(values, self.options.smoothing, &mut self.scratch.poisson)?;
        let (level, residual) = isosurface::iso_value::forward(indicator, cloud.points(), areas)?;
        *iso_value = level;
        residuals.iso_value = residual;
        report.iso_value = level.f64();
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
            self.options.band,
            &mut self.scratch.distance,
            sdf,
            closest,
        )?;
        Ok(())
    }

    /// Measures the result and looks for reasons not to trust it.
    fn check(&mut self, cloud: &PointCloud<T>) {
        if !self.options.checks {
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
        report.measure_samples(&residuals.neighborhoods.count, &orientation.confidence);
        report.measure_field(sdf);
        report.surface = measure::measure(mesh, &mut self.scratch.measure);
        let (points, normals) = (cloud.points(), &orientation.normals);
        let warnings = &mut report.warnings;
        warnings.extend(checks::thin_and_missed(points, normals, sdf));
        warnings.extend(checks::sparse(
            residuals.neighborhoods.spacing(),
            sdf.grid().spacing(),
        ));
        warnings.extend(checks::open(points, normals, &residuals.neighborhoods));
        warnings.extend(checks::components(report.surface.components));
        warnings.extend(checks::doubtful_signs(&orientation.confidence));
        warnings.extend(checks::guarded(report.guarded, points.len()));
        warnings.extend(checks::rounded(points, sdf.grid().spacing()));
    }
}

/// What a plan made of a cloud: the field, the surface, the normals, the report, and what the pullbacks
/// need of each stage.
#[derive(Clone)]
pub struct Reconstruction<T> {
    sdf: Field<T>,
    indicator: Field<T>,
    iso_value: T,
    mesh: Mesh<T>,
    closest: Vec<u32>,
    areas: Vec<T>,
    orientation: orient::Orientation<T>,
    residuals: Residuals<T>,
    report: Report,
}

/// What the stages keep for their pullbacks, beside the results themselves.
#[derive(Clone, Default)]
struct Residuals<T> {
    neighborhoods: neighbors::Neighborhoods<T>,
    normals: normals::Residual<T>,
    splat: splat::Residual,
    iso_value: isosurface::iso_value::Residual,
}

impl<T: Real> Reconstruction<T> {
    fn empty(grid: Grid<T>) -> Self {
        Self {
            sdf: Field::zeros(grid),
            indicator: Field::zeros(grid),
            iso_value: T::zero(),
            mesh: Mesh::default(),
            closest: Vec::new(),
            areas: Vec::new(),
            orientation: orient::Orientation::default(),
            residuals: Residuals::default(),
            report: Report::default(),
        }
    }

    /// The signed distance φ at every cell centre, in the cloud's unit, negative inside.
    pub fn sdf(&self) -> &Field<T> {
        &self.sdf
    }

    /// The indicator χ at every cell centre: below the iso-value inside, above it outside. It has no unit;
    /// without area weights also no scale.
    pub fn indicator(&self) -> &Field<T> {
        &self.indicator
    }

    /// The level `c` of the surface `χ = c`.
    pub fn iso_value(&self) -> T {
        self.iso_value
    }

    /// The surface, in the cloud's coordinates.
    pub fn mesh(&self) -> &Mesh<T> {
        &self.mesh
    }

    /// For each cell, in C order, the face of the surface closest to its centre;
    /// [`NO_TRIANGLE`](distance::NO_TRIANGLE) outside the band.
    pub fn closest(&self) -> &[u32] {
        &self.closest
    }

    /// `(N, 3)` outward unit normals of the samples, in their order.
    pub fn normals(&self) -> &[[T; 3]] {
        &self.orientation.normals
    }

    /// `(N,)` confidence in the sign of each normal, from 0 to 1.
    pub fn confidence(&self) -> &[T] {
        &self.orientation.confidence
    }

    /// `(N,)` area of surface that each sample stands for, in unit length²; 1 without area weights.
    pub fn areas(&self) -> &[T] {
        &self.areas
    }

    /// Numbers, times and warnings.
    pub fn report(&self) -> &Report {
        &self.report
    }
}
