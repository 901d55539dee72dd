//! The sheet of surface that a sample lies on, where other sheets pass close by.
//!
//! At an edge, and where a body is thinner than a neighborhood is wide, neighbors lie on several sheets, and
//! the axis of all of them together is that of none. Planes through the sample and two neighbors are
//! tried; one that fits a good third of the neighbors far better than the others lie from it is the
//! sheet.
//!
//! Source: robust fits by least order statistics, after P. Rousseeuw, "Least median of squares
//! regression" (1984), over planes as in A. Boulch, R. Marlet, "Fast and robust normal estimation for
//! point clouds with sharp features" (2012), but over all pairs of near neighbors instead of random
//! ones.

use super::coupling::NEIGHBORS;
use super::lattice::Lattice;
use crate::element::eigen::eigen;
use crate::vector;

/// Nearest neighbors whose pairs span the planes that are tried.
const SPANNING: usize = 9;

/// Neighbors that a plane has to fit.
const QUORUM: usize = 6;

/// Rank of the neighbor that stands for those off the plane.
const REST: usize = (NEIGHBORS + QUORUM) / 2;

/// A plane is taken for a sheet where it fits its quorum this much better than the rest. Noise does not: of
/// all planes the best fits its quorum about 7 times better than the rest, seldom 20 times.
const RESOLVED: f32 = 0.05;

/// Neighbors within this many times the fit of the quorum lie on the sheet, and so do those within this
/// share of the distance of the rest.
const ON: f32 = 3.0;
const ROUNDED: f32 = 0.02;

/// The square of the sine under which two neighbors must be seen to span a plane: 0.3.
const SLIVER: f32 = 0.3 * 0.3;

/// A local sheet; none if its scatter is 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sheet {
    /// Its axis, on the side of the axis that was given.
    pub axis: [f32; 3],
    /// How far its samples lie off it; above 0.
    pub scatter: f32,
}

impl Sheet {
    /// The sheet with its axis on the side of another.
    pub(super) fn toward(self, axis: [f32; 3]) -> Self {
        match vector::dot(self.axis, axis) < 0.0 {
            true => Self {
                axis: self.axis.map(|x| -x),
                ..self
            },
            false => self,
        }
    }
}

type Offsets = [[f32; 3]; NEIGHBORS];

/// Offsets, an array for each axis.
type ByAxis = [[f32; NEIGHBORS]; 3];

/// Bits of numbers that are not negative: ordered as they are, and compared without branches or masks.
type Bits = [i32; NEIGHBORS];

/// The sheet through a sample, from the offsets to its neighbors and the axis of all of them together;
/// `None` where one plane serves for all, or none stands out, or the steps of the coordinates explain what lies off it.
#[inline(always)]
pub(super) fn find(offset: &Offsets, axis: [f32; 3], lattice: Lattice) -> Option<Sheet> {
    let by_axis = std::array::from_fn(|a| std::array::from_fn(|k| offset[k][a]));
    let together = residuals(&by_axis, axis);
    let (normal, fit) = best_plane(offset, &by_axis, axis, quantile(&together, QUORUM));
    let apart = residuals(&by_axis, normal);
    let rest = quantile(&apart, REST).max(quantile(&together, REST));
    if !stands_out(fit, rest) || rest < lattice.least_distance(normal) {
        return None;
    }
    let limit = largest_residual(fit, rest);
    let on = offset
        .iter()
        .zip(apart)
        .filter(|&(_, r)| number(r) <= limit);
    let (found, scatter) = plane(on.map(|(d, _)| *d));
    let sheet = Sheet {
        axis: found,
        scatter: bounded_scatter(scatter, limit),
    };
    Some(sheet.toward(axis))
}

/// Of the given plane and those spanned by two near neighbors, the one closest to a quorum, and how close.
#[inline(always)]
fn best_plane(offset: &Offsets, by_axis: &ByAxis, axis: [f32; 3], fit: f32) -> ([f32; 3], f32) {
    let mut best = (axis, fit);
    for j in 0..SPANNING {
        for k in j + 1..SPANNING {
            let normal = vector::cross(offset[j], offset[k]);
            let square = vector::norm_squared(normal);
            let squares = vector::norm_squared(offset[j]) * vector::norm_squared(offset[k]);
            let normal = vector::scale(normal, 1.0 / square.sqrt());
            let r = residuals(by_axis, normal);
            if spans(square, squares) & (below(&r, best.1) >= QUORUM as i32) {
                best = (normal, quantile(&r, QUORUM));
            }
        }
    }
    best
}

/// Least-squares plane of some offsets and the sample itself: its normal, and the root mean square distance
/// from it.
fn plane(offsets: impl Iterator<Item = [f32; 3]>) -> ([f32; 3], f32) {
    let products = |[x, y, z]: [f64; 3]| [x * x, x * y, x * z, y * y, y * z, z * z];
    let (mut mean, mut second, mut count) = ([0.0; 3], [0.0; 6], 1.0);
    for d in offsets.map(vector::to_f64) {
        mean = vector::add(mean, d);
        second = std::array::from_fn(|k| second[k] + products(d)[k]);
        count += 1.0;
    }
    let mean = vector::scale(mean, 1.0 / count);
    let covariance: [f64; 6] = std::array::from_fn(|k| second[k] / count - products(mean)[k]);
    let found = eigen(covariance.into());
    let normal = vector::of_f64(found.first.into());
    (normal, found.values.x.max(0.0).sqrt() as f32)
}

/// Distances of the neighbors from a plane through the sample.
#[inline(always)]
fn residuals([x, y, z]: &ByAxis, normal: [f32; 3]) -> Bits {
    let residual = |k: usize| vector::dot([x[k], y[k], z[k]], normal).abs();
    std::array::from_fn(|k| residual(k).to_bits() as i32)
}

#[inline(always)]
fn number(bits: i32) -> f32 {
    f32::from_bits(bits as u32)
}

/// −1 if the first of two numbers is less, else 0.
#[inline(always)]
fn less(a: i32, b: i32) -> i32 {
    (a - b) >> 31
}

/// How many of the values are less than one.
#[inline(always)]
fn below(values: &Bits, value: f32) -> i32 {
    let value = value.to_bits() as i32;
    -values.iter().map(|&x| less(x, value)).sum::<i32>()
}

/// The value of the given rank, from 1: the largest that has fewer below it.
#[inline(always)]
fn quantile(values: &Bits, rank: usize) -> f32 {
    let mut below = [0; NEIGHBORS];
    for &other in values {
        for (below, &value) in below.iter_mut().zip(values) {
            *below -= less(other, value);
        }
    }
    let candidates = values.iter().zip(below);
    let candidates = candidates.map(|(&value, below)| value & less(below, rank as i32));
    number(candidates.fold(0, i32::max))
}

/// Whether two offsets span a plane, by the square of their cross product and the product of their squares.
#[inline(always)]
fn spans(cross: f32, squares: f32) -> bool {
    cross > SLIVER * squares
}

/// Whether a plane that fits its quorum so well stands out from the rest.
#[inline(always)]
fn stands_out(fit: f32, rest: f32) -> bool {
    rest > 0.0 && fit <= RESOLVED * rest
}

/// How far from the plane a neighbor may lie to be on the sheet.
#[inline(always)]
fn largest_residual(fit: f32, rest: f32) -> f32 {
    (ON * fit).max(ROUNDED * rest)
}

/// How far samples lie off the sheet, whose root mean square distance is `found`; above 0.
#[inline(always)]
fn bounded_scatter(found: f32, limit: f32) -> f32 {
    found.max(limit / ON)
}

#[cfg(test)]
mod tests {
    use super::super::shapes::Random;
    use super::*;

    /// Neighbors of the origin on two sheets, `z = 0` and `z = gap − slope x`, by turns, as far as 2 away,
    /// and off their sheets by up to `noise`.
    fn two_sheets(gap: f64, slope: f64, noise: f64, random: &mut Random) -> Offsets {
        std::array::from_fn(|k| {
            let [x, y, off] = [(); 3].map(|()| 4.0 * random.unit() - 2.0);
            let z = if k % 2 == 0 { 0.0 } else { gap - slope * x };
            [x, y, z + 0.5 * noise * off].map(|c| c as f32)
        })
    }

    fn tilt(axis: [f32; 3]) -> f32 {
        axis[2].abs().min(1.0).acos().to_degrees()
    }

    #[test]
    fn the_own_sheet_is_found_beside_another() {
        let mut random = Random(7);
        for (gap, slope) in [(0.2, 0.0), (1.0, 0.0), (0.6, 0.25), (3.0, 1.0)] {
            for _ in 0..200 {
                let offset = two_sheets(gap, slope, 0.0, &mut random);
                // Seven of the eight on the other sheet may by chance lie in a plane with the origin; a
                // tenth of the clouds is let off.
                let Some(sheet) = find(&offset, [0.6, 0.0, 0.8], Lattice::default()) else {
                    panic!("no sheet at gap {gap}, slope {slope}: {offset:?}");
                };
                assert!(tilt(sheet.axis) < 1.0, "gap {gap}: {}", tilt(sheet.axis));
                assert!(sheet.axis[2] > 0.0, "the given side is kept");
                assert!(sheet.scatter > 0.0 && f64::from(sheet.scatter) < 0.1 * gap);
            }
        }
    }

    #[test]
    fn one_sheet_or_noise_is_left_alone() {
        let mut random = Random(9);
        let flat = two_sheets(0.0, 0.0, 0.0, &mut random);
        assert!(find(&flat, [0.0, 0.0, 1.0], Lattice::default()).is_none());
        let noisy = |random: &mut Random| two_sheets(0.0, 0.0, 0.5, random);
        let found = (0..1000)
            .filter(|_| find(&noisy(&mut random), [0.0, 0.0, 1.0], Lattice::default()).is_some());
        // By chance 6 of 16 lie 20 times closer to one of 36 planes than the others: about one in a hundred.
        assert!(found.count() <= 30);
    }

    #[test]
    fn equal_points_have_no_sheet() {
        assert!(find(&[[0.0; 3]; NEIGHBORS], [0.0, 0.0, 1.0], Lattice::default()).is_none());
    }
}
