//! Outliers: few, isolated samples far from all others, and [strays][Neighborhoods::strays] nearer to them.
//!
//! The former are found here. Distances are along the axis where they are largest. The samples that are kept are the smallest set that
//!
//! - holds the bulk: the box that all but `m` samples at either end of each axis lie in, widened by its longest side;
//! - with the longest side `s` of its bounding box, holds every sample within `s` of that box, and every sample with three
//!   others within `s`: four samples can bound a volume.
//!
//! All others are far, unless they are more than `m = min(N/100, √N)`: then there are none. So a body, a second one
//! far away, a ground plane and a thin tail are kept: each of their samples has neighbors, or continues what is kept.
//! The result is independent of the order, position and scale of the points. `O(N)` operations.
//!
//! Strays show in the neighborhoods, which a reconstruction finds anyway; a grid that is fitted asks for them where few samples
//! reach far.
//!
//! [Neighborhoods::strays]: crate::neighbors::Neighborhoods::strays

use std::borrow::Cow;

use super::cloud::{PointCloud, Sensors, bounds};
use crate::{Real, neighbors, vector};

/// This many other samples nearby make a sample part of a body.
const NEIGHBORS: usize = 3;

/// Share of the longest side of a box in which few samples at one end may be strays that enlarge it.
const END: f64 = 0.05;

/// Use of outliers: samples that are far from all others, or in mid-air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Outliers {
    /// Left out of the fitted grid and of the reconstruction, with a warning. Their gradients are 0.
    #[default]
    Ignore,
    /// Samples like all others.
    Keep,
}

impl Outliers {
    /// The samples that are not far from all others.
    pub fn select<T: Real>(self, points: &[[T; 3]]) -> Selection {
        Selection {
            samples: points.len(),
            left_out: match self {
                Self::Ignore => find(points),
                Self::Keep => Vec::new(),
            },
        }
    }

    /// The samples for the box of a grid: without strays, where these enlarge it.
    pub(super) fn select_for_box<T: Real>(self, points: &[[T; 3]]) -> Selection {
        let mut selection = self.select(points);
        if self == Self::Ignore {
            let used = selection.points(points);
            if few_reach_far(&used) {
                selection.leave_out(&neighbors::strays(&used).unwrap_or_default());
            }
        }
        selection
    }
}

/// The samples of a cloud that are used.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    samples: usize,
    left_out: Vec<u32>,
}

impl Selection {
    /// Number of samples in the cloud.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Indices of the samples that are left out, ascending.
    pub fn left_out(&self) -> &[u32] {
        &self.left_out
    }

    /// Whether all samples are used.
    pub fn is_all(&self) -> bool {
        self.left_out.is_empty()
    }

    /// Leaves out more samples, given by their numbers, ascending, among those that were used.
    pub fn leave_out(&mut self, used: &[u32]) {
        let mut before = 0;
        let more = used.iter().map(|&k| {
            while (self.left_out.get(before)).is_some_and(|&i| i <= k + before as u32) {
                before += 1;
            }
            k + before as u32
        });
        let more: Vec<u32> = more.collect();
        self.left_out.extend(more);
        self.left_out.sort_unstable();
    }

    /// Rows of `width` entries of the samples that are used, from those of all.
    pub fn gather<E: Copy>(&self, all: &[E], width: usize) -> Vec<E> {
        let mut kept = Vec::with_capacity(all.len());
        let mut start = 0;
        for &i in &self.left_out {
            let end = i as usize * width;
            kept.extend_from_slice(&all[start..end]);
            start = end + width;
        }
        kept.extend_from_slice(&all[start..]);
        kept
    }

    /// Rows of `width` entries of all samples, from those of the ones that are used; `fill` for the others.
    pub fn scatter<E: Copy>(&self, kept: &[E], width: usize, fill: E) -> Vec<E> {
        let mut all = Vec::with_capacity(self.samples * width);
        let mut start = 0;
        for &i in &self.left_out {
            let end = start + i as usize * width - all.len();
            all.extend_from_slice(&kept[start..end]);
            all.resize(all.len() + width, fill);
            start = end;
        }
        all.extend_from_slice(&kept[start..]);
        all
    }

    /// The points that are used.
    pub(super) fn points<'a, T: Real>(&self, all: &'a [[T; 3]]) -> Cow<'a, [[T; 3]]> {
        match self.is_all() {
            true => Cow::Borrowed(all),
            false => Cow::Owned(self.gather(all, 1)),
        }
    }

    /// The cloud of the samples that are used, without attributes, or the whole cloud.
    pub fn cloud<'a, T: Real>(&self, cloud: &'a PointCloud<T>) -> Cow<'a, PointCloud<T>> {
        self.used(cloud).map_or(Cow::Borrowed(cloud), Cow::Owned)
    }

    /// The cloud of the samples that are used, without attributes; `None` if it is the whole cloud.
    pub fn used<T: Real>(&self, cloud: &PointCloud<T>) -> Option<PointCloud<T>> {
        if self.is_all() {
            return None;
        }
        let of = |all: &[[T; 3]]| self.gather(all, 1);
        let sensors = cloud.sensors().map(|sensors| match sensors {
            Sensors::Each(positions) => Sensors::Each(of(positions)),
            Sensors::Any(positions) => Sensors::Any(positions.clone()),
        });
        let normals = cloud.normals().map(of);
        Some(PointCloud::from_parts(of(cloud.points()), normals, sensors))
    }
}

/// A bounding box in double precision.
#[derive(Clone, Copy)]
struct Box {
    low: [f64; 3],
    high: [f64; 3],
}

impl Box {
    fn longest(&self) -> f64 {
        let sides = vector::sub(self.high, self.low);
        sides[0].max(sides[1]).max(sides[2])
    }

    /// Distance of a point, along the axis where it is largest.
    fn distance(&self, p: [f64; 3]) -> f64 {
        let beyond = |a: usize| (self.low[a] - p[a]).max(p[a] - self.high[a]);
        beyond(0).max(beyond(1)).max(beyond(2)).max(0.0)
    }

    fn add(&mut self, p: [f64; 3]) {
        for a in 0..3 {
            self.low[a] = self.low[a].min(p[a]);
            self.high[a] = self.high[a].max(p[a]);
        }
    }
}

/// A sample beyond the bulk.
struct Candidate {
    index: u32,
    point: [f64; 3],
    /// Distance to the third nearest other candidate.
    to_others: f64,
}

/// Indices of the outliers, ascending.
fn find<T: Real>(points: &[[T; 3]]) -> Vec<u32> {
    let most = most(points);
    if most == 0 || reaches_both_ends(points, most) {
        return Vec::new();
    }
    let bulk = bulk(points, most);
    let side = bulk.longest();
    let (mut kept, mut candidates) = (bulk, Vec::new());
    for (index, &p) in points.iter().enumerate() {
        let point = vector::to_f64(p);
        if bulk.distance(point) > side {
            let (index, to_others) = (index as u32, f64::INFINITY);
            candidates.push(Candidate {
                index,
                point,
                to_others,
            });
        } else {
            kept.add(point);
        }
    }
    set_distances(&mut candidates);
    loop {
        let (side, before) = (kept.longest(), candidates.len());
        let far = kept;
        candidates.retain(|c| {
            let is_outlier = far.distance(c.point) > side && c.to_others > side;
            if !is_outlier {
                kept.add(c.point);
            }
            is_outlier
        });
        if candidates.len() == before {
            break;
        }
    }
    if candidates.len() > most || !(kept.longest() > 0.0) {
        return Vec::new();
    }
    candidates.iter().map(|c| c.index).collect()
}

/// Most samples that are far.
fn most<T>(points: &[[T; 3]]) -> usize {
    (points.len() / 100).min(points.len().isqrt())
}

/// Whether as few samples as may be far lie at an end of the box.
fn few_reach_far<T: Real>(points: &[[T; 3]]) -> bool {
    let Some((low, high)) = bounds(points) else {
        return false;
    };
    let whole = Box {
        low: vector::to_f64(low),
        high: vector::to_f64(high),
    };
    let end = END * whole.longest();
    let mut counts = [0; 6];
    for point in points {
        for (k, count) in counts.iter_mut().enumerate() {
            let (axis, x) = (k / 2, point[k / 2].f64());
            *count += usize::from(match k % 2 {
                0 => x <= whole.low[axis] + end,
                _ => x >= whole.high[axis] - end,
            });
        }
    }
    counts.iter().any(|&count| count <= most(points))
}

/// Whether more than `most` samples lie in the first and in the last quarter of the longest axis. Then there are no
/// outliers: without these the box would have less than half the length.
fn reaches_both_ends<T: Real>(points: &[[T; 3]], most: usize) -> bool {
    let Some((low, high)) = bounds(points) else {
        return true;
    };
    let (low, high) = (vector::to_f64(low), vector::to_f64(high));
    let side = |a: usize| high[a] - low[a];
    let axis = (1..3).fold(0, |m, a| if side(a) > side(m) { a } else { m });
    let quarter = 0.25 * side(axis);
    let (first, last) = (low[axis] + quarter, high[axis] - quarter);
    let count =
        |is_in: &dyn Fn(f64) -> bool| points.iter().filter(|p| is_in(p[axis].f64())).count();
    count(&|x| x <= first) > most && count(&|x| x >= last) > most
}

/// The box without the `most` lowest and highest coordinates of each axis.
fn bulk<T: Real>(points: &[[T; 3]], most: usize) -> Box {
    let mut ends = [[0.0; 2]; 3];
    for (axis, ends) in ends.iter_mut().enumerate() {
        let mut along: Vec<f64> = points.iter().map(|p| p[axis].f64()).collect();
        let last = along.len() - 1 - most;
        *ends = [most, last].map(|rank| *along.select_nth_unstable_by(rank, f64::total_cmp).1);
    }
    Box {
        low: ends.map(|[low, _]| low),
        high: ends.map(|[_, high]| high),
    }
}

/// Finds the distance of each candidate to the third nearest other one. There are at most `6 √N`.
fn set_distances(candidates: &mut [Candidate]) {
    for i in 0..candidates.len() {
        let p = candidates[i].point;
        let mut nearest = [f64::INFINITY; NEIGHBORS];
        for (j, other) in candidates.iter().enumerate() {
            let d = vector::sub(p, other.point).map(f64::abs);
            let d = d[0].max(d[1]).max(d[2]);
            if j != i && d < nearest[NEIGHBORS - 1] {
                nearest[NEIGHBORS - 1] = d;
                nearest.sort_unstable_by(f64::total_cmp);
            }
        }
        candidates[i].to_others = nearest[NEIGHBORS - 1];
    }
}
