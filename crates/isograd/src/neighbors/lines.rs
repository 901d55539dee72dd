//! Samples along lines, as those of scanners, contours and structured meshes of wings: how many neighbors reach the next lines.
//!
//! Where lines are more than four times as far apart as the samples on them, the nearest 24 lie on one line, or on both sides of
//! one section, and their axis is that of the section, not of the surface. The radius must reach the lines on either side.

use super::cell_index::{CellIndex, Place, compare_points};
use super::rule::AUTO_NEIGHBORS;
use crate::element::eigen;
use crate::{Real, parallel, vector};

/// Samples lie along lines where the mean [turn] of the nearest others is less: it is 0 on a straight line, ½ on a surface that
/// is sampled evenly.
pub(crate) const LINE: f32 = 0.36;
/// Nearest others whose directions are compared. On a square lattice, two of three are at right angles.
pub(crate) const COMPARED: usize = 3;
/// Samples of a cloud whose turn is measured: on a surface, the mean is within .05 of ½.
const TOLD: usize = 128;
/// Samples whose next lines are sought: their distance is within 3 % of that of all.
const LOOKED_AT: usize = 512;
/// Nearest others that show the direction of a line.
const ALONG: usize = 6;
/// They lie on a line where the mean square of their distances from it is less than this share of that along it; at the leading
/// edge of a wing it is a fifth.
const WIDE: f64 = 0.25;
/// Nearest among which the next lines are sought, which are the most in a radius, too: lines 80 times as far apart as samples.
const MOST: usize = 512;
/// A sample lies beside another one if the cosine of the angle to the line is less,
const BESIDE: f64 = 0.35;
/// and two of them on either side if that of the angle between them, along the line, is less. The other side of a thin body is
/// on one side alone.
const OPPOSITE: f64 = -0.7;
/// Share of the samples with lines on either side, at the least.
const FEWEST: f64 = 0.2;
/// Radius in distances of lines. With 1.1 to 1.7, axes of scan lines and of wings are off by as much, with 1 by twice as much.
const REACH: f64 = 1.3;

/// Mean square of the sine of the angle between two of these offsets; ½, as on a surface, where all are 0.
pub(crate) fn turn<T: Real>(offset: &[[T; 3]]) -> T {
    let (mut sum, mut pairs) = (T::zero(), T::zero());
    for (j, &a) in offset.iter().enumerate() {
        for &b in &offset[..j] {
            let squares = vector::norm_squared(a) * vector::norm_squared(b);
            if squares > T::zero() {
                let product = vector::dot(a, b);
                sum += T::one() - product * product / squares;
                pairs += T::one();
            }
        }
    }
    if pairs > T::zero() {
        sum / pairs
    } else {
        T::of(0.5)
    }
}

/// Number of samples that the automatic radius holds in the middle, where samples lie along lines: [`AUTO_NEIGHBORS`] or more.
pub(super) fn neighbors<T: Real>(index: &CellIndex<T>) -> Option<usize> {
    let told = spread(index, TOLD);
    let turns = parallel::map_with(Vec::new, told.len(), |nearest, k| {
        turn(&others(index, told[k], COMPARED, nearest))
    });
    if turns.iter().sum::<f64>() >= f64::from(LINE) * turns.len() as f64 {
        return None;
    }
    let looked_at = spread(index, LOOKED_AT);
    let found = parallel::map_with(Vec::new, looked_at.len(), |nearest, k| {
        let offsets = others(index, looked_at[k], MOST, nearest);
        let squares: Vec<f64> = offsets.iter().map(|&d| vector::norm_squared(d)).collect();
        (beside(&offsets).map(|next| squares[next]), squares)
    });
    let mut distances: Vec<f64> = found.iter().filter_map(|&(square, _)| square).collect();
    if (distances.len() as f64) < FEWEST * looked_at.len() as f64 {
        return None;
    }
    let quarter = distances.len() / 4;
    let between = *distances.select_nth_unstable_by(quarter, f64::total_cmp).1;
    let is_within = |&square: &f64| square <= REACH * REACH * between;
    let count = |squares: &Vec<f64>| 1 + squares.partition_point(is_within);
    let mut counts: Vec<usize> = found.iter().map(|(_, squares)| count(squares)).collect();
    let middle = counts.len() / 2;
    Some((*counts.select_nth_unstable(middle).1).max(AUTO_NEIGHBORS))
}

/// The sorted position of the sample up to which others lie on either side of the line of one, where a radius holds so many
/// `neighbors`.
pub(super) fn next<T: Real>(
    index: &CellIndex<T>,
    position: usize,
    neighbors: usize,
    nearest: &mut Vec<(u32, T)>,
) -> Option<usize> {
    for count in [2 * neighbors, MOST] {
        let offsets = others(index, position, count, nearest);
        if let Some(next) = beside(&offsets) {
            return Some(nearest[next].0 as usize);
        }
        if offsets.len() < count {
            break;
        }
    }
    None
}

/// Up to so many sorted positions, spread over the cloud; not dependent on the order of the input, except for equal points.
fn spread<T: Real>(index: &CellIndex<T>, count: usize) -> Vec<usize> {
    let n = index.len();
    let count = count.min(n);
    let mut wanted = (0..count).map(|k| k * n / count).peekable();
    let (mut by_place, mut positions) = (Vec::new(), Vec::with_capacity(count));
    index.walk(&mut |_| true, &mut |cell: Place| {
        let cell = cell.positions();
        by_place.clear();
        while let Some(position) = wanted.next_if(|&position| position < cell.end) {
            if by_place.is_empty() {
                by_place.extend(cell.clone());
                by_place.sort_by(|&a, &b| compare_points(index.point(a), index.point(b)));
            }
            positions.push(by_place[position - cell.start]);
        }
    });
    positions
}

/// Offsets of the nearest others of a sample, nearest first, which `nearest` then holds.
fn others<T: Real>(
    index: &CellIndex<T>,
    position: usize,
    count: usize,
    nearest: &mut Vec<(u32, T)>,
) -> Vec<[f64; 3]> {
    let center = index.point(position);
    index.nearest_positions(center, count + 1, nearest);
    nearest.retain(|&(other, _)| other as usize != position);
    nearest.truncate(count);
    let offset = |&(other, _): &(u32, T)| vector::sub(index.point(other as usize), center);
    nearest.iter().map(offset).map(vector::to_f64).collect()
}

/// The one of these offsets, of the nearest, up to which there are samples beside a line on either side of it; `None` where
/// the sample in the middle lies on no line.
fn beside(offsets: &[[f64; 3]]) -> Option<usize> {
    let along = direction(&offsets[..ALONG.min(offsets.len())])?;
    let mut found: Vec<[f64; 3]> = Vec::new();
    for (k, &offset) in offsets.iter().enumerate() {
        let length = vector::norm(offset);
        let part = vector::dot(offset, along);
        if part.abs() < BESIDE * length {
            let across = vector::sub(offset, vector::scale(along, part));
            let across = vector::scale(across, 1.0 / vector::norm(across));
            if found
                .iter()
                .any(|&other| vector::dot(other, across) < OPPOSITE)
            {
                return Some(k);
            }
            found.push(across);
        }
    }
    None
}

/// The direction of the line on which some offsets lie, if they do.
fn direction(offsets: &[[f64; 3]]) -> Option<[f64; 3]> {
    let mut squares = [0.0; 6];
    for &[x, y, z] in offsets {
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        let pairs = squares.iter_mut().zip(products);
        pairs.for_each(|(sum, product)| *sum += product);
    }
    let found = eigen::eigen(squares.into());
    let [_, second, third]: [f64; 3] = found.values.into();
    (second < WIDE * third).then(|| found.third.into())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Random, torus};
    use super::super::{Neighborhoods, RadiiCotangent, Radius, forward, pullback, with_lines};
    use super::*;

    /// About 10,000 random samples of a torus on lines in parallel planes, and the distance of the planes, which is so many
    /// times that of the samples on a line.
    fn lines(ratio: f64) -> (Vec<[f64; 3]>, f64) {
        let across = [0.3, 0.5, 0.8].map(|x| x / 0.98f64.sqrt());
        let area = std::f64::consts::TAU.powi(2) * 0.7 * 0.25;
        let between = (area * ratio / 10_000.0).sqrt();
        let is_near = |point: [f64; 3]| {
            let place = vector::dot(point, across) / between;
            (place - place.round()).abs() < 0.008
        };
        let samples = torus(600_000, 5).into_iter().map(|(point, _)| point);
        (samples.filter(|&point| is_near(point)).collect(), between)
    }

    fn found(points: &[[f64; 3]]) -> Neighborhoods<f64> {
        let mut found = Neighborhoods::default();
        forward(points, Radius::Auto, &mut found).expect("a cloud");
        found
    }

    #[test]
    fn radii_reach_the_next_lines() {
        for ratio in [6.0, 10.0, 20.0] {
            let (points, between) = lines(ratio);
            let found = found(&points);
            let reach = found.common_radius / between;
            assert!(found.neighbors() > AUTO_NEIGHBORS, "{ratio}");
            assert!((1.2..1.8).contains(&reach), "{ratio}: {reach}");
            // A line of samples as far apart as on a lattice with as many samples per area.
            let spacing = found.spacing() * ratio.sqrt() / between;
            assert!((0.8..1.2).contains(&spacing), "{ratio}: {spacing}");
        }
    }

    /// Sections of a flat elliptic cylinder as long as four of its chords, 200 samples each, which are closer at both ends of
    /// the chord; and the distance of sections.
    fn wing() -> (Vec<[f64; 3]>, f64) {
        let point = |k: usize, section: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 200.0;
            let across = [0.5 * angle.cos(), 0.06 * angle.sin()];
            [across[0], across[1], section as f64 * 0.1]
        };
        let sections = (0..40).flat_map(|section| (0..200).map(move |k| point(k, section)));
        (sections.collect(), 0.1)
    }

    #[test]
    fn the_other_side_of_a_thin_body_is_not_the_next_line() {
        let (points, between) = wing();
        let reach = found(&points).common_radius / between;
        assert!((1.2..1.6).contains(&reach), "{reach}");
    }

    /// Rings of samples round the long axis of an ellipsoid, closer to each other toward its ends; and the normals.
    fn rings(rings: usize, samples: usize) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        let axes = [1.0, 0.35, 0.25];
        let point = |ring: usize, k: usize| {
            let angle = std::f64::consts::PI * (ring as f64 + 0.5) / rings as f64;
            let around = std::f64::consts::TAU * k as f64 / samples as f64;
            let on_sphere = [
                angle.cos(),
                angle.sin() * around.cos(),
                angle.sin() * around.sin(),
            ];
            let normal = [0, 1, 2].map(|a| on_sphere[a] / axes[a]);
            let normal = vector::normalized(normal).expect("not zero");
            ([0, 1, 2].map(|a| axes[a] * on_sphere[a]), normal)
        };
        (0..rings)
            .flat_map(|ring| (0..samples).map(move |k| point(ring, k)))
            .unzip()
    }

    #[test]
    fn radii_grow_where_lines_are_farther_than_most() {
        for (along, around) in [(50, 200), (30, 400), (400, 30)] {
            let (points, truth) = rings(along, around);
            let (mut found, mut axes) = Default::default();
            crate::normals::forward_with_neighborhoods(
                &points,
                Radius::Auto,
                &mut found,
                &mut axes,
            )
            .expect("a cloud");
            assert!(found.lines().is_some() && found.grown() > points.len() / 10);
            let pairs = axes.normals.iter().zip(&truth);
            let off = pairs
                .filter(|&(n, truth)| vector::dot(*n, *truth).abs() < 0.5)
                .count();
            assert!(off <= points.len() / 100, "{along} x {around}: {off}");
        }
    }

    #[test]
    fn surfaces_have_the_usual_number() {
        let random = torus(10_000, 3).into_iter().map(|(point, _)| point);
        let lattice = |step: [f64; 2]| -> Vec<[f64; 3]> {
            let point = |i: usize, j: usize| [step[0] * i as f64, step[1] * j as f64, 0.0];
            (0..60)
                .flat_map(|i| (0..60).map(move |j| point(i, j)))
                .collect()
        };
        for points in [
            random.collect(),
            lattice([1.0, 1.0]),
            lattice([1.0, 1.5]),
            lattice([1.0, 3.0]),
        ] {
            assert_eq!(found(&points).neighbors(), AUTO_NEIGHBORS);
        }
        // One line has no next one; neither have equal points.
        let mut random = Random::new(7);
        let line: Vec<[f64; 3]> = (0..500).map(|_| [random.uniform(), 0.0, 0.0]).collect();
        assert_eq!(found(&line).neighbors(), AUTO_NEIGHBORS);
        let pairs: Vec<[f64; 3]> = line.iter().flat_map(|&x| [x; 30]).collect();
        assert_eq!(found(&pairs).neighbors(), AUTO_NEIGHBORS);
    }

    #[test]
    fn the_number_is_that_of_the_points_in_any_order() {
        let (mut points, _) = lines(10.0);
        let before = found(&points);
        points.reverse();
        points.rotate_left(1234);
        let after = found(&points);
        assert_eq!(before.neighbors(), after.neighbors());
        assert_eq!(before.common_radius, after.common_radius);
    }

    #[test]
    fn lines_beside_are_those_on_either_side() {
        let along = (1..=10).flat_map(|k| [0.1, -0.1].map(|step| [step * f64::from(k), 0.0, 0.0]));
        let mut offsets: Vec<[f64; 3]> = along.collect();
        offsets.push([0.1, 0.0, -1.2]);
        assert_eq!(beside(&offsets), None);
        offsets.extend([
            [0.1, 0.2, -1.4],
            [0.0, 2.0, 0.0],
            [0.2, -2.5, 0.1],
            [0.0, -3.0, 0.0],
        ]);
        let found = beside(&offsets).expect("lines on either side");
        assert_eq!(offsets[found], [0.2, -2.5, 0.1]);
    }

    #[test]
    fn radii_have_their_derivatives_at_a_fixed_number() {
        for points in [lines(10.0).0, rings(30, 400).0] {
            let mut random = Random::new(9);
            let weights: Vec<f64> = points.iter().map(|_| 0.5 + random.uniform()).collect();
            let held = found(&points);
            let bars = held
                .radius
                .iter()
                .zip(&weights)
                .map(|(radius, weight)| radius * weight);
            let bar = RadiiCotangent::of(&held, &bars.collect::<Vec<_>>());
            let mut points_bar = vec![[0.0; 3]; points.len()];
            pullback(&held, &bar, &mut points_bar);
            let slopes = [1.0, 0.4, -0.3];
            let direction = |x: &[f64; 3]| [0, 1, 2].map(|a| slopes[a] * x[a]);
            let pairs = points_bar.iter().zip(&points);
            let slope: f64 = pairs.map(|(bar, x)| vector::dot(*bar, direction(x))).sum();
            let sum = |step: f64| -> f64 {
                let moved = points
                    .iter()
                    .map(|x| vector::add(*x, vector::scale(direction(x), step)));
                let mut found = Neighborhoods::default();
                with_lines(
                    &moved.collect::<Vec<_>>(),
                    Radius::Auto,
                    held.lines(),
                    &mut found,
                )
                .expect("a cloud");
                assert!(found.grown() > points.len() / 100);
                found
                    .radius
                    .iter()
                    .zip(&weights)
                    .map(|(radius, weight)| radius * weight)
                    .sum()
            };
            let step = 1e-8;
            let difference = (sum(step) - sum(-step)) / (2.0 * step);
            assert!(
                (slope - difference).abs() < 1e-5 * difference.abs(),
                "{slope} {difference}"
            );
        }
    }
}
