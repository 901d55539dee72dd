//! What a reconstruction says about itself: numbers, times and warnings.

mod json;

use std::fmt;

use rayon::prelude::*;

use crate::differential::{Eikonal, EikonalOptions, eikonal};
use crate::isosurface::measure::Measures;
use crate::orient::doubt::{Doubt, Reason};
use crate::{Field, Real};

pub use json::JsonReport;

/// A reason is named where it stands for one in this many of the doubtful samples.
const SMALLEST_REASON: usize = 10;

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
    /// Condition of the indicator at the walls of the grid: `free` or `closed`.
    pub walls: &'static str,
    /// The level `c` of the surface `χ = c`.
    pub iso_value: f64,
    /// Distance of the trim, and number of faces that it removed.
    pub trim: Option<(f64, usize)>,
    /// Measures of the mesh.
    pub surface: Measures,
    /// Least φ.
    pub sdf_min: f64,
    /// Greatest φ.
    pub sdf_max: f64,
    /// Statistics of `|∇φ|`, over all cells and near the surface.
    pub eikonal: Eikonal,
    /// Wall-clock seconds.
    pub seconds: Seconds,
    /// What a user should know before trusting the result.
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
        let ends = sdf.values().par_iter().fold(
            || (T::infinity(), T::neg_infinity()),
            |(low, high), &v| (low.min(v), high.max(v)),
        );
        let none = || (T::infinity(), T::neg_infinity());
        let (low, high) = ends.reduce(none, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        (self.sdf_min, self.sdf_max) = (low.f64(), high.f64());
        self.eikonal = eikonal(sdf, &EikonalOptions::default());
    }
}

/// The value at the fraction `q` of a sorted list, by nearest rank.
fn quantile<V: Copy>(sorted: &[V], q: f64) -> Option<V> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((q * last as f64).round() as usize).copied()
}

/// What a user should know before trusting the result. A warning is not an error: all outputs are there.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// Samples were left out: they are isolated, and further from the others than these extend.
    Outliers {
        /// Number of such samples.
        samples: usize,
    },
    /// Parts of the body are thinner than three cells.
    Thin {
        /// Share of the samples that lie on such parts, from 0 to 1.
        share: f64,
    },
    /// Samples are further apart than the cells are wide.
    Sparse {
        /// Typical distance between samples.
        sample_spacing: f64,
        /// Cell size.
        spacing: f64,
    },
    /// The samples end at a rim: they do not enclose a volume.
    Open {
        /// Number of samples along rims.
        samples: usize,
    },
    /// The surface reaches the wall of the grid.
    TouchesWall,
    /// A sheet is thinner than two cells of the surface: its shell may have holes.
    ThinSheet {
        /// Thickness, in cells.
        cells: f64,
    },
    /// The surface has several pieces.
    Components {
        /// Number of pieces.
        count: usize,
    },
    /// Samples lie off the surface.
    Missed {
        /// Share of the samples further than one cell from the surface, from 0 to 1.
        share: f64,
    },
    /// The sign of many normals is a guess.
    DoubtfulSigns {
        /// How many, and why.
        doubt: Doubt,
    },
    /// Normals are not defined by their neighbors.
    Guarded {
        /// Number of such samples.
        samples: usize,
    },
    /// Coordinates are so large that the number type rounds them visibly.
    Rounded {
        /// Distance between neighboring numbers of the type, in cells.
        cells: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outliers { samples } => write!(
                f,
                "{samples} samples were left out as outliers: they are isolated and further from the others than these extend; the option outliers 'keep' keeps them"
            ),
            Self::Thin { share } => write!(
                f,
                "{} of the samples lie on parts thinner than 3 cells; use a finer grid if these parts matter",
                percent(*share)
            ),
            Self::Sparse {
                sample_spacing,
                spacing,
            } => write!(
                f,
                "samples are {:.1} cells apart (spacing {sample_spacing:.3e}, cells {spacing:.3e}); use a coarser grid or more samples",
                sample_spacing / spacing
            ),
            Self::Open { samples } => write!(
                f,
                "the surface is open: {samples} samples lie along rims or holes; the gaps are closed by guess and the sign near them can't be trusted"
            ),
            Self::TouchesWall => write!(
                f,
                "the surface reaches the wall of the grid and is cut off there; use larger bounds or padding, or the option walls 'closed'"
            ),
            Self::ThinSheet { cells } => write!(
                f,
                "the sheet is {cells:.2} cells of the surface thick and its shell may have holes; φ is exact: use a thicker sheet or a finer surface"
            ),
            Self::Components { count } => {
                write!(f, "the surface has {count} separate pieces")
            }
            Self::Missed { share } => write!(
                f,
                "{} of the samples lie more than one cell from the surface (parts thinner than a cell, which the level 'thin' finds; outliers or wrong normals)",
                percent(*share)
            ),
            Self::DoubtfulSigns { doubt } => f.write_str(&doubtful_signs(doubt)),
            Self::Guarded { samples } => write!(
                f,
                "{samples} samples have no well-defined normal (a corner, a line or an isolated point)"
            ),
            Self::Rounded { cells } => write!(
                f,
                "coordinates are rounded to {cells:.1e} cells by the number type; use f64 or move the cloud toward the origin"
            ),
        }
    }
}

/// What there is to say about doubtful signs: how many, why, and what helps against the main reasons.
fn doubtful_signs(doubt: &Doubt) -> String {
    let mut text = format!(
        "the side of the surface is doubtful for {} of the samples",
        percent(doubt.share())
    );
    let mut named = doubt.by_frequency();
    named.retain(|&reason| doubt.of(reason) * SMALLEST_REASON >= doubt.doubtful());
    for (k, &reason) in named.iter().enumerate() {
        let lead = if k == 0 { ":" } else { "," };
        text += &format!(
            "{lead} {} {}",
            percent(doubt.share_of(reason)),
            cause(reason)
        );
    }
    let main = named.first().copied().unwrap_or(Reason::Unexplained);
    text + &format!("; {}", remedy(main))
}

/// Why samples are doubtful.
fn cause(reason: Reason) -> &'static str {
    match reason {
        Reason::Thin => "lie on sheets less than about 3 samples apart",
        Reason::Sparse => "are far from all others",
        Reason::Open => "lie at a rim or hole, or on an open surface",
        Reason::Noisy => "scatter about the surface",
        Reason::Unexplained => "for no plain reason",
    }
}

/// What helps; how to give more is the same for all.
fn remedy(reason: Reason) -> &'static str {
    match reason {
        Reason::Thin => "sample more densely there, or give sensor positions or normals",
        Reason::Sparse => {
            "sample more densely there or remove outliers, or give sensor positions or normals"
        }
        Reason::Open => "close the gaps, or give sensor positions or normals",
        Reason::Noisy => "remove noise, or give sensor positions or normals",
        Reason::Unexplained => {
            "give sensor positions or normals, or look at the confidence in the output"
        }
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}
