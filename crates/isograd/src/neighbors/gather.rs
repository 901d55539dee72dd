//! Cotangents of offsets, gathered: what the pullbacks of functions of `d_j = x_j − x_i` have in common.
//!
//! A point `k` gets `−Σ_j d̄_j` as the center of its own neighborhood, and the `d̄_k` of every other center
//! that has it as a neighbor. Where both have the common radius, `k` is a neighbor of `c` exactly where
//! `c` is one of `k`, rounding included; so one walk over the points within that radius gathers both. The
//! few centers with a wider radius hand out what they have in a fixed order.

use super::candidates::Candidates;
use super::radius::Neighborhoods;
use super::radius_pullback::RadiiCotangent;
use crate::parallel::{self, CHUNK};
use crate::{Real, vector};

/// Contributions of some centers.
struct Contributions<T> {
    /// Cotangents of points.
    points: Vec<(u32, [T; 3])>,
    /// `Σ ⟨d̄_j, d_j⟩` of each center.
    sums: Vec<f64>,
}

impl<T: Real> Neighborhoods<T> {
    /// Whether the radius of a point has grown beyond the common one.
    #[inline(always)]
    pub(crate) fn has_grown(&self, i: usize) -> bool {
        self.radius[i] > self.common_radius
    }

    /// Adds to `(N, 3)` `points_bar`, in input order, the first three numbers that `gather(sorted position, point,
    /// candidates)` returns for every point, and returns the sum of the fourth: `Σ ⟨d̄_j, d_j⟩` of the point as a center.
    /// The candidates hold all points within the common radius, each with its `values`, arrays in sorted order.
    pub(crate) fn add_gathered<const M: usize>(
        &self,
        values: [&[T]; M],
        sorted: &mut Vec<[T; 4]>,
        points_bar: &mut [[T; 3]],
        gather: &(impl Fn(usize, [T; 3], &Candidates<T, M>) -> [T; 4] + Sync),
    ) -> f64 {
        self.gather(values, sorted, gather);
        let (sorted, position) = (&*sorted, self.position());
        parallel::for_each(points_bar, |i, bar| {
            let [x, y, z, _] = sorted[position[i] as usize];
            *bar = vector::add(*bar, [x, y, z]);
        });
        let [sum] = parallel::sum_array(sorted.len(), |position| [sorted[position][3].f64()]);
        sum
    }

    /// Fills `sorted`, a place for each point in sorted order, with `gather(sorted position, point, candidates)`.
    /// The candidates hold all points within the common radius, each with its `values`, arrays in sorted order.
    pub(crate) fn gather<const M: usize, const K: usize>(
        &self,
        values: [&[T]; M],
        sorted: &mut Vec<[T; K]>,
        gather: &(impl Fn(usize, [T; 3], &Candidates<T, M>) -> [T; K] + Sync),
    ) {
        let index = &self.index;
        sorted.resize(index.len(), [T::zero(); K]);
        index.for_each_cell(
            self.common_radius,
            values,
            sorted,
            &|cell, candidates, out| {
                for (position, out) in cell.zip(out) {
                    *out = gather(position, index.point(position), candidates);
                }
            },
        );
    }

    /// Adds to `(N, 3)` `points_bar` what the centers contribute whose `radius` is above the common one:
    /// `offset_bar(center, neighbor, offset)` is `d̄_j`, not called for the center itself. And to `radii_bar` what
    /// `radius_bar(center, Σ ⟨d̄_j, d_j⟩)`, `R_i R̄_i`, says of each of them.
    pub(crate) fn add_from_wide(
        &self,
        radius: &[T],
        points_bar: &mut [[T; 3]],
        radii_bar: &mut RadiiCotangent,
        offset_bar: &(impl Fn(usize, usize, [T; 3]) -> [T; 3] + Sync),
        radius_bar: &mut impl FnMut(usize, f64) -> f64,
    ) {
        let wide = (0..radius.len()).filter(|&i| radius[i] > self.common_radius);
        let wide: Vec<usize> = wide.collect();
        // Rounds of a fixed number of centers, so that the lists stay short.
        for round in wide.chunks(4 * CHUNK) {
            let lists = parallel::map_each(round.chunks(CHUNK / 8), |_, centers| {
                self.contributions(radius, centers, offset_bar)
            });
            for (j, bar) in lists.iter().flat_map(|list| &list.points) {
                let sum = &mut points_bar[*j as usize];
                *sum = vector::add(*sum, *bar);
            }
            let sums = lists.iter().flat_map(|list| &list.sums);
            for (&i, &sum) in round.iter().zip(sums) {
                radii_bar.add(self, i, radius_bar(i, sum));
            }
        }
    }

    /// Calls `visit(j, x_j − x_i)` for every other point within `radius` of point `i`.
    pub(crate) fn for_each_offset(
        &self,
        i: usize,
        radius: T,
        mut visit: impl FnMut(usize, [T; 3]),
    ) {
        let point = |i: usize| self.index.point(self.position()[i] as usize);
        let center = point(i);
        self.index.for_each_within(center, radius, |j, _| {
            if j != i {
                visit(j, vector::sub(point(j), center));
            }
        });
    }

    fn contributions(
        &self,
        radius: &[T],
        centers: &[usize],
        offset_bar: &impl Fn(usize, usize, [T; 3]) -> [T; 3],
    ) -> Contributions<T> {
        let mut out = Contributions {
            points: Vec::new(),
            sums: Vec::with_capacity(centers.len()),
        };
        for &i in centers {
            let (mut total, mut sum) = ([T::zero(); 3], 0.0);
            self.for_each_offset(i, radius[i], |j, offset| {
                let bar = offset_bar(i, j, offset);
                total = vector::sub(total, bar);
                sum += vector::dot(bar, offset).f64();
                out.points.push((j as u32, bar));
            });
            out.points.push((i as u32, total));
            out.sums.push(sum);
        }
        out
    }
}
