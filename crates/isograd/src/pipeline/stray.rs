//! Samples that lie apart from the surface and from one another, as those of a scan in mid-air do.
//!
//! Each stands for as much area as it has room, so a few of them outweigh the surface. A part of the surface with few samples has as
//! much room round each; but there they lie in a plane and are near to one another, and outliers fill a volume or have only the
//! surface near them.

use crate::element::eigen;
use crate::neighbors::Neighborhoods;
use crate::report::{TOLERATED_SHARE, Warning};
use crate::{Real, parallel, splat, vector};

/// Radius of a neighborhood, in the distance between samples, from which a sample lies apart; usual are 2.8.
const APART: f64 = 5.5;
/// Nearest samples, besides the sample itself, that show whether it lies in a plane.
const NEAREST: usize = 24;
/// Quotient `λ₁/λ₂` of their covariance from which they fill a volume.
const FILLED: f64 = 0.3;
/// Share of the samples apart that must be isolated or in filled volumes; at borders and corners of sparse parts some are, too.
const MOST: f64 = 0.5;
/// Share of the area up to which they do not matter.
const TOLERATED: f64 = 0.1 * TOLERATED_SHARE;

/// The warning about samples that lie apart, if there are any that are no part of a surface.
pub(super) fn stray<T: Real>(
    points: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
) -> Option<Warning> {
    let radius = &neighborhoods.radius;
    let least = (T::of(APART) * neighborhoods.spacing()).max(neighborhoods.common_radius);
    let is_apart = |i: usize| radius[i] > least;
    let apart = parallel::flat_map(points.len(), |i| is_apart(i).then_some(i));
    let is_off = |i: usize| neighborhoods.isolated[i] || fills_a_volume(points, neighborhoods, i);
    let [off] = parallel::sum_array(apart.len(), |k| [f64::from(u8::from(is_off(apart[k])))]);
    if apart.is_empty() || off < MOST * apart.len() as f64 {
        return None;
    }
    let [of_apart, all] = parallel::sum_array(points.len(), |i| {
        let area = splat::area::at(neighborhoods, i).f64();
        [if is_apart(i) { area } else { 0.0 }, area]
    });
    let (samples, share) = (apart.len(), of_apart / all);
    (share > TOLERATED).then_some(Warning::Stray { samples, share })
}

/// Whether the samples nearest to one fill a volume.
fn fills_a_volume<T: Real>(points: &[[T; 3]], neighborhoods: &Neighborhoods<T>, i: usize) -> bool {
    let mut nearest = Vec::with_capacity(NEAREST + 1);
    (neighborhoods.index).nearest(points[i], NEAREST + 1, &mut nearest);
    let offset = |j: u32| vector::to_f64(vector::sub(points[j as usize], points[i]));
    let offsets: Vec<[f64; 3]> = nearest.iter().map(|&(j, _)| offset(j)).collect();
    let per_sample = 1.0 / offsets.len() as f64;
    let mean = offsets.iter().fold([0.0; 3], |sum, &d| vector::add(sum, d));
    let mean = vector::scale(mean, per_sample);
    let mut covariance = [0.0; 6];
    for offset in offsets {
        let [x, y, z] = vector::sub(offset, mean);
        for (sum, product) in
            (covariance.iter_mut()).zip([x * x, x * y, x * z, y * y, y * z, z * z])
        {
            *sum += product;
        }
    }
    let [first, second, _]: [f64; 3] = eigen::eigen(covariance.into()).values.into();
    first > FILLED * second
}
