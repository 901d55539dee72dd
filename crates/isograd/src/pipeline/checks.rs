//! Measurements of a reconstruction, and warnings that follow from them. None of them changes a result.

use crate::data::Mesh;
use crate::distance::samples::{self, Counts, Samples};
use crate::isosurface::measure::pieces::Pieces;
use crate::isosurface::measure::{self, Measures};
use crate::isosurface::trim::{Nearby, Trim};
use crate::neighbors::Neighborhoods;
use crate::orient::Orientation;
use crate::orient::doubt::{self, Doubt, Region};
use crate::orient::rim;
use crate::report::{Report, TOLERATED_SHARE, Warning};
use crate::{Field, Real, distance, parallel, vector};

use super::stray::stray;

/// Samples further apart than this many cells of the surface leave holes between the supports of their splats.
const SPARSE_CELLS: f64 = 1.25;
/// Depth below a sample at which its own side must still be the nearest, in cells.
const THIN_DEPTH: f64 = 2.0;
/// Distance between a sample and the surface beyond which they are far from each other, in cells of φ.
const FAR: f64 = 2.0;
/// Share of the samples in the same place as others from which on they are named.
const MANY_COPIES: f64 = 0.1;

impl Report {
    /// Measures φ and the surface and adds warnings about them, for results that were not made by a
    /// [`Reconstructor`](crate::Reconstructor). `normals` are the outward ones of the points;
    /// [`Report::sample_spacing`] and [`Report::surface_spacing`] must be set. `built` are the scratch buffers of the
    /// distance to `mesh`, whose tree is then not built again.
    pub fn check_field<T: Real>(
        &mut self,
        [points, normals]: [&[[T; 3]]; 2],
        neighborhoods: &Neighborhoods<T>,
        sdf: &Field<T>,
        mesh: &Mesh<T>,
        scratch: &mut measure::Scratch,
        built: Option<&distance::Scratch<T>>,
    ) {
        self.measure_field(sdf);
        self.surface = measure::measure(mesh, scratch);
        let samples = self.samples(points, normals, sdf);
        let counts = self.count(samples, sdf, mesh, built);
        let several = self.surface.components > 1;
        let pieces = several.then(|| Pieces::new(mesh, scratch));
        self.guessed = self.unsampled(mesh, neighborhoods, sdf.grid().spacing(), pieces.as_ref());
        let (warnings, spacing) = (&mut self.warnings, self.surface_spacing);
        warnings.extend(turned(counts.turned, points.len()));
        warnings.extend(thin(counts.thin, points.len()));
        warnings.extend(missed(counts, points.len()));
        warnings.extend(sparse(self.sample_spacing, spacing));
        warnings.extend(inside_out(&self.surface));
        if let Some(pieces) = &pieces {
            warnings.extend(fragments(pieces, mesh, points, built));
        }
        warnings.extend(rounded(points, spacing));
    }

    /// Measures φ of a sheet, whose middle is `mesh`, and adds warnings about them; else like [`Self::check_field`].
    pub(crate) fn check_sheet<T: Real>(
        &mut self,
        points: &[[T; 3]],
        normals: &[[T; 3]],
        sdf: &Field<T>,
        mesh: &Mesh<T>,
        built: &distance::Scratch<T>,
    ) {
        self.measure_field(sdf);
        let samples = self.samples(points, normals, sdf);
        let counts = samples::count(mesh, Some(built), samples).unwrap_or_default();
        self.warnings.extend(missed(counts, points.len()));
        self.warnings.extend(rounded(points, self.surface_spacing));
    }

    fn samples<'a, T: Real>(
        &self,
        points: &'a [[T; 3]],
        normals: &'a [[T; 3]],
        sdf: &Field<T>,
    ) -> Samples<'a, T> {
        let spacing = T::of(self.surface_spacing);
        Samples {
            points,
            normals,
            within: spacing,
            far: T::of(FAR) * sdf.grid().spacing(),
            depth: T::of(THIN_DEPTH) * spacing,
        }
    }

    /// Samples on parts thinner than about three cells of the surface, and samples off the surface.
    ///
    /// At [`THIN_DEPTH`] cells below a sample on a thick part, φ still grows toward that sample. On a part
    /// thinner than about three cells the opposite side is nearer there, and the gradient has turned round.
    fn count<T: Real>(
        &self,
        samples: Samples<'_, T>,
        sdf: &Field<T>,
        mesh: &Mesh<T>,
        built: Option<&distance::Scratch<T>>,
    ) -> Counts {
        // The grid of φ may be too coarse to see parts of this size, and its band too narrow.
        let is_wide = samples.far.f64() < self.sdf_max;
        if is_wide && sdf.grid().spacing() == samples.within {
            return interpolated(samples, sdf);
        }
        samples::count(mesh, built, samples).unwrap_or_default()
    }

    /// [The share of the surface](Self::guessed) that has no samples nearby, of the piece where it is largest; crumbs don't
    /// count. `spacing` is the cell size of φ.
    fn unsampled<T: Real>(
        &self,
        mesh: &Mesh<T>,
        neighborhoods: &Neighborhoods<T>,
        spacing: T,
        pieces: Option<&Pieces>,
    ) -> f64 {
        let between = Trim::Auto.distance(self.sample_spacing).unwrap_or(0.0);
        let nearby = Nearby {
            neighborhoods,
            distance: between.max(FAR * spacing.f64()),
            is_local: true,
        };
        let shares = nearby.far_shares(mesh, pieces).into_iter();
        let are_large = pieces.map_or_else(|| vec![true], Pieces::are_large);
        let shares = shares.zip(are_large).filter(|&(_, is_large)| is_large);
        shares.map(|(share, _)| share).fold(0.0, f64::max)
    }

    /// Measures the samples and their normals and adds warnings about them. `neighborhoods` are those of the points;
    /// [`Report::guarded`] must be set. A [sheet](crate::sheet) may end at rims.
    pub fn check_samples<T: Real>(
        &mut self,
        points: &[[T; 3]],
        neighborhoods: &Neighborhoods<T>,
        orientation: &Orientation<T>,
        is_sheet: bool,
    ) {
        self.checked = true;
        self.measure_samples(&neighborhoods.count, &orientation.confidence);
        let rims = rim::rims(points, &orientation.normals, neighborhoods);
        let reasons = doubt::reasons_beside(&rims, points, orientation, neighborhoods);
        self.doubt = Doubt::count(points.len(), &reasons);
        self.doubtful_regions = doubt::regions(points, &reasons, neighborhoods);
        let warnings = &mut self.warnings;
        if !is_sheet {
            warnings.extend(open(&rims, self.guessed));
            warnings.extend(doubtful_signs(self.doubt, self.doubtful_regions.first()));
        }
        warnings.extend(guarded(self.guarded, points.len()));
        warnings.extend(stray(neighborhoods));
        if !warnings.is_empty() {
            warnings.extend(duplicates(neighborhoods));
        }
    }
}

/// Counts by φ between its cells.
fn interpolated<T: Real>(samples: Samples<'_, T>, sdf: &Field<T>) -> Counts {
    let count = |i: usize| {
        let (x, n) = (samples.points[i], samples.normals[i]);
        let below = vector::sub(x, vector::scale(n, samples.depth));
        let (distance, at) = sdf.interpolate_with_gradient(x);
        let below = sdf.interpolate_with_gradient(below).1;
        samples.judged(n, distance.abs(), [at, below])
    };
    parallel::reduce(samples.points.len(), Counts::default(), count, Counts::add)
}

/// `count` of `all` as a share, from 0 to 1.
fn share(count: usize, all: usize) -> f64 {
    count as f64 / all.max(1) as f64
}

/// Samples on thin parts.
fn thin(count: usize, points: usize) -> Option<Warning> {
    let share = share(count, points);
    (share > TOLERATED_SHARE).then_some(Warning::Thin { share })
}

/// Samples whose normals are against the surface.
fn turned(count: usize, points: usize) -> Option<Warning> {
    let share = share(count, points);
    (share > TOLERATED_SHARE).then_some(Warning::Turned { share })
}

/// Samples off the surface.
fn missed(counts: Counts, points: usize) -> Option<Warning> {
    let [share, far] = [counts.missed, counts.far].map(|count| share(count, points));
    (share.max(far) > TOLERATED_SHARE).then_some(Warning::Missed { share, far })
}

/// Samples further apart than the surface's cells resolve.
fn sparse(sample_spacing: f64, spacing: f64) -> Option<Warning> {
    (sample_spacing > SPARSE_CELLS * spacing).then_some(Warning::Sparse {
        sample_spacing,
        spacing,
    })
}

/// Samples in the same place as others.
fn duplicates<T: Real>(neighborhoods: &Neighborhoods<T>) -> Option<Warning> {
    let samples = neighborhoods.index.duplicates();
    let share = share(samples, neighborhoods.index.len());
    (share > MANY_COPIES).then_some(Warning::Duplicates { samples })
}

/// Signs that are little more than a guess.
fn doubtful_signs(doubt: Doubt, largest: Option<&Region>) -> Option<Warning> {
    (doubt.share() > TOLERATED_SHARE).then_some(Warning::DoubtfulSigns {
        doubt,
        largest: largest.copied(),
    })
}

/// A closed surface of negative volume.
fn inside_out(surface: &Measures) -> Option<Warning> {
    let volume = surface.volume;
    (surface.closed && volume < 0.0).then_some(Warning::InsideOut { volume })
}

/// Pieces of the surface that are small, or have no samples.
fn fragments<T: Real>(
    pieces: &Pieces,
    mesh: &Mesh<T>,
    points: &[[T; 3]],
    built: Option<&distance::Scratch<T>>,
) -> Option<Warning> {
    let faces = samples::nearest_faces(mesh, built, points).ok()?;
    let mut samples = vec![0usize; pieces.areas.len()];
    for face in faces {
        if let Some(&piece) = pieces.of_face.get(face as usize) {
            samples[piece as usize] += 1;
        }
    }
    let (pieces, are_large) = (samples.len(), pieces.are_large());
    let is_fragment = |&(&samples, is_large): &(&usize, bool)| samples == 0 || !is_large;
    let fragments = samples.iter().zip(are_large).filter(is_fragment).count();
    (fragments > 0).then_some(Warning::Fragments { fragments, pieces })
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

/// A surface that ends at rims, or that is a guess where samples are missing.
fn open(rims: &[bool], guessed: f64) -> Option<Warning> {
    let samples = rims.iter().filter(|&&at_rim| at_rim).count();
    // A hole across a fifteenth of the square root of the area has a rim of this many samples; what is
    // shorter is a gap in the sampling, or the tip of a fin whose two sides were taken for one.
    let least = 24.max((0.2 * (rims.len() as f64).sqrt()) as usize);
    (samples >= least || guessed > TOLERATED_SHARE).then_some(Warning::Open { samples, guessed })
}
