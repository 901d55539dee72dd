//! Reasons not to trust a reconstruction, looked for in its own results.
//!
//! Each check names what it measures, so that a warning can be understood and argued with. None of them
//! changes a result.

use pulp::Arch;
use rayon::prelude::*;

use crate::neighbors::{Candidates, LANES, Neighborhoods};
use crate::report::Warning;
use crate::simd::dispatch;
use crate::{Field, Real, vector};

/// Share of the samples below which thin parts, missed samples and doubtful signs go without a warning.
const TOLERATED_SHARE: f64 = 0.01;
/// Samples further apart than this many cells leave holes between the supports of their splats.
const SPARSE_CELLS: f64 = 1.25;
/// A sign with less confidence than this is doubtful.
const DOUBTFUL_CONFIDENCE: f64 = 0.5;
/// A sample whose neighbours lie this far to one side, in radii, may be at a rim. Half a disc, which is
/// what a sample on the edge of a sheet sees, has its weighted centroid at 0.32 radii.
const RIM_OFFSET: f64 = 0.15;
/// It is at a rim where the neighbours leave out a sector of the tangent plane of at least this many
/// radians (135°; it is 180° on a straight rim). Of 24 random neighbours, one sample in 2,000 sees that.
const RIM_GAP: f64 = 0.75 * std::f64::consts::PI;
/// Mean normal of the neighbours of a rim sample: near 1 on a sheet, small on the edge of a solid.
const RIM_FLATNESS: f64 = 0.9;
/// A rim is a line of samples: this many neighbours are at a rim too.
const RIM_NEIGHBORS: usize = 3;
/// Depth below a sample at which its own side must still be the nearest, in cells.
const THIN_DEPTH: f64 = 2.0;

/// Samples on parts thinner than about three cells, and samples off the surface.
///
/// At [`THIN_DEPTH`] cells below a sample on a thick part, φ still grows towards that sample. On a part
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
pub(crate) fn sparse<T: Real>(sample_spacing: T, spacing: T) -> Option<Warning> {
    (sample_spacing > T::of(SPARSE_CELLS) * spacing).then(|| Warning::Sparse {
        sample_spacing: sample_spacing.f64(),
        spacing: spacing.f64(),
    })
}

/// Signs that are little more than a guess.
pub(crate) fn doubtful_signs<T: Real>(confidence: &[T]) -> Option<Warning> {
    let doubtful = confidence
        .iter()
        .filter(|c| !(**c >= T::of(DOUBTFUL_CONFIDENCE)))
        .count();
    let share = doubtful as f64 / confidence.len().max(1) as f64;
    (share > TOLERATED_SHARE).then_some(Warning::DoubtfulSigns { share })
}

/// More than one piece of surface.
pub(crate) fn components(count: usize) -> Option<Warning> {
    (count > 1).then_some(Warning::Components { count })
}

/// Samples whose neighbours define no normal.
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

/// Samples along the rims of an open surface.
///
/// Such a sample sees its neighbours on one side only, and they all face the same way. A sharp edge of a
/// solid looks the same but for the last part: there the two sides face different ways. Stray samples
/// look like rims now and then, but not several side by side.
pub(crate) fn open<T: Real>(
    points: &[[T; 3]],
    normals: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
) -> Option<Warning> {
    let mut one_sided = vec![false; points.len()];
    let arch = Arch::new();
    neighborhoods.for_each_neighborhood(&mut one_sided, &|center, radius, candidates| {
        let offset = dispatch(
            arch,
            #[inline(always)]
            || offset(center, radius, candidates),
        );
        offset > T::of(RIM_OFFSET)
    });
    let at_rim: Vec<bool> = neighborhoods
        .position()
        .par_iter()
        .enumerate()
        .map_init(Vec::new, |directions, (i, &position)| {
            one_sided[position as usize]
                && borders_a_gap(i, points, normals, neighborhoods, directions)
        })
        .collect();
    let samples = (0..points.len())
        .into_par_iter()
        .filter(|&i| at_rim[i] && rim_neighbors(i, points, &at_rim, neighborhoods) >= RIM_NEIGHBORS)
        .count();
    // A hole across a fifteenth of the square root of the area has a rim of this many samples; what is
    // shorter is a gap in the sampling, or the tip of a fin whose two sides were taken for one.
    let least = 24.max((0.2 * (points.len() as f64).sqrt()) as usize);
    (samples >= least).then_some(Warning::Open { samples })
}

/// Distance from a point to the centroid of its neighbours weighted by `1/r`, itself left out, in radii.
#[inline(always)]
fn offset<T: Real>(center: [T; 3], radius: T, candidates: &Candidates<T>) -> T {
    let mut sums = [[T::zero(); LANES]; 4];
    candidates.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            for l in 0..LANES {
                let [x, y, z] = [0, 1, 2].map(|a| lanes.point[a][l] - center[a]);
                let d2 = x * x + y * y + z * z;
                let counts = d2 <= lanes.limit[l] && d2 > T::zero();
                let weight = if counts {
                    T::one() / d2.sqrt()
                } else {
                    T::zero()
                };
                for (sum, term) in sums.iter_mut().zip([x, y, z, T::one()]) {
                    sum[l] += weight * term;
                }
            }
        },
    );
    let [x, y, z, weight] = sums.map(|sum| sum.into_iter().sum::<T>());
    vector::norm([x, y, z]) / (weight.max(T::min_positive_value()) * radius)
}

/// Whether the neighbours face the same way but leave out a wide sector of the tangent plane.
fn borders_a_gap<T: Real>(
    i: usize,
    points: &[[T; 3]],
    normals: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
    directions: &mut Vec<[T; 3]>,
) -> bool {
    let mut facing = T::zero();
    directions.clear();
    let index = &neighborhoods.index;
    index.for_each_within(points[i], neighborhoods.radius[i], |j, distance_squared| {
        facing += vector::dot(normals[i], normals[j]);
        if distance_squared > T::zero() {
            directions.push(vector::sub(points[j], points[i]));
        }
    });
    let flat = T::of(RIM_FLATNESS) * T::of_usize(directions.len() + 1);
    facing > flat && widest_gap(directions, normals[i]) > RIM_GAP
}

/// The widest sector of the plane across `normal` that no direction points into, in radians.
fn widest_gap<T: Real>(directions: &[[T; 3]], normal: [T; 3]) -> f64 {
    let turn = std::f64::consts::TAU;
    let least = (0..3).fold(0, |m, a| {
        if normal[a].abs() < normal[m].abs() {
            a
        } else {
            m
        }
    });
    let mut axis = [T::zero(); 3];
    axis[least] = T::one();
    let Some(first) = vector::normalized(vector::cross(normal, axis)) else {
        return 0.0;
    };
    let second = vector::cross(normal, first);
    let angle = |d: &[T; 3]| vector::dot(*d, second).atan2(vector::dot(*d, first)).f64();
    let mut angles: Vec<f64> = directions.iter().map(angle).collect();
    angles.sort_unstable_by(f64::total_cmp);
    let Some((&low, &high)) = angles.first().zip(angles.last()) else {
        return turn;
    };
    let between = angles.windows(2).map(|pair| pair[1] - pair[0]);
    between.fold(turn - (high - low), f64::max)
}

fn rim_neighbors<T: Real>(
    i: usize,
    points: &[[T; 3]],
    at_rim: &[bool],
    neighborhoods: &Neighborhoods<T>,
) -> usize {
    let mut count = 0;
    neighborhoods
        .index
        .for_each_within(points[i], neighborhoods.radius[i], |j, _| {
            count += usize::from(j != i && at_rim[j]);
        });
    count
}
