//! The samples nearest to one point, and what they look like.

use crate::neighbors::CellIndex;
use crate::{Real, vector};

/// Samples of a patch, the point itself included.
pub(super) const NEAREST: usize = 24;

/// Fewest samples of a sheet.
const FEWEST: usize = 3;

/// Two groups of samples are two sheets where the step between them is this many times what the samples
/// scatter beside it. One sheet of noise, cut in two, has 2.7.
const STEP: f64 = 5.0;

/// [`STEP`] for groups that face opposite ways: two sheets that meet at a sharp edge have 3.5 there.
const OPPOSED_STEP: f64 = 3.0;

/// Steps of less than this many spacings are none: a smooth surface has some by chance.
const SMALLEST_STEP: f64 = 0.2;

/// A gap between heights is wide from this share of all heights on; the widest of 24 random ones has 0.13.
const WIDE_GAP: f64 = 0.2;

/// Normals that are tried.
const TRIED: usize = 8;

/// Two sheets lie one above the other: their centroids are at most this many spacings apart across the
/// normal. The two sides of an edge lie side by side.
const ACROSS: f64 = 1.4;

/// Terms of a quadric over the tangent plane: `1, u, v, u², uv, v²`.
const TERMS: usize = 6;

/// The points that patches are taken from.
pub(super) struct Cloud<'a, T> {
    pub points: &'a [[T; 3]],
    pub normals: &'a [[T; 3]],
    pub index: &'a CellIndex<T>,
}

/// The samples nearest to a point, in the frame of a normal and in spacings of these samples.
#[derive(Default)]
pub(super) struct Patch {
    center: usize,
    nearest: Vec<usize>,
    samples: Vec<Sample>,
    spacing: f64,
}

#[derive(Clone, Copy)]
struct Sample {
    /// Place `(u, v)` in the tangent plane, and height along the normal.
    place: [f64; 3],
    /// Whether its normal points the other way.
    opposed: bool,
    /// Whether it is in the second of two groups.
    second: bool,
}

impl Patch {
    /// Takes the samples nearest to point `i`, in the frame of its unit normal.
    pub(super) fn take<T: Real>(&mut self, cloud: &Cloud<T>, i: usize) {
        let mut nearest = Vec::with_capacity(NEAREST);
        cloud.index.nearest(cloud.points[i], NEAREST, &mut nearest);
        let reach = nearest.last().map_or(0.0, |&(_, d2)| d2.f64().sqrt());
        self.center = i;
        self.spacing = reach * (std::f64::consts::PI / nearest.len().max(1) as f64).sqrt();
        self.nearest.clear();
        self.nearest
            .extend(nearest.iter().map(|&(j, _)| j as usize));
        self.turn_to(cloud, i);
    }

    /// Takes the same samples in the frame of the normal of point `axis`.
    fn turn_to<T: Real>(&mut self, cloud: &Cloud<T>, axis: usize) {
        self.samples.clear();
        let normal = vector::to_f64(cloud.normals[axis]);
        let Some([u, v]) = vector::tangents(normal).filter(|_| self.spacing > 0.0) else {
            return;
        };
        let center = cloud.points[self.center];
        self.samples.extend(self.nearest.iter().map(|&j| {
            let d = vector::to_f64(vector::sub(cloud.points[j], center));
            let d = vector::scale(d, 1.0 / self.spacing);
            Sample {
                place: [u, v, normal].map(|axis| vector::dot(axis, d)),
                opposed: vector::dot(normal, vector::to_f64(cloud.normals[j])) < -0.5,
                second: false,
            }
        }));
    }

    /// Side of the square that one sample has to itself, in the unit of the points.
    pub(super) fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The samples of the patch, the farthest first.
    pub(super) fn farthest(&self) -> impl Iterator<Item = usize> {
        self.nearest.iter().rev().copied()
    }

    /// Root mean square distance of the samples from a quadric, in spacings; corrected for the terms that
    /// were fitted.
    pub(super) fn scatter(&self) -> f64 {
        self.fit(terms).1
    }

    /// Whether the samples lie in two sheets, one above the other. Where they do, many a normal is askew, so
    /// those of several samples are tried.
    pub(super) fn has_two_sheets<T: Real>(&mut self, cloud: &Cloud<T>) -> bool {
        let every = self.nearest.len().div_ceil(TRIED).max(1);
        let found = (0..self.nearest.len()).step_by(every).any(|k| {
            self.turn_to(cloud, self.nearest[k]);
            self.group(|sample| sample.opposed);
            self.are_sheets(OPPOSED_STEP) || (self.cut_at_gap() && self.are_sheets(STEP))
        });
        self.turn_to(cloud, self.center);
        found
    }

    /// Makes two groups of what is above and below the widest gap between heights, if that is wide.
    fn cut_at_gap(&mut self) -> bool {
        let mut heights: Vec<f64> = self.samples.iter().map(|s| s.place[2]).collect();
        heights.sort_unstable_by(f64::total_cmp);
        let (Some(low), Some(high)) = (heights.first(), heights.last()) else {
            return false;
        };
        let inner = FEWEST - 1..heights.len().saturating_sub(FEWEST - 1);
        let gaps = heights.get(inner).unwrap_or_default().windows(2);
        let Some(gap) = gaps.max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0]))) else {
            return false;
        };
        let middle = 0.5 * (gap[0] + gap[1]);
        self.group(|sample| sample.place[2] > middle);
        gap[1] - gap[0] > WIDE_GAP * (high - low)
    }

    fn group(&mut self, is_second: impl Fn(&Sample) -> bool) {
        let samples = self.samples.iter_mut();
        samples.for_each(|sample| sample.second = is_second(sample));
    }

    /// Whether the two groups are two sheets, each of the same quadric, a step apart.
    fn are_sheets(&self, least: f64) -> bool {
        let (mut count, mut sum) = ([0.0f64; 2], [[0.0; 2]; 2]);
        for sample in &self.samples {
            let group = usize::from(sample.second);
            count[group] += 1.0;
            (0..2).for_each(|a| sum[group][a] += sample.place[a]);
        }
        if count[0].min(count[1]) < FEWEST as f64 {
            return false;
        }
        let apart = [0, 1].map(|a| sum[1][a] / count[1] - sum[0][a] / count[0]);
        let (fitted, scatter) = self.fit(with_step);
        let step = fitted[TERMS].abs();
        apart[0].hypot(apart[1]) <= ACROSS && step > SMALLEST_STEP && step > least * scatter
    }

    /// The heights as a sum of terms, by least squares, and the root mean square that is left.
    fn fit<const N: usize>(&self, terms: impl Fn(&Sample) -> [f64; N]) -> ([f64; N], f64) {
        let (mut matrix, mut right) = ([[0.0; N]; N], [0.0; N]);
        for sample in &self.samples {
            let t = terms(sample);
            for r in 0..N {
                right[r] += t[r] * sample.place[2];
                (0..N).for_each(|c| matrix[r][c] += t[r] * t[c]);
            }
        }
        let fitted = solve(matrix, right);
        let left = |sample: &Sample| (sample.place[2] - evaluate(&fitted, &terms(sample))).powi(2);
        let sum: f64 = self.samples.iter().map(left).sum();
        let freedom = self.samples.len().saturating_sub(N).max(1);
        (fitted, (sum / freedom as f64).sqrt())
    }
}

fn terms(sample: &Sample) -> [f64; TERMS] {
    let [u, v, _] = sample.place;
    [1.0, u, v, u * u, u * v, v * v]
}

fn with_step(sample: &Sample) -> [f64; TERMS + 1] {
    let [a, b, c, d, e, f] = terms(sample);
    [a, b, c, d, e, f, if sample.second { 1.0 } else { 0.0 }]
}

fn evaluate<const N: usize>(fitted: &[f64; N], terms: &[f64; N]) -> f64 {
    fitted.iter().zip(terms).map(|(c, t)| c * t).sum()
}

/// The solution of normal equations, by Cholesky's factors. A term that the samples do not determine (they
/// lie on a line, or on each other) is left out.
fn solve<const N: usize>(mut matrix: [[f64; N]; N], right: [f64; N]) -> [f64; N] {
    let mut solution = right;
    for k in 0..N {
        let whole = matrix[k][k];
        let rest = whole - (0..k).map(|j| matrix[k][j].powi(2)).sum::<f64>();
        // Rounding leaves 1e-15 of the whole.
        if !(rest > 1e-10 * whole) {
            matrix[k] = [0.0; N];
            matrix.iter_mut().for_each(|row| row[k] = 0.0);
            continue;
        }
        let pivot = rest.sqrt();
        matrix[k][k] = pivot;
        for r in k + 1..N {
            let done: f64 = (0..k).map(|j| matrix[r][j] * matrix[k][j]).sum();
            matrix[r][k] = (matrix[r][k] - done) / pivot;
        }
        let done: f64 = (0..k).map(|j| matrix[k][j] * solution[j]).sum();
        solution[k] = (solution[k] - done) / pivot;
    }
    for k in (0..N).rev() {
        let pivot = matrix[k][k];
        let done: f64 = (k + 1..N).map(|r| matrix[r][k] * solution[r]).sum();
        solution[k] = match pivot > 0.0 {
            true => (solution[k] - done) / pivot,
            false => 0.0,
        };
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::solve;

    #[test]
    fn equations_are_solved_and_what_they_leave_open_is_zero() {
        // A Aᵀ of a lower triangle with a zero on its diagonal: the third unknown is free.
        let matrix = [[4.0, 2.0, 2.0], [2.0, 10.0, 1.0], [2.0, 1.0, 1.0]];
        let right = [8.0, 22.0, 4.0];
        let x = solve(matrix, right);
        assert!((4.0 * x[0] + 2.0 * x[1] - 8.0).abs() < 1e-12);
        assert!((2.0 * x[0] + 10.0 * x[1] - 22.0).abs() < 1e-12);
        assert_eq!(x[2], 0.0);
    }
}
