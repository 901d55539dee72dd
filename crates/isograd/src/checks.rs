//! Reasons not to trust a reconstruction, looked for in its own results.
//!
//! Each check names what it measures, so that a warning can be understood and argued with. None of them
//! changes a result.

use rayon::prelude::*;

use crate::orient::doubt::Doubt;
use crate::report::Warning;
use crate::{Field, Real, vector};

/// Share of the samples below which thin parts, missed samples and doubtful signs go without a warning.
const TOLERATED_SHARE: f64 = 0.01;
/// Samples further apart than this many cells leave holes between the supports of their splats.
const SPARSE_CELLS: f64 = 1.25;
/// Depth below a sample at which its own side must still be the nearest, in cells.
const THIN_DEPTH: f64 = 2.0;

/// Samples on parts thinner than about three cells, and samples off the surface.
///
/// At [`THIN_DEPTH`] cells below a sample on a thick part, φ still grows toward that sample. On a part
/// thinner than about three cells the opposite side is nearer there, and the gradient has turned round.
pub(crate) fn thin_and_missed<T: Real>(
    points: &[[T; 3]],
    normals: &[[T; 3]],
    sdf: &Field<T>,
) -> Vec<Warning> {
    let h = sdf.grid().spacing();
    let depth = T::of(THIN_DEPTH) * h;
    let looks: Vec<[bool; 2]> = points
        .par_iter()
        .zip(normals)
        .map(|(&x, &n)| {
            let below = vector::sub(x, vector::scale(n, depth));
            let (_, gradient) = sdf.interpolate_with_gradient(below);
            let thin = vector::dot(gradient, n) < T::of(-0.5);
            [thin, !(sdf.interpolate(x).abs() <= h)]
        })
        .collect();
    let share = |what: usize| {
        looks.iter().filter(|look| look[what]).count() as f64 / points.len().max(1) as f64
    };
    let mut warnings = Vec::new();
    if share(0) > TOLERATED_SHARE {
        warnings.push(Warning::Thin { share: share(0) });
    }
    if share(1) > TOLERATED_SHARE {
        warnings.push(Warning::Missed { share: share(1) });
    }
    warnings
}

/// Samples further apart than the grid resolves.
pub(crate) fn sparse(sample_spacing: f64, spacing: f64) -> Option<Warning> {
    (sample_spacing > SPARSE_CELLS * spacing).then_some(Warning::Sparse {
        sample_spacing,
        spacing,
    })
}

/// Signs that are little more than a guess.
pub(crate) fn doubtful_signs(doubt: Doubt) -> Option<Warning> {
    (doubt.share() > TOLERATED_SHARE).then_some(Warning::DoubtfulSigns { doubt })
}

/// More than one piece of surface.
pub(crate) fn components(count: usize) -> Option<Warning> {
    (count > 1).then_some(Warning::Components { count })
}

/// Samples whose neighbors define no normal.
pub(crate) fn guarded(samples: usize, points: usize) -> Option<Warning> {
    (samples as f64 > TOLERATED_SHARE * points as f64).then_some(Warning::Guarded { samples })
}

/// Coordinates whose rounding is visible in cells.
pub(crate) fn rounded<T: Real>(points: &[[T; 3]], spacing: T) -> Option<Warning> {
    let largest = points
        .iter()
        .flatten()
        .fold(T::zero(), |m, c| m.max(c.abs()));
    let cells = (largest * T::epsilon() / spacing).f64();
    (cells > 1e-2).then_some(Warning::Rounded { cells })
}

/// A surface that ends at rims.
pub(crate) fn open(rims: &[bool]) -> Option<Warning> {
    let samples = rims.iter().filter(|&&at_rim| at_rim).count();
    // A hole across a fifteenth of the square root of the area has a rim of this many samples; what is
    // shorter is a gap in the sampling, or the tip of a fin whose two sides were taken for one.
    let least = 24.max((0.2 * (rims.len() as f64).sqrt()) as usize);
    (samples >= least).then_some(Warning::Open { samples })
}
