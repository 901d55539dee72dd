//! Samples along the boundary of an open surface.

use std::cmp::Ordering;

use pulp::Arch;

use crate::neighbors::{Candidates, LANES, Neighborhoods};
use crate::simd::vectorized;
use crate::{Real, parallel, vector};

/// A sample whose neighbors lie this far to one side, in radii, may be at a rim. Half a disc, which is
/// what a sample on the edge of a sheet sees, has its weighted centroid at 0.32 radii.
const RIM_OFFSET: f64 = 0.15;
/// It is at a rim where the neighbors leave out a sector of the tangent plane of at least this many
/// radians (135°; it is 180° on a straight rim). Of 24 random neighbors, one sample in 2,000 sees that.
const RIM_GAP: f64 = 0.75 * std::f64::consts::PI;
/// Mean normal of the neighbors of a rim sample: near 1 on a sheet, small on the edge of a solid.
const RIM_FLATNESS: f64 = 0.9;
/// A rim is a line of samples: this many neighbors are at a rim too.
const RIM_NEIGHBORS: usize = 3;
/// Neighborhoods of fewer samples are widened to about this many: few directions leave out wide sectors by chance, and at a
/// rim, where half of the disc is empty, few neighbors are at the rim themselves.
const RIM_COUNT: u32 = 24;

/// The octants of a plane, counter-clockwise, each by the signs of its two coordinates and which of them is larger.
const AROUND: [u32; 8] = [0b011, 0b111, 0b110, 0b010, 0b000, 0b100, 0b101, 0b001];

/// `(N,)` whether each sample is at a rim, of an open surface or of a hole in the sampling.
///
/// Such a sample sees its neighbors on one side only, and they all face the same way. A sharp edge of a
/// solid looks the same but for the last part: there the two sides face different ways. Stray samples
/// look like rims now and then, but not several side by side.
pub(crate) fn rims<T: Real>(
    points: &[[T; 3]],
    normals: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
) -> Vec<bool> {
    let mut one_sided = vec![false; points.len()];
    let arch = Arch::new();
    neighborhoods.for_each_neighborhood([], &mut one_sided, &|i, center, radius, candidates| {
        vectorized!(arch, {
            offset(center, radius, candidates) > T::of(RIM_OFFSET)
                && leaves_out_octants(center, radius, candidates, normals[i])
        })
    });
    let position = neighborhoods.position();
    let at_rim = parallel::map_with(Vec::new, position.len(), |directions, i| {
        one_sided[position[i] as usize]
            && borders_a_gap(i, points, normals, neighborhoods, directions)
    });
    parallel::map_with(Vec::new, points.len(), |places, i| {
        at_rim[i] && rim_neighbors(i, points, &at_rim, neighborhoods, places) >= RIM_NEIGHBORS
    })
}

/// Distance from a point to the centroid of its neighbors weighted by `1/r`, itself left out, in radii.
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

/// Whether the neighbors leave out two octants side by side of the plane across `normal`: so they do where they leave out a
/// sector of [`RIM_GAP`], three octants wide. Most samples of a sheet are told apart by this, without their neighbors' normals.
#[inline(always)]
fn leaves_out_octants<T: Real>(
    center: [T; 3],
    radius: T,
    candidates: &Candidates<T>,
    normal: [T; 3],
) -> bool {
    let Some([first, second]) = vector::tangents(normal) else {
        return false;
    };
    let mut seen = [0u32; LANES];
    candidates.for_each_lanes(
        radius,
        #[inline(always)]
        |lanes| {
            for l in 0..LANES {
                let d = [0, 1, 2].map(|a| lanes.point[a][l] - center[a]);
                let (a, b) = (vector::dot(d, first), vector::dot(d, second));
                let steeper = b.abs() > a.abs();
                let octant = u32::from(a > T::zero())
                    | u32::from(b > T::zero()) << 1
                    | u32::from(steeper) << 2;
                let is_aside = a != T::zero() || b != T::zero();
                let counts = vector::norm_squared(d) <= lanes.limit[l] && is_aside;
                seen[l] |= u32::from(counts) << octant;
            }
        },
    );
    let seen = seen.into_iter().fold(0, |all, lane| all | lane);
    let is_empty = |k: usize| seen >> AROUND[k % AROUND.len()] & 1 == 0;
    (0..AROUND.len()).any(|k| is_empty(k) && is_empty(k + 1))
}

/// Whether the neighbors face the same way but leave out a wide sector of the tangent plane.
fn borders_a_gap<T: Real>(
    i: usize,
    points: &[[T; 3]],
    normals: &[[T; 3]],
    neighborhoods: &Neighborhoods<T>,
    directions: &mut Vec<[T; 3]>,
) -> bool {
    let is_flat_within = |radius: T, directions: &mut Vec<[T; 3]>| {
        let (mut facing, mut samples) = (T::zero(), 1);
        directions.clear();
        let index = &neighborhoods.index;
        index.for_each_within(points[i], radius, |j, distance_squared| {
            facing += vector::dot(normals[i], normals[j]);
            if distance_squared > T::zero() {
                directions.push(vector::sub(points[j], points[i]));
                samples += 1;
            }
        });
        (facing > T::of(RIM_FLATNESS) * T::of_usize(samples), samples)
    };
    let radius = radius(i, neighborhoods);
    let (is_flat, samples) = is_flat_within(radius, directions);
    if !is_flat {
        return false;
    }
    let places = 1 + drop_copies(directions);
    let wider = T::of((samples as f64 / places as f64).sqrt());
    let is_flat = places == samples || is_flat_within(wider * radius, directions).0;
    is_flat && widest_gap(directions, normals[i]) > RIM_GAP
}

/// Keeps one of the equal vectors, and returns how many are left. Copies of a sample say nothing about gaps.
fn drop_copies<T: Real>(vectors: &mut Vec<[T; 3]>) -> usize {
    vectors.sort_unstable_by(|a, b| a.partial_cmp(b).unwrap_or(Ordering::Equal));
    vectors.dedup();
    vectors.len()
}

/// The widest sector of the plane across `normal` that no direction points into, in radians.
fn widest_gap<T: Real>(directions: &[[T; 3]], normal: [T; 3]) -> f64 {
    let turn = std::f64::consts::TAU;
    let Some([first, second]) = vector::tangents(normal) else {
        return 0.0;
    };
    let angle = |d: &[T; 3]| vector::dot(*d, second).atan2(vector::dot(*d, first)).f64();
    let mut angles: Vec<f64> = directions.iter().map(angle).collect();
    angles.sort_unstable_by(f64::total_cmp);
    let Some((&low, &high)) = angles.first().zip(angles.last()) else {
        return turn;
    };
    let between = angles.windows(2).map(|pair| pair[1] - pair[0]);
    between.fold(turn - (high - low), f64::max)
}

/// Radius around a sample that holds about [`RIM_COUNT`] samples.
fn radius<T: Real>(i: usize, neighborhoods: &Neighborhoods<T>) -> T {
    let wanted = T::of(f64::from(RIM_COUNT) / f64::from(neighborhoods.count[i].max(1)));
    neighborhoods.radius[i] * wanted.max(T::one()).sqrt()
}

/// Number of other places within the radius of a sample with samples at a rim.
fn rim_neighbors<T: Real>(
    i: usize,
    points: &[[T; 3]],
    at_rim: &[bool],
    neighborhoods: &Neighborhoods<T>,
    places: &mut Vec<[T; 3]>,
) -> usize {
    places.clear();
    let (index, radius) = (&neighborhoods.index, radius(i, neighborhoods));
    index.for_each_within(points[i], radius, |j, distance_squared| {
        if at_rim[j] && distance_squared > T::zero() {
            places.push(points[j]);
        }
    });
    drop_copies(places)
}

#[cfg(test)]
mod tests {
    use super::super::shapes::sphere;
    use super::*;
    use crate::neighbors::{self, Radius};

    /// [`rims`] of all pairs of points, one after the other.
    fn plain(points: &[[f64; 3]], normals: &[[f64; 3]], near: &Neighborhoods<f64>) -> Vec<bool> {
        let within = |i: usize, radius: f64| {
            let offsets = points.iter().map(move |&x| vector::sub(x, points[i]));
            let all = offsets.enumerate();
            all.filter(move |&(j, d)| j != i && vector::norm(d) <= radius)
        };
        let at_rim = |i: usize| {
            let (mut sum, mut weight) = ([0.0; 3], 0.0);
            for (_, d) in within(i, near.radius[i]) {
                sum = vector::add(sum, vector::scale(d, 1.0 / vector::norm(d)));
                weight += 1.0 / vector::norm(d);
            }
            let around: Vec<_> = within(i, radius(i, near)).collect();
            let directions: Vec<_> = around.iter().map(|&(_, d)| d).collect();
            let facing = |&(j, _): &(usize, _)| vector::dot(normals[i], normals[j]);
            let facing = 1.0 + around.iter().map(facing).sum::<f64>();
            vector::norm(sum) > RIM_OFFSET * weight * near.radius[i]
                && facing > RIM_FLATNESS * (around.len() + 1) as f64
                && widest_gap(&directions, normals[i]) > RIM_GAP
        };
        let at_rim: Vec<bool> = (0..points.len()).map(at_rim).collect();
        let company = |i: usize| {
            within(i, radius(i, near))
                .filter(|&(j, _)| at_rim[j])
                .count()
        };
        let is_rim = |i: usize| at_rim[i] && company(i) >= RIM_NEIGHBORS;
        (0..points.len()).map(is_rim).collect()
    }

    #[test]
    fn copies_of_samples_are_no_rims() {
        let (points, normals) = sphere(3000, [0.0; 3], 1.0, 5);
        for times in [1, 2, 4] {
            let [points, normals] = [&points, &normals].map(|of| of.repeat(times));
            let mut near = Neighborhoods::default();
            neighbors::forward(&points, Radius::Auto, &mut near).expect("valid");
            let found = rims(&points, &normals, &near);
            assert!(!found.contains(&true), "{times}");
        }
    }

    #[test]
    fn they_are_those_of_all_pairs() {
        let mut found = 0;
        for (count, turn) in [(300, 0.0), (900, 0.4), (2000, -0.3)] {
            let (points, normals) = sphere(count, [0.0; 3], 1.0, 7);
            // Part of a sphere, with few samples and with many to a neighborhood.
            let kept = |p: &[f64; 3]| p[2] + turn * p[0] > -0.2;
            let samples = points.into_iter().zip(normals).filter(|(p, _)| kept(p));
            let (points, normals): (Vec<_>, Vec<_>) = samples.unzip();
            for radius in [Radius::Auto, Radius::Fixed(0.15), Radius::Fixed(0.4)] {
                let mut near = Neighborhoods::default();
                neighbors::forward(&points, radius, &mut near).expect("a cloud");
                let rims = rims(&points, &normals, &near);
                assert_eq!(rims, plain(&points, &normals, &near), "{count} {radius:?}");
                found += rims.iter().filter(|&&rim| rim).count();
            }
        }
        assert!(found > 100, "{found}");
    }
}
