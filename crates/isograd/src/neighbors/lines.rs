//! Samples along lines, as those of scanners, contours and structured meshes of wings: how many neighbors reach the next lines.
//!
//! Where lines are more than four times as far apart as the samples on them, the nearest 24 lie on one line, or on both sides of
//! one section, and their axis is that of the section, not of the surface. The radius must reach the lines on either side.

#[cfg(test)]
mod tests;

use std::cell::Cell;

use super::cell_index::{CellIndex, Place, compare_points};
use super::rule::AUTO_NEIGHBORS;
use crate::element::eigen::{self, Eigen};
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
/// Samples within a radius from which on next lines are not sought there: the cost of a search is bounded.
const MANY: usize = 4096;
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

/// The sorted position of the sample up to which others lie on either side of the line of one, of which the `nearest` are known.
/// `None` where it lies on no line, and where there are none within four times `reach`, or more than [`MANY`].
pub(super) fn next<T: Real>(
    index: &CellIndex<T>,
    position: usize,
    reach: T,
    nearest: &[(u32, T)],
) -> Option<usize> {
    let center = index.point(position);
    let others = nearest
        .iter()
        .filter(|&&(other, _)| other as usize != position);
    let offsets = others.map(|&(other, _)| offset(index, center, other as usize));
    let along = direction(offsets.take(ALONG))?;
    let within = |factor: f64| next_within(index, position, along, T::of(factor) * reach);
    [1.0, 2.0, 4.0].into_iter().find_map(within)
}

/// [`next`] within a radius of a sample on a line of this direction.
fn next_within<T: Real>(
    index: &CellIndex<T>,
    position: usize,
    along: [f64; 3],
    radius: T,
) -> Option<usize> {
    let center = index.point(position);
    let (limit, seen, mut found) = (radius * radius, Cell::new(0), Vec::new());
    index.walk(
        &mut |node| seen.get() < MANY && node.distance_squared(center) <= limit,
        &mut |cell| {
            index.scan(cell, center, limit, &mut |other, square| {
                seen.set(seen.get() + 1);
                let offset = offset(index, center, other);
                found.extend(across(along, offset).map(|across| (square, other, across)));
            });
        },
    );
    if seen.get() >= MANY {
        return None;
    }
    let by_place = |a: usize, b: usize| compare_points(index.point(a), index.point(b));
    let order = |a: T, b: T| a.f64().total_cmp(&b.f64());
    found.sort_unstable_by(|a, b| order(a.0, b.0).then_with(|| by_place(a.1, b.1)));
    let next = first_opposite(found.iter().map(|&(_, _, across)| across))?;
    Some(found[next].1)
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
    let offsets = nearest
        .iter()
        .map(|&(other, _)| offset(index, center, other as usize));
    offsets.collect()
}

/// From a place to the point at a sorted position.
fn offset<T: Real>(index: &CellIndex<T>, from: [T; 3], position: usize) -> [f64; 3] {
    vector::to_f64(vector::sub(index.point(position), from))
}

/// The one of these offsets, of the nearest, up to which there are samples beside a line on either side of it; `None` where
/// the sample in the middle lies on no line.
fn beside(offsets: &[[f64; 3]]) -> Option<usize> {
    let along = direction(offsets.iter().copied().take(ALONG))?;
    let all = offsets.iter().enumerate();
    let found: Vec<(usize, [f64; 3])> = all
        .filter_map(|(k, &offset)| Some((k, across(along, offset)?)))
        .collect();
    let next = first_opposite(found.iter().map(|&(_, across)| across))?;
    Some(found[next].0)
}

/// The direction of an offset across a line, if it lies beside it.
fn across(along: [f64; 3], offset: [f64; 3]) -> Option<[f64; 3]> {
    let part = vector::dot(offset, along);
    let across = vector::sub(offset, vector::scale(along, part));
    (part.abs() < BESIDE * vector::norm(offset))
        .then(|| vector::scale(across, 1.0 / vector::norm(across)))
}

/// The first of these directions that is opposite to an earlier one.
fn first_opposite(directions: impl Iterator<Item = [f64; 3]>) -> Option<usize> {
    let mut earlier: Vec<[f64; 3]> = Vec::new();
    for (k, direction) in directions.take(MOST).enumerate() {
        if earlier
            .iter()
            .any(|&other| vector::dot(other, direction) < OPPOSITE)
        {
            return Some(k);
        }
        earlier.push(direction);
    }
    None
}

/// The direction of the line on which some offsets lie, if they do.
fn direction(offsets: impl Iterator<Item = [f64; 3]>) -> Option<[f64; 3]> {
    let found = principal(offsets);
    let [_, second, third]: [f64; 3] = found.values.into();
    (second < WIDE * third).then(|| found.third.into())
}

/// Eigenvalues and eigenvectors of the sum of `d dᵀ` over some offsets `d`.
pub(super) fn principal(offsets: impl Iterator<Item = [f64; 3]>) -> Eigen<f64> {
    let mut sums = [0.0; 6];
    for [x, y, z] in offsets {
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        for (sum, product) in sums.iter_mut().zip(products) {
            *sum += product;
        }
    }
    eigen::eigen(sums.into())
}
