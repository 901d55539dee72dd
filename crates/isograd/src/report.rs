//! Report of a reconstruction: numbers, times and warnings.

mod json;
mod verdict;
mod warning;

use crate::differential::{Eikonal, EikonalOptions, eikonal};
use crate::isosurface::Level;
use crate::isosurface::measure::Measures;
use crate::orient::doubt::{Doubt, Region};
use crate::{Field, Real, parallel};

pub use json::JsonReport;
pub(crate) use verdict::TOLERATED_SHARE;
pub use verdict::Verdict;
pub use warning::Warning;

/// The parts of a reconstruction, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Neighbors, D-PCA normals and area weights.
    Normals,
    /// The sign of each normal.
    Orient,
    /// The right-hand side of the Poisson equation.
    Splat,
    /// The Poisson solve and the iso-value.
    Poisson,
    /// Marching cubes.
    Isosurface,
    /// The exact distance.
    Distance,
    /// Measures and warnings.
    Checks,
}

impl Stage {
    /// Every stage, in order.
    pub const ALL: [Self; 7] = [
        Self::Normals,
        Self::Orient,
        Self::Splat,
        Self::Poisson,
        Self::Isosurface,
        Self::Distance,
        Self::Checks,
    ];

    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normals => "normals",
            Self::Orient => "orient",
            Self::Splat => "splat",
            Self::Poisson => "poisson",
            Self::Isosurface => "isosurface",
            Self::Distance => "distance",
            Self::Checks => "checks",
        }
    }
}

/// Wall-clock seconds of each stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds([f64; Stage::ALL.len()]);

impl Seconds {
    /// Seconds that a stage took.
    pub fn of(&self, stage: Stage) -> f64 {
        self.0[stage as usize]
    }

    /// Sum over all stages.
    pub fn total(&self) -> f64 {
        self.0.iter().sum()
    }

    /// Notes how long a stage took.
    pub fn set(&mut self, stage: Stage, seconds: f64) {
        self.0[stage as usize] = seconds;
    }
}

/// Numbers about one reconstruction. Lengths are in the cloud's unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Number of points.
    pub points: usize,
    /// Indices of the samples that were left out as outliers.
    pub outliers: Vec<u32>,
    /// The common neighborhood radius `R`.
    pub radius: f64,
    /// Typical distance between neighboring samples.
    pub sample_spacing: f64,
    /// Least, median and greatest number of neighbors of a point, itself included.
    pub neighbors: [u32; 3],
    /// Points whose normal is not well defined (equal eigenvalues): its derivative is bounded by a guard.
    pub guarded: usize,
    /// Cell size of the grid of the surface.
    pub surface_spacing: f64,
    /// Number of cells of that grid at which the indicator was computed: all, or with a sparse solve those near the
    /// surface.
    pub surface_cells: usize,
    /// Width of the smoothing of the indicator, in cells of that grid.
    pub smoothing: f64,
    /// Name of the way the signs were found.
    pub orientation: &'static str,
    /// Axes whose sign was changed.
    pub flipped: usize,
    /// 5th percentile of the confidence in the signs.
    pub confidence_p05: f64,
    /// Median of the confidence in the signs.
    pub confidence_median: f64,
    /// How many signs are doubtful, and why.
    pub doubt: Doubt,
    /// Regions of doubtful samples, largest first.
    pub doubtful_regions: Vec<Region>,
    /// Condition of the indicator at the walls of the grid: `free` or `closed`.
    pub walls: &'static str,
    /// How the level of the surface was chosen.
    pub level: Level,
    /// The level `c` of the surface `χ = c`.
    pub iso_value: f64,
    /// Distance of the trim, and number of faces that it removed.
    pub trim: Option<(f64, usize)>,
    /// Measures of the mesh.
    pub surface: Measures,
    /// Share of the surface, from 0 to 1, that is a guess: further from all samples than 2 cells of φ, than 4 times the
    /// typical distance between samples, and than 2.5 times that around the nearest one. Of several pieces, the largest share
    /// of one of them.
    pub guessed: f64,
    /// Least φ.
    pub sdf_min: f64,
    /// Greatest φ.
    pub sdf_max: f64,
    /// Statistics of `|∇φ|`, over all cells and near the surface.
    pub eikonal: Eikonal,
    /// Wall-clock seconds.
    pub seconds: Seconds,
    /// Whether the result was measured; without that there may be warnings, but no good verdict.
    pub checked: bool,
    /// Reasons not to trust the result.
    pub warnings: Vec<Warning>,
}

impl Report {
    pub(crate) fn measure_samples<T: Real>(&mut self, counts: &[u32], confidence: &[T]) {
        let mut counts = counts.to_vec();
        counts.sort_unstable();
        self.neighbors = [0.0, 0.5, 1.0].map(|q| quantile(&counts, q).unwrap_or(0));
        let mut confidence: Vec<f64> = confidence.iter().map(|c| c.f64()).collect();
        confidence.sort_unstable_by(f64::total_cmp);
        self.confidence_p05 = quantile(&confidence, 0.05).unwrap_or(0.0);
        self.confidence_median = quantile(&confidence, 0.5).unwrap_or(0.0);
    }

    pub(crate) fn measure_field<T: Real>(&mut self, sdf: &Field<T>) {
        [self.sdf_min, self.sdf_max] = parallel::range(sdf.values()).map(T::f64);
        self.eikonal = eikonal(sdf, &EikonalOptions::default());
    }
}

/// The value at the fraction `q` of a sorted list, by nearest rank.
fn quantile<V: Copy>(sorted: &[V], q: f64) -> Option<V> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((q * last as f64).round() as usize).copied()
}
