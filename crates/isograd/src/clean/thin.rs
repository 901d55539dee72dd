//! Fewer samples where there are many.

use rayon::slice::ParallelSliceMut;

use super::{Error, by_place, check_length, checked, indices, largest};
use crate::neighbors::CellIndex;
use crate::vector::{add, norm_squared, scale, sub};
use crate::{Real, parallel};

/// Indices of samples no two of which are within `distance` of each other, such that each removed sample has one of them
/// within it. At distance 0 equal points are duplicates, else this is [`poisson_disk`].
///
/// # Errors
/// A point that is not finite or out of range, or a distance that is not a finite number of 0 or more.
pub fn duplicates<T: Real>(points: &[[T; 3]], distance: f64) -> Result<Vec<u32>, Error> {
    if distance > 0.0 {
        return poisson_disk(points, distance);
    }
    if distance != 0.0 {
        let (name, expected) = (
            "the distance of duplicates",
            "0 or a positive, finite length",
        );
        return Err(Error::Option {
            name,
            value: distance,
            expected,
        });
    }
    let points = checked(points)?;
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.par_sort_unstable_by(by_place(&points));
    order.dedup_by_key(|i| points[*i as usize]);
    order.sort_unstable();
    Ok(order)
}

/// Indices of one sample in each cube of side `size` that has any: the one nearest to their mean. Cubes begin at the
/// origin, so that the result at a place does not depend on samples elsewhere.
///
/// Other libraries return the means instead, which lie beside the surface where it is curved and inside thin parts; normals
/// and attributes then have to be averaged, too.
///
/// # Errors
/// A point that is not finite or out of range, a size that is not a positive, finite length, or one too small for the
/// coordinates.
pub fn voxel<T: Real>(points: &[[T; 3]], size: f64) -> Result<Vec<u32>, Error> {
    /// Beyond it neighboring voxels have no numbers of their own.
    const MOST: f64 = (1u64 << 52) as f64;
    check_length("the size of voxels", size)?;
    let points = checked(points)?;
    let largest = largest(&points);
    if !(largest / size < MOST) {
        return Err(Error::Voxels { largest, size });
    }
    let voxel = |i: usize| points[i].map(|x| (x / size).floor() as i64);
    let voxels = parallel::map(points.len(), voxel);
    let voxel = |&i: &u32| voxels[i as usize];
    let compare = by_place(&points);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.par_sort_unstable_by(|a, b| voxel(a).cmp(&voxel(b)).then_with(|| compare(a, b)));
    let same = order.chunk_by(|a, b| voxel(a) == voxel(b));
    let mut kept: Vec<u32> = same
        .map(|members| nearest_to_mean(&points, members))
        .collect();
    kept.sort_unstable();
    Ok(kept)
}

/// The first of the members that are nearest to the mean of all. There is at least one.
fn nearest_to_mean(points: &[[f64; 3]], members: &[u32]) -> u32 {
    let point = |i: u32| points[i as usize];
    let first = members[0];
    // Relative to a member: far from the origin nothing is lost.
    let sum = members
        .iter()
        .fold([0.0; 3], |sum, &i| add(sum, sub(point(i), point(first))));
    let mean = scale(sum, 1.0 / members.len() as f64);
    let distance = |i: u32| norm_squared(sub(sub(point(i), point(first)), mean));
    let mut best = (distance(first), first);
    for &i in &members[1..] {
        let squared = distance(i);
        if squared < best.0 {
            best = (squared, i);
        }
    }
    best.1
}

/// Indices of samples no two of which are within `distance` of each other, such that each removed sample has one of them
/// within it. Samples are tried in an order that is random, but fixed by their coordinates.
///
/// # Errors
/// A point that is not finite or out of range, or a distance that is not a positive, finite length.
pub fn poisson_disk<T: Real>(points: &[[T; 3]], distance: f64) -> Result<Vec<u32>, Error> {
    check_length("the distance between samples", distance)?;
    let points = checked(points)?;
    let index = CellIndex::new(&points);
    let compare = by_place(&points);
    let mut order: Vec<(u64, u32)> = (0u32..).zip(&points).map(|(i, &p)| (hash(p), i)).collect();
    order.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| compare(&a.1, &b.1)));
    let mut kept = vec![false; points.len()];
    let mut is_covered = vec![false; points.len()];
    for (_, i) in order {
        let i = i as usize;
        if !is_covered[i] {
            kept[i] = true;
            index.for_each_within(points[i], distance, |j, _| is_covered[j] = true);
        }
    }
    Ok(indices(&kept))
}

/// A hash of coordinates (finalizer of SplitMix64); 0 and −0 are equal.
fn hash(point: [f64; 3]) -> u64 {
    point.iter().fold(0, |hash: u64, x| {
        let mut z = hash.wrapping_add(0x9e37_79b9_7f4a_7c15) ^ (x + 0.0).to_bits();
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    })
}
