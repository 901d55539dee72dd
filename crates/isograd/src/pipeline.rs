//! The stages in order: a plan ([`Reconstructor`]) and what it makes ([`Reconstruction`]).

mod buffers;
mod checks;
mod concrete;
mod cotangent;
mod extend;
mod indicator;
mod memory;
mod open;
#[cfg(test)]
mod open_tests;
mod options;
mod orienter;
mod pullback;
mod query;
#[cfg(test)]
mod residuals_tests;
mod restore;
mod scaling;
mod sdf;
mod selection;
#[cfg(test)]
mod selection_tests;
mod sparse;
mod stages;
mod stray;
mod surface;
mod text;
mod thickened;
#[cfg(test)]
mod walls_tests;

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use crate::data::blocks::BlockField;
use crate::data::{Field, Grid, Mesh, PointCloud, Selection};
use crate::large::is_large;
use crate::report::Report;
pub(crate) use crate::report::Stage;
use crate::{Real, orient, poisson, splat};

use buffers::{Residuals, Scratch};
pub use concrete::Pipeline;
pub use cotangent::{CloudCotangent, Cotangent, ExtensionCotangent, PullbackError};
pub use memory::{
    AvailableMemory, MemoryError, MemoryLimit, MemoryUse, available_memory, check_distance_memory,
    check_memory,
};
pub use options::{Error, Options};
pub use orienter::Orienter;
pub use restore::{RestoreError, Saved};
pub use sparse::Solve;
pub use surface::SurfaceResolution;
pub use text::ParseOptionError;

/// A plan for one grid and one set of options: Fourier tables and scratch buffers, reused by every call.
///
/// A second [`reconstruct`](Self::reconstruct) with as many points allocates nothing of the size of a field, unless there
/// are more than a million: then only results are kept.
pub struct Reconstructor<T: Real> {
    scratch: Scratch<T>,
    result: Reconstruction<T>,
    /// Whether the result is that of its cloud alone, and of all stages.
    is_whole: bool,
}

impl<T: Pipeline> Reconstructor<T> {
    /// A plan for clouds that lie on `grid`, at least 2 cells off its walls, but for [outliers](crate::Outliers).
    ///
    /// # Errors
    /// [`Error::Memory`] for a grid that needs more memory than is [free](available_memory).
    /// [`Error::Smoothing`], [`Error::Screening`], [`Error::Surface`], [`Error::Trim`] and [`Error::Sheet`] for what is out of range. Other options are
    /// checked by the stages that use them.
    pub fn new(grid: Grid<T>, options: Options) -> Result<Self, Error> {
        check_memory(&grid)?;
        if !options.smoothing.is_valid() {
            return Err(Error::Smoothing(options.smoothing));
        }
        if !options.surface.is_valid() {
            return Err(Error::Surface(options.surface));
        }
        if !options.trim.is_valid() {
            return Err(Error::Trim(options.trim));
        }
        if !options.sheet.is_valid() {
            return Err(Error::Sheet(options.sheet));
        }
        if !(options.screening >= 0.0) || !options.screening.is_finite() {
            return Err(Error::Screening(options.screening));
        }
        Ok(Self {
            result: Reconstruction::empty(grid, options),
            scratch: Scratch::default(),
            is_whole: false,
        })
    }

    /// The grid of φ.
    pub fn grid(&self) -> &Grid<T> {
        self.result.sdf.grid()
    }

    /// The options of the plan.
    pub fn options(&self) -> &Options {
        &self.result.options
    }

    /// Runs all stages on a cloud. The result stays in the plan, and the next call overwrites it:
    /// clone it, or [take it](Self::into_reconstruction), to keep it.
    ///
    /// # Errors
    /// The error of the stage that failed; the result of the previous call is then lost.
    pub fn reconstruct(&mut self, cloud: &PointCloud<T>) -> Result<&Reconstruction<T>, Error> {
        self.reconstruct_observed(cloud, &mut |_| ControlFlow::Continue(()))
    }

    /// Like [`reconstruct`](Self::reconstruct), calling `observer` before each stage; `Break` stops the work.
    ///
    /// # Errors
    /// As [`reconstruct`](Self::reconstruct), and [`Error::Interrupted`] if the observer returns `Break`.
    pub fn reconstruct_observed(
        &mut self,
        cloud: &PointCloud<T>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<&Reconstruction<T>, Error> {
        self.run_all(cloud, None, observer)
    }

    /// Runs all stages but the checks with the signs of the normals of `held`, a reconstruction of as many points, with its
    /// isolated samples, and with its resolution of the surface. This is the map that [`Reconstruction::pullback`]
    /// differentiates, for comparisons with finite differences.
    ///
    /// # Errors
    /// As [`reconstruct`](Self::reconstruct).
    pub fn reconstruct_held(
        &mut self,
        cloud: &PointCloud<T>,
        held: &Reconstruction<T>,
    ) -> Result<&Reconstruction<T>, Error> {
        self.run_all(cloud, Some(held), &mut |_| ControlFlow::Continue(()))
    }

    fn run_all(
        &mut self,
        cloud: &PointCloud<T>,
        held: Option<&Reconstruction<T>>,
        observer: &mut dyn FnMut(Stage) -> ControlFlow<()>,
    ) -> Result<&Reconstruction<T>, Error> {
        self.is_whole = false;
        let (cells, options) = (self.result.sdf.values().len(), &self.result.options);
        let is_lean = options.orient == orient::Method::Given && !options.residuals;
        memory::check_points::<T>(cloud.len(), self.result.points.len(), cells, is_lean)?;
        let mut used = self.result.select(cloud, held);
        for stage in Stage::ALL {
            if observer(stage).is_break() {
                return Err(Error::Interrupted(stage));
            }
            let start = Instant::now();
            let done = match stage {
                Stage::Normals => self.find_used(cloud, &mut used, held),
                stage => T::run(self, stage, used.as_ref().unwrap_or(cloud), held),
            };
            done.map_err(|error| self.result.selection.locate(error))?;
            if stage == Stage::Orient {
                // The result has its points, and later stages read nothing else of it.
                used = None;
            }
            if is_large(self.result.points.len()) {
                self.scratch.free(stage);
                self.result.free_residuals(stage);
            }
            let seconds = start.elapsed().as_secs_f64();
            self.result.report.seconds.set(stage, seconds);
        }
        self.result.expand(cloud);
        self.is_whole = held.is_none();
        Ok(&self.result)
    }

    /// The last result, without the plan.
    pub fn into_reconstruction(self) -> Reconstruction<T> {
        self.result
    }
}

/// Result of a plan: the field, the surface, the normals and the report, with the samples and the residuals of the
/// stages for the pullback.
#[derive(Clone)]
pub struct Reconstruction<T: Real> {
    options: Options,
    poisson: Arc<poisson::Plan<T>>,
    selection: Selection,
    /// Results for all samples, where some were left out: all others are for those that are used.
    all: Option<Box<selection::AllSamples<T>>>,
    points: Arc<Vec<[T; 3]>>,
    /// Normals of the cloud, with [`orient::Method::Given`].
    given: Arc<Vec<[T; 3]>>,
    sdf: Field<T>,
    /// With a sparse solve, that of the coarsest cells.
    indicator: Field<T>,
    /// The indicator of a sparse solve.
    sparse: Option<sparse::Sparse<T>>,
    iso_value: T,
    /// The indicator near the surface on cells half as large.
    refined: Option<BlockField<T>>,
    mesh: Mesh<T>,
    open: Option<Box<open::Open<T>>>,
    closest: Vec<u32>,
    areas: Vec<T>,
    orientation: orient::Orientation<T>,
    residuals: Residuals<T>,
    report: Report,
    pullback: pullback::Workspace<T>,
}

impl<T: Pipeline> Reconstruction<T> {
    fn empty(grid: Grid<T>, options: Options) -> Self {
        Self {
            options,
            poisson: Arc::new(T::poisson_plan(grid.shape())),
            selection: Selection::default(),
            all: None,
            refined: None,
            points: Arc::default(),
            given: Arc::default(),
            sdf: Field::zeros(grid),
            indicator: Field::zeros(grid),
            sparse: None,
            iso_value: T::zero(),
            mesh: Mesh::default(),
            open: None,
            closest: Vec::new(),
            areas: Vec::new(),
            orientation: orient::Orientation::default(),
            residuals: Residuals::default(),
            report: Report::default(),
            pullback: pullback::Workspace::default(),
        }
    }
}

impl<T: Real> Reconstruction<T> {
    /// Takes the samples of a cloud, for the stages to come.
    fn start(&mut self, cloud: &PointCloud<T>) {
        self.points = cloud.shared_points();
        self.given = match self.options.orient {
            orient::Method::Given => cloud.shared_normals(),
            _ => Arc::default(),
        };
        self.report = Report {
            points: self.selection.samples(),
            outliers: self.selection.left_out().to_vec(),
            warnings: self.selection.warning().into_iter().collect(),
            ..Report::default()
        };
    }

    /// Typical distance between samples: the root of the mean area where samples have areas.
    fn sample_spacing(&self) -> f64 {
        match self.options.area {
            true => splat::area::mean(&self.areas).0.sqrt(),
            false => self.residuals.neighborhoods.spacing().f64(),
        }
    }

    fn splat_samples(&self) -> splat::Samples<'_, T> {
        let (points, normals) = (&self.points, &self.orientation.normals);
        self.residuals
            .thickened
            .samples(points, normals, &self.areas)
    }

    /// The options of the plan.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The signed distance φ at every cell center, in the cloud's unit, negative inside.
    pub fn sdf(&self) -> &Field<T> {
        &self.sdf
    }

    /// The indicator χ at every cell center of [the surface's grid](SurfaceResolution): below the iso-value inside, above it outside, what the
    /// [local iso-value](crate::isosurface::local_level) takes off included. It has no unit; without area weights also no
    /// scale. With a [sparse](Solve) solve, it is the far part of χ on the coarsest cells: those near the surface are
    /// not given.
    pub fn indicator(&self) -> &Field<T> {
        &self.indicator
    }

    /// The grid that the surface was found on: that of the indicator, unless the solve was sparse.
    pub fn surface_grid(&self) -> &Grid<T> {
        self.chi().grid()
    }

    /// How the Poisson equation was solved: [`Solve::Dense`] or [`Solve::Sparse`].
    pub fn solve(&self) -> Solve {
        match self.sparse {
            Some(_) => Solve::Sparse,
            None => Solve::Dense,
        }
    }

    /// The level `c` of the surface `χ = c`.
    pub fn iso_value(&self) -> T {
        self.iso_value
    }

    /// For each cell, in C order, the face of [`closest_mesh`](Self::closest_mesh) closest to its center;
    /// [`NO_TRIANGLE`](crate::distance::NO_TRIANGLE) outside the band. Empty [without residuals](Options::residuals).
    pub fn closest(&self) -> &[u32] {
        &self.closest
    }

    /// `(N, 3)` the samples, in the order of the cloud.
    pub fn points(&self) -> &[[T; 3]] {
        self.all.as_ref().map_or(&self.points, |all| &all.points)
    }

    /// Indices of the [outliers](crate::Outliers) that were left out, ascending. Their normals, confidence, areas and gradients are 0.
    pub fn outliers(&self) -> &[u32] {
        self.selection.left_out()
    }

    /// `(N, 3)` outward unit normals of the samples, in their order.
    pub fn normals(&self) -> &[[T; 3]] {
        let used = &self.orientation.normals;
        self.all.as_ref().map_or(used, |all| &all.normals)
    }

    /// `(N,)` confidence in the sign of each normal, from 0 to 1.
    pub fn confidence(&self) -> &[T] {
        let used = &self.orientation.confidence;
        self.all.as_ref().map_or(used, |all| &all.confidence)
    }

    /// `(N,)` number of samples in the neighborhood of each, itself included.
    pub fn neighbor_counts(&self) -> &[u32] {
        let used = &self.residuals.neighborhoods.count;
        self.all.as_ref().map_or(used, |all| &all.counts)
    }

    /// `(N,)` number of samples in the neighborhood that each axis was found in; empty with given normals.
    pub(crate) fn axis_counts(&self) -> &[u32] {
        &self.residuals.normals.count
    }

    /// `(N,)` area of surface that each sample stands for, in unit length²; 1 without area weights.
    pub fn areas(&self) -> &[T] {
        self.all.as_ref().map_or(&self.areas, |all| &all.areas)
    }

    /// Numbers, times and warnings.
    pub fn report(&self) -> &Report {
        &self.report
    }
}
