//! Measurements of a reconstruction, and warnings that follow from them. None of them changes a result.

use rayon::prelude::*;

use crate::data::Mesh;
use crate::distance::samples::{self, Counts, Samples};
use crate::isosurface::measure;
use crate::neighbors::Neighborhoods;
use crate::orient::Orientation;
use crate::orient::doubt::{self, Doubt};
use crate::orient::rim;
use crate::report::{Report, Warning};
use crate::{Field, Real, distance, vector};

/// Share of the samples below which thin parts, missed samples and doubtful signs go without a warning.
const TOLERATED_SHARE: f64 = 0.01;
/// Samples further apart than this many cells leave holes between the supports of their splats.
const SPARSE_CELLS: f64 = 1.25;
/// Depth below a sample at which its own side must still be the nearest, in cells.
const THIN_DEPTH: f64 = 2.0;

impl Report {
    /// Measures φ and the surface and adds warnings about them, for results that were not made by a
    /// [`Reconstructor`](crate::Reconstructor). `normals` are the outward ones of the points;
    /// [`Report::sample_spacing`] and [`Report::surface_spacing`] must be set. `built` are the scratch buffers of the
    /// distance to `mesh`, whose tree is then not built again.
    pub fn check_field<T: Real>(
        &mut self,
        points: &[[T; 3]],
        normals: &[[T; 3]],
        sdf: &Field<T>,
        mesh: &Mesh<T>,
        scratch: &mut measure::Scratch,
        built: Option<&distance::Scratch<T>>,
    ) {
        self.measure_field(sdf);
        self.surface = measure::measure(mesh, scratch);
        let (warnings, spacing) = (&mut self.warnings, self.surface_spacing);
        let samples = Samples {
            points,
            normals,
            within: T::of(spacing),
            depth: T::of(THIN_DEPTH) * T::of(spacing),
        };
        warnings.extend(thin_and_missed(samples, sdf, mesh, built));
        warnings.extend(sparse(self.sample_spacing, sdf.grid().spacing().f64()));
        warnings.extend(components(self.surface.components));
        warnings.extend(rounded(points, spacing));
    }

    /// Measures the samples and their normals and adds warnings about them. `neighborhoods` are those of the points;
    /// [`Report::guarded`] must be set.
    pub fn check_samples<T: Real>(
        &mut self,
        points: &[[T; 3]],
        neighborhoods: &Neighborhoods<T>,
        orientation: &Orientation<T>,
    ) {
        self.measure_samples(&neighborhoods.count, &orientation.confidence);
        let rims = rim::rims(points, &orientation.normals, neighborhoods);
        let reasons = doubt::reasons_beside(&rims, points, orientation, neighborhoods);
        self.doubt = Doubt::count(points.len(), &reasons);
        let warnings = &mut self.warnings;
        warnings.extend(open(&rims));
        warnings.extend(doubtful_signs(self.doubt));
        warnings.extend(guarded(self.guarded, points.len()));
    }
}

/// Samples on parts thinner than about three cells of size `h`, those of the surface, and samples off the surface.
///
/// At [`THIN_DEPTH`] cells below a sample on a thick part, φ still grows toward that sample. On a part
/// thinner than about three cells the opposite side is nearer there, and the gradient has turned round.
fn thin_and_missed<T: Real>(
    samples: Samples<'_, T>,
    sdf: &Field<T>,
    mesh: &Mesh<T>,
    built: Option<&distance::Scratch<T>>,
) -> Vec<Warning> {
    let counts = if sdf.grid().spacing() == samples.within {
        interpolated(samples, sdf)
    } else {
        // The grid of φ is too coarse to see parts of this size.
        let Ok(counts) = samples::count(mesh, built, samples) else {
            return Vec::new();
        };
        counts
    };
    let share = |count: usize| count as f64 / samples.points.len().max(1) as f64;
    let (thin, missed) = (share(counts.thin), share(counts.missed));
    let mut warnings = Vec::new();
    if thin > TOLERATED_SHARE {
        warnings.push(Warning::Thin { share: thin });
    }
    if missed > TOLERATED_SHARE {
        warnings.push(Warning::Missed { share: missed });
    }
    warnings
}

/// Counts by φ between its cells.
fn interpolated<T: Real>(samples: Samples<'_, T>, sdf: &Field<T>) -> Counts {
    let count = |(&x, &n): (&[T; 3], &[T; 3])| {
        let below = vector::sub(x, vector::scale(n, samples.depth));
        let gradient = sdf.interpolate_with_gradient(below).1;
        let distance = sdf.interpolate(x);
        samples.judged(n, distance.abs(), gradient)
    };
    let pairs = samples.points.par_iter().zip(samples.normals);
    pairs.map(count).reduce(Counts::default, Counts::add)
}

/// Samples further apart than the grid resolves.
fn sparse(sample_spacing: f64, spacing: f64) -> Option<Warning> {
    (sample_spacing > SPARSE_CELLS * spacing).then_some(Warning::Sparse {
        sample_spacing,
        spacing,
    })
}

/// Signs that are little more than a guess.
fn doubtful_signs(doubt: Doubt) -> Option<Warning> {
    (doubt.share() > TOLERATED_SHARE).then_some(Warning::DoubtfulSigns { doubt })
}

/// More than one piece of surface.
fn components(count: usize) -> Option<Warning> {
    (count > 1).then_some(Warning::Components { count })
}

/// Samples whose neighbors define no normal.
fn guarded(samples: usize, points: usize) -> Option<Warning> {
    (samples as f64 > TOLERATED_SHARE * points as f64).then_some(Warning::Guarded { samples })
}

/// Coordinates whose rounding is visible in cells.
fn rounded<T: Real>(points: &[[T; 3]], spacing: f64) -> Option<Warning> {
    let largest = points
        .iter()
        .flatten()
        .fold(T::zero(), |m, c| m.max(c.abs()));
    let cells = (largest * T::epsilon()).f64() / spacing;
    (cells > 1e-2).then_some(Warning::Rounded { cells })
}

/// A surface that ends at rims.
fn open(rims: &[bool]) -> Option<Warning> {
    let samples = rims.iter().filter(|&&at_rim| at_rim).count();
    // A hole across a fifteenth of the square root of the area has a rim of this many samples; what is
    // shorter is a gap in the sampling, or the tip of a fin whose two sides were taken for one.
    let least = 24.max((0.2 * (rims.len() as f64).sqrt()) as usize);
    (samples >= least).then_some(Warning::Open { samples })
}
